"""The changes that may explain a disagreement, and the sizes that are tried first: one table a stage of the search."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.model.effects.second_virial import SECOND_VIRIAL
from ppafo.parameters.device import Device
from ppafo.signals.recording import Floats
from ppafo.simulation.numbers import declared_numbers, number_at, other_form
from ppafo.simulation.recorded.channels import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.units import from_si
from ppafo.validation.agreement import ReplaySettings, replay_of
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2
from ppafo.validation.measured import Measured
from ppafo.validation.replay import Motion, replayed_scenario

SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)

USUAL_ANGLE, USUAL_PRESSURE, USUAL_GAIN, USUAL_DELAY = math.radians(0.5), 0.3 * PASCALS_PER_PSI, 0.005, 1.0e-3
"""Zeros [rad], [Pa], gain [-] and delay [s] by which sensors of any bench are off: no disagreement."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """What a sensor makes of a true value: a gain [-] about a value, a zero in the channel's unit, a delay [s]."""

    gain: float = 1.0
    zero: float = 0.0
    about: float = 0.0
    delay: float = 0.0

    def of(self, true: Floats) -> Floats:
        """Return the readings of true values."""
        return self.about + self.gain * (true - self.about) + self.zero

    def true(self, readings: Floats) -> Floats:
        """Return the values of readings."""
        return self.about + (readings - self.zero - self.about) / self.gain


@dataclass(frozen=True, slots=True)
class Change:
    """How record and device differ from the set: sensors by channel, numbers by path [SI], settings of an effect.

    With a ``start``, samples that no sensor made are left out. It is where a channel begins whose first samples are
    among them, as a fraction [-] of its range.
    """

    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_swapped: bool = False
    clock: float = 1.0
    motion: Motion | None = None
    start: float | None = None


def joined(first: Change, second: Change) -> Change:
    """Return two changes at once; of numbers and settings that both have, the first's."""
    sensors = dict(first.sensors)
    for name, one in second.sensors.items():
        own = sensors.get(name, Sensor())
        # A zero and a delay turn about nothing, so that the gain's point stays.
        about = one.about if one.gain != 1.0 else own.about
        sensors[name] = Sensor(own.gain * one.gain, own.zero + one.zero, about, own.delay + one.delay)
    numbers, effects = {**second.numbers, **first.numbers}, {**second.effects, **first.effects}
    return replace(first, sensors=sensors, numbers=numbers, effects=effects, clock=first.clock * second.clock)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A cause before its size is known: what a size changes, its words with the place of ``shown`` times the size.

    ``sizes`` are tried first; a cause with one has nothing to fit. A size that ``is_ratio`` is sought as a logarithm.
    ``usual`` is the largest size, or logarithm, that any bench has, ``is_usual`` says so of one without a size;
    ``unit`` is the unit of the number of the set.
    """

    name: str
    words: str
    change: Callable[[float], Change]
    sizes: tuple[float, ...] = (0.0,)
    is_ratio: bool = False
    shown: float = 1.0
    usual: float = 0.0
    is_usual: bool = False
    unit: str = ""

    @property
    def grid(self) -> list[float]:
        """Sizes as they are sought."""
        return [math.log(size) if self.is_ratio else size for size in self.sizes]

    def at(self, size: float) -> Change:
        """Return the change of a size that was sought."""
        return self.change(math.exp(size) if self.is_ratio else size)

    def in_words(self, size: float) -> str:
        """Return what a size that was sought seems to be."""
        return self.words.format(self.shown * (math.exp(size) if self.is_ratio else size))


def _sensed(names: Iterable[str], kind: str, about: float, size: float) -> Change:
    """Return sensors that are off by a gain about a value, a zero or a delay."""
    return Change(dict.fromkeys(names, replace(Sensor(about=about), **{kind: size})))


_UNITS = {
    "kPa read as psi": PASCALS_PER_PSI / 1.0e3,
    "psi read as kPa": 1.0e3 / PASCALS_PER_PSI,
    "bar read as psi": PASCALS_PER_PSI / 1.0e5,
    "psi read as bar": 1.0e5 / PASCALS_PER_PSI,
    "kPa read as bar": 1.0e2,
    "bar read as kPa": 1.0e-2,
}


def _groups(names: Collection[str]) -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Pressure sensors that may be wrong together: in words, by channel, and the verb that goes with them."""
    chambers = tuple(name for name in (PRESSURE_1, PRESSURE_2) if name in names)
    supplies = tuple(name for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in names)
    every = {(name,) for name in (*chambers, *supplies)} | {chambers, supplies, (*chambers, *supplies)}
    for group in sorted(every - {()}, key=lambda one: (-len(one), one)):
        is_all = len(group) > 1 and len(group) == len(chambers) + len(supplies)
        words = "all pressures" if is_all else " and ".join(group)
        yield words, group, "seem" if len(group) > 1 else "seems"


