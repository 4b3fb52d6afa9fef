"""What the hour's test expects of poses, of a history, and of a head in another file."""

from session import State, expect
from steps import difference

# When the face does what.
POSES = {1: "neutral", 20: "happiness", 40: "surprise"}
# Blender keeps a key's value in single precision.
SAME = 1e-5
SAME_METRES = 1e-6
# Blender's own pictures, which come and go.
PASSING = {"image Render Result", "image Viewer Node"}
# What a head takes with it into another file.
KINDS = ("object Face", "image Face", "action ", "worn by Face")


def expect_pose(state: State, head: str, name: str) -> None:
    """A head shows an expression as strongly as it is defined, with every key that it has."""
    pose, found = state["poses"][head].get(name, {}), state["values"][head]
    wrong = [key for key, value in found.items() if abs(value - pose.get(key, 0.0)) > SAME]
    expect(not wrong, f"{name} is not shown: {', '.join(wrong)}")


def expect_right_at(frame: int, state: State, poses: list[dict[str, float]]) -> None:
    """The first head shows its pose at a key frame, and between two each of its keys is between its two values.

    The second head, which has no keyframes, rests.
    """
    frames = list(POSES)
    before = max((i for i, f in enumerate(frames) if f <= frame))
    after = min(before + (frame > frames[before]), len(frames) - 1)
    wrong = [
        key
        for key, value in state["values"]["Face"].items()
        if not is_between(value, poses[before][key], poses[after][key], frame in frames)
    ]
    expect(not wrong, f"at frame {frame} these keys are not what they should be: {', '.join(wrong)}")
    moved = [head for head, values in state["values"].items() if head != "Face" and any(values.values())]
    expect(not moved, f"at frame {frame} {', '.join(moved)} moves with the first head")


def is_between(value: float, one: float, other: float, is_end: bool) -> bool:
    """Whether a key is on its way from a value to another, or there; halted only where these are the same."""
    least, most = min(one, other), max(one, other)
    if is_end or most - least < SAME:
        return least - SAME <= value <= most + SAME
    return least < value < most


def expect_same_data(wanted: State, found: State, how: str) -> None:
    """All that there is in a file is what it was."""
    old, new = ({"data": things(state)} for state in (wanted, found))
    expect(old == new, f"{how}, it is not what it was: {difference(old, new)}")


def things(state: State) -> dict[str, str]:
    """What there is in a file, and what it is like. Not how many: nothing unused is saved."""
    told = state["data"] | state["worn"]
    return {name: like for name, like in told.items() if isinstance(like, str) and name not in PASSING}


def expect_appended(saved: State, found: State) -> None:
    """A head that was appended to a new file has all that it had."""
    old = {name: told for name, told in (saved["data"] | saved["worn"]).items() if of_first_head(name)}
    new = found["data"] | found["worn"]
    expect(len(old) > 15, f"only {len(old)} things are of the first head")
    missing = [f"{name} {told} → {new.get(name)}" for name, told in old.items() if new.get(name) != told]
    expect(not missing, f"appended, it is not what it was: {', '.join(missing)}")
    expect(found["poses"]["Face"] == saved["poses"]["Face"], "its expressions are lost")


def of_first_head(name: str) -> bool:
    return name.startswith(KINDS) and ".001" not in name


def expect_still(truth: dict[str, list[float]], found: dict[str, list[float]]) -> None:
    """Each part of a head is where it was."""
    places = {name_in_file(name): box for name, box in found.items()}
    expect(places.keys() == truth.keys(), f"the parts are {', '.join(places)}")
    apart = {name: max(abs(a - b) for a, b in zip(box, places[name])) for name, box in truth.items()}
    worst = max(apart, key=lambda name: apart[name])
    expect(apart[worst] < SAME_METRES, f"{worst} is {1e3 * apart[worst]:.3f} mm away from where it was")


def name_in_file(name: str) -> str:
    """What an exported part of the head Face is called: Face → Face_skin, Face eye_left → Face_eye_left."""
    return f"{name.replace(' ', '_')}" if " " in name else f"{name}_skin"
