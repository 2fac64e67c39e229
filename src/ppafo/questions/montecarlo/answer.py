"""The answer of a Monte Carlo estimate: the verdict, its remarks, and the trace of looks."""

from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import change_text, display_unit, display_value
from ppafo.answers.shown_metrics import metric_quantity
from ppafo.questions.montecarlo.estimate import Look, MonteCarlo
from ppafo.questions.montecarlo.figure import monte_carlo_figure
from ppafo.simulation.document import plain
from ppafo.studies.intervals import fraction_text

_HEAD = ("draws", "without value", "estimate", "low", "high", "width", "")
_CAPTION = "Left: estimate and interval at each look; grey: the target width. Right: the values of all draws."


def answer_of(estimate: MonteCarlo) -> Answer:
    """Return the answer of an estimate; it has passed where the interval became narrow enough."""
    title = f"{estimate.statistic.label} of {estimate.metric}"
    table = Table(tuple(map(Column, _HEAD)), tuple(tuple(row) for row in look_rows(estimate)))
    figure = Figure("trace", _CAPTION, lambda: monte_carlo_figure(estimate))
    return Answer(
        name="montecarlo",
        kicker="Monte Carlo",
        title=title[:1].upper() + title[1:],
        lead=(verdict(estimate), *remarks(estimate)),
        sections=(Section("Trace", (policy(estimate),), table, figure=figure),),
        data=_data(estimate),
        passed=estimate.is_met,
    )


def verdict(estimate: MonteCarlo) -> str:
    """Return the result in a sentence."""
    interval, rule = estimate.last.interval, estimate.rule
    numbers = [_level(estimate, value) for value in (interval.value, interval.low, interval.high)]
    is_narrow = rule.is_narrow(interval)
    ending = "" if is_narrow else f"; the target width was not reached with the maximum of {rule.maximum:,} draws"
    what = "" if estimate.statistic.unit == "-" else f" {display_unit(metric_quantity(estimate.metric))}"
    return (
        f"{estimate.statistic.label} of {estimate.metric}: {numbers[0]} [{numbers[1]}, {numbers[2]}]{what} "
        f"after {estimate.last.draws:,} draws, {100.0 * rule.confidence:g} % confidence{ending}"
    )


def remarks(estimate: MonteCarlo) -> list[str]:
    """Return what the number must not be read without: draws that decide alone, and noise."""
    said = []
    last = estimate.last
    if not last.is_carried:
        said.append(
            f"do not trust this interval: the mean has an effective sample size of {last.effective_size:.3g} of "
            f"{last.draws - last.missing:,} draws, so that the true value lies outside more often than stated; request "
            "a quantile or a probability"
        )
    if estimate.noise is not None:
        said.append(f"sensor noise causes {fraction_text(estimate.noise)} of the variance over the draws")
    return said


def policy(estimate: MonteCarlo) -> str:
    """Return the target width, what corrects for the looks, and what was left out."""
    rule = estimate.rule
    width = f"{100.0 * rule.width:g} % of the value" if rule.is_relative else _difference(estimate, rule.width)
    return (
        f"target width: {width}; at most {len(rule.sizes)} looks at doubling numbers of draws, each with "
        f"{100.0 * rule.confidence_of_look:.4g} % confidence (Bonferroni), so that all of them hold "
        f"simultaneously; {estimate.last.missing:,} draws have no value and are left out"
    )


def look_rows(estimate: MonteCarlo) -> list[list[str]]:
    """Return a row for each look."""
    return [_row(estimate, look) for look in estimate.looks]


def _data(estimate: MonteCarlo) -> dict[str, Any]:
    return {
        "metric": estimate.metric,
        "statistic": estimate.statistic.label,
        "unit": estimate.statistic.unit,
        "is_met": estimate.is_met,
        "draws": estimate.last.draws,
        "failed": estimate.outcomes.failures,
        "interval": plain(estimate.last.interval),
        "remarks": remarks(estimate),
        "share_of_noise": None if estimate.noise is None else plain(estimate.noise),
        "seed": estimate.seed,
        "rule": {**plain(estimate.rule), "looks": len(estimate.rule.sizes), "correction": "Bonferroni"},
        "looks": [plain(look) for look in estimate.looks],
    }


def _row(estimate: MonteCarlo, look: Look) -> list[str]:
    interval = look.interval
    met = "narrow enough" if estimate.rule.is_narrow(interval) else ""
    met = met if look.is_carried else f"{met}{', but ' if met else ''}its effective sample size is small"
    levels = [_level(estimate, value) for value in (interval.value, interval.low, interval.high)]
    return [f"{look.draws:,}", f"{look.missing:,}", *levels, _difference(estimate, interval.width), met]


def _level(estimate: MonteCarlo, value: float) -> str:
    quantity = "" if estimate.statistic.unit == "-" else metric_quantity(estimate.metric)
    return f"{display_value(value, quantity):.5g}"


def _difference(estimate: MonteCarlo, value: float) -> str:
    if estimate.statistic.unit == "-" or not _finite(value):
        return f"{value:.3g}"
    return change_text(value, metric_quantity(estimate.metric))


def _finite(value: float) -> bool:
    return abs(value) < float("inf")
