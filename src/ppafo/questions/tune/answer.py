"""The answer of a tuning: gains and metrics before and after, how the search went, and lines to paste."""

import math
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_value, title_with_unit
from ppafo.answers.shown_metrics import metric_quantity
from ppafo.questions.tune.figure import search_figure, task_figure
from ppafo.questions.tune.problem import Constraint, Problem
from ppafo.questions.tune.search import agreement, keeps
from ppafo.questions.tune.solve import FRESH_DRAWS, Setting, Tuning
from ppafo.simulation.document import plain
from ppafo.simulation.scenario import worn_kind
from ppafo.studies.intervals import fraction_text
from ppafo.units import percentage

_DIFFERENT = 0.1
"""Fraction of the way between the bounds from which on two starts are said to have ended in different places."""
_COURSE = "Left: the best objective so far in each start. Right: where the gains lie between their bounds."


def answer_of(tuning: Tuning) -> Answer:
    """Return the answer of a tuning; it has passed where the gains satisfy all constraints, over fresh draws too."""
    problem = tuning.problem
    task = Figure("task", "The nominal device.", lambda: task_figure(tuning))
    course = Figure("search", _COURSE, lambda: search_figure(tuning))
    return Answer(
        name="tune",
        kicker="Tuning",
        title=problem.name,
        lead=(verdict(tuning), *([problem.description] if problem.description else [])),
        sections=(
            Section("Gains", table=_gains(tuning)),
            Section("Before and after", table=_metrics(tuning), figure=task),
            Section("The search", remarks=tuple(remarks(tuning)), figure=course),
            Section("To use the gains", code=f"ppafo {_verb(problem)} {problem.scenario.name} {_options(tuning)}"),
        ),
        data=_data(tuning),
        passed=tuning.after.is_feasible,
        files={"overrides.txt": lambda: _overrides(tuning).encode()},
    )


def verdict(tuning: Tuning) -> str:
    """Return the result in a sentence."""
    before, after, name = tuning.before, tuning.after, tuning.problem.name
    if after.without_value[0]:
        failing = percentage(after.without_value[0], 3)
        return f"{name}: with the best gains found, {failing} of the runs fail or lack a goal or a constraint"
    if not after.is_feasible_in_search:
        broken = f"the best found exceed the limits by {percentage(after.violation[0], 3)}"
        return f"{name}: no gains within the bounds satisfy all constraints; {broken}{_by_ceiling(tuning)}"
    if not after.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints over the draws of the search, but not over "
            f"{FRESH_DRAWS:,} fresh ones{_by_ceiling(tuning)}"
        )
    if not before.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints, which the previous gains did not; objective "
            f"{after.objective:.4g}"
        )
    if after.objective >= before.objective:
        return f"{name}: nothing better than the previous gains was found within the bounds"
    change = (after.objective - before.objective) / abs(before.objective) if before.objective else math.nan
    return f"{name}: objective {before.objective:.4g} before, {after.objective:.4g} after ({100.0 * change:+.3g} %)"


def _by_ceiling(tuning: Tuning) -> str:
    """Return that the torque ceiling is why, where the draws below it are what breaks the constraints."""
    ceiling = tuning.after.ceiling
    if not ceiling.explains:
        return ""
    where = "" if tuning.problem.spread is None else f" in {percentage(ceiling.fraction, 2)} of the draws"
    return (
        "; the torque ceiling is the cause: the reference requires more than the torque constant times the gauge "
        f"pressure of the supply{where}, which no gains can change"
    )


def _gains(tuning: Tuning) -> Table:
    """Return a row for each searched number: before, after, bounds, and whether it ended at one."""
    reached = tuning.bounds_reached
    rows = [
        (
            item.path,
            *map(item.place.quote, (item.before, tuning.after.gains[item.path], item.minimum, item.maximum)),
            f"at its {reached[item.path]}" if item.path in reached else "",
        )
        for item in tuning.problem.searched
    ]
    return Table(tuple(map(Column, ("gain", "before", "after", "minimum", "maximum", ""))), tuple(rows))


def _metrics(tuning: Tuning) -> Table:
    """Return a row for each metric of the goals and constraints."""
    spread = tuning.problem.spread
    head: tuple[str, ...] = ("metric", "before", "after", "constraint")
    if spread is not None:
        fresh = ("before, fresh draws", "after, fresh draws")
        head = ("metric", f"before ({spread.measure})", "after", *fresh, "constraint", "before, nominal")
        head = (*head, "after, nominal")
    rows = [_metric_row(tuning, name) for name in tuning.problem.metrics]
    return Table(tuple(map(Column, head)), tuple(rows))


