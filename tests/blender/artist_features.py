"""What an artist does at random with the list of heads, controls, the clip's frames and the report."""

import json
from types import SimpleNamespace
from typing import Any

import bpy
import consistent
import numpy as np
from artist import Artist, action, press, unused
from consistent_controls import values
from people import select
from tracking import Finished, module

FIND, LAYOUT = (module(f"scene.controls_{name}") for name in ("find", "layout"))
TITLES = ("Face", "Anna", "Thing", "  ")


def _choose(artist: Artist) -> Any:
    """Click a row of the list; gives the head that the buttons act on, None without one that may be changed."""
    scene, heads = bpy.context.scene, module("heads.actions")
    if rows := heads.listed(scene).rows:
        obj = artist.chance.choice(rows).obj
        scene.facewright_heads.index = list(scene.objects).index(obj)
    row = heads.current(scene, bpy.context.object)
    return row.head if row is not None and not row.complaint else None


@action(3)
def choose_in_list(artist: Artist) -> None:
    """Click a row of the list, or the plus."""
    if artist.chance.random() < 0.2:
        press(bpy.ops.facewright.choose_head)
    else:
        _choose(artist)


@action(4)
def duplicate_in_list(artist: Artist) -> None:
    """The copy is whole and shares nothing."""
    head = _choose(artist)
    if press(bpy.ops.facewright.duplicate_head):
        key = bpy.context.scene.facewright_clip.wanted
        copies = [copy for copy in module("scene.heads").heads(bpy.context.scene) if copy.key == key]
        assert len(copies) == 1, f"{len(copies)} heads have the copy's key"
        assert copies[0].parts.keys() == head.parts.keys(), f"{copies[0].parts.keys()} of {head.parts.keys()}"
        assert not (sharing := consistent.shared(copies[0].skin)), f"the copy shares {sharing}"
        held = head.home.all_objects.values() if head.home is not None else []
        if FIND.of(head.skin) is not None and FIND.of(head.skin) in held:
            made = FIND.of(copies[0].skin)
            assert made is not None and made != FIND.of(head.skin), "the copy has no controls of its own"
            assert FIND.led(copies[0].skin) == FIND.led(head.skin), "the copy's controls lead other keys"


@action(2)
def remove_in_list(artist: Artist) -> None:
    """Nothing is left over."""
    _choose(artist)
    before = unused()
    press(bpy.ops.facewright.remove_head)
    assert unused() <= before, f"left over: {sorted(unused() - before)}"


@action(2)
def rename_in_list(artist: Artist) -> None:
    head = _choose(artist)
    if head is not None and bpy.context.mode == "OBJECT":
        head.skin.facewright_title = artist.chance.choice(TITLES)


@action(1)
def mark_in_list(artist: Artist) -> None:
    _choose(artist)
    press(bpy.ops.facewright.mark_head, clear=artist.chance.random() < 0.3)


@action(8)
def add_controls(artist: Artist) -> None:
    """Every key keeps its value, and is led where nothing of the artist's sets it."""
    skin = _worked_on()
    before = values(skin) if skin is not None else {}
    if not press(bpy.ops.facewright.add_controls):
        return
    assert skin is not None and FIND.of(skin) is not None, "there are no controls"
    _same(_unkeyed(skin, before), values(skin), "adding controls")
    if artist.chance.random() < 0.6 and bpy.context.mode == "POSE":
        press(bpy.ops.facewright.pose_controls)


@action(6)
def remove_controls(artist: Artist) -> None:
    """Every key keeps its value; nothing of ours is left."""
    if artist.chance.random() < 0.7:
        _controls(artist)
    skin = _worked_on()
    before, loose = _unkeyed(skin, values(skin)) if skin is not None else {}, unused()
    if not press(bpy.ops.facewright.remove_controls):
        return
    assert skin is not None
    _same(before, values(skin), "removing controls")
    assert not FIND.our_drivers(skin), f"drivers are left of {sorted(FIND.our_drivers(skin))}"
    assert FIND.CONTROLS not in skin, "the skin still points to controls"
    assert unused() <= loose, f"left over: {sorted(unused() - loose)}"


@action(2)
def pose_controls(_artist: Artist) -> None:
    press(bpy.ops.facewright.pose_controls)


@action(6)
def drag_handles(artist: Artist) -> None:
    """Some handles and joints, beyond their ends too."""
    if (made := _controls(artist)) is None:
        return
    bones = FIND.bones(made)
    for _ in range(3):
        role = artist.chance.choice([*bones])
        moved = bones[role].rotation_euler if role in ("neck", "head", "jaw_master") else bones[role].location
        moved[artist.chance.randrange(3)] = artist.chance.uniform(-0.5, 0.5) * (1.0 if "head" in role else 0.05)
    made.update_tag()


@action(3)
def let_gaze_follow(artist: Artist) -> None:
    """Gaze Follows Target, with the target anywhere, behind the head too."""
    made = _controls(artist)
    if made is not None and (eyes := FIND.bones(made).get("eyes")) is not None:
        eyes[FIND.FOLLOW] = artist.chance.choice((0.0, 0.5, 1.0))
        eyes.location = [artist.chance.uniform(-0.6, 0.6) for _ in range(3)]
        made.update_tag()


@action(4)
def key_handles(artist: Artist) -> None:
    """Keyframes as with I in Pose Mode."""
    if (made := _controls(artist)) is None:
        return
    bpy.context.scene.frame_set(artist.chance.randrange(1, 30))
    posed = FIND.bones(made)
    for role in artist.chance.sample([*posed], min(3, len(posed))):
        axis = next((link.axis for link in LAYOUT.LINKS.values() if link.axis.role == role), None)
        posed[role].keyframe_insert(axis.channel if axis is not None else "location")


