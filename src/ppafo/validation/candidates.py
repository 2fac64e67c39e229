"""Table of the causes of a disagreement: rows of change of the model, trial magnitudes, prior and words.

The generators yield the rows in the order in which they are tried: faulty samples, motion, sensors, clock, and device.
"""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.report.kind import Kind
from ppafo.simulation.numbers import declared_numbers, number_at, other_form
from ppafo.simulation.recorded.channels import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.simulation.recorded.usual_errors import (
    ANGLE_ERRORS,
    PRESSURE_ERRORS,
    SUPPLY_ERROR,
    SensorErrors,
    misread_units,
    usual_errors,
)
from ppafo.units.shown import quantity_of_unit, shown_in, shown_unit, shown_value
from ppafo.validation.record import SENSORS, UNTRIED, ModelChange, Record, ScaledResiduals, SensorModel
from ppafo.validation.replay import Replay, replayed_scenario
from ppafo.validation.settings import ANGLE, PRESSURE_1, PRESSURE_2, Motion
from ppafo.wording import argument_text

_STARTS = (-0.05, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.05)
"""Trial initial values of a channel whose first samples are wrong, as fractions of its range [-].

The two outermost values lie outside the range, and a best fit there is rejected.
"""
_AT_REST = 2.0
"""Ratio of the angle's standard deviation to its noise [-] below which the vane may be locked."""
_GAINS = (0.3, 0.6, 0.8, 0.95, 0.98, 1.02, 1.05, 1.25, 1.6, 3.0)
"""Trial gains of a sensor [-]."""
_LONG_DELAYS = (0.015, 0.03, 0.05, 0.08, 0.12)
"""Trial delays [s] of all sensors with respect to the command, beyond the common delay that is removed."""
_SHIFTS = (0.0005, 0.001, 0.003, 0.008, 0.015, 0.03, 0.05, 0.08, 0.12)
"""Trial times [s] by which all sensors lead the command, of which none is removed, and delays of a valve with none."""
_RATES = (0.7, 0.85, 0.94, 0.98, 0.995, 1.005, 1.02, 1.06, 1.15, 1.4)
"""Trial rates [-] of the clock of a recording."""
_FACTORS: tuple[float, ...] = (0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0, 20.0)
"""Trial values of a parameter divided by its value in the set [-]."""
_OF_A_GAS = 5
"""Number of trial values of a property of the gas, in geometric progression."""
_ATMOSPHERES = (0.6, 0.7, 0.8, 0.9, 0.95, 1.03, 1.1)
"""Trial atmospheric pressures divided by the pressure in the set [-]: from a high mountain to a deep mine."""
_SECTIONS = ("valve", "actuator", "friction", "foot_plate", "supply", "gas", "effects")
"""Sections of the parameter set whose parameters are tried, in this order; effects that the set names alone."""
_NOT_TRIED = "actuator.restitution"
"""Parameter observable only when the vane reaches a stop; a replay starts between the stops."""
_CURVED = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Commands at which a curved opening is a table [-]."""
_POWERS = (0.4, 0.7, 1.4, 2.0, 3.0)
"""Trial powers of the command to which an opening is proportional [-]."""
_ZEROS = (-0.6, -0.3, -0.1, -0.03, -0.01, -0.003, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6)
"""Trial zero offsets of angle [rad], command [full openings] and pressures [gauge supply pressures].

