"""What all peers share: times and results. What `src/clock.rs` and `src/results.rs` are in Rust."""

import json
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

ENOUGH_S = 0.4
ROUNDS = (3, 200)

T = TypeVar("T")


@dataclass
class Run:
    """One task on one case; `setting` tells how the peer was set."""

    case: str
    task: str
    setting: str
    times_ms: dict[str, float]
    answer: Any


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Median processor time of `work`, milliseconds, and what its first round gave.

    The first round is not counted, unless it alone took long enough: then what is cold at its start does not matter,
    and it is the only one. The answer does not depend on how many rounds there were.
    """
    first, answer = one_round(work)
    if first >= ENOUGH_S:
        return 1e3 * first, answer
    started, rounds = time.process_time(), []
    while len(rounds) < ROUNDS[0] or (len(rounds) < ROUNDS[1] and time.process_time() - started < ENOUGH_S):
        rounds.append(one_round(work)[0])
    return 1e3 * statistics.median(rounds), answer


def median_ms(work: Callable[[], Any]) -> float:
    """Median processor time of `work`, milliseconds, where what it gives is of no interest."""
    return timed(work)[0]


def one_round(work: Callable[[], T]) -> tuple[float, T]:
    """Processor time of `work`, seconds, and what it gave."""
    before = time.process_time()
    answer = work()
    return time.process_time() - before, answer


def write_runs(program: str, measure: Callable[[dict[str, Any], Path], list[Run]]) -> None:
    """`WORD.py FOLDER RESULT`: measures every case of `inputs.json`."""
    folder, result = map(Path, sys.argv[1:])
    cases = json.loads((folder / "inputs.json").read_text())
    runs = [asdict(run) for case in cases for run in measure(case, folder)]
    result.write_text(json.dumps({"program": program, "runs": runs}))
