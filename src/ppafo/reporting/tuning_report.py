"""A tuning as text, as JSON and as files: before and after, what was searched, and lines to paste."""

import math
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.reporting.analysis_page import Section, analysis_page
from ppafo.reporting.metric_numbers import metric_level, metric_unit
from ppafo.reporting.monte_carlo_report import shown_share
from ppafo.reporting.style import rendered
from ppafo.reporting.text_table import text_table
from ppafo.reporting.tuning_figure import search_figure, task_figure
from ppafo.simulation.document import plain
from ppafo.studies.tuning.judging import keeps
from ppafo.studies.tuning.problem import Constraint
from ppafo.studies.tuning.search import agreement
from ppafo.studies.tuning.study import FRESH_DRAWS, Setting, Tuning

JSON, TEXT, OVERRIDES, REPORT = "tuning.json", "tuning.txt", "overrides.txt", "report.html"
FILES = ("task.png", "task.svg", "search.png", "search.svg", JSON, TEXT, OVERRIDES, REPORT)
_GAINS_HEAD = ("gain", "before", "after", "minimum", "maximum", "")
_DIFFERENT = 0.1
"""Share of the way between the bounds from which on two starts are said to have ended in different places."""


def tuning_text(tuning: Tuning) -> list[str]:
    """Return verdict, gains, metrics before and after, remarks, and the lines to paste."""
    return [
        verdict(tuning),
        "",
        *text_table(_GAINS_HEAD, gain_rows(tuning)),
        "",
        *text_table(metric_head(tuning), metric_rows(tuning)),
        "",
        *remarks(tuning),
        "",
        f"ppafo simulate {tuning.problem.scenario.name} {pasted(tuning)}",
    ]


def verdict(tuning: Tuning) -> str:
    """Return the result in a sentence."""
    before, after, name = tuning.before, tuning.after, tuning.problem.name
    if not after.is_feasible_in_search:
        broken = f"the best found break them by {100.0 * after.violation[0]:.3g} % of the limits"
        return f"{name}: no gains between the bounds keep all constraints; {broken}{_by_ceiling(tuning)}"
    if not after.is_feasible:
        return (
            f"{name}: the gains found keep all constraints over the draws of the search alone, not over "
            f"{FRESH_DRAWS:,} fresh ones{_by_ceiling(tuning)}"
        )
    if not before.is_feasible:
        return (
            f"{name}: the gains found keep all constraints, which those before did not; objective {after.objective:.4g}"
        )
    if after.objective >= before.objective:
        return f"{name}: nothing better than the gains before was found between the bounds"
    change = (after.objective - before.objective) / abs(before.objective) if before.objective else math.nan
    return f"{name}: objective {before.objective:.4g} before, {after.objective:.4g} after ({100.0 * change:+.3g} %)"


def _by_ceiling(tuning: Tuning) -> str:
    """Return that the torque ceiling is why, where the draws below it are what breaks the constraints."""
    ceiling = tuning.after.ceiling
    if not ceiling.explains:
        return ""
    where = "" if tuning.problem.spread is None else f" in {100.0 * ceiling.share:.2g} % of the draws"
    return (
        f"; the torque ceiling is the cause: the reference asks for more than the torque constant times the gauge "
        f"pressure of the supply{where}, which no gains can change"
    )


def gain_rows(tuning: Tuning) -> list[list[str]]:
    """Return a row for each searched number: before, after, bounds, and whether it ended at one."""
    reached = tuning.bounds_reached
    return [
        [
            item.path,
            item.place.shown(item.before),
            item.place.shown(tuning.after.gains[item.path]),
            item.place.shown(item.minimum),
            item.place.shown(item.maximum),
            f"at its {reached[item.path]}" if item.path in reached else "",
        ]
        for item in tuning.problem.searched
    ]


def metric_head(tuning: Tuning) -> list[str]:
    """Return the head of the table of metrics."""
    spread = tuning.problem.spread
    if spread is None:
        return ["metric", "before", "after", "constraint"]
    fresh = ["before, fresh draws", "after, fresh draws"]
    return ["metric", f"before ({spread.told})", "after", *fresh, "constraint", "before, as said", "after, as said"]


def metric_rows(tuning: Tuning) -> list[list[str]]:
    """Return a row for each metric of the goals and constraints."""
    return [_metric_row(tuning, name) for name in tuning.problem.metrics]


def remarks(tuning: Tuning) -> list[str]:
    """Return how the search went and what it leaves open."""
    problem, starts = tuning.problem, tuning.starts
    settled = sum(start.is_settled for start in starts)
    said = [
        f"{len(starts)} start{'' if len(starts) == 1 else 's'}, {sum(start.candidates for start in starts):,} "
        f"candidates, {tuning.runs:,} runs; {settled} of {len(starts)} settled before their last generation"
    ]
    for path, bound in tuning.bounds_reached.items():
        said.append(
            f"{path} ended at its {bound}: a better value may lie beyond; widen the bounds if the device allows it"
        )
    apart = agreement(starts)
    if apart > _DIFFERENT:
        said.append(
            f"starts that are as good to 1 % lie up to {100.0 * apart:.0f} % of the bounds apart: "
            "the goal leaves open which is best"
        )
    spread = problem.spread
    if spread is not None:
        over = f"study '{spread.study}'" if spread.study else "the noise of the sensors"
        said.append(
            f"every candidate ran over the same {spread.draws} draws of {over}; 'fresh' is over {FRESH_DRAWS:,} draws "
            "that the search never saw"
        )
    shares = ", ".join(f"{shown_share(share)} of that of {name}" for name, share in tuning.after.noise.items())
    said += [f"noise of the sensors makes, of the variance over the fresh draws, {shares}"] if shares else []
    return [*said, *(f"broken on fresh draws: {text}" for text in broken_on_fresh(tuning))]


