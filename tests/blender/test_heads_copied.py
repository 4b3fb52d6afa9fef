"""Heads that come from elsewhere: appended, linked, copied by the artist, or left by an older version."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest
from people import (
    ANNA,
    BEN,
    OLDER_ANNA,
    Clips,
    assert_is,
    collection_of,
    duplicated,
    evaluated,
    head_of,
    heads,
    red,
    reds,
    reopened,
    run,
    select,
)
from tracking import drawn, module


def test_a_head_is_appended_to_another_file_whole(clips: Clips, grown: Callable[[], None], tmp_path: Path) -> None:
    run(clips.anna)
    jaw = bpy.context.object.data.shape_keys.key_blocks["jawOpen"]
    jaw.keyframe_insert("value", frame=5)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "anna.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    ben = run(clips.ben)
    append(tmp_path / "anna.blend")
    anna = bpy.data.objects["Face.001"]
    assert_is(anna, ANNA)
    assert_is(ben, BEN)
    pictures = [m.node_tree.nodes["Image Texture"].image for m in anna.data.materials]
    assert all(picture.packed_file is not None for picture in pictures), "pictures are packed"
    assert anna.data.shape_keys.animation_data.action is not None, "animation comes along"
    assert bpy.context.scene.facewright_clip.head == ben.name, "what the next run makes stays"
    grown()
    assert run(clips.anna) == anna, "and its clip knows it"
    assert_is(anna, OLDER_ANNA)
    assert_is(ben, BEN)


def append(path: Path, **more: bool) -> None:
    """Append the collection of a file's first head, as an artist does."""
    folder = f"{path}/Collection/"
    assert bpy.ops.wm.append(filepath=f"{folder}Face", directory=folder, filename="Face", **more) == {"FINISHED"}


def test_a_head_appended_twice_is_two(clips: Clips, grown: Callable[[], None], tmp_path: Path) -> None:
    run(clips.anna)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "anna.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    for _ in range(2):
        append(tmp_path / "anna.blend", do_reuse_local_id=False)
    first, second = bpy.data.objects["Face"], bpy.data.objects["Face.001"]
    assert_is(first, ANNA)
    assert_is(second, ANNA)
    grown()
    assert run(clips.anna, head="Face.001") == second
    assert_is(first, ANNA)
    assert_is(second, OLDER_ANNA)