def exchanges(device: Device, names: Collection[str]) -> Iterator[Candidate]:
    """Units, gauge or absolute, swapped channels and signs: mistakes without a size."""
    room, actuator = device.supply.atmospheric_pressure, device.actuator
    for group_words, group, verb in _groups(names):
        for unit, factor in _UNITS.items():
            words = f"{group_words} {verb} to be {unit}"
            yield Candidate(words, words, partial(_sensed, group, "gain", room), (factor,))
        for kind, zero in (("gauge read as absolute", -room), ("absolute read as gauge", room)):
            words = f"{group_words} {verb} to be {kind}"
            yield Candidate(words, words, partial(_sensed, group, "zero", 0.0), (zero,))
    if PRESSURE_1 in names and PRESSURE_2 in names:
        yield Candidate("swap", "pressure_1 and pressure_2 seem to be swapped", lambda _: Change(is_swapped=True))
    for name in (COMMAND, EXTERNAL_TORQUE):
        if name in names:
            words = f"{name} seems to have the wrong sign"
            yield Candidate(f"sign of {name}", words, partial(_sensed, [name], "gain", 0.0), (-1.0,))
    if PRESSURE_1 in names and PRESSURE_2 in names:
        # A symmetric device mirrors both by an angle from the other end, and no recording tells these apart.
        words = "command seems to have the wrong sign, and pressure_1 and pressure_2 to be swapped"
        mirrored = Change({COMMAND: Sensor(gain=-1.0)}, is_swapped=True)
        yield Candidate("sign of command and swap", words, lambda _: mirrored)
    if ANGLE in names:
        middle = 0.5 * (actuator.angle_min + actuator.angle_max)
        words = "the angle seems to be counted from the other end"
        yield Candidate("end of angle", words, partial(_sensed, [ANGLE], "gain", middle), (-1.0,))


def _both_ways(*sizes: float) -> tuple[float, ...]:
    return (*(-size for size in reversed(sizes)), *sizes)


_ZEROS = _both_ways(0.003, 0.01, 0.03, 0.1, 0.3, 0.6)
"""In radians, full openings and gauge pressures of the supply."""
# Grids are so fine that two Gauss-Newton steps reach the least squares, and no likely fault lies at one of their ends.
_GAINS = (0.3, 0.6, 0.8, 0.95, 0.98, 1.02, 1.05, 1.25, 1.6, 3.0)
_DELAYS = _both_ways(0.001, 0.003, 0.006, 0.012, 0.025)
_LONG_DELAYS = _both_ways(0.015, 0.03, 0.05, 0.08, 0.12)
_RATES = (0.7, 0.85, 0.94, 0.98, 0.995, 1.005, 1.02, 1.06, 1.15, 1.4)


def sizes(device: Device, names: Collection[str]) -> Iterator[Candidate]:
    """Gain and zero of one sensor, of all pressures, of command and supply; delays and the rate of the clock."""
    supply = device.supply
    room = supply.atmospheric_pressure
    gauge = max(supply.pressure, supply.dorsiflexion_pressure) - room
    bare, per_unit = _unit_of_pressure(device)
    sensors = [
        (words, group, verb, room, gauge, bare, per_unit, USUAL_PRESSURE, USUAL_GAIN)
        for words, group, verb in _groups(names)
    ]
    if ANGLE in names:
        sensors.append((ANGLE, (ANGLE,), "seems", 0.0, 1.0, "deg", math.degrees(1.0), USUAL_ANGLE, USUAL_GAIN))
    sensors.append((COMMAND, (COMMAND,), "seems", 0.0, 1.0, "of full opening", 1.0, 0.0, 0.0))
    for words, group, verb, about, size, unit, shown, usual_zero, usual_gain in sensors:
        yield Candidate(
            f"zero of {words}",
            f"the zero of {words} seems to be off by {{:+.3g}} {unit}",
            partial(_sensed, group, "zero", 0.0),
            tuple(size * part for part in _ZEROS),
            shown=shown,
            usual=usual_zero,
        )
        yield Candidate(
            f"gain of {words}",
            f"{words} {verb} to be read {{:.4g}} times too large",
            partial(_sensed, group, "gain", about),
            _GAINS,
            is_ratio=True,
            usual=usual_gain,
        )
    seen = tuple(name for name in SENSORS if name in names)
    for name in seen:
        words = f"{name} seems to be later than the other channels by {{:.3g}} ms"
        change = partial(_sensed, (name,), "delay", 0.0)
        yield Candidate(f"delay of {name}", words, change, _DELAYS, shown=1.0e3, usual=USUAL_DELAY)
    words, change = "all sensors seem to be later than the command by {:.3g} ms", partial(_sensed, seen, "delay", 0.0)
    yield Candidate("delay of all sensors", words, change, _LONG_DELAYS, shown=1.0e3)
    words = "the clock of the recording seems to run {:.4g} times as fast"
    yield Candidate("rate of the clock", words, lambda rate: Change(clock=rate), _RATES, is_ratio=True)


