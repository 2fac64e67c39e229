"""Whether a setting means the same at every door: random words of a user, at each door and as `--set` of a single run.

    python scripts/one_meaning.py --settings 1000 --seed 1
    python scripts/one_meaning.py --settings 200 --doors study library --items torque-task-solenoid

Draws settings as texts with units (`supply.pressure=57.3 psi_g`), one to four paths at once over all numbers of every
scenario and walk of the package, and compares what each door makes of them, bit for bit, with what `ppafo simulate
--set` and `ppafo walk --set` run: program, clock, parameters and start. What a single run refuses a door must refuse.
Prints a line for each item and door, and settings that differ; the status is 1 where one does.
"""

import argparse
import ctypes
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.engine.run import batch_of
from ppafo.errors import PpafoError
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import COUNTS
from ppafo.loading import load_scenario
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES
from ppafo.parameters.graph import ATMOSPHERE_PATH, fixed_zero
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.loading import list_scenarios
from ppafo.simulation.motion_kind import VANE
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.studies.loading import load_study
from ppafo.studies.varying import varied_path
from ppafo.study.blocks import drawn_values, varied_columns
from ppafo.units import parse_quantity
from ppafo.walking import list_walks
from scripts.typed_words import (
    ROWS,
    Judged,
    Planned,
    Words,
    drawn_paths,
    numbers_of,
    numbers_of_walk,
    planned,
    settings_of,
    single,
    words_of,
)

# What is drawn must not depend on the kinds that were used before: a scenario has the numbers of those that are loaded.
for kinds in (VALVES, ACTUATORS, EFFECTS):
    kinds.load_own()


def at_study(name: str, count: int, seed: int) -> Judged:
    """Columns of a study file: a list of texts for each path, all of them crossed."""
    found = Judged()
    draw = random.Random(f"study {name} {seed}")
    base = load_scenario(name)
    known, atmosphere = numbers_of(base), base.device.supply.atmospheric_pressure
    while found.same + found.refused + len(found.differing) < count:
        paths = drawn_paths(list(known), draw)[:3]
        texts = {path: [words_of(path, *known[path], draw, atmosphere) for _ in range(ROWS)] for path in paths}
        for path, given in texts.items():
            units = {text.rpartition("_")[2] for text in given}
            if units == {"g", "a"}:  # together they are refused where the atmosphere varies
                texts[path] = [text for text in given if text.rpartition("_")[2] == given[0].rpartition("_")[2]]
        _compare_study(found, name, texts)
    return found


def _compare_study(found: Judged, name: str, texts: Mapping[str, Sequence[str]]) -> None:
    whole = {path: [int(text) if path == "sensors.seed" else text for text in given] for path, given in texts.items()}
    document = {
        "schema_version": 1,
        "name": "words",
        "configurations": [{"name": "one", "scenario": name}],
        "vary": [{"path": path, "kind": "list", "values": given} for path, given in whole.items()],
        "outputs": {"metrics": ["gas_supplied"]},
    }
    try:
        study = load_study(document)
    except PpafoError as error:
        # A value out of range refuses the whole study: one of its single runs must be refused too.
        alone = [single(name, words) for words in crossed(texts)]
        first = next((line for line in alone if isinstance(line, str)), alone[0])
        found.compare(next(crossed(texts)), first, str(error))
        return
    values = drawn_values(study, np.arange(study.runs))
    base = study.configurations[0].scenario
    columns = varied_columns(study, study.configurations[0], values)
    plan = plan_ensemble(check_columns(base, columns, study.gauge))
    rows: dict[int, Planned | str] = dict(plan.reasons)
    rows |= {int(run): planned(batch, place) for runs, batch in plan.batches for place, run in enumerate(runs)}
    for run, words in enumerate(crossed(texts)):
        found.compare(words, single(name, words), rows[run])


def crossed(texts: Mapping[str, Sequence[str]]) -> Iterator[dict[str, str]]:
    """The settings of a grid in the order of its runs: the last path changes first."""
    if not texts:
        yield {}
        return
    *before, last = texts
    for words in crossed({path: texts[path] for path in before}):
        yield from ({**words, last: text} for text in texts[last])


def in_si(scenario: Scenario, words: Words) -> dict[str, float]:
    """Words in SI units as who hands over numbers converts them: gauge pressures from the atmosphere of that run."""
    places = {path: varied_path(path, scenario) for path in words}
    given = {path: place.level(words[path]) for path, place in places.items() if path == ATMOSPHERE_PATH}
    zero = given.get(ATMOSPHERE_PATH, scenario.device.supply.atmospheric_pressure)
    linked = ("supply.", "initial.")
    return {
        path: (replace(place, atmosphere=zero) if path.startswith(linked) else place).level(
            int(words[path]) if path == "sensors.seed" else words[path]
        )
        for path, place in places.items()
    }


