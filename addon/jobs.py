"""Running a native job: polled by a modal operator in a window, waited for in the background.

`Work` is a generator that yields its `Progress` while it is busy and returns its result. The same generator serves both
ways, so that a click and a script cannot differ. Closing it cancels what runs.
"""

import time
from collections.abc import Generator
from typing import Any, TypeVar

from .engine import Job, Progress

T = TypeVar("T")
Work = Generator[Progress, None, T]

POLL_SECONDS = 0.05


def watch(job: Job[Any]) -> Work[Any]:
    """Follow a native job to its result; closing the generator cancels the job and waits until it has stopped."""
    seen = 0
    try:
        while not job.finished():
            seen, sketch = job.sketch(seen) or (seen, None)
            yield Progress(*job.progress(), job.step(), sketch)
        return job.result()
    except GeneratorExit:
        job.cancel()
        while not job.finished():
            time.sleep(POLL_SECONDS / 5)
        raise


def wait(work: Work[T]) -> T:
    """Run work to its end, for scripts and `blender -b`."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
        time.sleep(POLL_SECONDS / 5)
