"""A Monte Carlo estimate as text, as JSON and as files."""

from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.reporting.analysis_page import Section, analysis_page
from ppafo.reporting.metric_numbers import metric_difference, metric_level, metric_unit
from ppafo.reporting.monte_carlo_figure import monte_carlo_figure
from ppafo.reporting.style import rendered
from ppafo.reporting.text_table import text_table
from ppafo.simulation.document import plain
from ppafo.studies.monte_carlo.estimate import Look, MonteCarlo
from ppafo.studies.uncertainty.intervals import Interval

JSON, TEXT, REPORT = "monte-carlo.json", "monte-carlo.txt", "report.html"
FILES = ("trace.png", "trace.svg", JSON, TEXT, REPORT)
_HEAD = ("draws", "without value", "estimate", "low", "high", "width", "")


def monte_carlo_text(estimate: MonteCarlo) -> list[str]:
    """Return the verdict and the trace of looks."""
    return [verdict(estimate), *remarks(estimate), policy(estimate), "", *text_table(_HEAD, look_rows(estimate))]


def verdict(estimate: MonteCarlo) -> str:
    """Return the result in a sentence."""
    interval, rule = estimate.last.interval, estimate.rule
    numbers = [_level(estimate, value) for value in (interval.value, interval.low, interval.high)]
    ending = "" if rule.is_narrow(interval) else f"; not narrow enough after all {rule.most:,} draws that were allowed"
    what = "" if estimate.statistic.unit == "-" else f" {metric_unit(estimate.metric)}"
    return (
        f"{estimate.statistic.told} of {estimate.metric}: {numbers[0]} [{numbers[1]}, {numbers[2]}]{what} "
        f"after {estimate.last.draws:,} draws, {100.0 * rule.confidence:g} % confidence{ending}"
    )


def remarks(estimate: MonteCarlo) -> list[str]:
    """Return what the number must not be read without: draws that decide alone, and noise."""
    said = []
    last = estimate.last
    if not last.is_carried:
        said.append(
            f"do not trust this interval: as few as {last.carrying:.3g} of {last.draws - last.missing:,} draws carry "
            "the mean, so that the truth is outside more often than it says; ask for a quantile or a probability"
        )
    if estimate.noise is not None:
        said.append(f"noise of the sensors makes {shown_share(estimate.noise)} of the variance over the draws")
    return said


def shown_share(share: Interval) -> str:
    """Return a share with its interval in percent."""
    return f"{100.0 * share.value:.3g} % [{100.0 * share.low:.3g}, {100.0 * share.high:.3g}]"


def policy(estimate: MonteCarlo) -> str:
    """Return which width was asked for, what corrects for the looks, and what was left out."""
    rule = estimate.rule
    width = f"{100.0 * rule.width:g} % of the value" if rule.is_relative else _difference(estimate, rule.width)
    return (
        f"width asked for: {width}; at most {len(rule.sizes)} looks at doubling numbers of draws, each with "
        f"{100.0 * rule.confidence_of_look:.4g} % confidence (Bonferroni), so that all of them hold at once; "
        f"{estimate.last.missing:,} draws have no value and are left out"
    )


def look_rows(estimate: MonteCarlo) -> list[list[str]]:
    """Return a row for each look."""
    return [_row(estimate, look) for look in estimate.looks]


def monte_carlo_document(estimate: MonteCarlo) -> dict[str, Any]:
    """Return the estimate as plain data, in SI units."""
    return {
        "metric": estimate.metric,
        "statistic": estimate.statistic.told,
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


def monte_carlo_files(estimate: MonteCarlo) -> dict[str, bytes]:
    """Return everything that ``ppafo montecarlo`` writes, by name."""
    drawn = rendered(monte_carlo_figure(estimate), ("png", "svg"))
    caption = "Left: estimate and interval at each look; grey: the width asked for. Right: the values that were drawn."
    sections = [
        Section("Trace", [policy(estimate)], _HEAD, look_rows(estimate), drawn["svg"], caption),
    ]
    title = f"{estimate.statistic.told} of {estimate.metric}"
    text = "\n".join(monte_carlo_text(estimate))
    return {
        **{f"trace.{kind}": content for kind, content in drawn.items()},
        JSON: f"{json_text(monte_carlo_document(estimate))}\n".encode(),
        TEXT: f"{text}\n".encode(),
        REPORT: analysis_page(
            "Monte Carlo", title[:1].upper() + title[1:], [verdict(estimate), *remarks(estimate)], sections
        ),
    }


def _row(estimate: MonteCarlo, look: Look) -> list[str]:
    interval = look.interval
    met = "narrow enough" if estimate.rule.is_narrow(interval) else ""
    met = met if look.is_carried else f"{met}{', but ' if met else ''}few draws carry it"
    levels = [_level(estimate, value) for value in (interval.value, interval.low, interval.high)]
    return [f"{look.draws:,}", f"{look.missing:,}", *levels, _difference(estimate, interval.width), met]


def _level(estimate: MonteCarlo, value: float) -> str:
    return (
        f"{value if estimate.statistic.unit == '-' or not _finite(value) else metric_level(estimate.metric, value):.5g}"
    )


def _difference(estimate: MonteCarlo, value: float) -> str:
    if estimate.statistic.unit == "-" or not _finite(value):
        return f"{value:.3g}"
    return f"{metric_difference(estimate.metric, value):.3g} {metric_unit(estimate.metric)}".rstrip()


def _finite(value: float) -> bool:
    return abs(value) < float("inf")
