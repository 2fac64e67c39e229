"""Estimates and checks of an identification as text, in the units of the set that it started from."""

import math
import textwrap
from collections.abc import Iterable

from ppafo.identification.bench.result import BenchResult, counted
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate
from ppafo.identification.identify import Beforehand, Identification
from ppafo.identification.trajectory.expected import Expected
from ppafo.identification.trajectory.outcome import TrajectoryOutcome
from ppafo.identification.trajectory.profiles import Profile
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.reporting.in_set_units import in_set_unit
from ppafo.reporting.trajectory_files import kind_of_fit

_WIDTH = 118
_NO_VALUE = "no value"
_FEWEST_DIGITS, _MOST_DIGITS = 4, 9


def identification_table(identification: Identification) -> list[str]:
    """Return lines of text: for each procedure its estimates and checks, then what the new set got."""
    rows = [_row(item, identification.before) for item in identification.estimates]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(4)]
    lines = _beforehand(identification.beforehand)
    for result in identification.results:
        lines += [*_procedure(result, identification.before, widths), ""]
    if identification.trajectory is not None:
        lines += [*_trajectory(identification.trajectory, identification.before, widths), ""]
    lines += textwrap.wrap(f"new set '{identification.name}': {_found(identification)}", _WIDTH, subsequent_indent="  ")
    if identification.new_set.problem:
        lines += textwrap.wrap(f"it makes no device yet: {identification.new_set.problem}", _WIDTH)
    return lines


def _beforehand(found: Iterable[Beforehand]) -> list[str]:
    """Return what was known before anything was fitted, procedure by procedure."""
    lines: list[str] = []
    for item in found:
        lines.append(f"before {item.procedure}, from the recordings alone:")
        for prospect in item.prospects:
            word = "can be had" if prospect.can_be_had else "CANNOT be had"
            lines += _wrapped(f"  {word}: {prospect.name}: {prospect.statement}", "    ")
        lines.append("")
    return lines


def _procedure(result: BenchResult, before: ParameterSet, widths: list[int]) -> list[str]:
    kind = "" if result.kind == "measured" else f" ({result.kind})"
    lines = textwrap.wrap(f"{result.procedure}{kind}: {result.summary}", _WIDTH, subsequent_indent="  ")
    lines += [_estimate(item, before, widths) for item in result.estimates]
    lines += _checks(result.checks)
    for remark in result.remarks:
        lines += _wrapped(f"  remark: {remark}", "          ")
    return lines


def _found(identification: Identification) -> str:
    """Return how many values are identified, and apart from them which are fitted only."""
    written, fitted = identification.new_set.written, identification.new_set.fitted
    told = f"{counted(len(written), 'value')} identified: {', '.join(written)}" if written else "no value identified"
    rest = f"; fitted only, weak or for this model only: {', '.join(fitted)}" if fitted else ""
    return f"{told}{rest}"


def _trajectory(outcome: TrajectoryOutcome, before: ParameterSet, widths: list[int]) -> list[str]:
    """Return estimates, each that is not simply identified with its sentence, then checks, profiles and candidates."""
    kind = kind_of_fit(outcome.fit)
    told = "" if kind == "measured" else f" ({kind})"
    recordings = counted(len(outcome.fit.measurements), "recording")
    lines = [f"trajectory{told}: {counted(len(outcome.fit.estimates), 'number')} fitted to {recordings}"]
    for one in outcome.beforehand:
        if not one.can_be_had:
            lines += _wrapped(f"  beforehand: CANNOT be had: {one.name}: {one.statement}", "              ")
    for item in outcome.fit.estimates:
        lines.append(_estimate(item, before, widths))
        if item.verdict != "identified":
            lines += _wrapped(f"    {item.explanation}", "    ")
    lines += _checks(outcome.checks)
    for remark in outcome.remarks:
        lines += _wrapped(f"  remark: {remark}", "          ")
    for curve in outcome.profiles:
        lines += _wrapped(f"  profile: {_profile(curve, before)}", "           ")
    for number, candidate in enumerate(outcome.expected, start=1):
        lines += _wrapped(f"  next experiment {number}: {_candidate(candidate)}", "                     ")
    return lines


def _profile(one: Profile, before: ParameterSet) -> str:
    """Return the interval of a profile in words."""
    sides = [None if side is None else in_set_unit(side, one.path, one.unit, before) for side in (one.low, one.high)]
    known = [side[0] for side in sides if side is not None]
    digits = _digits(known[0], 0.5 * (known[-1] - known[0])) if known else _FEWEST_DIGITS
    low, high = ("not bounded" if side is None else f"{side[0]:#.{digits}g}" for side in sides)
    unit = next((side[1] for side in sides if side is not None), "")
    return f"{one.path}: {low} to {high} {unit}".rstrip()


def _candidate(one: Expected) -> str:
    share = 1.0 - one.shrinkage[one.most_helped]
    return f"{one.label}: gain {one.gain:.2f}; most for {one.most_helped}, whose interval would shrink by {share:.0%}"


def _estimate(item: Estimate, before: ParameterSet, widths: list[int]) -> str:
    path, value, unit, interval = _row(item, before)
    number = f"{value:>{widths[1]}} {unit:<{widths[2]}}"
    return f"  {path:<{widths[0]}}  {number}  {interval:<{widths[3]}}  {item.verdict_in_words}"


def _checks(checks: Iterable[Check]) -> list[str]:
    lines: list[str] = []
    for check in checks:
        mark = "holds" if check.holds else "FAILS"
        lines += _wrapped(f"  {mark}: {check.name}: {check.statement}", "         ")
    return lines


def _wrapped(text: str, indent: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, subsequent_indent=indent)


def _row(estimate: Estimate, before: ParameterSet) -> tuple[str, str, str, str]:
    """Return path, value, unit and interval."""
    if math.isnan(estimate.value):
        return estimate.path, _NO_VALUE, "", ""
    numbers = (estimate.value, estimate.low, estimate.high)
    shown = [in_set_unit(one, estimate.path, estimate.unit, before) for one in numbers]
    value, low, high = (number for number, _ in shown)
    digits = _digits(value, 0.5 * abs(high - low))
    return estimate.path, f"{value:#.{digits}g}", shown[0][1], f"{low:#.{digits}g} to {high:#.{digits}g}"


def _digits(value: float, half_width: float) -> int:
    """Return the digits that a number needs so that its interval can be told from it, at least four."""
    if not (half_width > 0.0 and math.isfinite(half_width) and value != 0.0):
        return _FEWEST_DIGITS
    needed = math.ceil(math.log10(abs(value) / half_width)) + 1
    return min(max(needed, _FEWEST_DIGITS), _MOST_DIGITS)
