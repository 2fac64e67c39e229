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
import json
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.engine.lanes import Batch
from ppafo.engine.run import batch_of
from ppafo.errors import PpafoError
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.program import COUNTS
from ppafo.exports.c_library.walk_preparation import settings_of_walk
from ppafo.exports.loading import load_exportable
from ppafo.exports.wasm.description import description_of
from ppafo.live.content import page_content, program_content
from ppafo.model.declaration import Quantity
from ppafo.parameters.graph import ATMOSPHERE_PATH, counts_from
from ppafo.questions.sweep.chunks import drawn_values, varied_columns
from ppafo.simulation.ensemble.columns import check_columns
from ppafo.simulation.ensemble.planning import plan_ensemble
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.numbers import TIMES, declared_numbers, number_at, other_form, with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.studies.loading import load_study
from ppafo.studies.varying import varied_path
from ppafo.units import from_si, parse_quantity
from ppafo.walking import list_walks, load_walk
from ppafo.walking.configuration import Configuration
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import plan_of, walk_duration

UNITS: Mapping[str, Sequence[str]] = {
    "s": ("s", "ms"),
    "Hz": ("Hz", "kHz"),
    "rad": ("deg", "rad"),
    "rad/s": ("deg/s", "rad/s"),
    "Pa_a": ("psi_g", "psi_g", "kPa_g", "bar_g", "psi_a", "kPa_a", "Pa_a"),
    "Pa_d": ("psi_d", "kPa_d", "Pa_d"),
    "m^2": ("mm^2", "m^2"),
    "m^3": ("cm^3", "L", "m^3"),
    "kg": ("g", "kg"),
    "m": ("mm", "cm", "m"),
    "kg/mol": ("g/mol", "kg/mol"),
    "kg m^2": ("g m^2", "kg m^2"),
}
"""Units in which a user may write a number, by that in SI; others are written as they are."""
TYPICAL: Mapping[str, float] = {"s": 2.0e-3, "Hz": 80.0, "rad": 0.01, "rad/s": 0.5, "Pa_d": 300.0, "N m": 0.3}
"""How large a number is drawn that is 0 in the file, by its unit; others about 0.1."""
LISTED: Mapping[str, Sequence[str]] = {
    "run.duration": ("50 ms", "0.08 s", "0.1 s", "0.07001 s"),
    "run.step": ("1 ms", "0.5 ms", "0.3 ms", "0.0007 s"),
    "run.output_interval": ("1 ms", "2 ms", "2.5 ms", "0.01 s"),
    "controller.rate": ("1 kHz", "500 Hz", "0.7 kHz", "1300 Hz", "2 kHz"),
    "controller.period": ("1 ms", "0.002 s", "0.7 ms", "1.3 ms"),
    "sensors.seed": ("1", "7", "4294967295"),
    "flow.linear_ratio": ("0.995", "0.999", "0.9995"),
    "valve.dead_band": ("0", "0.05"),
    "controller.command": ("-1", "0.3", "1"),
    "supply.atmospheric_pressure": ("95 kPa_a", "14.1 psi_a", "0.8431 bar_a", "105000 Pa_a"),
}
MOST_PATHS = 4
ROWS = 3
"""Values of each path at the door of studies, whose grid crosses them."""
OFTEN = ("supply.pressure", "supply.dorsiflexion_pressure", ATMOSPHERE_PATH, "initial.pressure_1", "initial.pressure_2")
"""Paths that are linked, which one of two settings has one of."""

Words = Mapping[str, str]


def words_of(path: str, quantity: Quantity, value: float, draw: random.Random, atmosphere: float) -> str:
    """A number of a path as a user types it."""
    if path in LISTED:
        return draw.choice(LISTED[path])
    size = value if value else draw.choice((0.0, 1.0)) * TYPICAL.get(quantity.unit, 0.1)
    number = min(max(size * draw.uniform(0.8, 1.25), quantity.minimum), quantity.maximum)
    unit = draw.choice(UNITS.get(quantity.unit, (quantity.unit,)))
    shown = from_si(number, unit, quantity.unit, atmosphere)
    text = repr(shown) if draw.random() < 0.3 else f"{shown:.{draw.randint(2, 8)}g}"
    return f"{text} {unit}".replace(" 1", "") if unit in ("", "1") else f"{text} {unit}"


def drawn_paths(paths: Sequence[str], draw: random.Random) -> list[str]:
    """Some paths at once; of two names of one number never both."""
    linked = [path for path in OFTEN if path in paths]
    first = [draw.choice(linked)] if linked and draw.random() < 0.5 else []
    further = [path for path in draw.sample(paths, draw.randint(1, MOST_PATHS)) if path not in first]
    found = [*first, *further][:MOST_PATHS]
    for one, other in (("controller.rate", "controller.period"), ("motion.angle", "motion.profile.level")):
        if one in found and other in found:
            found.remove(other)
    draw.shuffle(found)
    return found