def at_numbers(name: str, count: int, seed: int) -> Judged:
    """Numbers of a scenario replaced in Python, as tuned and fitted ones are."""
    found, base = Judged(), load_scenario(name)
    for words in settings_of(name, count, seed):
        timeless = {path: text for path, text in words.items() if path not in TIMES}
        try:
            door: Planned | str = planned(batch_of(plan_run(with_numbers(base, in_si(base, timeless)))))
        except PpafoError as error:
            door = str(error)
        alone = single(name, timeless)
        # What contradicts itself is for the caller to check here.
        if isinstance(alone, str):
            found.refused += 1
        else:
            found.compare(timeless, alone, door)
    return found


OTHER_PROGRAM = "needs another program"


def _handed(values: np.ndarray) -> Any:
    """Numbers where C has a struct of them."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class BuiltLibrary:
    """The exported library of a scenario or walk, whose functions are called from here."""

    def __init__(self, item: Scenario | Scenario, folder: Path) -> None:
        self.library = library_of(item)
        for file, content in library_files(self.library).items():
            (folder / file).write_bytes(content)
        made, name = folder / "library.so", self.library.name
        flags = ["-std=c99", "-O0", "-ffp-contract=off", "-Dstatic=", "-Wl,-Bsymbolic", "-shared", "-fPIC", "-w"]
        subprocess.run(["gcc", *flags, str(folder / f"{name}.c"), "-o", str(made), "-lm"], check=True)
        self.c = ctypes.CDLL(str(made))
        self.wrong_setting, self.size = self.c.wrong_setting, getattr(self.c, f"{name}_size")
        self.wrong_setting.restype, self.size.restype = ctypes.c_char_p, ctypes.c_size_t
        self.places = {setting.path: place for place, setting in enumerate(self.library.settings)}

    def changed(self, numbers: Mapping[str, float]) -> np.ndarray:
        """The settings with some of them changed."""
        settings = np.array([setting.value for setting in self.library.settings])
        for path, number in numbers.items():
            is_rate = path == "controller.rate"
            settings[self.places["controller.period" if is_rate else path]] = 1.0 / number if is_rate else number
        return settings

    def planned(self, settings: np.ndarray, alone: "Planned | str") -> "Planned | str":
        """What the library runs with some settings; ``alone``, the single run, says how many numbers there are."""
        pointer = settings.ctypes.data_as(ctypes.c_void_p)
        bad = self.wrong_setting(pointer)
        if bad is not None:
            return f"{bad.decode()} is out of range or contradicts another"
        if not self.size(pointer):
            return OTHER_PROGRAM
        if isinstance(alone, str):
            return Planned(np.zeros(0), np.zeros(0), ())
        every = settings.copy()
        if self.library.following is not None:
            self.c.follow(_handed(settings), _handed(every))
        parameters, states, counts = np.zeros(alone.parameters.size), np.zeros(alone.states.size), np.zeros(len(COUNTS))
        self.c.prepare(*map(_handed, (every, parameters, states, counts)))
        return Planned(parameters, states, (*counts.tolist()[:5], alone.clock[5]))


def at_library(name: str, count: int, seed: int) -> Judged:
    """Settings of an exported library in C, as FMU and plugin have them: SI units, all others as they are."""
    found, base = Judged(), load_scenario(name)
    with tempfile.TemporaryDirectory() as folder:
        built = BuiltLibrary(base, Path(folder))
        for drawn in settings_of(name, count, seed):
            # An effect that is off in the library has no settings there.
            words = {path: text for path, text in drawn.items() if path in built.places or "effects." not in path}
            alone = single(name, words)
            door = built.planned(built.changed(_numbers_in_si(base, words)), alone)
            if door == OTHER_PROGRAM and not isinstance(alone, str):
                found.other += 1
            else:
                found.compare(words, alone, door)
    return found


def _numbers_in_si(base: Scenario, words: Words) -> dict[str, float]:
    if base.motion.motion_kind.layout == VANE:
        return in_si(base, words)
    declared = {path: quantity for path, (quantity, _) in numbers_of_walk(base).items()}
    zero = base.device.supply.atmospheric_pressure
    if ATMOSPHERE_PATH in words:
        zero = parse_quantity(words[ATMOSPHERE_PATH], "Pa_a")
    return {path: parse_quantity(text, declared[path].unit, fixed_zero(path) or zero) for path, text in words.items()}


Door = Callable[[str, int, int], Judged]
DOORS: Mapping[str, tuple[Door, Sequence[str]]] = {
    "study": (at_study, (*list_scenarios(), *list_walks())),
    "numbers": (at_numbers, (*list_scenarios(), *list_walks())),
    "library": (at_library, (*list_scenarios(), *list_walks())),
}
"""Doors by name, and the items that can be taken through them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge and print; 1 where a setting differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--settings", type=int, default=100, help="settings of each item at each door")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--doors", nargs="*", default=list(DOORS), choices=list(DOORS))
    parser.add_argument("--items", nargs="*", default=None, help="names of scenarios and walks; all of the package")
    given = parser.parse_args(arguments)
    wrong = 0
    for name in given.doors:
        door, items = DOORS[name]
        for item in items if given.items is None else [item for item in items if item in given.items]:
            found = door(item, given.settings, given.seed)
            wrong += len(found.differing)
            print(f"{name:8} {item:28} {found.line}", flush=True)
            for text in found.differing[:5]:
                print(f"    differs: {text}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
