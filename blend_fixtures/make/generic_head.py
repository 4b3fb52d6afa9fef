"""generic_head.blend: the generic head alone, with its keys; generic_head.toml: what must be in it."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

from parts import engine  # noqa: E402


def main() -> None:
    scene = engine.empty_scene()
    head = engine.addon("engine").generic_head()
    engine.addon("scene.head").place(scene, head)
    engine.save("generic_head")
    lines = [
        f"vertices = {len(head.positions)}",
        f"quads = {len(head.quads)}",
        f"keys = {[name for name, _, _ in head.keys]}".replace("'", '"'),
        f"expressions = {[name for name, _ in head.expressions]}".replace("'", '"'),
    ]
    for name, vertices, quads in head.parts:
        lines += ["", "[[part]]", f'name = "{name}"', f"vertices = {vertices[1] - vertices[0]}"]
        lines += [f"quads = {quads[1] - quads[0]}"]
    engine.write_toml("generic_head", lines)


if __name__ == "__main__":
    main()
