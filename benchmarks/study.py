"""Runs the whole benchmark, in one of two sizes."""

from collections.abc import Callable
from dataclasses import asdict, dataclass

from benchmarks.ensemble import measure_ensemble
from benchmarks.free_vanes import measure_free_vanes
from benchmarks.report import BenchReport, describe_machine
from benchmarks.single_run import measure_single_run
from benchmarks.start_up import measure_start_up


@dataclass(frozen=True, slots=True)
class BenchSize:
    """How much is run: durations in seconds of simulated time."""

    name: str
    single_duration: float
    single_repetitions: int
    runs: int
    runs_duration: float
    runs_repetitions: int
    free_vanes: int
    first_starts: int
    later_starts: int


FULL = BenchSize("full", 5.0, 9, 4096, 3.0, 12, 1024, 2, 7)
QUICK = BenchSize("quick", 1.0, 5, 1024, 1.0, 5, 128, 1, 3)


def measure_speed(size: BenchSize, say: Callable[[str], None]) -> BenchReport:
    """The report; ``say`` gets a line whenever something new is being measured."""
    lines = [
        *measure_single_run(size.single_duration, size.single_repetitions, say),
        *measure_ensemble(size.runs, size.runs_duration, size.runs_repetitions, say),
        *measure_free_vanes(size.free_vanes, size.runs_repetitions, say),
        *measure_start_up(size.first_starts, size.later_starts, say),
    ]
    return BenchReport(describe_machine(), asdict(size), tuple(lines))