def broken_on_fresh(tuning: Tuning) -> list[str]:
    """Return what the result breaks over fresh draws: constraints, and runs that fail."""
    after = tuning.after
    values, lacking = after.fresh, after.without_value[1]
    broken = [
        f"{item.metric} {_limit(item)}, it is {metric_level(item.metric, values[item.metric]):.4g}"
        for item in tuning.problem.constraints
        if item.metric in values and not keeps(item, values[item.metric])
    ]
    return [*broken, *([f"{100.0 * lacking:.2g} % of the runs fail or lack a metric"] if values and lacking else [])]


def pasted(tuning: Tuning) -> str:
    """Return the gains as options of a command."""
    return " ".join(f'--set "{line}"' for line in (*tuning.problem.overrides, *tuning.lines))


def overrides_text(tuning: Tuning) -> str:
    """Return the gains for a command line, a study file and Python."""
    lines = (*tuning.problem.overrides, *tuning.lines)
    listed = ", ".join(f'"{line}"' for line in lines)
    return (
        f"# {verdict(tuning)}\n\n# on the command line\n{pasted(tuning)}\n\n"
        f"# in a study file\noverrides = [{listed}]\n\n"
        f"# in Python\nppafo.simulate({tuning.problem.scenario.name!r}, [{listed}])\n"
    )


def tuning_document(tuning: Tuning) -> dict[str, Any]:
    """Return the tuning as plain data, in SI units."""
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
        else {"study": problem.spread.study or None, "measure": problem.spread.told},
        "effort": plain(problem.effort),
        "before": _setting_document(tuning.before),
        "after": _setting_document(tuning.after),
        "starts": [plain(start) for start in tuning.starts],
        "runs": tuning.runs,
        "remarks": remarks(tuning),
    }


def tuning_files(tuning: Tuning) -> dict[str, bytes]:
    """Return everything that ``ppafo tune`` writes, by name."""
    figures = {"task": task_figure(tuning), "search": search_figure(tuning)}
    drawn = {name: rendered(figure, ("png", "svg")) for name, figure in figures.items()}
    text = "\n".join(tuning_text(tuning))
    return {
        **{f"{name}.{kind}": content for name, kinds in drawn.items() for kind, content in kinds.items()},
        JSON: f"{json_text(tuning_document(tuning))}\n".encode(),
        TEXT: f"{text}\n".encode(),
        OVERRIDES: overrides_text(tuning).encode(),
        REPORT: _page(tuning, {name: kinds["svg"] for name, kinds in drawn.items()}),
    }


def _page(tuning: Tuning, figures: dict[str, bytes]) -> bytes:
    problem = tuning.problem
    sections = [
        Section("Gains", (), _GAINS_HEAD, gain_rows(tuning), code=pasted(tuning).replace(" --set", "\n--set")),
        Section(
            "Before and after",
            (),
            metric_head(tuning),
            metric_rows(tuning),
            figures["task"],
            "The device as it is said to be.",
        ),
        Section(
            "The search",
            remarks(tuning),
            figure=figures["search"],
            caption="Left: the best objective so far in each start. Right: where the gains lie between their bounds.",
        ),
    ]
    lead = [verdict(tuning), *([problem.description] if problem.description else [])]
    return analysis_page("Tuning", problem.name, lead, sections)


def _metric_row(tuning: Tuning, name: str) -> list[str]:
    unit = metric_unit(name)
    sides = (tuning.before, tuning.after)
    limits = [_limit(item) for item in tuning.problem.constraints if item.metric == name]
    row = [f"{name} ({unit})" if unit else name, *(_number(name, side.values.get(name)) for side in sides)]
    if tuning.problem.spread is None:
        return [*row, ", ".join(limits)]
    nominal = [side.result.metrics.get(name) for side in sides]
    fresh = [_number(name, side.fresh.get(name)) for side in sides]
    return [*row, *fresh, ", ".join(limits), *(_number(name, None if item is None else item.value) for item in nominal)]


def _number(name: str, value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{metric_level(name, value):.4g}"


def _limit(item: Constraint) -> str:
    return f"at {'most' if item.is_most else 'least'} {item.text}"


def _setting_document(setting: Setting) -> dict[str, Any]:
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
        "share_of_noise": {name: plain(share) for name, share in setting.noise.items()},
        "metrics": {name: plain(metric) for name, metric in setting.result.metrics.items()},
    }
