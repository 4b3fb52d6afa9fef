"""synthetic_person.blend: a person outside the fit's face class who turns before a still camera, and a board.

Also writes synthetic_person.toml, and the film of it with its truth to tests/data/clip. Frames 1…21 are the turn,
101…108 the board.  `--frames 1,11` renders only these, for a look.
"""

import json
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

sys.path[:0] = [str(Path(__file__).parent)]

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from parts import engine, film, person, studio  # noqa: E402

if TYPE_CHECKING:
    from facewright import Reconstruction

SEED = 5
FRAMES, YAW_DEG, DISTANCE = 21, 28.0, 0.62
INNER, SQUARE, BOARDS, FIRST_BOARD = (9, 6), 0.0255, 8, 101
SKIN_SIZE = 1024
HEAD_GAIN, BOARD_GAIN = 1.15, 0.8


def main(only: set[int] | None = None) -> None:
    scene = engine.empty_scene()
    head = make_person(engine.addon("engine").generic_head())
    skin = engine.addon("scene.head").place(scene, head)
    pack_small(bpy.data.images["Face skin"])
    studio.furnish(scene, SEED)
    board = studio.board_object(scene, INNER, SQUARE)
    lens = studio.Lens()
    turn = studio.turn(FRAMES, YAW_DEG, DISTANCE)
    boards = studio.board_poses(lens, INNER, SQUARE, BOARDS, SEED)
    animate(scene, skin, board, turn, boards)
    camera = film.Film(scene, lens, SEED)
    write_truth(head, lens, turn, boards)
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.frame_set((FRAMES + 1) // 2)
    engine.save("synthetic_person")
    shoot(scene, camera, only)


def make_person(generic: "Reconstruction") -> SimpleNamespace:
    """The generic head pushed and painted; it has no keys."""
    quads, uvs = generic.quads, generic.uvs
    first, end = generic.parts[0][2]
    positions = generic.positions.astype(float)
    texture = person.paint(positions, SKIN_SIZE, SEED, quads[first:end].astype(np.int64), uvs[first:end].astype(float))
    return SimpleNamespace(
        positions=person.push(positions, SEED).astype(np.float32),
        generic_positions=generic.positions,
        quads=quads,
        uvs=uvs,
        parts=generic.parts,
        keys=[],
        expressions=[],
        texture=texture,
        eyes=generic.eyes,
        report="{}",
    )


def pack_small(picture: bpy.types.Image) -> None:
    """Pack a picture as JPEG instead of PNG."""
    with tempfile.TemporaryDirectory() as folder:
        picture.filepath_raw, picture.file_format = str(Path(folder) / "skin.jpg"), "JPEG"
        picture.save(quality=92)
        picture.unpack(method="REMOVE")
        picture.source = "FILE"
        picture.reload()
        picture.pack()


def animate(
    scene: bpy.types.Scene,
    skin: bpy.types.Object,
    board: bpy.types.Object,
    turn: list[tuple[float, studio.Array]],
    boards: list[studio.Array],
) -> None:
    """Poses on frames; the head is away while the board is there."""
    people = [skin, *skin.children, bpy.data.objects["Shoulders"]]
    for obj in (skin, board):
        obj.rotation_mode = "QUATERNION"
    keyed = [(skin, 1 + i, studio.object_matrix(pose)) for i, (_, pose) in enumerate(turn)]
    keyed += [(board, FIRST_BOARD + i, studio.board_matrix(pose)) for i, pose in enumerate(boards)]
    for obj, frame, matrix in keyed:
        obj.matrix_world = matrix
        obj.keyframe_insert("location", frame=frame)
        obj.keyframe_insert("rotation_quaternion", frame=frame)
    for frame, with_board in ((1, False), (FRAMES + 1, False), (FIRST_BOARD, True)):
        for obj in people:
            obj.hide_render = frame > FRAMES
            obj.keyframe_insert("hide_render", frame=frame)
        board.hide_render = not with_board
        board.keyframe_insert("hide_render", frame=frame)


def write_truth(head: SimpleNamespace, lens: studio.Lens, turn: list, boards: list) -> None:
    """truth.json and head.ply of the clip, and the fixture's own summary."""
    for folder in ("frames", "board"):
        (engine.CLIP / folder).mkdir(parents=True, exist_ok=True)
    (_, vertices, quads) = head.parts[0]
    skin, faces = head.positions[: vertices[1]], head.quads[: quads[1]]
    write_ply(engine.CLIP / "head.ply", skin, np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]]))
    tip = skin[np.argmax(skin[:, 2])]
    truth = {
        "convention": "camera x right, y down, z forward; head x the subject's left, y up, z out of the face; metres; "
        "pixel centres at integers; x_d = x (1 + k1 r^2 + k2 r^4); p_cam = cam_from_head p_head",
        "camera": lens.as_dict(),
        "frames": [
            {
                "name": f"frame_{i:02d}",
                "file": f"frames/frame_{i:02d}.jpg",
                "yaw_deg": yaw,
                "cam_from_head": pose.tolist(),
            }
            for i, (yaw, pose) in enumerate(turn)
        ],
        "boards": [
            {"name": f"board_{i}", "file": f"board/board_{i}.png", "cam_from_board": pose.tolist()}
            for i, pose in enumerate(boards)
        ],
        "board": {"inner_corners": list(INNER), "square_m": SQUARE},
        "mesh": "head.ply",
        "mesh_unit": "m",
        "nose_tip": [round(float(c), 6) for c in tip],
        "noise_sigma": film.NOISE_SIGMA,
        "jpeg_quality": film.JPEG_QUALITY,
    }
    (engine.CLIP / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    camera = [f"{key} = {value}" for key, value in lens.as_dict().items()]
    ends = [f"yaw_deg = [{turn[0][0]:.3f}, {turn[-1][0]:.3f}]"]
    lines = [f"turn_frames = [1, {FRAMES}]", f"board_frames = [{FIRST_BOARD}, {FIRST_BOARD + BOARDS - 1}]", *ends]
    lines += [
        f"inner_corners = {list(INNER)}",
        f"square_m = {SQUARE}",
        'film = "tests/data/clip"',
        "",
        "[camera]",
        *camera,
    ]
    engine.write_toml("synthetic_person", lines)


def write_ply(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    """Binary PLY of float32 vertices and triangles."""
    header = f"""ply
format binary_little_endian 1.0
comment head frame: x the subject's left, y up, z out of the face; metres
element vertex {len(vertices)}
property float x
property float y
property float z
element face {len(triangles)}
property list uchar int vertex_indices
end_header
"""
    faces = np.zeros(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    path.write_bytes(header.encode() + vertices.astype("<f4").tobytes() + faces.tobytes())


def shoot(scene: bpy.types.Scene, camera: film.Film, only: set[int] | None) -> None:
    """Film the turn, the empty room and the boards."""
    wanted = lambda frame: only is None or frame in only  # noqa: E731
    for frame in filter(wanted, range(1, FRAMES + 1)):
        film.write_jpeg(engine.CLIP / f"frames/frame_{frame - 1:02d}.jpg", camera.shoot(frame, HEAD_GAIN))
    if wanted(FRAMES + 1):
        film.write_jpeg(engine.CLIP / "no_face.jpg", camera.shoot(FRAMES + 1, HEAD_GAIN))
    for i in filter(lambda i: wanted(FIRST_BOARD + i), range(BOARDS)):
        film.write_grey_png(engine.CLIP / f"board/board_{i}.png", camera.shoot(FIRST_BOARD + i, BOARD_GAIN))


if __name__ == "__main__":
    chosen = sys.argv[sys.argv.index("--frames") + 1] if "--frames" in sys.argv else ""
    main({int(n) for n in chosen.split(",")} if chosen else None)
