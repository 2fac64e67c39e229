"""Thousands of different runs: the lanes on one thread and on all cores, against JAX on the same cores."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

from benchmarks.ensemble_worker import Order
from benchmarks.jax_program import Variant
from benchmarks.report import MISSING_EXTRA, Line, Target, has_avx512, usable_cores
from benchmarks.timing import Timing, run_python
from ppafo.errors import SimulationError

GROUP = "Thousands of different runs"
WORKER = ("-m", "benchmarks.ensemble_worker")
ONE_THREAD_TARGET = Target(80_000.0, at_least=True)
JAX_TARGET = Target(3.0, at_least=True)
TWO_CORES_TARGET = Target(1.8, at_least=True)
METRICS_TARGET = Target(0.8, at_least=True)
AGREEMENT_TARGET = Target(1e-9, at_least=False)

DEFAULT_FLAGS = "default flags"
FLAGS: dict[str, str] = {
    DEFAULT_FLAGS: "",
    "wide vectors, fast math": "--xla_cpu_prefer_vector_width=512 --xla_cpu_enable_fast_math=true",
}
"""Flags of XLA; with the first it is as strict as the lanes, the second set gives up the bits for speed."""

LAYOUTS = ((0, 1), (128, 1), (256, 1), (256, 2), (512, 1))
"""Runs in a block and unrolled steps of the variants of JAX."""


@dataclass(slots=True)
class Findings:
    """Durations of one set of cores by name, which XLA flags and variant each was, and the worst disagreement."""

    timings: dict[str, Timing] = field(default_factory=dict)
    difference: float | None = None
    complaint: str = ""

    def add(self, answer: dict[str, Any], flags: str) -> None:
        """Take in what a worker found."""
        for name, seconds in answer["seconds"].items():
            label = name if name.startswith("lanes") else f"{name}, {flags}"
            timing = Timing(tuple(seconds))
            self.timings[label] = timing.joined(self.timings[label]) if label in self.timings else timing
        if answer["difference"] is not None:
            self.difference = max(self.difference or 0.0, answer["difference"])

    def best_jax(self, flags: str = "") -> tuple[str, Timing] | None:
        """Name and durations of the quickest variant of JAX, with these flags only where some are named."""
        named = [(name, timing) for name, timing in self.timings.items() if not name.startswith("lanes")]
        found = [pair for pair in named if pair[0].endswith(flags)]
        return min(found, key=lambda pair: pair[1].best) if found else None


def measure_ensemble(runs: int, duration: float, repetitions: int, say: Callable[[str], None]) -> list[Line]:
    """Lines about ``runs`` different runs of ``duration`` [s]."""
    cores = usable_cores()
    one = _ask(runs, duration, repetitions, cores[-1:], (1,), say)
    lines = [_speed_line("ensemble_one_thread", "one thread", runs * duration, one.timings["lanes 1"], _one_thread())]
    lines += [_metrics_line("ensemble_metrics_one_thread", "one thread", one, 1)]
    lines += [_jax_line("ensemble_jax_one_core", "JAX on one core", one, "lanes 1")]
    if len(cores) == 1:
        return [*lines, _alone("ensemble_two_cores"), _agreement(one)]
    threads = tuple(sorted({1, 2, len(cores)}))
    every = _ask(runs, duration, repetitions, cores, threads, say)
    most = f"lanes {len(cores)}"
    lines += [
        _speed_line("ensemble_all_cores", f"{len(cores)} threads", runs * duration, every.timings[most], None),
        _metrics_line("ensemble_metrics_two_threads", "two threads", every, 2),
        _scaling_line(every),
        _jax_line("ensemble_jax_all_cores", f"JAX on {len(cores)} cores", every, most),
    ]
    return [*lines, _agreement(one, every)]


def _ask(
    runs: int,
    duration: float,
    repetitions: int,
    cores: tuple[int, ...],
    threads: tuple[int, ...],
    say: Callable[[str], None],
) -> Findings:
    """Let one worker for each set of XLA flags time everything on ``cores``; without JAX one worker is enough."""
    findings = Findings()
    with_jax = find_spec("jax") is not None
    for label, flags in FLAGS.items() if with_jax else [("", "")]:
        place = f"{len(cores)} core{'s' if len(cores) > 1 else ''}"
        say(f"{runs} runs of {duration:g} s on {place}: lanes" + (f" and JAX ({label})" if with_jax else ""))
        order = Order(runs, duration, repetitions, cores, threads, _variants(runs, len(cores)) if with_jax else ())
        outcome = run_python([*WORKER, order.text()], _environment(flags, len(cores)))
        if outcome.code == 0:
            findings.add(json.loads(outcome.output), label)
        else:
            findings.complaint = outcome.complaint
    if not findings.timings:
        raise SimulationError(f"the benchmark's worker failed: {findings.complaint}")
    return findings


def _environment(flags: str, cores: int) -> dict[str, str]:
    """XLA on the processor, with one device for each core so that runs can be spread over them."""
    devices = f"--xla_force_host_platform_device_count={cores}"
    eigen = "--xla_cpu_multi_thread_eigen=false" if cores == 1 else ""
    return {"XLA_FLAGS": " ".join(part for part in (flags, devices, eigen) if part), "JAX_PLATFORMS": "cpu"}


def _variants(runs: int, cores: int) -> tuple[Variant, ...]:
    """Variants of JAX whose blocks divide the runs; on several cores also all runs on one device with XLA's threads."""
    spread = [Variant(block, unroll, cores) for block, unroll in LAYOUTS if block == 0 or runs % (block * cores) == 0]
    whole = [Variant(0, 1, 1)] if cores > 1 else []
    return tuple(variant for variant in [*spread, *whole] if runs % variant.devices == 0)


