"""A still room with a camera, lights and a wall; a person who turns in it, and a board that is held up.

Poses are `cam_from_x`, camera x right, y down, z forward, metres. In Blender the camera stands at the origin and looks
along +y, z up, so that a head at rest before it keeps the axes in which the add-on places heads.
"""

from dataclasses import asdict, dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

Array = NDArray[np.float64]

WORLD_FROM_CAM = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
HEAD_FROM_OBJECT = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
FACING = np.diag([1.0, -1.0, -1.0])
NECK = np.array([0.0, -0.03, -0.085])

# Place in the camera's frame, m; size, m; watt; colour.
LIGHTS = [
    ((-0.85, -0.70, -0.10), 0.7, 13.0, (1.0, 0.96, 0.90)),
    ((1.00, -0.20, 0.00), 0.9, 8.0, (0.92, 0.96, 1.0)),
    ((0.15, -1.25, 0.70), 0.9, 8.0, (1.0, 1.0, 1.0)),
]
AMBIENT = (0.30, 0.30, 0.31, 1.0)
WALL_DISTANCE = 1.8


@dataclass(frozen=True)
class Lens:
    """The camera: pixel centres at integers, `x_d = x (1 + k1 r² + k2 r⁴)`."""

    width: int = 400
    height: int = 300
    fx: float = 520.0
    fy: float = 520.0
    cx: float = 203.2
    cy: float = 147.1
    k1: float = -0.12
    k2: float = 0.04

    def as_dict(self) -> dict[str, float]:
        return asdict(self)

    def project(self, points: Array) -> Array:
        xy = points[..., :2] / points[..., 2:]
        r2 = (xy**2).sum(-1, keepdims=True)
        return xy * (1 + self.k1 * r2 + self.k2 * r2**2) * [self.fx, self.fy] + [self.cx, self.cy]

    def undistort(self, pixels: Array) -> Array:
        """Normalised coordinates of pixels, by fixed-point iteration."""
        distorted = (pixels - [self.cx, self.cy]) / [self.fx, self.fy]
        xy = distorted
        for _ in range(50):
            r2 = (xy**2).sum(-1, keepdims=True)
            xy = distorted / (1 + self.k1 * r2 + self.k2 * r2**2)
        return xy


def turn(frames: int, yaw_deg: float, distance: float) -> list[tuple[float, Array]]:
    """Yaw and `cam_from_head` of a head that turns from one side to the other, with the sway of a person."""
    poses = []
    for i in range(frames):
        s = i / (frames - 1)
        yaw = yaw_deg * (2 * s - 1) + 0.7 * np.sin(13 * s) * np.sin(np.pi * s)
        pitch = 2.2 * np.sin(5.5 * s + 0.4) + 0.5 * np.sin(19 * s)
        roll = 1.7 * np.sin(4.2 * s + 1.9)
        sway = 1e-3 * np.array([5 * np.sin(5 * s + 2), 2.5 * np.sin(7 * s + 1), 7 * np.sin(4 * s)])
        rotation = FACING @ _about("y", yaw) @ _about("x", pitch) @ _about("z", roll)
        base = np.array([0.0, -0.035, distance]) + sway
        poses.append((float(yaw), _pose(rotation, base + FACING @ NECK - rotation @ NECK)))
    return poses


def board_poses(lens: Lens, inner: tuple[int, int], square: float, count: int, seed: int) -> list[Array]:
    """Varied poses with the whole board in the picture: the first nearly frontal, each next far from the others."""
    random = np.random.default_rng(seed)
    nx, ny = inner
    border = np.array([[x, y, 0] for x in (-1.5, nx + 0.5) for y in (-1.5, ny + 0.5)]) * square
    middle = np.array([nx - 1, ny - 1, 0]) / 2 * square
    found: list[tuple[Array, Array]] = []
    while len(found) < 400:
        distance = lens.fx * (nx + 1) * square / (random.uniform(0.5, 0.92) * lens.width)
        tilt, towards, spin = random.uniform(0, 40), random.uniform(0, 360), random.normal(0, 12)
        rotation = _about("z", towards) @ _about("x", tilt) @ _about("z", spin - towards)
        centre = np.array([*random.uniform(-0.5, 0.5, 2) * [lens.width / lens.fx, lens.height / lens.fy], 1]) * distance
        pose = _pose(rotation, centre - rotation @ middle)
        pixels = lens.project(border @ rotation.T + pose[:3, 3])
        if (pixels > 1).all() and (pixels < [lens.width - 2, lens.height - 2]).all():
            found.append((np.array([*(3 * centre[:2] / distance), np.log(distance), *(2 * rotation[2, :2])]), pose))
    features = np.array([f for f, _ in found])
    chosen = [int(np.linalg.norm(features[:, 3:], axis=1).argmin())]
    while len(chosen) < count:
        nearest = np.min([np.linalg.norm(features - features[i], axis=1) for i in chosen], axis=0)
        chosen.append(int(nearest.argmax()))
    return [found[i][1] for i in chosen]


def object_matrix(cam_from_head: Array) -> Matrix:
    """World matrix of a head's object."""
    return Matrix((WORLD_FROM_CAM @ cam_from_head @ HEAD_FROM_OBJECT).tolist())