def link(path: Path) -> bpy.types.Collection:
    """Save the file there and link its first head into a new one; gives the collection."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.collections = ["Face"]
    bpy.context.scene.collection.children.link(wanted.collections[0])
    return wanted.collections[0]


def test_an_override_of_a_linked_head_is_not_changed_either(clips: Clips, tmp_path: Path) -> None:
    run(clips.anna)
    linked = link(tmp_path / "anna.blend")
    linked.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer, do_fully_editable=True)
    bpy.context.scene.collection.children.unlink(linked)
    anna = next(o for o in bpy.context.scene.objects if o.get("facewright_part") == "skin")
    assert anna.override_library is not None, "its objects are the artist's"
    select(anna)
    assert not bpy.ops.facewright.expression.poll(), "its keys are still of the other file"
    bpy.context.scene.facewright_clip.path = clips.anna
    assert bpy.context.scene.facewright_clip.head == "NEW"
    assert run(clips.anna) != anna
    assert_is(anna, ANNA)


def test_a_linked_head_is_shown_but_not_changed(clips: Clips, tmp_path: Path) -> None:
    run(clips.anna)
    link(tmp_path / "anna.blend")
    linked = bpy.context.scene.objects["Face"]
    select(linked)
    assert "This is Anna" in drawn("FACEWRIGHT_PT_report", object=linked), "its report is shown"
    assert not bpy.ops.facewright.expression.poll(), "its keys belong to the other file"
    with pytest.raises(RuntimeError, match="linked from another file: set them there, or append"):
        bpy.ops.facewright.expression(name="happiness")
    bpy.context.scene.facewright_clip.path = clips.anna
    assert bpy.context.scene.facewright_clip.head == "NEW", "a run cannot change it"
    own = run(clips.anna)
    assert own.library is None
    assert len(heads()) == 2
    assert bpy.ops.facewright.expression(name="happiness") == {"FINISHED"}, "the new one is the artist's own"
    assert linked.data.shape_keys.key_blocks["mouthSmileLeft"].value == 0.0


@pytest.mark.parametrize("rigged", [False, True], ids=["below its skin", "without parents"])
def test_a_duplicated_head_is_another_head(clips: Clips, grown: Callable[[], None], rigged: bool) -> None:
    anna = run(clips.anna)
    if rigged:
        for part in head_of(anna).objects:
            part.parent = None
    copies = duplicated(*head_of(anna).objects)
    copy = copies["skin"]
    assert len(heads()) == 2
    assert head_of(copy).parts == copies, "its parts are the copies"
    assert not {*head_of(anna).objects} & {*copies.values()}, "and the original's are the originals"
    grown()
    assert run(clips.anna) == anna, "the head that was made is updated"
    assert_is(anna, OLDER_ANNA)
    assert_is(copy, ANNA)
    assert bpy.context.scene.facewright_clip.head == anna.name


def test_a_copy_may_be_updated_alone_and_gets_a_collection(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    copy = duplicated(*head_of(anna).objects)["skin"]
    grown()
    assert run(clips.anna, head=copy.name) == copy
    assert_is(copy, OLDER_ANNA)
    assert_is(anna, ANNA)
    home = collection_of(copy)
    assert home != collection_of(anna), "a head is a collection"
    assert set(home.objects) == set(head_of(copy).objects)
    assert run(clips.anna, head=anna.name) == anna
    assert collection_of(anna).name == "Face", "the original stays in its own"


def test_a_copy_put_before_its_original_is_not_taken_for_it(clips: Clips, grown: Callable[[], None]) -> None:
    backup = bpy.data.collections.new("Backup")
    bpy.context.scene.collection.children.link(backup)
    anna = run(clips.anna)
    copies = duplicated(*head_of(anna).objects)
    for obj in copies.values():
        collection_of(obj).objects.unlink(obj)
        backup.objects.link(obj)
    grown()
    assert run(clips.anna) == anna
    assert_is(copies["skin"], ANNA)
    assert_is(anna, OLDER_ANNA)


def test_a_copy_whose_original_is_gone_is_the_head(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    copy = duplicated(*head_of(anna).objects)["skin"]
    for obj in head_of(anna).objects:
        bpy.data.objects.remove(obj)
    grown()
    assert run(clips.anna) == copy
    assert len(heads()) == 1
    assert_is(copy, OLDER_ANNA)


def test_a_copy_whose_originals_skin_is_gone_keeps_its_own_parts(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    left = [obj for obj in head_of(anna).objects if obj != anna]
    copies = duplicated(*head_of(anna).objects)
    bpy.data.objects.remove(anna)
    assert head_of(copies["skin"]).parts == copies
    before = [evaluated(obj) for obj in left]
    grown()
    assert run(clips.anna) == copies["skin"]
    assert_is(copies["skin"], OLDER_ANNA)
    assert all(np.array_equal(evaluated(obj), shape) for obj, shape in zip(left, before)), "the rest stays as it is"


def test_a_duplicated_collection_is_another_head(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    home = collection_of(anna)
    twin = home.copy()
    bpy.context.scene.collection.children.link(twin)
    copies = duplicated(*head_of(anna).objects)
    for obj in copies.values():
        home.objects.unlink(obj)
    for obj in set(home.objects):
        twin.objects.unlink(obj)
    assert twin["facewright_head"] == home["facewright_head"], "Blender copies the mark"
    grown()
    assert run(clips.anna, head=copies["skin"].name) == copies["skin"]
    assert collection_of(copies["skin"]) == twin, "it stays in the copied collection"
    assert twin["facewright_head"] != home["facewright_head"], "which is its own from then on"
    assert_is(anna, ANNA)
    assert_is(copies["skin"], OLDER_ANNA)


def test_a_linked_duplicate_goes_on_showing_the_same_head(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    copy = duplicated(*head_of(anna).objects, linked=True)["skin"]
    grown()
    assert run(clips.anna) == anna
    assert copy.data == anna.data, "they share a mesh, as the artist wanted"
    assert len(bpy.data.images) == 2
    assert_is(anna, OLDER_ANNA)


def test_a_copied_skin_alone_is_a_head_that_takes_no_parts(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    parts = head_of(anna).parts
    copy = duplicated(anna)["skin"]
    assert head_of(anna).parts == parts
    assert set(head_of(copy).parts) == {"skin"}
    grown()
    run(clips.anna, head=copy.name)
    assert_is(copy, OLDER_ANNA)
    assert_is(anna, ANNA)


def test_a_full_copy_of_a_scene_has_a_head_of_its_own(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    bpy.ops.scene.new(type="FULL_COPY")
    (copy,) = (head.skin for head in heads())
    assert copy != anna
    grown()
    assert run(clips.anna) == copy
    assert_is(copy, OLDER_ANNA)
    bpy.context.window.scene = bpy.data.scenes["Scene"]
    assert_is(anna, ANNA)


def made_by_an_older_version(clip: str, skin: bpy.types.Object) -> None:
    """Turn a head into what the versions without keys have saved."""
    home = collection_of(skin)
    for obj in head_of(skin).objects:
        bpy.context.scene.collection.objects.link(obj)
        home.objects.unlink(obj)
        for name in ("facewright_head", "facewright_picture", "facewright_name", "facewright_made_of"):
            if name in obj:
                del obj[name]
    bpy.data.collections.remove(home)
    bpy.context.scene.facewright_clip.path = clip


def test_a_head_of_an_older_version_is_adopted_by_the_next_run(
    clips: Clips, grown: Callable[[], None], tmp_path: Path
) -> None:
    made_by_an_older_version(clips.anna, run(clips.anna))
    reopened(tmp_path / "old.blend")
    anna, settings = bpy.data.objects["Face"], bpy.context.scene.facewright_clip
    assert bpy.ops.facewright.expression(name="happiness") == {"FINISHED"}, "it works as it is"
    assert bpy.ops.facewright.expression(name="neutral") == {"FINISHED"}
    assert settings.head == "Face", "the clip of the file has made it"
    grown()
    bpy.ops.facewright.reconstruct()
    assert bpy.context.object == anna
    assert_is(anna, OLDER_ANNA)
    assert len(bpy.data.images) == 2, "its pictures are painted over"
    assert set(collection_of(anna).objects) == set(head_of(anna).objects), "it has a collection now"
    ben = run(clips.ben)
    assert_is(ben, BEN)
    assert_is(anna, OLDER_ANNA)


def test_another_person_does_not_repaint_a_head_of_an_older_version(clips: Clips, tmp_path: Path) -> None:
    made_by_an_older_version(clips.anna, run(clips.anna))
    reopened(tmp_path / "old.blend")
    anna = bpy.data.objects["Face"]
    ben = run(clips.ben)
    assert ben != anna
    assert_is(anna, ANNA)
    assert_is(ben, BEN)


def test_heads_of_older_versions_in_two_scenes_come_apart(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    made_by_an_older_version(clips.anna, anna)
    bpy.ops.scene.new(type="FULL_COPY")
    (copy,) = (head.skin for head in heads())
    grown()
    assert run(clips.anna) == copy
    assert_is(copy, OLDER_ANNA)
    bpy.context.window.scene = bpy.data.scenes["Scene"]
    assert reds(anna) == {ANNA.red}, "they had shared their pictures"


def test_a_picture_within_a_node_group_comes_apart_too(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    tree = anna.data.materials[0].node_tree
    group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    group.nodes.new("ShaderNodeTexImage").image = tree.nodes["Image Texture"].image
    tree.nodes.remove(tree.nodes["Image Texture"])
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    copy = duplicated(*head_of(anna).objects)["skin"]
    grown()
    run(clips.anna, head=copy.name)
    shown = [next(n for n in s.data.materials[0].node_tree.nodes if n.type == "GROUP") for s in (anna, copy)]
    assert [red(node.node_tree.nodes[0].image) for node in shown] == [ANNA.red, OLDER_ANNA.red]


def test_a_painting_that_a_copy_shows_too_comes_apart(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    painted = anna["facewright_picture"]
    blacken(painted)
    copy = duplicated(*head_of(anna).objects)["skin"]
    grown()
    run(clips.anna, head=copy.name)
    assert reds(copy) == {0, OLDER_ANNA.red}, "the painting stays shown"
    assert reds(anna) == {0, ANNA.red}
    (shown,) = images(copy)
    assert images(anna) == [painted] and shown != painted, "each has its own to paint on"
    assert module("scene.head").kept(copy)[0].startswith(f"the painting on {shown.name} ")
    run(clips.anna, head=copy.name)
    assert len(bpy.data.images) == 5, "two paintings, what was made for one of them, the eyes of both"


def test_linked_duplicates_remember_the_same_new_picture(clips: Clips, grown: Callable[[], None]) -> None:
    anna = run(clips.anna)
    linked = duplicated(*head_of(anna).objects, linked=True)["skin"]
    duplicated(*head_of(anna).objects)
    grown()
    run(clips.anna, head=anna.name)
    assert images(linked) == [linked["facewright_picture"]] == [anna["facewright_picture"]]
    run(clips.anna, head=linked.name)
    assert reds(anna) == reds(linked) == {OLDER_ANNA.red}


def test_a_head_of_which_nothing_is_left_is_none_though_another_is_in_its_collection(
    clips: Clips, grown: Callable[[], None]
) -> None:
    anna = run(clips.anna)
    copy = duplicated(anna)["skin"]
    run(clips.anna, head=anna.name)
    for obj in head_of(anna).objects:
        bpy.data.objects.remove(obj)
    assert [head.skin for head in heads()] == [copy]
    labels = [label for _, label, _ in module("reconstruct.actions").choices(bpy.context.scene)]
    assert labels == ["New Head", f"Update {copy.name}"]


def images(skin: bpy.types.Object) -> list[bpy.types.Image]:
    return module("scene.materials").images(skin.data.materials[0].node_tree)


def blacken(picture: bpy.types.Image) -> None:
    """Paint all of it, as with a brush."""
    pixels = np.zeros((picture.size[1], picture.size[0], 4), np.float32)
    pixels[..., 3] = 1.0
    picture.pixels.foreach_set(pixels.ravel())
    picture.update()
    picture.pack()
