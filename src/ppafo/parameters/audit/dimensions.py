"""Does every value have the dimension that its equation needs?"""

from collections.abc import Iterator

from ppafo.errors import UnitError
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Side
from ppafo.parameters.parameter_set import entry_in_si, number_text
from ppafo.units import to_si

_NEEDS_PLAIN = "a plain number"


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield one finding for values of a foreign dimension, and one for each whose unit is that of its inverse."""
    refused = dict(_refusals(evidence))
    inverted = [path for path in refused if _fits_inverse(evidence, path)]
    for path in inverted:
        yield _upside_down(evidence, path)
    foreign = [path for path in refused if path not in inverted]
    if foreign:
        yield _foreign(evidence, foreign)


def _refusals(evidence: Evidence) -> Iterator[tuple[str, str]]:
    for path, entry in evidence.parameter_set.numbers.items():
        try:
            entry_in_si(entry, evidence.declared[path], evidence.atmosphere())
        except UnitError as error:
            yield path, str(error)


def _fits_inverse(evidence: Evidence, path: str) -> bool:
    entry = evidence.parameter_set.numbers[path]
    try:
        return to_si(entry.value, entry.unit, _inverse_unit(evidence.declared[path].unit)) != 0.0
    except UnitError:
        return False


def _inverse_unit(unit: str) -> str:
    return f"1/({unit})" if " " in unit or "/" in unit else f"1/{unit}"


def _upside_down(evidence: Evidence, path: str) -> Finding:
    entry, quantity = evidence.parameter_set.numbers[path], evidence.declared[path]
    inverse_unit = _inverse_unit(quantity.unit)
    value = to_si(entry.value, entry.unit, inverse_unit)
    name = path.rpartition(".")[2].replace("_", "-")
    return Finding(
        id=f"{name}-upside-down",
        severity="error",
        title=f"{path} is upside down: its unit belongs to the inverse",
        values=evidence.values_of(path),
        sides=(Side("as printed", value, inverse_unit), Side("taken literally", 1.0 / value, quantity.unit)),
        paragraph=(
            f"{path} = {number_text(entry)} is meant as: {quantity.summary}. That has the unit "
            f"{quantity.unit}; the printed "
            f"unit {entry.unit} is the one of its inverse. Reconciled by turning the ratio over and keeping the "
            f"number: taken literally it would be {1.0 / value:.3g} {quantity.unit}."
        ),
    )


def _foreign(evidence: Evidence, paths: list[str]) -> Finding:
    described = "; ".join(_mismatch(evidence, path) for path in paths)
    return Finding(
        id="dimensions",
        severity="error",
        title="values whose unit does not fit their equation",
        values=evidence.values_of(*paths),
        sides=tuple(Side(path, evidence.number(path) or 0.0, "as given, base units") for path in paths),
        paragraph=(
            f"{described}. Reconciled by giving the same number in the unit that is needed, if only the unit was "
            f"misprinted; the other checks use the number as it stands."
        ),
    )


def _mismatch(evidence: Evidence, path: str) -> str:
    needed = evidence.declared[path].unit or _NEEDS_PLAIN
    entry = evidence.parameter_set.numbers[path]
    return f"{path} = {number_text(entry)}, where {needed} is needed ({evidence.declared[path].summary})"