def numbers_of(scenario: Scenario) -> dict[str, tuple[Quantity, float]]:
    """Every number of a scenario that a user can type, with its value; not of a form of an orifice that it has not."""
    absent = {f"{part}.{name}" for part in ("valve", "actuator.leak") for name in other_form(scenario.device, part)}
    absent |= {"motion.profile.level"} if "motion.angle" in declared_numbers(scenario) else set()
    return {
        path: (quantity, 0.0 if path in TIMES else number_at(scenario, path))
        for path, quantity in declared_numbers(scenario).items()
        if path not in absent
    }


def numbers_of_walk(walk: Configuration) -> dict[str, tuple[Quantity, float]]:
    """The same of a walk; its length is given in minutes and its record follows from that."""
    apart = ("run.duration", "run.output_interval")
    return {item.path: (item.quantity, item.value) for item in settings_of_walk(walk) if item.path not in apart}


@dataclass
class Judged:
    """What came of the settings of one item at one door."""

    same: int = 0
    refused: int = 0
    other: int = 0
    differing: list[str] = field(default_factory=list)

    @property
    def line(self) -> str:
        """Counts in words."""
        counted = f"{self.same:6} the same, {self.refused:5} refused by both, {len(self.differing):4} differ"
        return f"{counted}, {self.other:4} refused for another program" if self.other else counted

    def compare(self, words: Words, alone: "Planned | str", door: "Planned | str") -> None:
        """Count one setting: its single run, and what the door made of it; a text is why it was refused."""
        shown = " ".join(f'--set "{path}={text}"' for path, text in words.items())
        if isinstance(alone, str) and isinstance(door, str):
            self.refused += 1
        elif isinstance(alone, str) or isinstance(door, str):
            who = f"the single run refuses: {alone}" if isinstance(alone, str) else f"the door refuses: {door}"
            self.differing.append(f"{shown}: {who}")
        elif problem := alone.difference(door):
            self.differing.append(f"{shown}: {problem}")
        else:
            self.same += 1


@dataclass(frozen=True)
class Planned:
    """What is run: program and clock where a door shows them, parameters and start by row."""

    parameters: np.ndarray
    states: np.ndarray
    clock: tuple[float, ...]
    names: tuple[str, ...] = ()

    def difference(self, other: "Planned") -> str:
        """What is not the same to the bit, in words; empty where all is."""
        if self.clock != other.clock:
            return f"clock {other.clock} for {self.clock}"
        for own, its, names in ((self.parameters, other.parameters, self.names), (self.states, other.states, ())):
            if own.size != its.size:
                return f"{its.size} rows for {own.size}"
            rows = np.flatnonzero(own.view(np.int64) != its.view(np.int64))
            if rows.size:
                row = int(rows[0])
                return f"{names[row] if names else f'state {row}'} = {its[row]!r} for {own[row]!r}"
        return ""


def planned(batch: Batch, place: int = 0) -> Planned:
    """What the lanes run of one place of a batch."""
    clock, names = (
        batch.clock,
        tuple(batch.program.parameter_paths) if hasattr(batch.program, "parameter_paths") else (),
    )
    counts = (clock.record_every, clock.step_count, clock.steps_per_sample, clock.signal_delay, clock.command_delay)
    return Planned(
        np.ascontiguousarray(batch.parameters[:, place]),
        np.ascontiguousarray(batch.states[:, place]),
        (*map(float, counts), float(hash(batch.program) % 2**31)),
        names,
    )


def single(name: str, words: Words) -> "Planned | str":
    """What `ppafo simulate --set` or `ppafo walk --set` runs; the line with which it refuses."""
    texts = [f"{path}={text}" for path, text in words.items()]
    try:
        if name in list_walks():
            walk = load_walk(name, texts)
            return planned(batch_of(plan_walk(plan_of(walk, walk_duration(walk)))))
        return planned(batch_of(plan_run(load_scenario(name, texts))))
    except PpafoError as error:
        return str(error)


def settings_of(name: str, count: int, seed: int) -> Iterator[dict[str, str]]:
    """Settings of a scenario, the same for every door."""
    draw = random.Random(f"{name} {seed}")
    scenario = load_exportable(name)
    known = numbers_of(scenario) if isinstance(scenario, Scenario) else numbers_of_walk(scenario)
    for _ in range(count):
        paths = drawn_paths(list(known), draw)
        yield {path: words_of(path, *known[path], draw, scenario.device.supply.atmospheric_pressure) for path in paths}


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


class _Handed(ctypes.Structure):
    """An array as the C of a library takes it."""

    _fields_ = (("values", ctypes.POINTER(ctypes.c_double)), ("extent", ctypes.c_int64 * 3))


def _handed(values: np.ndarray) -> _Handed:
    return _Handed(values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), (ctypes.c_int64 * 3)(values.size, 0, 0))


