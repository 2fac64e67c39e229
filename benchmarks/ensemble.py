"""Thousands of different runs: the lanes on one thread and on all cores, with and without metrics."""

import json
from collections.abc import Callable, Mapping

from benchmarks.ensemble_worker import Order
from benchmarks.report import Line, Target, has_avx512, usable_cores
from benchmarks.timing import Timing, run_python
from ppafo.errors import SimulationError

GROUP = "Thousands of different runs"
WORKER = ("-m", "benchmarks.ensemble_worker")
ONE_THREAD_TARGET = Target(80_000.0, at_least=True)
TWO_CORES_TARGET = Target(1.8, at_least=True)
METRICS_TARGET = Target(0.8, at_least=True)


def measure_ensemble(runs: int, duration: float, repetitions: int, say: Callable[[str], None]) -> list[Line]:
    """Lines about ``runs`` different runs of ``duration`` [s]."""
    cores = usable_cores()
    one = _ask(runs, duration, repetitions, cores[-1:], (1,), say)
    lines = [_speed_line("ensemble_one_thread", "one thread", runs * duration, one["lanes 1"], _one_thread())]
    lines += [_metrics_line("ensemble_metrics_one_thread", "one thread", one, 1)]
    if len(cores) == 1:
        return [*lines, _alone("ensemble_two_cores")]
    threads = tuple(sorted({1, 2, len(cores)}))
    every = _ask(runs, duration, repetitions, cores, threads, say)
    most = f"lanes {len(cores)}"
    return [
        *lines,
        _speed_line("ensemble_all_cores", f"{len(cores)} threads", runs * duration, every[most], None),
        _metrics_line("ensemble_metrics_two_threads", "two threads", every, 2),
        _scaling_line(every),
    ]


def _ask(
    runs: int,
    duration: float,
    repetitions: int,
    cores: tuple[int, ...],
    threads: tuple[int, ...],
    say: Callable[[str], None],
) -> dict[str, Timing]:
    """Let a worker time everything on ``cores``: durations by name."""
    say(f"{runs} runs of {duration:g} s on {len(cores)} core{'s' if len(cores) > 1 else ''}")
    outcome = run_python([*WORKER, Order(runs, duration, repetitions, cores, threads).text()], {})
    if outcome.code != 0:
        raise SimulationError(f"the benchmark's worker failed: {outcome.complaint}")
    return {name: Timing(tuple(seconds)) for name, seconds in json.loads(outcome.output).items()}


def _one_thread() -> Target | None:
    return ONE_THREAD_TARGET if has_avx512() else None


def _speed_line(line_id: str, where: str, simulated: float, timing: Timing, target: Target | None) -> Line:
    spread = (simulated / timing.worst, simulated / timing.best)
    return Line(line_id, GROUP, f"ppafo, {where}", simulated / timing.best, "x real time", target, spread)


def _metrics_line(line_id: str, where: str, timings: Mapping[str, Timing], threads: int) -> Line:
    """Speed with metrics worked out in the lanes, over the speed of the lanes alone."""
    bare, metered = timings[f"lanes {threads}"], timings[f"lanes with metrics {threads}"]
    spread = (bare.best / metered.worst, bare.worst / metered.best)
    note = "every metric of tracking, gas and switching, none of them from a record"
    what = f"speed with metrics over speed without, {where}"
    return Line(line_id, GROUP, what, bare.best / metered.best, "times", METRICS_TARGET, spread, note)


def _scaling_line(timings: Mapping[str, Timing]) -> Line:
    one, two = timings["lanes 1"], timings["lanes 2"]
    spread = (one.best / two.worst, one.worst / two.best)
    what = "two threads over one"
    return Line("ensemble_two_cores", GROUP, what, one.best / two.best, "times", TWO_CORES_TARGET, spread)


def _alone(line_id: str) -> Line:
    return Line(line_id, GROUP, "two threads over one", None, "", TWO_CORES_TARGET, note="not measured: one core")
