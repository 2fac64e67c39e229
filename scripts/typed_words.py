"""Settings as a user types them, drawn, and what a single run with them is, with which `one_meaning.py` compares."""

import random
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.engine.lanes import Batch
from ppafo.engine.run import batch_of
from ppafo.errors import PpafoError
from ppafo.exports.c_library import settings
from ppafo.loading import load_scenario
from ppafo.model.declaration import Quantity
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.simulation.clock import TIMES
from ppafo.simulation.numbers import declared_numbers, number_at, other_form
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.units import from_si
from ppafo.walking import list_walks, load_walk

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
    # A few are far off, so that they contradict others.
    share = draw.uniform(0.1, 4.0) if draw.random() < 0.2 else draw.uniform(0.8, 1.25)
    number = min(max(size * share, quantity.minimum), quantity.maximum)
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


def numbers_of_walk(walk: Scenario) -> dict[str, tuple[Quantity, float]]:
    """The same of a walk; its length is given in minutes and its record follows from that."""
    apart = ("run.duration", "run.output_interval")
    return {
        item.path: (item.quantity, item.value) for item in settings.settings_of(walk, 1.0) if item.path not in apart
    }


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
            return planned(batch_of(plan_run(walk)))
        return planned(batch_of(plan_run(load_scenario(name, texts))))
    except PpafoError as error:
        return str(error)


def settings_of(name: str, count: int, seed: int) -> Iterator[dict[str, str]]:
    """Settings of a scenario, the same for every door."""
    draw = random.Random(f"{name} {seed}")
    scenario = load_scenario(name)
    known = numbers_of_walk(scenario) if name in list_walks() else numbers_of(scenario)
    for _ in range(count):
        paths = drawn_paths(list(known), draw)
        yield {path: words_of(path, *known[path], draw, scenario.device.supply.atmospheric_pressure) for path in paths}