@action(1)
def spoil_controls(artist: Artist) -> None:
    """The artist's own way with an armature: another name, a bone gone, or the whole of it with X."""
    made = _controls(artist)
    if made is None or bpy.context.mode != "OBJECT":
        return
    bones = FIND.bones(made)
    way = artist.chance.choice(("rename bone", "delete bone", "delete", "delete data"))
    if way == "rename bone" and bones:
        artist.chance.choice([*bones.values()]).name = artist.chance.choice(("jaw", "head", "Bone"))
    elif way == "delete bone" and (handles := [role for role in bones if "." in role and "MCH" not in role]):
        name = bones[artist.chance.choice(handles)].name
        with module("scene.controls_bones").edited(made) as edited:
            edited.remove(edited[name])
    elif way == "delete":
        bpy.data.objects.remove(made)
    elif way == "delete data":
        bpy.data.armatures.remove(made.data)


@action(3)
def look_at_clip(artist: Artist) -> None:
    """Look at the clip; the library finds faces in most frames."""
    chance = artist.chance

    def survey(frames: list[str], **_settings: Any) -> Finished:
        return Finished(_surveyed(len(frames), chance.randrange(3)))

    with artist.monkeypatch.context() as changed:
        changed.setattr(module("clip.actions"), "survey", survey)
        press(bpy.ops.facewright.survey, part=chance.random() < 0.3)


@action(5)
def choose_frames(artist: Artist) -> None:
    """Click on frames, whether they are shown or not, type ends, take them from the timeline, or use all again."""
    settings, chance = bpy.context.scene.facewright_clip, artist.chance
    for _ in range(2):
        way = chance.choice(("click", "click", "click", "type", "timeline", "all"))
        if way == "click":
            settings.click = chance.choice(("FIRST", "LAST", "OUT"))
            press(bpy.ops.facewright.pick_frame, number=chance.randrange(9))
        elif way == "type":
            setattr(settings, chance.choice(("shown_first", "shown_last")), chance.randrange(12))
        elif way == "timeline":
            press(bpy.ops.facewright.frames_from_timeline, which=chance.choice(("FIRST", "LAST", "RANGE")))
        else:
            press(bpy.ops.facewright.use_all_frames)


@action(3)
def open_report(_artist: Artist) -> None:
    """One text for each head, and it says something."""
    if press(bpy.ops.facewright.open_report):
        owners = [text["facewright_report_of"] for text in bpy.data.texts if "facewright_report_of" in text]
        assert len(owners) == len(set(owners)), "a head has two reports"
        key = module("scene.heads").key_of(_worked_on())
        (text,) = [text for text in bpy.data.texts if text.get("facewright_report_of") == key and not text.library]
        said = json.loads(_worked_on()["facewright_report"])["warnings"]
        # Lines that are too long are broken.
        missing = [one for one in said if one.lower() not in " ".join(text.as_string().lower().split())]
        assert not missing, f"the report does not say {missing}"


def _worked_on() -> Any:
    """The skin that the buttons act on; None without."""
    scene = bpy.context.scene
    shown = module("scene.heads").current(scene, bpy.context.object, scene.facewright_clip.wanted)
    return shown[0].skin if shown is not None else None


def _controls(artist: Artist) -> Any:
    """The armature of any head that may be changed; None without."""
    heads = [head for head in module("scene.heads").heads(bpy.context.scene) if head.skin is not None]
    found = [FIND.of(head.skin) for head in heads if head.is_local]
    found = [made for made in found if made is not None and made.library is None and made.mode != "EDIT"]
    made = artist.chance.choice(found) if found else None
    if made is not None and bpy.context.mode == "OBJECT" and made in bpy.context.view_layer.objects.values():
        select(made)
    return made


def _same(before: dict[str, float], after: dict[str, float], by: str) -> None:
    changed = {n: (before[n], after.get(n, np.nan)) for n in before if not abs(before[n] - after.get(n, np.nan)) < 1e-4}
    assert not changed, f"{by} changed {changed}"


def _unkeyed(skin: bpy.types.Object, found: dict[str, float]) -> dict[str, float]:
    """Values but of keys that keyframes move: a handle that was dragged since goes back to those at any moment."""
    blocks, posed = skin.data.shape_keys.key_blocks if skin.data.shape_keys else {}, module("scene.controls_pose")
    channels = {name: posed.channels(skin, [name]).get(name, []) for name in found}
    moved = {name for name, some in channels.items() if any(channel.curve is not None for channel in some)}
    moved |= {name for name in found if name in blocks and module("scene.keys").key_channel(blocks[name]).curve}
    return {name: value for name, value in found.items() if name not in moved}


def _surveyed(count: int, unusable: int) -> Any:
    """What the library finds in so many frames; some cannot be used."""
    picture = np.full((72, 96, 3), 127, np.uint8)
    shown = {"reason": "a face", "rectangle": None, "turn_deg": (0, 0), "thumbnail": picture}
    looks = [SimpleNamespace(number=number, usable=number != unusable, **shown) for number in range(count)]
    said = SimpleNamespace(summary=[f"{count} frames"], findings=[("turn", "the head does not turn")])
    return SimpleNamespace(looks=looks, size=(96, 72), part=lambda _wanted: said, **vars(said))
