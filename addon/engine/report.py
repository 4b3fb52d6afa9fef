"""A report.json: what the library reads of it, remembered for panels."""

from functools import lru_cache

from facewright import Report


@lru_cache(maxsize=4)
def parse(text: str) -> Report:
    """Read a report.json; raises FacewrightError with what is wrong. Cheap when asked again, so that panels may."""
    return Report.parse(text)
