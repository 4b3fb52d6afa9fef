"""What all peers share: times and results. What `src/clock.rs` and `src/results.rs` are in Rust."""

import json
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

ENOUGH_S = 0.4
ROUNDS = (3, 200)


@dataclass
class Run:
    """One task on one case; `setting` tells how the peer was set."""

    case: str
    task: str
    setting: str
    times_ms: dict[str, float]
    answer: Any


def median_ms(work: Callable[[], Any]) -> float:
    """Median processor time of `work`, milliseconds, after one round that is not counted."""
    work()
    started, rounds = time.process_time(), []
    while len(rounds) < ROUNDS[0] or (len(rounds) < ROUNDS[1] and time.process_time() - started < ENOUGH_S):
        before = time.process_time()
        work()
        rounds.append(1e3 * (time.process_time() - before))
    return statistics.median(rounds)


def write_runs(program: str, measure: Callable[[dict[str, Any], Path], list[Run]]) -> None:
    """`WORD.py FOLDER RESULT`: measures every case of `inputs.json`."""
    folder, result = map(Path, sys.argv[1:])
    cases = json.loads((folder / "inputs.json").read_text())
    runs = [asdict(run) for case in cases for run in measure(case, folder)]
    result.write_text(json.dumps({"program": program, "runs": runs}))
