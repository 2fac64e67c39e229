"""What may be meant by a unit that does not exist or does not fit: only what would be taken in its place."""

import difflib
import re

from ppafo.errors import UnitError
from ppafo.units.definitions import PRESSURE, UnknownUnitError, parse_unit
from ppafo.units.spelling import as_product, spellings

_NEAR, _TRIED = 0.6, 12
_LEVEL, _DIFFERENCE = "Pa_a", "Pa_d"


def hint(unknown: UnknownUnitError, kind: str, si_unit: str | None) -> str:
    """Return ``, did you mean 'mm^2'?``: the unit with the nearest name that makes it fit ``si_unit``, or nothing.

    Where it is not known what is wanted only another case of the same letters is meant.
    """
    name, wanted = unknown.name, None if si_unit is None else parse_unit(si_unit)[0].dimensions
    same = sorted(known for known in spellings() if known.lower() == name.lower())
    near = [] if wanted is None else difflib.get_close_matches(name, sorted(spellings()), _TRIED, _NEAR)
    same += [f"deg{name}"] if wanted is not None and f"deg{name}" in spellings() else []
    # nm for N m: a force has a capital letter.
    product = as_product(name.capitalize())
    same += [product] if product else []
    for known in dict.fromkeys((*same, *near)):
        unit = re.sub(rf"(?<![A-Za-zµ]){re.escape(name)}(?![A-Za-zµ])", known, unknown.unit)
        try:
            dimensions = parse_unit(unit)[0].dimensions
        except UnitError:
            continue
        if wanted is None or dimensions == wanted:
            kinds = (
                _kinds(kind, si_unit) if dimensions == PRESSURE and si_unit in (_LEVEL, _DIFFERENCE, None) else ("",)
            )
            *others, last = (f"'{unit}{suffix}'" for suffix in kinds)
            return f", did you mean {' or '.join(filter(None, (', '.join(others), last)))}?"
    return ""


def _kinds(kind: str, si_unit: str | None) -> tuple[str, ...]:
    if kind:
        return (f"_{kind}",)
    return {_LEVEL: ("_g", "_a"), _DIFFERENCE: ("_d",)}.get(str(si_unit), ("_g", "_a", "_d"))


def pressures_to_write(unit: str, si_unit: str) -> str:
    """Return how a pressure says what it is where a level or a difference is wanted."""
    if si_unit == _DIFFERENCE:
        return f"write {unit}_d for a difference"
    return f"write {unit}_g for gauge or {unit}_a for absolute"
