"""Runs what the golden hashes are of, and compares."""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.resources import files

from ppafo.answers import Solved
from ppafo.engine.lanes import load_programs, run_batch
from ppafo.engine.loading import chosen_compiler
from ppafo.errors import SimulationError, nearest_name, one_line
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.bits.runs import hashes_of, names, plain_batch

GOLDEN = files("ppafo.questions.bits").joinpath("golden.json")
QUICK = ("torque-task-proportional", "torque-task-solenoid", "torque-task-moving-ankle", "step-response", "off")
"""What is run where nothing is asked for: Numba compiles it within a minute on a common computer."""
PARTS = {"rows": "rows of the run", "run": "the run", "draws": "the draws", "failed": "how many draws fail"}
_DAMAGED = "golden.json of this installation of ppafo is damaged; install ppafo anew"

Hashes = Mapping[str, Mapping[str, str | int]]


@dataclass(frozen=True, slots=True)
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
