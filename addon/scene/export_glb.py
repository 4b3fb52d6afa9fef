"""What Blender's exporter leaves to be mended in a GLB."""

import json
import struct
from pathlib import Path

# Bytes of the file's header, and of a chunk's: its length and kind.
HEADER, CHUNK = 12, 8


def put_skinned_at_root(file: Path) -> None:
    """Take meshes that follow joints from below the armature, as glTF advises: joints alone place them."""
    content = file.read_bytes()
    (length,) = struct.unpack_from("<I", content, HEADER)
    begin, end = HEADER + CHUNK, HEADER + CHUNK + length
    tree = json.loads(content[begin:end])
    skinned = {number for number, node in enumerate(tree["nodes"]) if "skin" in node}
    carried = skinned & {child for node in tree["nodes"] for child in node.get("children", ())}
    if not carried:
        return
    for node in tree["nodes"]:
        if children := [child for child in node.pop("children", ()) if child not in carried]:
            node["children"] = children
    tree["scenes"][tree.get("scene", 0)]["nodes"] += sorted(carried)
    text = json.dumps(tree, separators=(",", ":")).encode()
    # Chunks end at multiples of four bytes.
    text += b" " * (-len(text) % 4)
    magic, version, _ = struct.unpack_from("<4sII", content)
    rest = content[end:]
    header = struct.pack("<4sII", magic, version, HEADER + CHUNK + len(text) + len(rest))
    file.write_bytes(header + struct.pack("<I4s", len(text), b"JSON") + text + rest)