class BuiltLibrary:
    """The exported library of a scenario or walk, whose functions are called from here."""

    def __init__(self, item: Scenario | Configuration, folder: Path) -> None:
        self.library = library_of(item)
        for file, content in library_files(self.library).items():
            (folder / file).write_bytes(content)
        made, name = folder / "library.so", self.library.name
        flags = ["-std=c99", "-O0", "-ffp-contract=off", "-DPPAFO_ENTRY=extern", "-shared", "-fPIC", "-w"]
        subprocess.run(["gcc", *flags, str(folder / f"{name}.c"), "-o", str(made), "-lm"], check=True)
        self.c = ctypes.CDLL(str(made))
        self.bad_setting, self.size = getattr(self.c, f"{name}_bad_setting"), getattr(self.c, f"{name}_size")
        self.bad_setting.restype, self.size.restype = ctypes.c_char_p, ctypes.c_size_t
        self.places = {setting.path: place for place, setting in enumerate(self.library.settings)}

    def changed(self, numbers: Mapping[str, float]) -> np.ndarray:
        """The settings with some of them changed."""
        settings = np.array([setting.value for setting in self.library.settings])
        for path, number in numbers.items():
            is_rate = path == "controller.rate"
            settings[self.places["controller.period" if is_rate else path]] = 1.0 / number if is_rate else number
        return settings

    def planned(self, settings: np.ndarray, alone: "Planned", follows: bool = True) -> "Planned | str":
        """What the library runs with some settings; ``alone`` says how many numbers there are."""
        pointer = settings.ctypes.data_as(ctypes.c_void_p)
        bad = self.bad_setting(pointer)
        if bad is not None:
            return f"{bad.decode()} is out of range or contradicts another"
        if not self.size(pointer):
            return OTHER_PROGRAM
        every = settings.copy()
        if follows and self.library.following is not None:
            self.c.follow(_handed(settings), _handed(every))
        parameters, states, counts = np.zeros(alone.parameters.size), np.zeros(alone.states.size), np.zeros(len(COUNTS))
        self.c.prepare(*map(_handed, (every, parameters, states, counts)))
        return Planned(parameters, states, (*counts.tolist()[:5], alone.clock[5]))


def at_library(name: str, count: int, seed: int) -> Judged:
    """Settings of an exported library in C, as FMU and plugin have them: SI units, all others as they are."""
    found, base = Judged(), load_exportable(name)
    with tempfile.TemporaryDirectory() as folder:
        built = BuiltLibrary(base, Path(folder))
        for words in settings_of(name, count, seed):
            alone = single(name, words)
            if isinstance(alone, str):
                found.refused += 1
                continue
            door = built.planned(built.changed(_numbers_in_si(base, words)), alone)
            if door == OTHER_PROGRAM:
                found.other += 1
            else:
                found.compare(words, alone, door)
    return found


def _numbers_in_si(base: Scenario | Configuration, words: Words) -> dict[str, float]:
    if isinstance(base, Scenario):
        return in_si(base, words)
    declared = {path: quantity for path, (quantity, _) in numbers_of_walk(base).items()}
    zero = base.device.supply.atmospheric_pressure
    if ATMOSPHERE_PATH in words:
        zero = parse_quantity(words[ATMOSPHERE_PATH], "Pa_a")
    return {path: parse_quantity(text, declared[path].unit, counts_from(path, zero)) for path, text in words.items()}


def at_page(name: str, count: int, seed: int) -> Judged:
    """Texts typed on the page that simulates: its script makes numbers of them, which a program is given."""
    found, base = Judged(), load_exportable(name)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        built = BuiltLibrary(base, folder)
        told = description_of(base, built.library)
        simulated = SimpleNamespace(module=SimpleNamespace(description=told), scenario=base, label=name)
        content = page_content(name, "page", (), [{**program_content(simulated, "", {}), "usual": {}}])  # type: ignore[arg-type]
        every = [
            {path: text for path, text in words.items() if path in built.places}
            for words in settings_of(name, count, seed)
        ]
        (folder / "content.json").write_text(json.dumps(content))
        (folder / "configurations.json").write_text(json.dumps(every))
        for words, line in zip(every, _page_values(folder), strict=True):
            alone = single(name, words)
            if isinstance(alone, str):
                found.refused += 1
            elif line.startswith("refused") and ("must stay" in line or "does not fit here" in line):
                found.other += 1
            elif line.startswith("refused"):
                found.compare(words, alone, line)
            else:
                numbers = np.frombuffer(bytes.fromhex(line), dtype=np.float64).copy()
                found.compare(words, alone, built.planned(numbers, alone, follows=False))
    return found


def _page_values(folder: Path) -> list[str]:
    """Lines of ``page_values.mjs``; the script of the page is bundled first."""
    page, here = Path(__file__).parents[1] / "page", Path(__file__).parent
    options = "{entryPoints: ['source/settings.ts'], bundle: true, format: 'esm', outfile: process.argv[1]}"
    build = f"require('esbuild').buildSync({options})"
    subprocess.run(["node", "-e", build, str(folder / "settings.mjs")], cwd=page, check=True)
    files = [str(folder / name) for name in ("settings.mjs", "content.json", "configurations.json")]
    done = subprocess.run(["node", str(here / "page_values.mjs"), *files], check=True, capture_output=True, text=True)
    return done.stdout.splitlines()


Door = Callable[[str, int, int], Judged]
DOORS: Mapping[str, tuple[Door, Sequence[str]]] = {
    "study": (at_study, list_scenarios()),
    "numbers": (at_numbers, list_scenarios()),
    "page": (at_page, (*list_scenarios(), *list_walks())),
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
