"""Packs the folder of a Python package with its native module into a wheel for the machine it was compiled on."""

import argparse
import base64
import hashlib
import sysconfig
import tomllib
import zipfile
from pathlib import Path

PYPROJECT = Path(__file__).parents[2] / "python/pyproject.toml"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--package", type=Path, required=True, help="folder of the package")
    parser.add_argument("--version", required=True)
    parser.add_argument("--out", type=Path, required=True, help="folder of the wheel")
    arguments = parser.parse_args()
    print(pack(arguments.package, arguments.version, arguments.out))


def pack(package: Path, version: str, out: Path) -> Path:
    project = tomllib.loads(PYPROJECT.read_text())["project"]
    oldest = project["requires-python"].removeprefix(">=").replace(".", "")
    tag = f"cp{oldest}-abi3-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
    files = {f"{package.name}/{path.relative_to(package)}": path.read_bytes() for path in sorted(package.rglob("*.*"))}
    about = f"{package.name}-{version}.dist-info"
    files[f"{about}/METADATA"] = (
        f"Metadata-Version: 2.4\nName: {project['name']}\nVersion: {version}\nSummary: {project['description']}\n"
        f"Requires-Python: {project['requires-python']}\n"
    ).encode()
    files[f"{about}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: xtask\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    record = "".join(f"{name},sha256={digest(data)},{len(data)}\n" for name, data in files.items())
    files[f"{about}/RECORD"] = f"{record}{about}/RECORD,,\n".encode()
    out.mkdir(parents=True, exist_ok=True)
    wheel = out / f"{package.name}-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return wheel


def digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


if __name__ == "__main__":
    main()
