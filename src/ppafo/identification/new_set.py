"""The new parameter set: identified values in the place of the old ones, each with interval and origin."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ppafo.errors import ParameterError
from ppafo.identification.estimate import Estimate, half_width_for
from ppafo.model.declaration import Quantity
from ppafo.parameters.building import build_device
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM, alternatives, is_within
from ppafo.parameters.graph import acting
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, links_of_set, number_text
from ppafo.parameters.provenance import CONFIDENCE, Entry
from ppafo.units import from_si

_FORMS = (frozenset(item.name for item in AREA_FORM), frozenset(item.name for item in SONIC_FORM))


@dataclass(frozen=True, slots=True)
class NewSet:
    """A set with new values, and what is wrong with it as a device (an empty text if nothing).

    ``written`` are the paths of the identified ones. ``fitted`` are those of values that are weak or hold for this
    model only: the set has them, with the origin ``fitted``, and they do not count as identified.
    """

    parameter_set: ParameterSet
    written: tuple[str, ...]
    fitted: tuple[str, ...]
    problem: str


def with_estimates(parameter_set: ParameterSet, estimates: Iterable[Estimate], valve: str | None = None) -> NewSet:
    """Return the set with every usable estimate that has a place in it; the later of two for one path counts."""
    found: dict[str, bool] = {}
    for estimate in estimates:
        if _has_a_place(parameter_set, estimate):
            parameter_set = _with_estimate(parameter_set, estimate)
            found[estimate.path] = estimate.is_identified
    written = tuple(path for path, is_identified in found.items() if is_identified)
    fitted = tuple(path for path, is_identified in found.items() if not is_identified)
    return NewSet(parameter_set, written, fitted, _device_problem(parameter_set, valve))


def _has_a_place(parameter_set: ParameterSet, estimate: Estimate) -> bool:
    quantity = parameter_set.declarations().get(estimate.path)
    return quantity is not None and estimate.is_usable and is_within(estimate.value, quantity)


def _with_estimate(parameter_set: ParameterSet, estimate: Estimate) -> ParameterSet:
    """Return the set with one value replaced; it keeps the unit that the set had."""
    quantity = parameter_set.declarations()[estimate.path]
    before = parameter_set.numbers.get(estimate.path)
    atmosphere = atmospheric_pressure(parameter_set)
    unit = quantity.unit if before is None else before.unit
    si_unit = fitting_unit(unit, quantity)
    value, low, high = (
        from_si(number, unit, si_unit, atmosphere) for number in (estimate.value, estimate.low, estimate.high)
    )
    was = (
        "the set had no value"
        if before is None
        else f"the set had {number_text(before)} ({before.origin}: {before.source})"
    )
    interval = f"{100.0 * estimate.confidence:g}% interval {low:.6g} to {high:.6g} {unit}".rstrip()
    entry = Entry(
        value=value,
        unit=unit,
        origin="identified" if estimate.is_identified else "fitted",
        source="; ".join(estimate.recordings),
        note=f"{estimate.verdict_in_words}, {interval}. {estimate.explanation} Before, {was}.",
        uncertainty=half_width_for(CONFIDENCE, max(high - value, value - low), estimate.confidence),
    )
    kept = {path: old for path, old in parameter_set.numbers.items() if path not in _other_form(estimate.path)}
    # What was fitted as the pressure of both regulators is that of both.
    links = acting(links_of_set(parameter_set), {estimate.path})
    found = {path: entry for path in (estimate.path, *(path for path, link in links.items() if link.when_set))}
    return replace(parameter_set, numbers={**kept, **found})


def fitting_unit(unit: str, quantity: Quantity) -> str:
    """Return the SI unit of a quantity, of the several that it may be declared in, that a unit can be turned into."""
    return next((item for item in alternatives(quantity) if _fits(unit, item)), quantity.unit)


def _fits(unit: str, si_unit: str) -> bool:
    from ppafo.errors import UnitError

    try:
        from_si(1.0, unit, si_unit)
    except UnitError:
        return False
    return True


def _other_form(path: str) -> frozenset[str]:
    """Return the paths of an orifice that no longer hold when it is given in the form that ``path`` belongs to."""
    section, _, name = path.rpartition(".")
    own = next((form for form in _FORMS if name in form), None)
    other = (
        next((form for form in _FORMS if form is not own), frozenset[str]()) if own is not None else frozenset[str]()
    )
    return frozenset(f"{section}.{member}" for member in other)


def _device_problem(parameter_set: ParameterSet, valve: str | None) -> str:
    try:
        build_device(parameter_set, valve)
    except ParameterError as error:
        return str(error)
    return ""


def in_set_unit(number: float, path: str, si_unit: str, parameter_set: ParameterSet) -> tuple[float, str]:
    """Return a number of a path in the unit that the set has for it, and this unit; as it is where the set has none."""
    entry, quantity = parameter_set.numbers.get(path), parameter_set.declarations().get(path)
    if entry is None or quantity is None or entry.unit == si_unit:
        return number, si_unit
    si = fitting_unit(entry.unit, quantity)
    return from_si(number, entry.unit, si, atmospheric_pressure(parameter_set)), entry.unit
