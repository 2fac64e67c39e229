"""Estimates and checks of an identification as text, in the units of the set that it started from."""

import math
import textwrap

from ppafo.identification.bench.result import BenchResult, counted
from ppafo.identification.estimate import Estimate
from ppafo.identification.identify import Identification
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.units import from_si

_WIDTH = 118
_NO_VALUE = "no value"


def identification_table(identification: Identification) -> list[str]:
    """Return lines of text: for each procedure its estimates and checks, then what the new set got."""
    rows = [_row(item, identification.before) for item in identification.estimates]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(4)]
    lines: list[str] = []
    for result in identification.results:
        lines += [*_procedure(result, identification.before, widths), ""]
    written = identification.new_set.written
    told = f"{counted(len(written), 'value')} identified: {', '.join(written)}" if written else "no value identified"
    lines += textwrap.wrap(f"new set '{identification.name}': {told}", _WIDTH, subsequent_indent="  ")
    if identification.new_set.problem:
        lines += textwrap.wrap(f"it makes no device yet: {identification.new_set.problem}", _WIDTH)
    return lines


def _procedure(result: BenchResult, before: ParameterSet, widths: list[int]) -> list[str]:
    kind = "" if result.kind == "measured" else f" ({result.kind})"
    lines = textwrap.wrap(f"{result.procedure}{kind}: {result.summary}", _WIDTH, subsequent_indent="  ")
    for item in result.estimates:
        path, value, unit, interval = _row(item, before)
        number = f"{value:>{widths[1]}} {unit:<{widths[2]}}"
        lines.append(f"  {path:<{widths[0]}}  {number}  {interval:<{widths[3]}}  {item.verdict_in_words}")
    for check in result.checks:
        mark = "holds" if check.holds else "FAILS"
        lines += textwrap.wrap(f"  {mark}: {check.name}: {check.statement}", _WIDTH, subsequent_indent="         ")
    return lines


def _row(estimate: Estimate, before: ParameterSet) -> tuple[str, str, str, str]:
    """Return path, value, unit and interval."""
    if math.isnan(estimate.value):
        return estimate.path, _NO_VALUE, "", ""
    entry = before.numbers.get(estimate.path)
    unit = estimate.unit if entry is None else entry.unit
    numbers = (estimate.value, estimate.low, estimate.high)
    value, low, high = (number if unit == estimate.unit else _moved(number, unit, estimate.unit) for number in numbers)
    return estimate.path, f"{value:#.4g}", unit, f"{low:#.4g} to {high:#.4g}"


def _moved(number: float, unit: str, si_unit: str) -> float:
    return from_si(number, unit, "N m s" if si_unit == "N m s/rad" and "rad" not in unit else si_unit)
