"""Do the runs of this computer have the bits of every other: the runs, their hashes, the answer.

The rows of a run are made by its plan. Those of a draw are theirs times factors from whole numbers alone, so that no
library has a part in them.
"""

import hashlib
import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Answer, Column, Section, Table
from ppafo.engine.lanes import Batch, BatchResult, Clock, load_programs, run_batch
from ppafo.engine.loading import chosen_compiler
from ppafo.engine.run import batch_of
from ppafo.errors import SimulationError, nearest_name, one_line
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.question import Solved
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking import list_walks
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import with_duration
from ppafo.walking.planning import plan_walk

Runner = Callable[[Batch], BatchResult]
VARIED = {
    "noisy-sensors": (
        "torque-task-proportional",
        ("sensors.delay=2.3 ms", "sensors.pressure_noise=0.1 psi_d", "sensors.pressure_resolution=0.05 psi_d"),
    ),
    "thermal-gas-behind-lines": (
        "step-response",
        (
            "gas_model.kind=thermal",
            "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
            "gas_model.wall_area_per_volume=100 1/m",
            "supply_line.plantarflexion.droop=3e6 Pa s/kg",
        ),
    ),
}
"""Scenarios with settings of their own, for what no shipped one has."""
COURSES = {"first-steps": "proportional"}
"""Courses, and the walk that takes each."""
DRAWS = 1000
WALKED = 4.0
"""Seconds of a walk."""
LONGEST_DRAWN = 200
"""Steps of a draw at most."""
LONGEST_STEPS = 40
"""The same of steps as long as the gas of a vane that rests allows: one that fails takes 100,000 parts for each."""
LONGEST_WALKED = 1000
"""The same of a walk: some tenths of its first stride, and more."""
SEED = 15
SPREAD = (0.7, 1.4)
"""Smallest and largest factor on a number of a draw."""
_IMPOSSIBLE = (-1.0, 0.0, 1.0e6, float("nan"))
"""Factors on one number in one draw of ten."""
_TIMING_ROWS, _RESULT_ROWS = 5, 4
"""Rows of the clock and of the outcome: draws leave them as they are."""


def names() -> tuple[str, ...]:
    """Return the names of all runs."""
    return (*list_scenarios(), *VARIED, *list_walks(), *COURSES)


def plain_batch(name: str) -> Batch:
    """Return one run of a scenario, or some seconds of a walk, by its name."""
    if name in VARIED:
        scenario, settings = VARIED[name]
        return batch_of(plan_run(load_scenario(scenario, settings)))
    if name in list_scenarios():
        return batch_of(plan_run(load_scenario(name)))
    walk = load_walk(COURSES[name], course=name) if name in COURSES else load_walk(name)
    return batch_of(plan_walk(with_duration(walk, WALKED)))


