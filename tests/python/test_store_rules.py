"""The rules of extensions.blender.org, and what other systems ask of file names, held against the zip itself."""

import ast
import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import PurePosixPath
from zipfile import ZipFile

import pytest

NEEDED = {
    "schema_version",
    "id",
    "version",
    "name",
    "tagline",
    "maintainer",
    "type",
    "blender_version_min",
    "license",
}
OPTIONAL = {"blender_version_max", "website", "copyright", "permissions", "tags", "platforms", "wheels", "build"}
PERMISSIONS = {"files", "network", "clipboard", "camera", "microphone"}
PLATFORMS = {"windows-x64", "windows-arm64", "macos-x64", "macos-arm64", "linux-x64", "linux-arm64"}
# Of taglines, and of the reasons of permissions.
TERSE = 64
# Those of add-ons.
TAGS = [
    "3D View",
    "Add Curve",
    "Add Mesh",
    "Animation",
    "Bake",
    "Camera",
    "Compositing",
    "Development",
    "Game Engine",
    "Geometry Nodes",
    "Grease Pencil",
    "Import-Export",
    "Lighting",
    "Material",
    "Mesh",
    "Modeling",
    "Node",
    "Object",
    "Paint",
    "Physics",
    "Pipeline",
    "Render",
    "Rigging",
    "Scene",
    "Sculpt",
    "Sequencer",
    "System",
    "Text Editor",
    "Tracking",
    "User Interface",
    "UV",
]
# Modules that reach the network, start programs or install packages.
FORBIDDEN_MODULES = set(
    [
        "socket",
        "ssl",
        "urllib",
        "http",
        "ftplib",
        "smtplib",
        "imaplib",
        "poplib",
        "telnetlib",
        "xmlrpc",
        "socketserver",
        "asyncio",
        "requests",
        "httpx",
        "aiohttp",
        "urllib3",
        "websocket",
        "websockets",
        "subprocess",
        "pip",
        "ensurepip",
        "venv",
        "importlib_resources",
        "pkg_resources",
        "setuptools",
        "multiprocessing",
        "marshal",
        "pickle",
        "runpy",
    ]
)
# What gets round all other rules, and what shows code that is hidden.
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "os.system", "os.popen", "os.startfile"}
FORBIDDEN_ENDINGS = set(
    [
        ".pyc",
        ".pyo",
        ".so",
        ".dll",
        ".dylib",
        ".pyd",
        ".exe",
        ".bat",
        ".sh",
        ".zip",
        ".blend1",
        ".blend2",
        ".whl.metadata",
        ".orig",
    ]
)
# Names that Windows keeps for devices, and characters that it does not allow.
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
NOT_IN_NAMES = re.compile(r'[<>:"|?*\\\x00-\x1f]|[ .]$')
# Windows takes 260; a user's folder of extensions takes up to 150 of them.
LONGEST = 110

Zip = dict[str, bytes]


@pytest.fixture(scope="module")
def extension() -> Zip:
    """The zip: files by their names."""
    with ZipFile(os.environ["FACEWRIGHT_ZIP"]) as content:
        return {name: content.read(name) for name in content.namelist() if not name.endswith("/")}


@pytest.fixture(scope="module")
def manifest(extension: Zip) -> dict[str, object]:
    return tomllib.loads(extension["blender_manifest.toml"].decode())


@pytest.fixture(scope="module")
def sources(extension: Zip) -> dict[str, str]:
    return {name: content.decode() for name, content in extension.items() if name.endswith(".py")}


def terse(text: str) -> bool:
    """Whether a text is short, without a full stop, as the store wants taglines and reasons."""
    return 0 < len(text) <= TERSE and text == text.strip() and (text[-1].isalnum() or text[-1] in ")]}")


