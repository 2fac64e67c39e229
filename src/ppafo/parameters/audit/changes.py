"""Changes of a parameter set relative to its parent set, value by value, in any units."""

import math
from dataclasses import dataclass

from ppafo.errors import UnitError
from ppafo.parameters.parameter_set import (
    Entry,
    ParameterSet,
    atmospheric_pressure,
    entry_in_si,
    entry_text,
    with_followers,
)

_SAME = 1e-12
"""Relative tolerance for rounding in unit conversions [-]."""


@dataclass(frozen=True, slots=True)
class ValueChange:
    """Changed value of a parameter set: text in parent and set ('' if absent), and origin of the new value."""

    path: str
    before: str
    after: str
    origin: str


def changes(parameter_set: ParameterSet, parent: ParameterSet) -> list[ValueChange]:
    """Return the differences of a parameter set from its parent: valve and other names first, then values in order.

    Numbers are compared in SI: the same value in another unit is no change. Sources and notes are not compared.
    """
    parameter_set = with_followers(parameter_set)
    parent = with_followers(parent)
    kinds, old_kinds = (
        {
            "default_valve": each.default_valve,
            "actuator.kind": each.actuator_kind,
            "actuator.file": each.actuator_file,
            **{f"valves.{name}.kind": kind for name, kind in each.valve_kinds.items()},
        }
        for each in (parameter_set, parent)
    )
    changed = [
        ValueChange(path, old_kinds.get(path, ""), kinds.get(path, ""), "")
        for path in dict.fromkeys((*kinds, *old_kinds))
        if kinds.get(path) != old_kinds.get(path)
    ]
    after = parameter_set.entries()
    before = parent.entries()
    for path in dict.fromkeys((*after, *before)):
        new = after.get(path)
        old = before.get(path)
        if new is None and path.startswith("reported."):
            # A number reported of one device is no property that another could lack.
            continue
        if new is None or old is None or not _is_same(path, parameter_set, parent):
            was = "" if old is None else entry_text(old)
            changed.append(ValueChange(path, was, *(("", "") if new is None else (entry_text(new), new.origin))))
    return changed


def _is_same(path: str, parameter_set: ParameterSet, parent: ParameterSet) -> bool:
    new = parameter_set.entries()[path]
    old = parent.entries()[path]
    if not isinstance(new, Entry) or not isinstance(old, Entry):
        return new.value == old.value
    if (new.value, new.unit) == (old.value, old.unit):
        return True
    quantity = parameter_set.declarations()[path]
    try:
        # Gauge pressures count from each set's own atmosphere.
        mine = entry_in_si(new, quantity, atmospheric_pressure(parameter_set))
        theirs = entry_in_si(old, quantity, atmospheric_pressure(parent))
    except UnitError:  # A unit that does not fit, as one may be reported: its correction is a change.
        return False
    return math.isclose(mine, theirs, rel_tol=_SAME)
