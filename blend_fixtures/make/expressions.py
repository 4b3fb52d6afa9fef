"""expressions.blend: the generic head with keyframed expressions; expressions.toml: key values at keyframes."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

from parts import engine  # noqa: E402

LAST_FRAME = 100
SCORE = [
    (1, None),
    (15, "happiness"),
    (30, None),
    (45, "surprise"),
    (60, "smile"),
    (75, "fear"),
    (90, "anger"),
    (LAST_FRAME, None),
]


def main() -> None:
    scene = engine.empty_scene()
    skin = engine.addon("scene.head").place(scene, engine.addon("engine").generic_head())
    scene.frame_start, scene.frame_end = 1, LAST_FRAME
    poses = engine.addon("scene.keys").expressions(skin)
    blocks = skin.data.shape_keys.key_blocks
    acting = sorted({key for _, name in SCORE if name for key in poses[name]})
    for key in acting:
        blocks[key].slider_max = 2.0
    lines = [f"last_frame = {LAST_FRAME}", f"keys = {acting}".replace("'", '"')]
    for frame, name in SCORE:
        values = poses[name] if name else {}
        lines += ["", "[[keyframe]]", f"frame = {frame}", f'expression = "{name or "rest"}"', "[keyframe.values]"]
        for key in acting:
            blocks[key].value = values.get(key, 0.0)
            blocks[key].keyframe_insert("value", frame=frame)
            lines.append(f"{key} = {values.get(key, 0.0)}")
    scene.frame_set(1)
    engine.save("expressions")
    engine.write_toml("expressions", lines)


if __name__ == "__main__":
    main()