def drawn_batch(batch: Batch, runs: int = DRAWS, seed: int = SEED) -> Batch:
    """Return runs like the one of a batch, each with all its numbers times factors of its own; none is recorded."""
    parameters = np.repeat(batch.parameters, runs, axis=1)
    states = np.repeat(batch.states, runs, axis=1)
    # Steps and delays stay: others would be another clock.
    parameters[_TIMING_ROWS:] *= _factors(parameters[_TIMING_ROWS:].shape, seed)
    states[_RESULT_ROWS:] *= _factors(states[_RESULT_ROWS:].shape, seed + 1)
    # In one run of ten a number is what no plan would give: it may fail, and must fail alike.
    for run in range(0, runs, 10):
        word = int(_words(np.array([run], np.uint64), seed + 2)[0])
        rows = len(parameters) - _TIMING_ROWS
        parameters[_TIMING_ROWS + word // 4 % rows, run] *= _IMPOSSIBLE[word % 4]
    longest = LONGEST_WALKED if batch.program.walks else LONGEST_STEPS if batch.program.is_adaptive else LONGEST_DRAWN
    clock: Clock = replace(batch.clock, record_every=0, step_count=min(batch.clock.step_count, longest))
    return Batch(batch.program, clock, parameters, states)


def _factors(shape: tuple[int, ...], seed: int) -> NDArray[np.float64]:
    """Factors in ``SPREAD`` from whole numbers below 2^32, by one product and one sum each."""
    count = int(np.prod(shape))
    low, high = SPREAD
    share = _words(np.arange(count, dtype=np.uint64), seed).astype(np.float64) * 2.0**-32
    return (low + (high - low) * share).reshape(shape)


def _words(numbers: NDArray[np.uint64], seed: int) -> NDArray[np.uint64]:
    """Words of 32 bits that look unrelated to their numbers; xor, shift and a product, thrice."""
    words = numbers * np.uint64(0x9E3779B9) + np.uint64(seed) * np.uint64(0x85EBCA6B) & np.uint64(0xFFFFFFFF)
    for factor in (0x7FEB352D, 0x6C50B47D, 0x45D9F3B):
        words = (words ^ words >> np.uint64(16)) * np.uint64(factor) & np.uint64(0xFFFFFFFF)
    mixed: NDArray[np.uint64] = words ^ words >> np.uint64(16)
    return mixed


def digest(result: BatchResult) -> str:
    """Return the hash of all numbers of a result, with one NaN for all: what a NaN is made of is free."""
    return _hash((result.states, result.record))


def _hash(arrays: tuple[NDArray[np.float64], ...]) -> str:
    found = hashlib.sha256()
    for values in arrays:
        found.update(np.where(np.isnan(values), np.nan, values).astype("<f8").tobytes())
    return found.hexdigest()[:16]


def failures(result: BatchResult) -> int:
    """Return how many runs left what is possible."""
    return int((result.states[1] < 1.0e300).sum())


def hashes_of(name: str, run: Callable[[Batch], Runner], draws: int = DRAWS) -> dict[str, str | int]:
    """Return the hashes of the rows, of the run and of the draws of a name, and how many draws failed.

    ``run`` is given a batch and returns what runs those of its program.
    """
    batch = plain_batch(name)
    runner = run(batch)
    drawn = runner(drawn_batch(batch, draws))
    # The hash of the rows that a plan made.
    return {
        "rows": _hash((batch.parameters, batch.states)),
        "run": digest(runner(batch)),
        "draws": digest(drawn),
        "failed": failures(drawn),
    }


GOLDEN = files("ppafo.questions.bits").joinpath("golden.json")
QUICK = ("torque-task-proportional", "torque-task-solenoid", "torque-task-moving-ankle", "step-response", "off")
"""What is run where nothing is asked for: Numba compiles it within a minute on a common computer."""
PARTS = {"rows": "rows of the run", "run": "the run", "draws": "the draws", "failed": "how many draws fail"}
_DAMAGED = "golden.json of this installation of ppafo is damaged; install ppafo anew"
Hashes = Mapping[str, Mapping[str, str | int]]


@dataclass(frozen=True, slots=True, repr=False)
class Bits(Solved):
    """Hashes of this computer and the golden ones, by name; what it is, what processor, and what compiled."""

    found: Hashes
    golden: Hashes
    platform: str
    processor: str
    compiler: str

    def differing(self, name: str) -> tuple[str, ...]:
        """Return what of a name differs, as words."""
        return tuple(words for part, words in PARTS.items() if self.found[name][part] != self.golden[name][part])

    @property
    def is_same(self) -> bool:
        """True where nothing differs."""
        return not any(map(self.differing, self.found))


def golden_hashes() -> Hashes:
    """Return the hashes that every computer must find, by name; SimulationError where their file is damaged."""
    try:
        found = json.loads(GOLDEN.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise SimulationError(f"{_DAMAGED}: {one_line(error)}") from None
    entries = list(found.values()) if isinstance(found, dict) else []
    if not entries or not all(isinstance(item, dict) and item.keys() == PARTS.keys() for item in entries):
        raise SimulationError(f"{_DAMAGED}: it is to have {', '.join(PARTS)} of each scenario, walk and course")
    return dict(found)


def bits(
    names: Sequence[str] = (),
    everything: bool = False,
    threads: int | None = None,
    progress: Report = report_nothing,
) -> Bits:
    """Return whether scenarios, walks and 1,000 draws of each program have the golden bits on this computer.

    ``names`` are those to run, by default some, and all where ``everything`` is asked for. SimulationError for a name
    that there is not, for names beside ``everything``, and where nothing can be compiled.
    """
    if everything and names:
        raise SimulationError("--all takes all scenarios, walks and courses: give no names beside it")
    golden = golden_hashes()
    chosen = tuple(golden) if everything else tuple(dict.fromkeys(names)) or QUICK
    for name in chosen:
        if name not in golden:
            raise SimulationError(
                f"there is no golden hash of '{name}'{nearest_name(name, golden)}; there are: {', '.join(golden)}"
            )
    load_programs(plain_batch(name).program for name in chosen)
    found = {}
    for number, name in enumerate(chosen):
        progress(Progress("comparing bits", number, len(chosen), noun="models"))
        found[name] = hashes_of(name, lambda _batch: partial(run_batch, threads=threads))
    return Bits(found, golden, _platform(), _processor(), chosen_compiler().described())


def new_golden_hashes() -> Hashes:
    """Return the hashes of all runs as this computer finds them."""
    return {name: hashes_of(name, lambda _batch: run_batch) for name in names()}


def _platform() -> str:
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as lines:  # noqa: PTH123
            told = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
            return next(told, "") or platform.processor()
    except OSError:
        return platform.processor() or "unknown"


_HEAD = tuple(map(Column, ("scenario, walk or course", "run", "1,000 draws", "of which failed", "")))


def answer_of(solved: Bits) -> Answer:
    """Return the answer: the same bits as everywhere, or what differs."""
    differing = {name: solved.differing(name) for name in solved.found}
    others = [name for name, parts in differing.items() if parts]
    verdict = (
        f"{', '.join(others)}: not the golden bits"
        if others
        else f"all {len(differing)} have the golden bits, to the last one"
    )
    rows = tuple(
        (name, hashes["run"], hashes["draws"], hashes["failed"], _said(differing[name]))
        for name, hashes in solved.found.items()
    )
    marked = tuple(number for number, name in enumerate(differing) if differing[name])
    where = Table(
        (), tuple({"computer": solved.platform, "processor": solved.processor, "by": solved.compiler}.items())
    )
    remark = "hashes are of the final state and of every recorded sample, with one NaN for all"
    return Answer(
        name="bits",
        kicker="Bits",
        title="The same bits on every computer?",
        lead=(verdict,),
        sections=(
            Section(table=where),
            Section("Hashes", table=Table(_HEAD, rows, marked, left=3), remarks=(remark,)),
        ),
        data={
            "platform": solved.platform,
            "processor": solved.processor,
            "compiler": solved.compiler,
            "hashes": {name: dict(hashes) for name, hashes in solved.found.items()},
            "differs": {name: list(parts) for name, parts in differing.items() if parts},
        },
        passed=solved.is_same,
    )


def _said(differing: tuple[str, ...]) -> str:
    return f"differs: {', '.join(differing)}" if differing else "the same"