_FACTORS = (0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0, 20.0)
_ROOMS = (0.6, 0.7, 0.8, 0.9, 0.95, 1.03, 1.1)
_SECTIONS = ("valve", "actuator", "friction", "foot_plate", "supply", "gas")
# Only a vane that reaches a stop tells these, and a replay starts between the stops.
_NOT_TRIED = ("actuator.angle_min", "actuator.angle_max", "actuator.restitution")
_ATMOSPHERE = "supply.atmospheric_pressure"
_OF_SUPPLY = {"supply.pressure": SUPPLY, "supply.dorsiflexion_pressure": DORSIFLEXION_SUPPLY}


def numbers(measured: Measured, device: Device, settings: ReplaySettings) -> Iterator[Candidate]:
    """Each number of the set, and another atmosphere under sensors of gauge pressure."""
    wanted = replay_of(measured, device, settings)
    device = wanted.device
    scenario = replace(replayed_scenario(wanted), device=device)
    other_forms = {f"{part}.{name}" for part in ("actuator.leak", "valve") for name in other_form(device, part)}
    followed = {path for path, name in _OF_SUPPLY.items() if measured.has(name)}
    followed |= set(_OF_SUPPLY) if measured.has(SUPPLY) and device.supply.has_one_pressure else set()
    declared = declared_numbers(scenario)
    chosen = [path for section in _SECTIONS for path in declared if path.split(".")[0] == section]
    for path in (path for path in chosen if path not in (*_NOT_TRIED, *other_forms, *followed)):
        quantity = declared[path]
        own = number_at(scenario, path)
        factors = tuple(one for one in _FACTORS if quantity.minimum <= one * own <= quantity.maximum)
        if own > 0.0 and len(factors) > 2:
            words = f"{path} seems to be {{:.3g}} times the model's value"
            change = partial(_numbered, path, own)
            yield Candidate(path, words, change, factors, is_ratio=True, unit=quantity.unit or "-")
    room = device.supply.atmospheric_pressure
    pressures = {path: number_at(scenario, path) for path in _OF_SUPPLY if path not in followed}

    def in_room(factor: float) -> Change:
        higher = (factor - 1.0) * room
        numbers = {_ATMOSPHERE: room + higher, **{path: own + higher for path, own in pressures.items()}}
        return Change(dict.fromkeys((PRESSURE_1, PRESSURE_2, *_OF_SUPPLY.values()), Sensor(zero=-higher)), numbers)

    unit, per_unit = _unit_of_pressure(device)
    words = f"the atmosphere under gauge pressures seems to be {{:.4g}} {unit}"
    yield Candidate("atmosphere", words, in_room, _ROOMS, is_ratio=True, shown=per_unit * room)


def _unit_of_pressure(device: Device) -> tuple[str, float]:
    """The unit in which a difference of pressures is shown, and how many of it are 1 Pa."""
    unit = device.shown.get("Pa_d", "kPa_d")
    return unit.removesuffix("_d"), from_si(1.0, unit, "Pa_d")


def _numbered(path: str, own: float, factor: float) -> Change:
    return Change(numbers={path: factor * own})


_PER_PRESSURE, _CO2 = ("static_per_pressure", "dynamic_per_pressure"), {"coefficient": SECOND_VIRIAL["CO2"]}
_EFFECTS: tuple[tuple[str, str, tuple[str, ...], dict[str, float], float, float], ...] = (
    ("leak_opening", "the leak seems to open at {:.3g} Pa", ("pressure",), {"rise": 0.3}, 1e3, 2e5),
    ("stribeck", "friction seems to be higher up to {:.2g} rad/s (Stribeck)", ("velocity",), {"share": 0.9}, 0.02, 6.0),
    ("seal_friction", "friction seems to grow with pressure by {:.2g} N m/Pa", _PER_PRESSURE, {}, 1e-8, 5e-6),
    ("second_virial", "the gas seems to have {:.2g} times the virial coefficient of CO2", ("share",), _CO2, 0.05, 8.0),
    ("spool_play", "the spool seems to have a play of {:.2g} of its command", ("width",), {}, 0.005, 0.4),
)
"""Effects that a device may have and the model has not: the settings that grow with one size, those given, its ends."""


def effects(device: Device) -> Iterator[Candidate]:
    """Effects that the model has not, each with one size."""
    for name, words, scaled, given, low, high in _EFFECTS:
        if name not in device.effects:
            sizes = tuple(np.geomspace(low, high, 5).tolist())
            yield Candidate(name, words, partial(_affected, name, scaled, given), sizes, is_ratio=True)


def _affected(name: str, scaled: Iterable[str], given: Mapping[str, float], size: float) -> Change:
    return Change(effects={name: {**given, **dict.fromkeys(scaled, size)}})
