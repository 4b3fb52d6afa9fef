"""The points of a head that a motion was found from, as the vertices of an object.

A vertex without a face is hardly seen over a picture: a modifier of geometry nodes sets a small ball of the region's
colour on each, for the viewport only. The vertices are below, to be selected, snapped to and measured.
"""

import bpy
import numpy as np
from mathutils import Color, Matrix

from ..engine.motion import MotionPoints
from ..engine.tracks import REGIONS
from .axes import to_blender
from .face_tracks import COLORS
from .materials import plain

CLOUD = "facewright_motion_points"
DISPLAY = "facewright_motion_display"
TITLE = "Face Points"
MODIFIER = "Show Points"
# Of a ball, metres.
RADIUS = 0.0012


def cloud(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The object with the points of a scene."""
    return next((o for o in scene.objects if o.type == "MESH" and o.get(CLOUD)), None)


def place(
    scene: bpy.types.Scene, home: bpy.types.Collection, points: MotionPoints, head: bpy.types.Object
) -> bpy.types.Object:
    """Put the points into a collection below the head, or bring the object that is in the scene up to date."""
    obj = cloud(scene) or _new(home)
    hang(scene, head)
    mesh = obj.data
    mesh.clear_geometry()
    mesh.from_pydata(to_blender(points.positions.astype(np.float32)).tolist(), [], [])
    regions = np.array([REGIONS.index(region) for region in points.regions], np.int32)
    colours = np.array([linear(region) for region in REGIONS], np.float32)
    _attribute(mesh, "track_id", "INT", "value", points.ids.astype(np.int32))
    _attribute(mesh, "sigma_mm", "FLOAT", "value", points.sigmas_mm.astype(np.float32))
    _attribute(mesh, "rms_px", "FLOAT", "value", points.reprojection_rms_px.astype(np.float32))
    _attribute(mesh, "frames", "INT", "value", points.frames.astype(np.int32))
    _attribute(mesh, "region", "INT", "value", regions)
    _attribute(mesh, "moves", "BOOLEAN", "value", points.moves)
    _attribute(mesh, "region_color", "FLOAT_COLOR", "color", colours[regions].ravel())
    mesh.update()
    return obj


def hang(scene: bpy.types.Scene, head: bpy.types.Object) -> None:
    """Make the points the head's children, unless the artist has given them another parent."""
    obj = cloud(scene)
    if obj is not None and obj.parent is None:
        obj.parent = head
        obj.matrix_parent_inverse = Matrix.Identity(4)


def remove(scene: bpy.types.Scene) -> None:
    """Take the points and what shows them out of the file."""
    obj = cloud(scene)
    if obj is None:
        return
    mesh = obj.data
    bpy.data.objects.remove(obj)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)
    for tree in [tree for tree in bpy.data.node_groups if tree.get(DISPLAY) and not tree.users]:
        bpy.data.node_groups.remove(tree)
    for region in REGIONS:
        look = bpy.data.materials.get(look_name(region))
        if look is not None and not look.users:
            bpy.data.materials.remove(look)


def linear(region: str) -> tuple[float, float, float, float]:
    """A region's colour, that of its markers, as materials have it."""
    return (*Color(COLORS[region]).from_srgb_to_scene_linear(), 1.0)


def look_name(region: str) -> str:
    """What a region's material is called."""
    return f"{TITLE} {region}"


def _new(home: bpy.types.Collection) -> bpy.types.Object:
    obj = bpy.data.objects.new(TITLE, bpy.data.meshes.new(TITLE))
    obj[CLOUD] = True
    obj.hide_render = True
    home.objects.link(obj)
    obj.modifiers.new(MODIFIER, "NODES").node_group = _display()
    return obj


def _attribute(mesh: bpy.types.Mesh, name: str, kind: str, field: str, values: np.ndarray) -> None:
    mesh.attributes.new(name, kind, "POINT").data.foreach_set(field, values)


def _display() -> bpy.types.NodeTree:
    """Nodes that set a ball on each vertex: one chain for each region, and the vertices themselves."""
    known = next((tree for tree in bpy.data.node_groups if tree.get(DISPLAY)), None)
    if known is not None:
        return known
    tree = bpy.data.node_groups.new(TITLE, "GeometryNodeTree")
    tree[DISPLAY] = True
    tree.is_modifier = True
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    radius = tree.interface.new_socket("Radius", in_out="INPUT", socket_type="NodeSocketFloat")
    radius.default_value, radius.min_value, radius.subtype = RADIUS, 0.0, "DISTANCE"
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    source, target = _node(tree, "NodeGroupInput", -800, 0), _node(tree, "NodeGroupOutput", 400, 0)
    join = _node(tree, "GeometryNodeJoinGeometry", 200, 0)
    region = _node(tree, "GeometryNodeInputNamedAttribute", -800, -200)
    region.data_type = "INT"
    region.inputs["Name"].default_value = "region"
    for number, name in enumerate(REGIONS):
        balls = _balls(tree, number, name, source, region)
        tree.links.new(balls.outputs["Geometry"], join.inputs[0])
    tree.links.new(source.outputs["Geometry"], join.inputs[0])
    tree.links.new(join.outputs[0], target.inputs[0])
    return tree


def _balls(
    tree: bpy.types.NodeTree, number: int, name: str, source: bpy.types.Node, region: bpy.types.Node
) -> bpy.types.Node:
    """Balls on the points of one region, in its material."""
    height = -300 * number
    ball, equal = (
        _node(tree, "GeometryNodeMeshIcoSphere", -500, height),
        _node(tree, "FunctionNodeCompare", -500, height),
    )
    equal.data_type, equal.operation = "INT", "EQUAL"
    set_on = _node(tree, "GeometryNodeInstanceOnPoints", -250, height)
    colour = _node(tree, "GeometryNodeSetMaterial", 0, height)
    colour.inputs["Material"].default_value = plain(look_name(name), linear(name))
    wanted = next(socket for socket in equal.inputs if socket.type == "INT" and socket.name == "B")
    found = next(socket for socket in equal.inputs if socket.type == "INT" and socket.name == "A")
    wanted.default_value = number
    link = tree.links.new
    link(region.outputs["Attribute"], found)
    link(source.outputs["Radius"], ball.inputs["Radius"])
    link(source.outputs["Geometry"], set_on.inputs["Points"])
    link(equal.outputs["Result"], set_on.inputs["Selection"])
    link(ball.outputs["Mesh"], set_on.inputs["Instance"])
    link(set_on.outputs["Instances"], colour.inputs["Geometry"])
    return colour


def _node(tree: bpy.types.NodeTree, kind: str, x: float, y: float) -> bpy.types.Node:
    node = tree.nodes.new(kind)
    node.location = (x, y)
    return node