def remarks(tuning: Tuning) -> list[str]:
    """Return how the search went and what it leaves open."""
    problem, starts = tuning.problem, tuning.starts
    settled = sum(start.is_settled for start in starts)
    said = [
        f"{len(starts)} start{'' if len(starts) == 1 else 's'}, {sum(start.candidates for start in starts):,} "
        f"candidates, {tuning.runs:,} runs; {settled} of {len(starts)} converged before the maximum number of "
        "generations"
    ]
    for path, bound in tuning.bounds_reached.items():
        said.append(
            f"{path} ended at its {bound}: a better value may lie beyond; widen the bounds if the device allows it"
        )
    apart = agreement(starts)
    if apart > _DIFFERENT:
        said.append(
            f"starts whose objectives agree within 1 % differ by up to {100.0 * apart:.0f} % of the range between "
            "the bounds: the objective does not determine the gains uniquely"
        )
    spread = problem.spread
    if spread is not None:
        over = f"study '{spread.study}'" if spread.study else "the sensor noise"
        said.append(
            f"every candidate ran over the same {spread.draws} draws of {over}; 'fresh' is over {FRESH_DRAWS:,} "
            "draws that the search did not use"
        )
    fractions = ", ".join(f"{name} {fraction_text(fraction)}" for name, fraction in tuning.after.noise.items())
    said += (
        [f"fraction of the variance over the fresh draws that is due to sensor noise: {fractions}"] if fractions else []
    )
    return [*said, *(f"violated on fresh draws: {text}" for text in _violations_on_fresh(tuning))]


def _violations_on_fresh(tuning: Tuning) -> list[str]:
    """Return what the result breaks over fresh draws: constraints, and runs that fail."""
    after = tuning.after
    values, lacking = after.fresh, after.without_value[1]
    broken = [
        f"{item.metric} {_limit(item)}, it is {_number(item.metric, values[item.metric])}"
        for item in tuning.problem.constraints
        if item.metric in values and not keeps(item, values[item.metric])
    ]
    return [*broken, *([f"{percentage(lacking, 2)} of the runs fail or lack a metric"] if values and lacking else [])]


def _verb(problem: Problem) -> str:
    """Return the command, and the function, that runs the scenario once."""
    return "simulate" if worn_kind(problem.scenario) is None else "walk"


def _options(tuning: Tuning) -> str:
    """Return the gains as options of a command."""
    return " ".join(f'--set "{line}"' for line in (*tuning.problem.overrides, *tuning.lines))


def _overrides(tuning: Tuning) -> str:
    """Return the gains for a command line, a study file and Python."""
    lines = (*tuning.problem.overrides, *tuning.lines)
    listed, verb = ", ".join(f'"{line}"' for line in lines), _verb(tuning.problem)
    given = "" if verb == "simulate" else "overrides="
    return (
        f"# {verdict(tuning)}\n\n# on the command line\n{_options(tuning)}\n\n# in a study file\noverrides = "
        f"[{listed}]\n\n# in Python\nppafo.{verb}({tuning.problem.scenario.name!r}, {given}[{listed}])\n"
    )


def _data(tuning: Tuning) -> dict[str, Any]:
    problem = tuning.problem
    return {
        "tuning": problem.name,
        "scenario": problem.scenario.name,
        "verdict": verdict(tuning),
        "is_feasible": tuning.after.is_feasible,
        "overrides": [*problem.overrides, *tuning.lines],
        "bounds_reached": dict(tuning.bounds_reached),
        "scales": dict(tuning.scales),
        "goals": plain(list(problem.goals)),
        "constraints": plain(list(problem.constraints)),
        "robust": None
        if problem.spread is None
        else {"study": problem.spread.study or None, "measure": problem.spread.measure},
        "effort": plain(problem.effort),
        "before": _setting_data(tuning.before),
        "after": _setting_data(tuning.after),
        "starts": [plain(start) for start in tuning.starts],
        "runs": tuning.runs,
        "remarks": remarks(tuning),
    }


def _metric_row(tuning: Tuning, name: str) -> tuple[str, ...]:
    sides = (tuning.before, tuning.after)
    limits = ", ".join(_limit(item) for item in tuning.problem.constraints if item.metric == name)
    first = [title_with_unit(name, metric_quantity(name)), *(_number(name, side.values.get(name)) for side in sides)]
    if tuning.problem.spread is None:
        return (*first, limits)
    nominal = [side.result.metrics.get(name) for side in sides]
    fresh = [_number(name, side.fresh.get(name)) for side in sides]
    return (*first, *fresh, limits, *(_number(name, None if item is None else item.value) for item in nominal))


def _number(name: str, value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{display_value(value, metric_quantity(name)):.4g}"


def _limit(item: Constraint) -> str:
    return f"at {'most' if item.is_most else 'least'} {item.text}"


def _setting_data(setting: Setting) -> dict[str, Any]:
    return {
        "gains": plain(setting.gains),
        "values": plain(setting.values),
        "fresh": plain(setting.fresh),
        "objective": setting.objective,
        "violation": setting.violation[0],
        "share_without_value": setting.without_value[0],
        "fresh_violation": setting.violation[1],
        "fresh_share_without_value": setting.without_value[1],
        "torque_ceiling": plain(setting.ceiling),
        "share_of_noise": {name: plain(fraction) for name, fraction in setting.noise.items()},
        "metrics": {name: plain(metric) for name, metric in setting.result.metrics.items()},
    }
