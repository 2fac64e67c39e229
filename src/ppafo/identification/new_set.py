"""New parameter set: identified values with interval and origin replace earlier values."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from ppafo.errors import ParameterError
from ppafo.identification.estimate import Estimate, in_shown_unit, interval_factor
from ppafo.model.catalog import find_effects
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION
from ppafo.parameters.building import build_device
from ppafo.parameters.declaration import is_within
from ppafo.parameters.graph import acting
from ppafo.parameters.overrides import other_forms
from ppafo.parameters.parameter_set import (
    CONFIDENCE,
    Entry,
    ParameterSet,
    atmospheric_pressure,
    entry_text,
    in_first_unit,
    links_of_set,
)
from ppafo.units import from_si, to_si

_TABLE = f"{SECTION}.opening."
_DIGITS = 3
"""Significant digits of the half-width to which a value is rounded."""


@dataclass(frozen=True, slots=True)
class NewSet:
    """Parameter set with identified values.

    ``problem``: error in building a device from the set, empty if valid. ``written``: paths of identified values.
    ``fitted``: paths of values that hold for this model only, with the origin ``fitted`` in the set.
    """

    parameter_set: ParameterSet
    written: tuple[str, ...]
    fitted: tuple[str, ...]
    problem: str


def with_estimates(parameter_set: ParameterSet, estimates: Iterable[Estimate], valve: str | None = None) -> NewSet:
    """Return the set with every usable estimate written to its entry; later estimates override earlier ones."""
    used: dict[str, Estimate] = {}
    estimates = list(estimates)
    if any(estimate.beside for estimate in estimates):
        # A new table takes the place of the old one, whose nodes may be others.
        kept = {path: entry for path, entry in parameter_set.numbers.items() if not path.startswith(_TABLE)}
        parameter_set = replace(parameter_set, numbers=kept)
    for estimate in estimates:
        find_effects([estimate.path])
        quantity = parameter_set.declarations().get(estimate.path)
        if quantity is None or not (estimate.is_usable and is_within(estimate.value, quantity)):
            continue
        used[estimate.path] = estimate
        # In the unit of the earlier entry.
        before = parameter_set.numbers.get(estimate.path)
        unit = quantity.unit if before is None else before.unit
        ends = (estimate.value, estimate.low, estimate.high)
        value, low, high = (_in_unit(unit, end, quantity, parameter_set) for end in ends)
        previous = "no value" if before is None else f"{entry_text(before)} ({before.origin}: {before.source})"
        said = f"{100.0 * estimate.confidence:g}% interval {low:.6g} to {high:.6g} {unit}".rstrip()
        said = f"{estimate.verdict_text}, {said}; {estimate.explanation.rstrip('.')}"
        # An interval that is cut at a bound is too narrow on that side.
        wider = max(high - value, value - low)
        half_width = wider * interval_factor(CONFIDENCE) / interval_factor(estimate.confidence)
        entry = Entry(
            value=_in_digits_of(value, half_width),
            unit=unit,
            origin="identified" if estimate.is_identified else "fitted",
            source="; ".join(estimate.recordings),
            note=f"{said}. Before, the set had {previous}.",
            uncertainty=_in_digits_of(half_width, half_width),
        )
        # An orifice that is given as an area has no sonic conductance any more, and the other way round.
        others = other_forms(estimate.path)
        numbers = {path: old for path, old in parameter_set.numbers.items() if path not in others}
        # A pressure that was fitted for both regulators holds for both.
        links = acting(links_of_set(parameter_set, parameter_set.default_valve), {estimate.path})
        numbers |= dict.fromkeys((estimate.path, *(path for path, link in links.items() if link.when)), entry)
        note = f"as {estimate.path} was identified"
        numbers |= {path: Entry(beside, "", "derived", entry.source, note) for path, beside in estimate.beside.items()}
        parameter_set = replace(parameter_set, numbers=numbers)
    static, dynamic = (used.get(f"friction.{kind}_torque") for kind in ("static", "dynamic"))
    if static is not None and dynamic is not None and static.value >= dynamic.value:
        # Rounded to the digits of its interval, static friction may be below dynamic friction.
        entry, below = (parameter_set.numbers[item.path] for item in (static, dynamic))
        if entry.unit == below.unit and entry.value < below.value:
            higher = replace(entry, value=below.value)
            parameter_set = replace(parameter_set, numbers={**parameter_set.numbers, static.path: higher})
    problem = ""
    try:
        build_device(parameter_set, valve)
    except ParameterError as error:
        problem = str(error)
    written = tuple(path for path, estimate in used.items() if estimate.is_identified)
    fitted = tuple(path for path, estimate in used.items() if not estimate.is_identified)
    return NewSet(parameter_set, written, fitted, problem)


def _in_digits_of(value: float, half_width: float) -> float:
    """Return a value rounded to the third significant digit of its half-width."""
    if not (math.isfinite(half_width) and half_width > 0.0):
        return value
    return round(value, _DIGITS - 1 - math.floor(math.log10(half_width)))


def stated_half_width(entry: Entry, quantity: Quantity) -> float:
    """Return the half-width of the 95 % interval stated in a set [SI]; 0 if none is stated."""
    if not entry.uncertainty:
        return 0.0
    ends = entry.value + entry.uncertainty, entry.value
    return in_first_unit(quantity, lambda si: to_si(ends[0], entry.unit, si) - to_si(ends[1], entry.unit, si))


def in_set_unit(number: float, path: str, si_unit: str, parameter_set: ParameterSet) -> tuple[float, str]:
    """Return a value [SI] and its unit for display: those of its entry in the set, or the display unit without one."""
    entry = parameter_set.numbers.get(path)
    quantity = parameter_set.declarations().get(path)
    if entry is None or quantity is None or entry.unit == si_unit:
        return in_shown_unit(number, si_unit)
    return _in_unit(entry.unit, number, quantity, parameter_set), entry.unit


def _in_unit(unit: str, number: float, quantity: Quantity, parameter_set: ParameterSet) -> float:
    """Return a number [SI] in the unit of an entry of the set."""
    return in_first_unit(quantity, lambda si: from_si(number, unit, si, atmospheric_pressure(parameter_set)))