def complaints_of_manifest(told: dict) -> Iterator[str]:
    yield from (f"{name} is missing" for name in sorted(NEEDED - told.keys()))
    yield from (f"{name} is unknown" for name in sorted(told.keys() - NEEDED - OPTIONAL))
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", told.get("id", "")):
        yield "the id is no identifier"
    if "blender" in told.get("name", "").lower():
        yield "the name has Blender in it"
    if not terse(told.get("tagline", "")):
        yield "the tagline is long, or ends with a full stop"
    if told.get("type") != "add-on":
        yield "the type is not add-on"
    if not re.fullmatch(r"\d+\.\d+\.\d+", told.get("version", "")):
        yield "the version is not of three numbers"
    if not re.fullmatch(r"\d+\.\d+\.\d+", told.get("blender_version_min", "")):
        yield "the oldest Blender is not of three numbers"
    if "SPDX:GPL-3.0-or-later" not in told.get("license", []):
        yield "the licence is not the GPL that the store asks for"
    yield from (f"{held} is no copyright" for held in told.get("copyright", []) if not _is_copyright(held))
    yield from (f"{tag} is no tag" for tag in told.get("tags", []) if tag not in TAGS)
    yield from (f"{name} is no platform" for name in told.get("platforms", []) if name not in PLATFORMS)
    yield from _complaints_of_permissions(told.get("permissions", {}))
    build = told.get("build", {})
    if {"paths", "paths_exclude_pattern"} <= build.keys():
        yield "the build names both what is in it and what is not"


def _is_copyright(text: str) -> bool:
    return re.fullmatch(r"\d{4}(-\d{4})? \S.*", text) is not None


def _complaints_of_permissions(asked: object) -> Iterator[str]:
    if not isinstance(asked, dict):
        yield "the permissions are no table"
        return
    yield from (f"{name} is no permission" for name in asked if name not in PERMISSIONS)
    yield from (
        f"the reason of {name} is long, or ends with a full stop" for name, why in asked.items() if not terse(why)
    )


def test_the_manifest_keeps_the_rules(manifest: dict) -> None:
    assert list(complaints_of_manifest(manifest)) == []


def test_nothing_but_files_is_asked_for(manifest: dict) -> None:
    assert set(manifest["permissions"]) == {"files"}


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"tagline": "Heads of films."}, "tagline"),
        ({"tagline": "x" * 65}, "tagline"),
        ({"name": "Blender Faces"}, "Blender"),
        ({"tags": ["Faces"]}, "no tag"),
        ({"id": "face__wright"}, "identifier"),
        ({"permissions": ["files"]}, "no table"),
        ({"permissions": {"disk": "Write heads"}}, "no permission"),
        ({"permissions": {"files": "Write heads."}}, "full stop"),
        ({"blender_version_min": "4.2"}, "three numbers"),
        ({"license": ["SPDX:MIT"]}, "licence"),
        ({"copyright": ["The developers"]}, "copyright"),
        ({"platforms": ["linux-x86_64"]}, "platform"),
        ({"homepage": "here"}, "unknown"),
    ],
)
def test_a_manifest_that_breaks_a_rule_is_told_of(manifest: dict, change: dict, complaint: str) -> None:
    assert any(complaint in said for said in complaints_of_manifest(manifest | change))


def platform_of(wheel: str) -> str:
    """Blender's word for what a wheel is for: `linux-x64`."""
    tag = wheel.removesuffix(".whl").rsplit("-", 1)[1]
    system = next(name for word, name in SYSTEMS.items() if tag.startswith(word))
    return f"{system}-{'arm64' if tag.endswith(('arm64', 'aarch64')) else 'x64'}"


SYSTEMS = {"manylinux": "linux", "linux": "linux", "win": "windows", "macosx": "macos"}


def test_every_wheel_is_there_listed_and_for_every_python(manifest: dict, extension: Zip) -> None:
    listed = [path.removeprefix("./") for path in manifest["wheels"]]
    assert sorted(listed) == sorted(name for name in extension if name.endswith(".whl")) and listed
    assert all(path.startswith("./wheels/") for path in manifest["wheels"])
    for wheel in listed:
        _, _, python, abi, _ = PurePosixPath(wheel).name.split("-")
        assert (python, abi) == ("cp311", "abi3"), "others would bind the extension to one Python"
    assert sorted(map(platform_of, listed)) == sorted(manifest["platforms"])


def test_licences_and_notices_come_along(extension: Zip) -> None:
    assert b"GNU GENERAL PUBLIC LICENSE" in extension["LICENSE-GPL"] and extension["NOTICE"].strip()


def complaints_of_names(names: list[str]) -> Iterator[str]:
    lower: dict[str, str] = {}
    for name in names:
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts:
            yield f"{name} leads out of the extension"
        if any(NOT_IN_NAMES.search(part) or PurePosixPath(part).stem.lower() in DEVICES for part in path.parts):
            yield f"{name} is no name on Windows"
        if not name.isascii() or len(name) > LONGEST:
            yield f"{name} is too long, or not of plain letters"
        if path.suffix.lower() in FORBIDDEN_ENDINGS or any(p.startswith(".") or p == "__pycache__" for p in path.parts):
            yield f"{name} does not belong into an extension"
        if name.lower() in lower:
            yield f"{name} and {lower[name.lower()]} are one file on Windows and macOS"
        lower[name.lower()] = name