Grids are so fine that two Gauss-Newton steps reach the least squares, and no likely fault lies at one of their ends.
"""
_DELAYS = (-0.025, -0.012, -0.006, -0.003, -0.001, 0.001, 0.003, 0.006, 0.012, 0.025)
"""Trial delays of a sensor relative to the other sensors [s]."""
_OFF = {
    "s": _SHIFTS,
    "": (0.002, 0.006, 0.02, 0.06, 0.2, 0.6),
    "Hz": (3.0, 8.0, 20.0, 50.0, 130.0, 350.0),
    "1/s": (0.5, 2.0, 8.0, 30.0, 120.0, 500.0),
    "m^2": (1e-8, 1e-7, 1e-6, 1e-5),
    "kg m^2": (1e-4, 1e-3, 1e-2, 1e-1),
    "N m": (-3.0, -0.8, -0.3, -0.1, -0.02, 0.02, 0.1, 0.3, 0.8, 3.0),
    "N m s/rad": (1e-3, 1e-2, 1e-1, 0.9),
    "N m/rad": (0.03, 0.15, 0.8, 4.0, 20.0),
    "N m s^2/rad^2": (1e-4, 1e-3, 1e-2, 1e-1),
    "kg/(s Pa^2)": (1e-18, 1e-17, 1e-16, 1e-15, 1e-14),
    "rad/s": (0.02, 0.08, 0.35, 1.5, 6.0),
    "N m/Pa": (1e-8, 5e-8, 2e-7, 1e-6, 5e-6),
}
"""Trial values of a number that is 0 in the set, by its unit."""
_OF_GASES = {
    "gas.molar_mass": (0.0039, 0.046),
    "gas.heat_capacity_ratio": (1.05, 1.68),
    "gas.temperature": (250.0, 340.0),
}
"""Ends of what gases in use and rooms have [SI]; other values are no cause."""
_OF_SUPPLY = {PRESSURE_PATH: SUPPLY, SECOND_PRESSURE_PATH: DORSIFLEXION_SUPPLY}
_EFFECTS = {
    "stribeck": ("rad/s", "friction seems to be higher up to {:.2g} rad/s (Stribeck)"),
    "seal_friction": ("N m/Pa", "friction seems to grow with pressure by {:.2g} N m/Pa"),
    "joint_load.stiffness": ("N m/rad", "a spring of {:.2g} N m/rad seems to act at the joint"),
    "joint_load.drag": ("N m s^2/rad^2", "a drag of {:.2g} N m s^2/rad^2 seems to act at the joint"),
    "laminar_leak.coefficient": ("kg/(s Pa^2)", "a laminar leak of {:.2g} kg/(s Pa^2) seems to pass the seal"),
    "line_resistance.area": ("m^2", "lines seem to throttle as an orifice of {:.2g} mm^2 does"),
}
"""Effects that a device may lack, by name and setting, or by name alone for several: unit and words."""


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """Row of the table of causes; once tried, with its best magnitude, residuals and gain G [-] of ``causes.py``.

    ``words``: message with a placeholder for ``shown`` times the magnitude. ``change``: function from magnitude to
    change. ``sizes``: trial magnitudes; a single one means that there is nothing to fit. ``is_ratio``: the magnitude is
    a ratio, fitted as its logarithm. ``usual``: largest usual error on any bench (of a ratio, its logarithm).
    ``is_of_unit``: misread unit, reported only if it explains the recordings. ``is_off``: the model lacks the number or
    effect, so that a ratio of 1 is a change too. ``unit``: unit of the changed parameter.

    ``size``: magnitude, for ratios its logarithm. ``left``: largest RMS error of any channel divided by its noise [-]
    under the cause. ``same``: other causes that the recordings cannot distinguish from this one; of the nearest cause,
    the two next ones.
    """

    name: str
    words: str
    change: Callable[[float], ModelChange]
    sizes: tuple[float, ...] = (0.0,)
    is_ratio: bool = False
    shown: float = 1.0
    usual: float = 0.0
    is_of_unit: bool = False
    is_off: bool = False
    unit: str = ""
    size: float = math.nan
    residuals: ScaledResiduals = UNTRIED
    gain: float = 0.0
    left: float = math.nan
    same: "tuple[Cause, ...]" = ()

    @property
    def has_size(self) -> bool:
        """True if the magnitude is fitted; a swap or a wrong sign has no magnitude."""
        return len(self.sizes) > 1

    @property
    def is_of_bench(self) -> bool:
        """True for a usual error of a single sensor; an error of a sensor group is a sum of single errors."""
        return self.usual > 0.0 and len(self.at(self.usual).sensors) <= 1

    @property
    def grid(self) -> list[float]:
        """Trial magnitudes, as logarithms if they are ratios."""
        return [math.log(size) if self.is_ratio else size for size in self.sizes]

    def at(self, size: float) -> ModelChange:
        """Return the change of the model for a fitted magnitude (for ratios, its logarithm)."""
        return self.change(math.exp(size) if self.is_ratio else size)

    @property
    def fitted(self) -> ModelChange:
        """Change of the model at the best magnitude."""
        return self.at(self.size)

    @property
    def numbers(self) -> dict[str, tuple[float, str]]:
        """Changed parameters by path, each a value with its SI unit."""
        return {path: (value, self.unit) for path, value in self.fitted.numbers.items() if self.unit}

    @property
    def in_words(self) -> str:
        """Message, with values of the set in display units."""
        said = self.words.format(self.shown * (math.exp(self.size) if self.is_ratio else self.size))
        for value, unit in self.numbers.values():
            # An atmosphere in gauge pressure says nothing.
            quantity = "pressure change" if unit == "Pa_a" else quantity_of_unit(unit)
            said += f" ({Kind('', '' if unit == '-' else unit, quantity).text(value)})"
        return said

    @property
    def is_of_samples(self) -> bool:
        """True for faulty samples, which are visible without a model."""
        return self.at(self.grid[0]).start is not None

    @property
    def is_inside(self) -> bool:
        """True if the magnitude is inside its grid; at an end, a better magnitude may lie beyond."""
        return min(self.grid) < self.size < max(self.grid)

    @property
    def is_usual(self) -> bool:
        """True if the magnitude is within what is usual on any bench."""
        return self.usual > 0.0 and abs(self.size) <= self.usual

    @property
    def explains(self) -> bool:
        """True if the residuals of every channel are noise and G is positive."""
        return self.residuals.is_noise and self.gain > 0.0


def of_samples(records: Sequence[Record]) -> Iterator[Cause]:
    """Yield the faulty samples of all channels as a single cause; nothing without faulty samples."""
    faulty = [record for record in records if record.words]
    if not faulty:
        return
    of_file = {True: " ({})", False: ""}[len(records) > 1]
    texts = [words + of_file.format(record.agreement.file) for record in faulty for words in record.words]
    channels = dict.fromkeys(words.split()[0] for record in faulty for words in record.words)
    # Every channel has a sample that a sensor made among those of the start.
    has_start = all(
        bool(record.good[:, : samples_at_rest(record.agreement.measured)].any(axis=1).all()) for record in faulty
    )
    yield Cause(
        f"samples of {' and '.join(channels)}",
        # No size is shown, and a file's name may have a brace.
        "; ".join(texts).replace("{", "{{").replace("}", "}}"),
        lambda share: ModelChange(start=share),
        (0.0,) if has_start else _STARTS,
        usual=math.inf if all(record.has_few for record in faulty) else 0.0,
    )


def of_motion(records: Sequence[Record], motion: Motion) -> Iterator[Cause]:
    """Yield another motion than the given one: a locked vane for a recorded angle at rest, else a leg if it is free."""
    angles = [record.values[record.channels.index(ANGLE)] for record in records if ANGLE in record.channels]
    is_at_rest = all(float(np.std(angle)) < _AT_REST for angle in angles)
    if angles and (motion == "free" or (motion == "leg" and is_at_rest)):
        other: Motion = "locked" if is_at_rest else "leg"
        seems = "be locked, because its recorded angle is constant" if is_at_rest else "be coupled to a leg"
        words = f"the vane seems to {seems} ({argument_text('motion', other)})"
        yield Cause("motion", words, lambda _: ModelChange(motion=other))


def of_sensors(device: Device, names: Collection[str], units: Mapping[str, AbstractSet[str]]) -> Iterator[Cause]:
    """Yield errors of sensors and clock: zero, gain, unit, sign and delay, swapped channels, rate of the clock.

    ``units`` has, for each channel that moves, the units declared in the files, empty for none. Units are not tried for
    a chamber that stays at atmospheric pressure, which shows no factor, nor against a unit that the file declares.
    """
    atmosphere = device.supply.atmospheric_pressure
    gauge = max(device.supply.pressure, device.supply.dorsiflexion_pressure) - atmosphere
    unit, per_pascal = _unit_of_pressure(device)
    chambers = tuple(name for name in (PRESSURE_1, PRESSURE_2) if name in names)
    supplies = tuple(name for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in names)
    pressures = (*chambers, *supplies)
    # Pressure sensors may share an error: each, both chambers, both supplies, and all, the largest group first.
    groups = {(name,) for name in pressures} | {chambers, supplies, pressures} - {()}
    # Sensors of one kind: their SI unit, the point [SI] about which a gain turns, the size of a zero of 1 [SI], or 0
    # where none is tried, its unit and how many of that are 1 in SI, and the errors of any bench; a command has none.
    of_pressure = ("Pa", atmosphere, gauge, unit, per_pascal, PRESSURE_ERRORS)
    exact = SensorErrors(zero=0.0, gain=0.0, delay=0.0)
    sensed = [(group, *of_pressure) for group in sorted(groups, key=lambda group: (-len(group), group))]
    sensed += [
        ((ANGLE,), "rad", 0.0, 1.0, "deg", math.degrees(1.0), ANGLE_ERRORS),
        ((COMMAND,), "", 0.0, 1.0, "of full opening", 1.0, exact),
        ((EXTERNAL_TORQUE,), "N m", 0.0, 0.0, "", 1.0, exact),
    ]
    for channels, si_unit, about, size, unit, shown, usual in sensed:
        if not {*channels} <= {*names, COMMAND}:
            continue
        several = len(channels) > 1
        group = "all pressures" if several and channels == pressures else " and ".join(channels)
        verb = "seem" if several else "seems"
        gained, moved = partial(_sensed, channels, "gain", about), partial(_sensed, channels, "zero", 0.0)
        if size:
            words, zeros = f"the zero of {group} seems to be off by {{:+.3g}} {unit}", [size * part for part in _ZEROS]
            yield Cause(f"zero of {group}", words, moved, tuple(zeros), shown=shown, usual=usual.zero)
            words = f"{group} {verb} to read {{:.4g}} times the true value"
            yield Cause(f"gain of {group}", words, gained, _GAINS, is_ratio=True, usual=usual.gain)
        read_as = ("gauge read as absolute", -about), ("absolute read as gauge", about)
        for kind, zero in read_as if si_unit == "Pa" else ():
            words = f"{group} {verb} to be {kind}"
            yield Cause(words, words, moved, (zero,), is_of_unit=True)
        stated = set[str]().union(*(units.get(name, ()) for name in channels))
        for mistake, factor in misread_units(si_unit, stated) if si_unit and units.keys() & {*channels} else ():
            name = f"{group} {verb} to be {mistake}"
            words = f"{name}: the unit is probably wrong, by a factor of {max(factor, 1.0 / factor):.4g}"
            yield Cause(name, words, gained, (factor,), is_of_unit=True)
    sensors = tuple(name for name in SENSORS if name in names)
    # Of one sensor alone the delay is the one of all, which is taken out.
    for name in sensors if len(sensors) > 1 else ():
        words, change = (
            f"{name} seems to lag the other channels by {{:.3g}} ms",
            partial(_sensed, (name,), "delay", 0.0),
        )
        yield Cause(f"delay of {name}", words, change, _DELAYS, shown=1.0e3, usual=usual_errors(name).delay)
    leads = tuple(-lead for lead in _SHIFTS)
    for noun, verb, delays, shown in (("delay", "lag", _LONG_DELAYS, 1.0e3), ("lead", "lead", leads, -1.0e3)):
        words = f"all sensors seem to {verb} the command by {{:.3g}} ms"
        yield Cause(f"{noun} of all sensors", words, lambda delay: ModelChange(delay=delay), delays, shown=shown)
    words = "the clock of the recording seems to run {:.4g} times as fast"
    yield Cause("rate of the clock", words, lambda rate: ModelChange(clock=rate), _RATES, is_ratio=True)
    swapped, has_both = ModelChange(is_swapped=True), len(chambers) > 1
    if has_both:
        yield Cause("swap", "pressure_1 and pressure_2 seem to be swapped", lambda _: swapped)
    for name in (COMMAND, EXTERNAL_TORQUE):
        if name in names:
            words = f"{name} seems to have the wrong sign"
            yield Cause(f"sign of {name}", words, partial(_sensed, [name], "gain", 0.0), (-1.0,))
    if has_both:
        # A symmetric device mirrors both by an angle from the other end, and no recording tells these apart.
        words = "command seems to have the wrong sign, and pressure_1 and pressure_2 to be swapped"
        mirrored = replace(swapped, sensors={COMMAND: SensorModel(gain=-1.0)})
        yield Cause("sign of command and swap", words, lambda _: mirrored)
    if ANGLE in names:
        middle = 0.5 * (device.actuator.angle_min + device.actuator.angle_max)
        words = "the angle seems to be counted from the other end"
        yield Cause("end of angle", words, partial(_sensed, [ANGLE], "gain", middle), (-1.0,))


def _sensed(names: Iterable[str], kind: str, about: float, size: float) -> ModelChange:
    """Return a change in which sensors have an error of one ``kind``: gain about a value, zero offset or delay."""
    return ModelChange(dict.fromkeys(names, replace(SensorModel(about=about), **{kind: size})))


def of_numbers(request: Replay) -> Iterator[Cause]:
    """Yield every number of the set, 0 or not, with trial values, and a wrong atmosphere under gauge sensors."""
    device, recording = request.device, request.measured.recording
    scenario = replace(replayed_scenario(request), device=device)
    # Supply pressures that a replay follows in the recording, whatever the set has.
    followed = {path for path, channel in _OF_SUPPLY.items() if channel in recording}
    if SUPPLY in recording and device.supply.has_one_pressure:
        followed = set(_OF_SUPPLY)
    declared = declared_numbers(scenario)
    other_forms = {f"{part}.{name}" for part in ("actuator.leak", "valve") for name in other_form(device, part)}
    off = {path for path in declared if path.startswith("effects.") and path.split(".")[1] not in device.effects}
    tried = [path for path in declared if path not in {_NOT_TRIED, *other_forms, *followed, *off}]
    for path in (path for section in _SECTIONS for path in tried if path.split(".")[0] == section):
        value, quantity = number_at(scenario, path), declared[path]
        words, base, trials = f"{path} seems to be {{:.3g}} times the model's value", value, _FACTORS
        if value == 0.0:
            sign = "above" if quantity.minimum == 0.0 else "other than"
            words, base, trials = f"{path} seems to be {sign} 0", 1.0, _OFF.get(quantity.unit, ())
        elif path in _OF_GASES:
            trials = tuple((np.geomspace(*_OF_GASES[path], _OF_A_GAS) / value).tolist())
        trials = tuple(size for size in trials if quantity.minimum <= size * base <= quantity.maximum)
        # Two regulators of one pressure are set together; one of them may be off alone.
        is_first = path == PRESSURE_PATH and device.supply.has_one_pressure
        for alone, others in (("", {}), (" alone", {SECOND_PRESSURE_PATH: value}))[: 1 + is_first]:
            if len(trials) > 2:
                is_ratio = min(trials) > 0.0
                yield Cause(
                    path + alone,
                    words.replace(path, path + alone),
                    partial(_with_number, path, base, others),
                    trials,
                    is_ratio=is_ratio,
                    usual=math.log1p(SUPPLY_ERROR / value) if path in _OF_SUPPLY else 0.0,
                    is_off=value == 0.0 and is_ratio,
                    unit="" if others else quantity.unit or "-",
                )
    pressures = {path: number_at(scenario, path) for path in _OF_SUPPLY if path not in followed}
    atmosphere = device.supply.atmospheric_pressure

    def under_atmosphere(factor: float) -> ModelChange:
        higher = (factor - 1.0) * atmosphere
        sensors = dict.fromkeys((PRESSURE_1, PRESSURE_2, *_OF_SUPPLY.values()), SensorModel(zero=-higher))
        moved = {path: pressure + higher for path, pressure in pressures.items()}
        return ModelChange(sensors, {ATMOSPHERE_PATH: atmosphere + higher, **moved})

    unit, per_pascal = _unit_of_pressure(device)
    words = f"the atmosphere under gauge pressures seems to be {{:.4g}} {unit}"
    yield Cause("atmosphere", words, under_atmosphere, _ATMOSPHERES, is_ratio=True, shown=per_pascal * atmosphere)


def _unit_of_pressure(device: Device) -> tuple[str, float]:
    """Return the display unit of a pressure difference, and the number of these units in 1 Pa."""
    with shown_in(device.shown):
        return shown_unit("Pa_d").removesuffix("_d"), shown_value(1.0, "Pa_d")


def _with_number(path: str, base: float, others: Mapping[str, float], size: float) -> ModelChange:
    """Return a change of a number of the set to a multiple of ``base``, and of ``others`` to their values [SI]."""
    return ModelChange(numbers={**others, path: size * base})


def of_effects(device: Device) -> Iterator[Cause]:
    """Yield other openings of the valve, and every effect that is off in the model of the device."""
    if "opening" in device.effects:
        straight = ModelChange(effects={"opening": {}})
        yield Cause("opening", "the valve seems to open by a straight line, not by its table", lambda _: straight)
    elif device.valve.kind == "proportional":
        words = "the valve seems to open by the power {:.2g} of its command"
        yield Cause("opening", words, partial(_with_effect, "opening"), _POWERS, is_ratio=True)
    for name, (unit, words) in _EFFECTS.items():
        if name.partition(".")[0] not in device.effects:
            change, shown = partial(_with_effect, name), 1.0e6 if unit == "m^2" else 1.0
            yield Cause(name, words, change, _OFF[unit], is_ratio=True, shown=shown, is_off=True)


def _with_effect(name: str, size: float) -> ModelChange:
    """Return a change of the effect ``name``, or of its setting of a full name, to a magnitude."""
    effect, _, setting = name.partition(".")
    settings = {
        "opening": {f"command_{number:02}": command for number, command in enumerate(_CURVED, 1)}
        | {f"opening_{number:02}": command**size for number, command in enumerate(_CURVED, 1)},
        "stribeck": {"velocity": size, "share": 0.9},
        "seal_friction": {"static_per_pressure": size, "dynamic_per_pressure": size},
    }
    return ModelChange(effects={effect: {setting: size} if setting else settings[effect]})
