"""Varied values of a study: paths with units and limits; conversion of ``[[vary]]`` tables to SI."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ppafo.errors import ScenarioError, UnitError, refused_as
from ppafo.model.catalog import find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import fits, is_within, range_rule
from ppafo.parameters.declared import PLAIN
from ppafo.parameters.graph import fixed_zero, gauge_link
from ppafo.parameters.parameter_set import atmospheric_pressure, entry_in_si, in_first_unit, unit_in
from ppafo.simulation.numbers import NOISE_SEED, declared_numbers, number_at
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.studies.declaration import KINDS
from ppafo.studies.distributions import Distribution
from ppafo.studies.study import Axis, RandomValue, Study
from ppafo.units import parse_quantity, split_pressure_kind, split_quantity
from ppafo.units.shown import shown_text, shown_unit, shown_value
from ppafo.wording import nearest_name

_UNIT_OF_DIFFERENCE = {"Pa_a": "Pa_d"}
_OFFSET_UNITS = ("degC", "°C")
DEVIATIONS_IN_HALF_WIDTH = 1.959963984540054
"""Half width of the 95 % interval of a normal distribution, in standard deviations."""
_STATED_DIFFERENCES = {"psi_g": "psi_d", "psi_a": "psi_d", "degC": "K", "°C": "K"}
# Range of magnitudes that are displayed in the unit in which they were given.
_SMALLEST_SHOWN = 1.0e-3
_LARGEST_SHOWN = 1.0e7
_TAIL = 1.0e-3
"""Probability of a draw below those that are told, and of one above them [-]."""


@dataclass(frozen=True, slots=True)
class VariedPath:
    """Varied path with its declared quantity, and the atmospheric pressure [Pa absolute] for its gauge pressures.

    With ``is_gauge`` the values are gauge pressures relative to the varying atmosphere of each run, else absolute.
    ``given`` is the unit in which values were given, "" if unknown.
    """

    path: str
    quantity: Quantity
    atmosphere: float
    is_gauge: bool = False
    given: str = ""

    def level(self, value: str | float) -> float:
        """Convert a value of the path to SI; UnitError for a wrong unit or a value out of range."""
        number = self._in_si(value, self.quantity)
        if not is_within(number, self.quantity):
            given = split_quantity(value)[1] if isinstance(value, str) else ""
            raise UnitError(f"{self.path} {range_rule(self.quantity, given)}")
        if self.is_gauge:
            return in_first_unit(self.quantity, lambda unit: parse_quantity(str(value), unit, 0.0))
        return number

    def distance(self, value: str | float) -> float:
        """Convert a difference of two values of the path to SI, such as a standard deviation."""
        # A difference of pressures counts from nothing; in degC it would get the offset of the scale.
        unit = _UNIT_OF_DIFFERENCE.get(self.quantity.unit, self.quantity.unit)
        if isinstance(value, str) and split_quantity(value)[1] in _OFFSET_UNITS:
            raise UnitError("a temperature difference must be given in K")
        return self._in_si(value, replace(self.quantity, unit=unit))

    def quote(self, value: float, digits: str = ".6g") -> str:
        """Format a value [SI] of the path for messages: in the unit in which it was given."""
        unit = self.given or shown_unit(self.quantity.unit)
        unit, zero = (f"{split_pressure_kind(unit)[0]}_g", 0.0) if self.is_gauge else (unit, self.atmosphere)
        return f"{shown_value(value, self.quantity.unit, unit, zero):{digits}} {unit}".rstrip()

    def _in_si(self, value: str | float, quantity: Quantity) -> float:
        if isinstance(value, str):
            return in_first_unit(quantity, lambda unit: parse_quantity(value, unit, self.atmosphere))
        if quantity.unit not in PLAIN:
            raise UnitError(
                f"has no unit; write the number and its unit in quotes, with a unit such as {quantity.unit}"
            )
        return float(value)


def varied_path(
    path: str, scenario: Scenario, texts: Iterable[object] = (), atmosphere_varies: bool = False
) -> VariedPath:
    """Look up a path in a scenario, of which ``texts`` are values; ScenarioError with the nearest name if unknown.

    It is shown in the first unit of the texts, unless a number needs a power of ten there, such as 1.451e-5 m^3. Where
    the atmosphere varies, gauge pressures such as ``50 psi_g`` are relative to the atmosphere of each run; raises
    UnitError for a mix of gauge and absolute pressures.
    """
    find_effects([path])
    known = declared_numbers(scenario)
    if path not in known:
        section = path.partition(".")[0]
        near = [name for name in known if name.startswith(f"{section}.")]
        hint = nearest_name(path, known) or f"; for example {', '.join(near[:6] or list(known)[:6])}"
        raise ScenarioError(f"scenario '{scenario.name}' has no numeric value '{path}'{hint}")
    quantity = known[path]
    texts = list(texts)
    number, given = next((split_quantity(str(text)) for text in texts if unit_in(text)), (0.0, ""))
    is_plain = number == 0.0 or _SMALLEST_SHOWN <= abs(number) < _LARGEST_SHOWN
    # A text that cannot be read is refused with its key, where it is converted.
    units = [unit for text in texts if (unit := unit_in(text))]
    gauge = [bool(gauge_link(path, 0.0, unit)) for unit in units]
    is_gauge = atmosphere_varies and quantity.unit == "Pa_a" and any(gauge)
    if is_gauge and not all(gauge):
        other = units[gauge.index(not gauge[0])]
        raise UnitError(f"the atmosphere varies, so '{units[0]}' and '{other}' cannot be mixed")
    atmosphere = fixed_zero(path) or scenario.device.supply.atmospheric_pressure
    return VariedPath(path, quantity, atmosphere, is_gauge, given if is_plain and fits(given, quantity.unit) else "")


def left_out(study: Study) -> Iterator[str]:
    """Yield a remark on each drawn path whose values are all on one side of the value in a scenario of the study."""
    for drawn in study.drawn:
        low, high = drawn.distribution.values(np.array([_TAIL, 1.0 - _TAIL])).tolist()
        shown = partial(shown_text, si_unit=study.units[drawn.path], unit=study.given.get(drawn.path, ""))
        for configuration in study.configurations:
            zero = configuration.scenario.device.supply.atmospheric_pressure if drawn.path in study.gauge else 0.0
            nominal = value_at(drawn.path, configuration.scenario)
            varies = configuration.name in study.only.get(drawn.path, (configuration.name,))
            if varies and nominal is not None and not low <= nominal - zero <= high:
                yield (
                    f"{configuration.name}: {drawn.path} is drawn from {shown(low + zero)} to {shown(high + zero)}, "
                    f"which leaves out its value, {shown(nominal)}"
                )


def value_at(path: str, scenario: Scenario) -> float | None:
    """Return the value [SI] of a scenario at a path as in overrides; None if there is none."""
    run = scenario.run
    period = scenario.controller.period
    of_clock = {
        "controller.period": period,
        "controller.rate": 1.0 / period,
        "run.duration": run.duration,
        "run.step": run.step,
        "run.output_interval": run.output_interval,
    }
    try:
        return float(of_clock[path]) if path in of_clock else number_at(scenario, path)
    except (AttributeError, KeyError, TypeError):
        return None


def texts_of(entry: Mapping[str, Any]) -> list[object]:
    """Return the values of a ``[[vary]]`` table in the order of its keys, except differences and fractions."""
    keys = ("first", "last", "minimum", "maximum", "mean", "median", "mode")
    return [*(entry[key] for key in keys if key in entry), *entry.get("values", ())]


def axis_or_distribution(entry: Mapping[str, Any], varied: VariedPath) -> Axis | RandomValue:
    """Convert a ``[[vary]]`` table to an axis or distribution; UnitError with the key of an unusable value."""
    path = varied.path
    kind = entry["kind"]
    if kind == "whole_numbers" and not varied.quantity.whole:
        raise UnitError(f"kind = 'whole_numbers' is only for {NOISE_SEED}; use 'choice' or 'uniform'")
    if varied.quantity.whole and kind not in ("grid", "list", "choice", "whole_numbers"):
        raise UnitError(f"kind = '{kind}' does not give whole numbers, which '{path}' needs; use 'whole_numbers'")
    if kind in ("list", "choice"):
        values = _all_whole(varied, tuple(_level("values", value, varied) for value in entry["values"]))
        return Axis(path, values) if kind == "list" else RandomValue(path, _choice(values, entry.get("weights", ())))
    if kind != "grid":
        return RandomValue(path, distribution_in({"minimum": 0, "maximum": LARGEST_SEED, **entry}, varied))
    first, last = (_level(key, entry[key], varied) for key in ("first", "last"))
    if first == last:
        raise UnitError(f"first and last are both {entry['first']!r}; they must differ")
    is_logarithmic = entry.get("spacing") == "logarithmic"
    if is_logarithmic and min(first, last) <= 0.0:
        raise UnitError("spacing = 'logarithmic' needs first and last above 0")
    spaced = np.geomspace if is_logarithmic else np.linspace
    return Axis(path, _all_whole(varied, tuple(spaced(first, last, entry["count"]).tolist())))


def _all_whole(varied: VariedPath, values: tuple[float, ...]) -> tuple[float, ...]:
    broken = [value for value in values if varied.quantity.whole and value != math.floor(value)]
    if broken:
        raise UnitError(f"{broken[0]:g} must be a whole number")
    return values


def distribution_in(entry: Mapping[str, Any], varied: VariedPath) -> Distribution:
    """Return the distribution of a ``[[vary]]`` table; UnitError for numbers that do not make one."""
    kind = entry["kind"]
    is_logarithmic = kind in ("log_uniform", "log_normal")
    # Of the absolute pressure: a gauge pressure may be 0 or below, where there is no logarithm.
    place = replace(varied, is_gauge=False) if is_logarithmic else varied
    keys = [key for key in ("mean", "median", "minimum", "mode", "maximum") if key in KINDS[kind].fields]
    levels = {key: _level(key, entry[key], place) for key in keys}
    said = {key: f"{key} = {entry[key]!r}" for key in (*keys, "standard_deviation") if key in entry}
    if "minimum" in levels and levels["minimum"] >= levels["maximum"]:
        raise UnitError(f"{said['minimum']} must be less than {said['maximum']}")
    if "mode" in levels and not levels["minimum"] <= levels["mode"] <= levels["maximum"]:
        raise UnitError(f"{said['mode']} must lie between {said['minimum']} and {said['maximum']}")
    if is_logarithmic and levels[keys[0]] <= 0.0:
        raise UnitError(f"{said[keys[0]]} must be above 0")
    numbers = list(levels.values())
    if "mean" in levels:
        with refused_as(UnitError, said["standard_deviation"], UnitError):
            numbers.insert(1, varied.distance(entry["standard_deviation"]))
        if numbers[1] <= 0.0:
            raise UnitError(f"{said['standard_deviation']} must be above 0")
    if kind == "log_normal":
        numbers.append(entry["factor"])
    return Distribution(kind, tuple(numbers), varied.atmosphere if is_logarithmic and varied.is_gauge else 0.0)


def _choice(values: tuple[float, ...], given: Sequence[float]) -> Distribution:
    """Return a discrete distribution; UnitError if the number of weights does not fit the values."""
    weights = [float(weight) for weight in given or (1.0,) * len(values)]
    if len(weights) != len(values):
        raise UnitError(
            f"weights has {len(weights)} numbers, values has {len(values)}; there must be one weight for each value"
        )
    if min(weights) < 0.0 or math.fsum(weights) <= 0.0:
        raise UnitError(f"weights = {weights} must be at least 0, and not all of them 0")
    fractions = np.cumsum(weights) / np.sum(weights)
    return Distribution("choice", (values, tuple(fractions.tolist())))


def _level(key: str, value: str | float, varied: VariedPath) -> float:
    with refused_as(UnitError, f"{key} = {value!r}", UnitError):
        return varied.level(value)


def stated_normal(varied: VariedPath, scenario: Scenario) -> tuple[Distribution, str]:
    """Return the stated distribution of a path and its unit in the parameter set; UnitError without an uncertainty."""
    origin = scenario.origin
    path = varied.path
    # With the overrides of the scenario: one that replaces a value takes its uncertainty away.
    parameters = origin.parameters
    assert parameters is not None, "read from a file"
    inside = f"valves.{origin.valve}.{path.removeprefix('valve.')}" if path.startswith("valve.") else path
    entry = parameters.numbers.get(inside)
    if entry is None or not entry.uncertainty:
        why = "an override replaced it" if entry is not None and entry.source == "override" else "it states none"
        raise UnitError(
            f"kind 'stated' needs an uncertainty in the parameter set '{scenario.origin.parameter_set}', but {why}"
        )
    unit = _STATED_DIFFERENCES.get(entry.unit, entry.unit)
    if unit.endswith(("_g", "_a")):
        unit = f"{unit[:-2]}_d"
    half_width = varied.distance(f"{entry.uncertainty!r} {unit}".strip())
    mean = entry_in_si(entry, parameters.declarations()[inside], atmospheric_pressure(parameters))
    return Distribution("normal", (mean, half_width / DEVIATIONS_IN_HALF_WIDTH)), entry.unit
