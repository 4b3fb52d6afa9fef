"""Make a head of a clip and let it smile, without a window.

    blender -b --python expression.py -- FRAMES head.blend [camera.json]

FRAMES is a video, a folder of pictures, or the first picture of a sequence. The add-on must be installed and enabled.
"""

import sys
from pathlib import Path

import bpy

# Frame, expression, strength: quiet, a surprise that comes quickly, a smile that grows and stays.
KEYS = [(1, "neutral", 1.0), (12, "neutral", 1.0), (18, "surprise", 1.0), (40, "smile", 0.8), (80, "smile", 1.0)]


def main() -> None:
    try:
        frames, blend, *camera = sys.argv[sys.argv.index("--") + 1 :]
    except ValueError:
        sys.exit("usage: blender -b --python expression.py -- FRAMES head.blend [camera.json]")
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    if camera:
        bpy.ops.facewright.open_camera(filepath=camera[0])
    scene.facewright_clip.path = str(Path(frames).resolve())
    # An operator that fails raises RuntimeError with the sentence that the artist would see.
    bpy.ops.facewright.reconstruct()
    face = bpy.context.object
    animate(scene)
    scene.frame_end, _, _ = KEYS[-1]
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(blend).resolve()))
    print(f"{face.name} has {len(face.data.shape_keys.key_blocks) - 1} shape keys")


def animate(scene: bpy.types.Scene) -> None:
    """Set the expressions one after the other, with a keyframe of every shape key at each."""
    for frame, name, strength in KEYS:
        scene.frame_set(frame)
        bpy.ops.facewright.expression(name=name, strength=strength, keyframe="INSERT")


if __name__ == "__main__":
    main()