def board_matrix(cam_from_board: Array) -> Matrix:
    """World matrix of the board's object, whose axes are the board's own."""
    return Matrix((WORLD_FROM_CAM @ cam_from_board).tolist())


def furnish(scene: bpy.types.Scene, seed: int) -> None:
    """Camera, lights, wall, and the shoulders, which do not turn with the head."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.rotation_euler = (np.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("Room")
    scene.world.use_nodes = True
    background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = AMBIENT
    for place, size, watt, colour in LIGHTS:
        lamp = bpy.data.lights.new("Lamp", "AREA")
        lamp.shape, lamp.size, lamp.energy, lamp.color = "DISK", size, watt, colour
        at = bpy.data.objects.new("Lamp", lamp)
        at.location = _world(place)
        at.rotation_euler = (_world((0, 0, 0.7)) - at.location).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(at)
    wall = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]]) * 0.85
    corners = [tuple(_world((x, y, WALL_DISTANCE))) for x, y in wall]
    material = plain_material("Wall", (0.5, 0.5, 0.5), picture=wall_picture(seed))
    mesh_object(scene, "Wall", corners, [(0, 1, 2, 3)], [material], uvs=[(0, 0), (1, 0), (1, 1), (0, 1)])
    _shoulders(scene)


def board_object(scene: bpy.types.Scene, inner: tuple[int, int], square: float) -> bpy.types.Object:
    """The checkerboard with its white border; corner (0, 0) is the origin, the square before it is black."""
    nx, ny = inner
    xs = np.array([-1.5, *range(-1, nx + 1), nx + 0.5]) * square
    ys = np.array([-1.5, *range(-1, ny + 1), ny + 0.5]) * square
    vertices = [(x, y, 0) for y in ys for x in xs]
    columns = len(xs)
    quads, colours = [], []
    for j in range(len(ys) - 1):
        for i in range(columns - 1):
            a = j * columns + i
            quads.append((a, a + 1, a + columns + 1, a + columns))
            colours.append(int(1 <= i <= nx + 1 and 1 <= j <= ny + 1 and (i + j) % 2 == 0))
    materials = [plain_material("Board white", (0.72,) * 3), plain_material("Board black", (0.03,) * 3)]
    board = mesh_object(scene, "Board", vertices, quads, materials)
    board.data.polygons.foreach_set("material_index", colours)
    return board


def wall_picture(seed: int, size: int = 512) -> bpy.types.Image:
    """Pictures and boxes on a wall: many corners that stand still."""
    random = np.random.default_rng(seed)
    picture = np.full((size, size, 4), [150, 152, 140, 255], np.uint8)
    for _ in range(60):
        x, y = random.integers(0, size, 2)
        width, height = random.integers(16, 90, 2)
        patch = picture[y : y + height, x : x + width, :3]
        patch[:] = random.integers(40, 190, 3)
        if random.random() < 0.5:
            patch[:, :: int(random.integers(5, 12))] = random.integers(40, 200, 3)
        else:
            patch[4:-4, 4:-4] = random.integers(40, 200, 3)
    made = bpy.data.images.new("Wall", size, size)
    made.pixels.foreach_set((picture[::-1].astype(np.float32) / 255).ravel())
    made.pack()
    return made


def mesh_object(
    scene: bpy.types.Scene,
    name: str,
    vertices: list,
    faces: list,
    materials: list[bpy.types.Material],
    uvs: list | None = None,
) -> bpy.types.Object:
    """A mesh of its own in the scene."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    for material in materials:
        mesh.materials.append(material)
    if uvs:
        mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.array(uvs, np.float32).ravel())
    made = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(made)
    return made


def plain_material(name: str, colour: tuple[float, ...], picture: bpy.types.Image | None = None) -> bpy.types.Material:
    """A matt material."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 0.9
    shader.inputs["Specular IOR Level"].default_value = 0.1
    if picture:
        texture = material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = picture
        material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return material


def _shoulders(scene: bpy.types.Scene) -> None:
    rings, spokes = 16, 32
    polar, around = np.meshgrid(
        np.linspace(0.05, np.pi - 0.05, rings), np.arange(spokes) * 2 * np.pi / spokes, indexing="ij"
    )
    unit = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1).reshape(-1, 3)
    vertices = unit * [0.21, 0.11, 0.13] + np.array(_world((0.0, 0.245, 0.80)))
    quads = [
        (i * spokes + j, (i + 1) * spokes + j, (i + 1) * spokes + (j + 1) % spokes, i * spokes + (j + 1) % spokes)
        for i in range(rings - 1)
        for j in range(spokes)
    ]
    shirt = mesh_object(scene, "Shoulders", vertices.tolist(), quads, [plain_material("Shirt", (0.05, 0.08, 0.14))])
    shirt.data.shade_smooth()


def _world(place: tuple[float, float, float]) -> Vector:
    return Vector((WORLD_FROM_CAM[:3, :3] @ np.array(place)).tolist())


def _pose(rotation: Array, translation: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return pose


def _about(axis: str, degrees: float) -> Array:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    rotation = np.eye(3)
    rotation[j, j] = rotation[k, k] = c
    rotation[j, k], rotation[k, j] = -s, s
    return rotation