def test_every_file_can_be_unpacked_everywhere_and_belongs_there(extension: Zip) -> None:
    assert len(extension) > 50
    assert list(complaints_of_names(list(extension))) == []


@pytest.mark.parametrize(
    "names",
    [
        ["a/con.py"],
        ["a:b.py"],
        ["Head.py", "head.py"],
        ["../a.py"],
        ["engine/_native.abi3.so"],
        [".git/config"],
        ["__pycache__/a.py"],
        ["grün.py"],
        ["a/" * 60 + "a.py"],
    ],
)
def test_a_name_that_breaks_a_rule_is_told_of(names: list[str]) -> None:
    assert list(complaints_of_names(names))


def called(node: ast.expr) -> str:
    """`os.system` of the expression that is called; empty for what has no name."""
    if isinstance(node, ast.Attribute):
        return f"{called(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def complaints_of_source(source: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from _complaints_of_imports([alias.name for alias in node.names])
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield from _complaints_of_imports([node.module or ""])
        elif isinstance(node, ast.Call) and called(node.func) in FORBIDDEN_CALLS:
            yield f"{called(node.func)} is called in line {node.lineno}"
        elif isinstance(node, ast.Attribute) and called(node) == "sys.path":
            yield f"sys.path is used in line {node.lineno}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and re.search("https?://", node.value):
            yield f"an address of the network is in line {node.lineno}"


def _complaints_of_imports(names: list[str]) -> Iterator[str]:
    for name in names:
        top = name.partition(".")[0]
        if top in FORBIDDEN_MODULES:
            yield f"{name} is imported"
        if top in {"bl_ext", "addon"}:
            yield f"{name} is a module of extensions: imports of the own one are relative"


def test_no_source_reaches_out_of_the_extension(sources: dict[str, str]) -> None:
    assert len(sources) > 40
    found = {name: list(complaints_of_source(source)) for name, source in sources.items()}
    assert {name: said for name, said in found.items() if said} == {}


@pytest.mark.parametrize(
    "source",
    [
        "import socket",
        "from urllib.request import urlopen",
        "import http.client",
        "import requests",
        "import subprocess",
        "import pip",
        "import sys\nsys.path.append('here')",
        "import sys\nsys.path[:0] = ['here']",
        "exec('1')",
        "import os\nos.system('pip install numpy')",
        "from bl_ext.user_default.facewright import cli",
        "a = 'https://example.org/net.onnx'",
    ],
)
def test_a_source_that_breaks_a_rule_is_told_of(source: str) -> None:
    assert list(complaints_of_source(source))


def test_every_text_file_is_opened_as_utf_8(sources: dict[str, str]) -> None:
    """Windows would take the code page of its user."""
    found = [
        f"{name}:{node.lineno}"
        for name, source in sources.items()
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call) and opens_text(node) and "encoding" not in {k.arg for k in node.keywords}
    ]
    assert found == []


def opens_text(node: ast.Call) -> bool:
    name = called(node.func)
    if name.endswith((".read_text", ".write_text")):
        return True
    if name != "open":
        return False
    mode = node.args[1] if len(node.args) > 1 else next((k.value for k in node.keywords if k.arg == "mode"), None)
    return not (isinstance(mode, ast.Constant) and "b" in str(mode.value))


@pytest.mark.parametrize(
    ("code", "is_text"),
    [("open(a)", True), ("open(a, 'rb')", False), ("p.read_text()", True), ("p.read_bytes()", False)],
)
def test_what_opens_text_is_known(code: str, is_text: bool) -> None:
    call = ast.parse(code, mode="eval").body
    assert isinstance(call, ast.Call) and opens_text(call) == is_text


def test_the_own_folder_is_only_read(sources: dict[str, str]) -> None:
    """It is replaced by an update and may be read-only: its place is asked for by those alone that read from it."""
    asking = {name for name, source in sources.items() if re.search(r"\b__file__\b", source)}
    assert asking == {"engine/__init__.py", "help/actions.py"}