def _one_thread() -> Target | None:
    return ONE_THREAD_TARGET if has_avx512() else None


def _speed_line(line_id: str, where: str, simulated: float, timing: Timing, target: Target | None) -> Line:
    spread = (simulated / timing.worst, simulated / timing.best)
    return Line(line_id, GROUP, f"ppafo, {where}", simulated / timing.best, "x real time", target, spread)


def _metrics_line(line_id: str, where: str, findings: Findings, threads: int) -> Line:
    """Speed with metrics worked out in the lanes, over the speed of the lanes alone."""
    bare, metered = findings.timings[f"lanes {threads}"], findings.timings[f"lanes with metrics {threads}"]
    spread = (bare.best / metered.worst, bare.worst / metered.best)
    note = "every metric of tracking, gas and switching, none of them from a record"
    what = f"speed with metrics over speed without, {where}"
    return Line(line_id, GROUP, what, bare.best / metered.best, "times", METRICS_TARGET, spread, note)


def _scaling_line(findings: Findings) -> Line:
    one, two = findings.timings["lanes 1"], findings.timings["lanes 2"]
    spread = (one.best / two.worst, one.worst / two.best)
    what = "two threads over one"
    return Line("ensemble_two_cores", GROUP, what, one.best / two.best, "times", TWO_CORES_TARGET, spread)


def _jax_line(line_id: str, what: str, findings: Findings, lanes: str) -> Line:
    best = findings.best_jax()
    label = f"times faster than {what}"
    if best is None:
        note = f"not measured: {findings.complaint}" if findings.complaint else MISSING_EXTRA
        return Line(line_id, GROUP, label, None, "", JAX_TARGET, note=note)
    name, timing = best
    ours = findings.timings[lanes]
    spread = (timing.best / ours.worst, timing.worst / ours.best)
    note = f"JAX {timing.best:.3g} s at best, with {name}"
    plain = findings.best_jax(DEFAULT_FLAGS)
    if plain is not None and plain != best:
        note += f"; {plain[1].best:.3g} s with {DEFAULT_FLAGS}"
    return Line(line_id, GROUP, label, timing.best / ours.best, "", JAX_TARGET, spread, note)


def _alone(line_id: str) -> Line:
    return Line(line_id, GROUP, "two threads over one", None, "", TWO_CORES_TARGET, note="not measured: one core")


def _agreement(*findings: Findings) -> Line:
    found: Sequence[float] = [item.difference for item in findings if item.difference is not None]
    what = "largest difference between ppafo and JAX"
    if not found:
        return Line("ensemble_jax_agreement", GROUP, what, None, "", AGREEMENT_TARGET, note=MISSING_EXTRA)
    note = "final masses, totals, error, integral and command of all runs, over the largest of its kind"
    return Line("ensemble_jax_agreement", GROUP, what, max(found), "", AGREEMENT_TARGET, note=note)
