"""Report of an estimated statistic: table and plot of the interim estimates, histogram of the values."""

import math
from functools import partial

import numpy as np

from ppafo.analyses.sweep.statistic_kind import FEWEST_SEEN, FURTHEST_UNSEEN, Statistic
from ppafo.analyses.sweep.stopping import InterimEstimate, StatisticEstimate, StoppingRule
from ppafo.report.finding import Finding, Section, columns_of
from ppafo.report.kind import ConfidenceInterval, Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import GREY, VERMILION
from ppafo.studies.distributions import Floats
from ppafo.studies.intervals import fraction_text

_RULE_OF_THREE = 3.0
"""Numerator of the rule of three: 3 / n bounds the probability of an event missing in n draws (95 %)."""
_ENDS = ("estimate", "low", "high")
"""Column heads of an estimate and the ends of its interval."""
_MAXIMUM_BINS = 80
"""Largest number of bins of the histogram."""
_CAPTION = "Left: estimate and interval at each interim look; grey: target width. Right: values of all draws."


def kind_of(metric: str, statistic: Statistic) -> Kind:
    """Return label, unit and format of a statistic: of a probability, or of the metric."""
    return Kind("Probability", form=".5g") if statistic.unit == "-" else of_metric(metric, ".5g")


def remarks_on(
    last: InterimEstimate, values: Floats, statistic: Statistic, kind: Kind, noise: ConfidenceInterval | None
) -> list[str]:
    """Return remarks on estimates that few draws dominate, on values not drawn, and on sensor noise."""
    sentences = []
    are_equal = values.size > 0 and float(np.ptp(values)) == 0.0
    known = last.draws - last.missing
    if not last.is_carried and are_equal:
        sentences.append(
            f"do not trust this interval: all {known:,} values are equal, so the size of a rare deviation is unknown; "
            f"use at least {FEWEST_SEEN:,} draws"
        )
    elif not last.is_carried:
        sentences.append(
            f"do not trust this interval: the mean has an effective sample size of {last.effective_size:.3g} of "
            f"{known:,} draws, so the true value lies outside more often than stated; request a quantile or a "
            "probability"
        )
    if statistic.is_of_replicates and known:
        share, furthest = _RULE_OF_THREE / known, FURTHEST_UNSEEN * float(np.std(values))
        moved = (
            f"an outcome up to {FURTHEST_UNSEEN:g} standard deviations, {kind.change(furthest)}, from the mean would "
            f"shift the mean by up to {kind.change(last.unseen)}, which the target width includes"
        )
        if are_equal:
            moved = f"an outcome at a distance d from the mean would shift the mean by up to {share:.2g} d"
        sentences.append(
            f"outcomes with a probability below {100.0 * share:.2g} % may be missing from these draws (95 % "
            f"confidence): {moved}"
        )
    if noise is not None:
        sentences.append(f"sensor noise causes {fraction_text(noise)} of the variance over the draws")
    return sentences


def finding_of(estimated: StatisticEstimate, statistic: Statistic, rule: StoppingRule) -> Finding[StatisticEstimate]:
    """Return an estimate as a finding: sentence, table and plot of the interim estimates, histogram of the values."""
    kind, looks = kind_of(estimated.metric, statistic), estimated.looks
    unit = kind.shown_unit if kind.quantity else ""
    ending = ""
    if not rule.is_narrow(looks[-1]):
        ending = f"; the target width was not reached with the maximum of {rule.maximum:,} draws"
    elif statistic.is_of_replicates and estimated.draws < FEWEST_SEEN:
        ending = f"; a mean needs at least {FEWEST_SEEN:,} draws, and the maximum is {rule.maximum:,}"
    verdict = (
        f"{estimated.statistic} of {estimated.metric}: {kind.interval(estimated.interval)} {unit}".rstrip()
        + f" after {estimated.draws:,} draws, {100.0 * rule.confidence:g} % confidence{ending}"
    )
    width = f"{100.0 * rule.width:g} % of the value" if rule.is_relative else kind.change(rule.width)
    policy = (
        f"target width: {width}; at most {len(rule.sizes)} looks at doubling numbers of draws, each with "
        f"{100.0 * rule.confidence_of_look:.4g} % confidence (Bonferroni), so that all intervals hold simultaneously; "
        f"{looks[-1].missing:,} draws have no value and are left out"
    )
    rows = []
    for look in looks:
        interval = look.interval
        met = ["narrow enough"] if rule.is_narrow(look) else []
        if not look.is_carried:
            met.append("its effective sample size is small")
        ends = (kind.number(value) for value in (interval.value, interval.low, interval.high))
        wide = kind.change(interval.width) if math.isfinite(interval.width) else f"{interval.width:.3g}"
        rows.append((f"{look.draws:,}", f"{look.missing:,}", *ends, wide, ", but ".join(met)))
    further = [
        (of_metric(name).title, f"{mean.draws:,}", *map(of_metric(name).number, (mean.value, mean.low, mean.high)))
        for name, mean in estimated.also.items()
    ]
    also = Section(
        "Further metrics",
        columns_of(("mean over the same draws", "with a value", *_ENDS), further),
        said=[f"Each with {100.0 * rule.confidence_of_look:.4g} % confidence, of the draws that have a value."],
    )
    title = f"{estimated.statistic} of {estimated.metric}"
    return Finding(
        name="statistic",
        command="sweep",
        kicker="Statistic of a study",
        title=title[:1].upper() + title[1:],
        said=(verdict, *estimated.remarks),
        parts=(
            *([also] if further else []),
            Section(
                "Trace",
                columns_of(("draws", "without value", *_ENDS, "width", ""), rows),
                said=[policy],
                panels=partial(_panels, estimated, kind, rule, statistic.threshold),
                name="trace",
                caption=_CAPTION,
                across=2,
                size=(3.0, 2.7),
            ),
        ),
        found=estimated,
        passed=estimated.is_met,
    )


def _panels(estimated: StatisticEstimate, kind: Kind, rule: StoppingRule, threshold: float | None) -> list[Panel]:
    """Return panels of the interim estimates with intervals and target width, and of the values of all draws.

    The histogram marks the estimate, or for a probability its ``threshold`` [SI].
    """
    draws = np.array([look.draws for look in estimated.looks])
    values = np.array([(look.interval.value, look.interval.low, look.interval.high) for look in estimated.looks]).T
    known, last = np.isfinite(values).all(axis=0), float(values[0, -1])
    reach = 0.5 * rule.width * (abs(last) if rule.is_relative else 1.0)
    label = f"{estimated.statistic[:1].upper()}{estimated.statistic[1:]}"
    trace = (
        Mark("upright", draws[known], values[1:, known], style={"linewidth": 3, "alpha": 0.45}),
        Mark("line", draws, values[0], style={"marker": "o", "markersize": 5, "linewidth": 1.0}),
        Mark("strip", (), (last - reach, last + reach), colour=GREY, style={"alpha": 0.18}),
    )
    bins = min(_MAXIMUM_BINS, max(10, int(np.sqrt(estimated.values.size))))
    counts, edges = np.histogram(estimated.values, bins)
    mark = last if threshold is None else threshold
    histogram = (Mark("bars", edges, counts), Mark("at", mark, colour=VERMILION, style={"linewidth": 1.4}))
    return [
        Panel(Kind("Draws"), kind, trace, label, then=lambda axes: axes.set_xscale("log", base=2)),
        Panel(of_metric(estimated.metric), Kind("Draws"), histogram, f"{estimated.values.size:,} values"),
    ]
