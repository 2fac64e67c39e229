"""The valves of a sizing study as text and as data."""

from typing import Any

import ppafo
from ppafo.control.catalog import CONTROLLERS
from ppafo.reporting.design_table import SUGGESTED, doubt_groups
from ppafo.reporting.shown_values import aligned_rows, shown_number, shown_value
from ppafo.studies.sizing import SizedValve, Sizing, SizingProblem
from ppafo.studies.sizing.result import LIMITS

HEADS = ("valve", "pressure", "lowest", "RMS error", "gas a repetition", "gas in all", "bottle", "mass", "limited by")
_MARGINS = ("error", "torque", "flow", "gas")
_WHERE_FROM = {
    "typed": "typed, not measured",
    "measured": "measured",
    "simulated": "simulated, not measured",
    "synthetic": "synthetic, not measured",
}


def sizing_table(sizing: Sizing) -> list[str]:
    """Return the table of valves, the margins of each, the suggestion and the doubts, line by line."""
    rows = [("", *HEADS), *((_mark(sizing, place), *valve_cells(item)) for place, item in enumerate(sizing.valves))]
    margins = [("", "valve", *(f"{name} margin" for name in _MARGINS), "gains")]
    margins += [
        ("", item.valve.name, *margin_cells(item), gains_sentence(sizing.problem, item))
        for item in sizing.valves
        if item.works
    ]
    return [
        profile_sentence(sizing.problem),
        "",
        *aligned_rows(rows, left=2),
        *(["", *aligned_rows(margins, left=2)] if len(margins) > 1 else []),
        "",
        f"{SUGGESTED} {suggestion_sentence(sizing)}",
        *(f"{item.valve.name}: {item.remark}" for item in sizing.valves if item.remark),
        f"{sizing.runs} runs in {sizing.seconds:.0f} s; {failure_sentence(sizing)}",
        *doubt_groups(sizing.doubtful),
    ]


def profile_sentence(problem: SizingProblem) -> str:
    """Return what is sized for, in a sentence or two."""
    profile = problem.profile
    near = (
        f", {profile.knot_times.size} knots, to {shown_value(profile.table_error, 'N m')}"
        if profile.table_error
        else ""
    )
    return (
        f"profile of {shown_value(profile.period, 's')} with up to {shown_value(profile.largest, 'N m')} "
        f"({_WHERE_FROM[profile.kind]}{near}); {problem.repetitions:.0f} repetitions ({problem.hours:.2g} h), "
        f"RMS error at most {shown_value(problem.largest_error, 'N m')}, "
        f"{100 * problem.reserve:.0f} % of the gas to be left"
    )


def valve_cells(item: SizedValve) -> tuple[str, ...]:
    """Return the cells of a valve in the order of ``HEADS``."""
    if not item.works:
        error = f"{shown_value(item.error, 'N m')} at best"
        return item.valve.name, "-", "-", error, "-", "-", "-", "-", item.limit
    return (
        item.valve.name,
        shown_value(item.pressure, "Pa_a"),
        shown_value(item.lowest_pressure or item.pressure, "Pa_a"),
        shown_value(item.error, "N m"),
        shown_value(item.gas, "kg"),
        shown_value(item.gas_in_all, "kg"),
        "none" if item.bottle is None else item.bottle.name,
        "-" if item.mass is None else shown_value(item.mass, "kg"),
        item.limit,
    )


def margin_cells(item: SizedValve) -> tuple[str, ...]:
    """Return the margins of a valve that works, in percent."""
    margins = item.margins
    values = [None if margins is None else getattr(margins, name) for name in _MARGINS]
    return tuple("-" if value is None else f"{100 * value:.0f} %" for value in values)


def gains_sentence(problem: SizingProblem, item: SizedValve) -> str:
    """Return the controller's gains of a sized valve."""
    control = problem.scenario.control
    units = {f"controller.{quantity.name}": quantity.unit for quantity in CONTROLLERS[control.kind].quantities}
    said = [
        f"{path.rpartition('.')[2].replace('_', ' ')} {shown_number(value)} {units[path]}"
        for path, value in item.gains.items()
    ]
    return ", ".join(said) or "none to choose"


def suggestion_sentence(sizing: Sizing) -> str:
    """Return the suggestion with the reason, or why there is none."""
    item = sizing.choice
    if item is None:
        if any(valve.works for valve in sizing.valves):
            return "no suggestion: valves work, but no bottle is large enough for the use"
        return "no suggestion: no valve keeps the error limit at any of the pressures"
    bottle = "" if item.bottle is None else f" and {item.bottle.name}"
    return (
        f"suggested: {item.valve.name} at {shown_value(item.pressure, 'Pa_a')}{bottle}, the lightest that works, "
        f"{shown_value(item.mass or 0.0, 'kg')}; a lower pressure is kept from it by {LIMITS[item.limit]}"
    )


def failure_sentence(sizing: Sizing) -> str:
    """Return how many runs failed, and the first reason."""
    failed = sum(sizing.failures.values())
    return f"{failed} failed; the first: {next(iter(sizing.failures))}" if failed else "none failed"


def sizing_document(sizing: Sizing) -> dict[str, Any]:
    """Return what ``sizing.json`` says, in SI units."""
    problem = sizing.problem
    return {
        "format": "ppafo sizing",
        "schema_version": 1,
        "name": problem.name,
        "description": problem.description,
        "file": problem.file,
        "units": "SI; pressures absolute, errors in N m, gas and mass in kg, margins as shares",
        "scenario": problem.scenario.name,
        "profile": {
            "kind": problem.profile.kind,
            "period": problem.profile.period,
            "largest": problem.profile.largest,
            "table_error": problem.profile.table_error,
            "times": problem.profile.knot_times.tolist(),
            "torques": problem.profile.knot_values.tolist(),
        },
        "repetitions": problem.repetitions,
        "hours": problem.hours,
        "reserve": problem.reserve,
        "largest_error": problem.largest_error,
        "suggested": None if sizing.choice is None else sizing.choice.valve.name,
        "summary": suggestion_sentence(sizing),
        "valves": [_valve_document(item) for item in sizing.valves],
        "runs": sizing.runs,
        "failures": [{"reason": reason, "runs": count} for reason, count in sizing.failures.items()],
        "doubtful": [
            {"part": part.name, "figure": name, **part.figures[name].model_dump(mode="json")}
            for part, name in sizing.doubtful
        ],
        "versions": {"ppafo": ppafo.__version__},
    }


def _valve_document(item: SizedValve) -> dict[str, Any]:
    margins = item.margins
    return {
        "valve": item.valve.name,
        "works": item.works,
        "pressure": item.pressure,
        "lowest_pressure": item.lowest_pressure,
        "gains": dict(item.gains),
        "error": item.error,
        "gas_per_repetition": item.gas,
        "gas_in_all": item.gas_in_all,
        "bottle": None if item.bottle is None else item.bottle.name,
        "mass": item.mass,
        "margins": None if margins is None else {name: getattr(margins, name) for name in _MARGINS},
        "limited_by": item.limit,
        "limit": LIMITS[item.limit],
        "remark": item.remark,
    }


def _mark(sizing: Sizing, place: int) -> str:
    return SUGGESTED if place == sizing.suggested else ""
