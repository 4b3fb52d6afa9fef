"""A report.json: what the library reads of it, remembered for panels, and in sentences."""

from collections.abc import Callable
from functools import lru_cache

from facewright import Quality, Report

# Why frames were not needed, by the library's words for it; for any other reason there was something wrong with them.
NOT_NEEDED = {
    "between frames that were looked at": "between those that were looked at",
    "looks like a better frame that is used": "like a better one",
    "enough frames from this side": "from a side with enough others",
}

# Puts what is given into the braces of a text, in a language.
Say = Callable[..., str]


@lru_cache(maxsize=4)
def parse(text: str) -> Report:
    """Read a report.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    return Report.parse(text)


def summary(report: Report, say: Say = str.format) -> list[str]:
    """A report in a few sentences, in English unless told otherwise; none where nothing was measured."""
    if not report.frames:
        return []
    used, seen = sum(frame.used for frame in report.frames), 100 * report.texture.seen
    points = say("1 point") if report.points == 1 else say("{count} points", count=report.points)
    said = [say("Made from {frames}, {points}", frames=_frames_of(used, say), points=points), *_rest(report, say)]
    if report.points:
        off = f"{report.fit.points_median_mm:.2f}"
        said.append(say("Points lie {distance} mm off (median)", distance=off))
    skin = "Skin: {percent} % seen, rest filled in" if seen < 99.5 else "Skin: {percent} % seen"
    return [*said, say(skin, percent=f"{seen:.0f}")]


def _rest(report: Report, say: Say) -> list[str]:
    """Of the other frames, how many were not needed, and with how many something was wrong."""
    spare = [(count, NOT_NEEDED[why]) for count, why in report.left_out if why in NOT_NEEDED]
    wrong = [(count, why) for count, why in report.left_out if why not in NOT_NEEDED]
    said = []
    if spare:
        spare = [(count, say(why)) for count, why in spare]
        frames = _frames_of(sum(count for count, _ in spare), say)
        said.append(say("{frames} not needed: {why}", frames=frames, why=_listed(spare)))
    if wrong:
        frames = _frames_of(sum(count for count, _ in wrong), say)
        said.append(say("{frames} left out: {why}", frames=frames, why=_listed(wrong)))
    return said


def _listed(counts: list[tuple[int, str]]) -> str:
    """The most frequent first; a reason alone has been counted before."""
    if len(counts) == 1:
        return counts[0][1]
    return ", ".join(f"{count} {why}" for count, why in sorted(counts, key=lambda pair: -pair[0]))


def _frames_of(count: int, say: Say) -> str:
    """`1 frame`, `36 frames`."""
    return say("1 frame") if count == 1 else say("{count} frames", count=count)


def document(text: str, name: str) -> str:
    """All that a report says of a head of some name, to be read from top to bottom."""
    report = parse(text)
    parts = [[f"Report of {name}", f"Facewright {report.version}, method {report.method}"], summary(report)]
    if report.quality is not None:
        parts.append(_measures(report.quality))
    parts.append([f"! {warning[:1].upper()}{warning[1:]}" for warning in report.warnings])
    parts.append(_frames(report))
    parts.append([f"{stage}: {seconds:.1f} s" for stage, seconds in report.timings_s.items()])
    return "\n\n".join("\n".join(part) for part in parts if part) + "\n"


def _measures(quality: Quality) -> list[str]:
    unusual = {measure.name for measure in quality.unusual}
    return [f"{'!' if one.name in unusual else ' '} {one.sentence}" for one in quality.measures]


def _frames(report: Report) -> list[str]:
    """A line for each frame: whether it was used, and why."""
    width = max((len(frame.name) for frame in report.frames), default=0)
    return [f"{f.name:<{width}}  {'used' if f.used else '–':<4}  {f.reason}" for f in report.frames]
