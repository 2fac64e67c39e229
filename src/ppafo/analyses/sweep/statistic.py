"""A statistic over the distributions of a study, drawn until its interval is narrow enough.

A mean is estimated from randomised Sobol replicates, which know the mean of a smooth function far better than as many
independent draws; its interval is never narrower than theirs, as nobody knows beforehand that no rare value decides.
The intervals of quantiles and probabilities are exact for independent draws, and get those.

Looking repeatedly and stopping at a favourable interval makes an ordinary interval too narrow. Here the number of
looks is bounded before the first draw, and each look takes an equal part of the allowed error (Bonferroni's
inequality): with the stated confidence all intervals of the trace hold at once, the one at which it stopped too.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.arguments import Confidence, Count, MaximumFailed, Name, Overrides, Seed, Threads, checked
from ppafo.documents.json_text import plain
from ppafo.errors import StudyError, UnitError, refused_as
from ppafo.metrics import METRICS
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report
from ppafo.report.finding import Finding, Part, columns_of
from ppafo.report.kind import Interval, Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import GREY, VERMILION
from ppafo.studies.distributions import (
    Floats,
    effective_sample_size,
    floored_interval,
    fraction_interval,
    fraction_text,
    is_carried,
    noise_interval,
    quantile_interval,
)
from ppafo.studies.draws import (
    CONFIDENCE,
    FEWEST_DRAWS,
    MAXIMUM_DRAWS,
    REPLICATES,
    Columns,
    Uncertainty,
    atmosphere_of,
    check_fraction,
    check_metrics,
    difference_of,
    drawn_in,
    level_of,
)
from ppafo.studies.sampling import with_new_noise
from ppafo.studies.study import Study
from ppafo.study.runs import Runs, Tally
from ppafo.units import number_text, parse_quantity
from ppafo.units.shown import shown_in

GRAMMAR = "'mean', 'quantile 0.95', 'probability above VALUE' or 'probability below VALUE'"
_QUANTILE = re.compile(r"quantile\s+([0-9]*\.?[0-9]+)")
_PROBABILITY = re.compile(r"probability\s+(above|below)\s+(\S.*)")


@dataclass(frozen=True, slots=True)
class Statistic:
    """A number about a distribution: in words that ``parse_statistic`` reads, the SI unit of its interval ('-': plain).

    ``estimate`` takes the values (draws,) of the metric [SI], nan where there is none, and a confidence. Means come
    from replicates, whose interval rests on the central limit theorem; intervals of all else are exact. ``threshold``
    [SI] is what a probability is about.
    """

    label: str
    unit: str
    estimate: Callable[[Floats, float], Interval] = field(compare=False)
    is_of_replicates: bool = False
    threshold: float | None = None

    def columns(self, uncertainty: Uncertainty, first: int, count: int, seed: int) -> Columns:
        """Return the draws from number ``first`` on that its interval is made for: Sobol replicates, or independent."""
        draw = uncertainty.replicated_columns if self.is_of_replicates else uncertainty.random_columns
        return draw(first, count, seed)

    def effective_size(self, values: Floats) -> float:
        """Return how many of the values determine the estimate; all where its interval is exact.

        None of them, for a mean, while all are equal and few: one that comes later may lie anywhere.
        """
        known = values[np.isfinite(values)]
        if self.is_of_replicates and 0 < known.size < FEWEST_SEEN and float(np.ptp(known)) == 0.0:
            return 0.0
        return effective_sample_size(known) if self.is_of_replicates else float(known.size)


def mean_of(unit: str) -> Statistic:
    """Return the statistic of a sweep that is the mean of a metric, in the unit of the metric."""
    return Statistic("mean", unit, _mean_interval, True)


def quantile_of(unit: str, fraction: float) -> Statistic:
    """Return the value of a metric below which a fraction of the runs lies."""
    return Statistic(f"quantile {fraction:g}", unit, partial(_quantile, fraction))


def _mean_interval(values: Floats, level: float) -> Interval:
    return floored_interval(values, REPLICATES, level)


def _quantile(fraction: float, values: Floats, level: float) -> Interval:
    return quantile_interval(values[np.isfinite(values)], fraction, level)


def _probability(threshold: float, is_above: bool, values: Floats, level: float) -> Interval:
    # Strictly beyond: a metric that counts may be exactly at the threshold in many runs.
    known = values[np.isfinite(values)]
    hits = known > threshold if is_above else known < threshold
    return fraction_interval(int(np.count_nonzero(hits)), known.size, level)


def probability_of(threshold: float, is_above: bool, text: str) -> Statistic:
    """Return the probability that a metric is above (or else below) a value [SI], written as ``text``."""
    words = f"probability {'above' if is_above else 'below'} {text}"
    return Statistic(words, "-", partial(_probability, threshold, is_above), threshold=threshold)


def parse_statistic(text: str, metric: str, atmosphere: float | None) -> Statistic:
    """Return the statistic of a metric that a text names; StudyError where it names none.

    A gauge pressure counts from ``atmosphere`` [Pa absolute], as in ``studies.draws.level_of``.
    """
    words, unit = text.strip(), METRICS[metric].unit
    if words == "mean":
        return mean_of(unit)
    quantile = _QUANTILE.fullmatch(words)
    if quantile is not None and 0.0 < float(quantile[1]) < 1.0:
        return quantile_of(unit, float(quantile[1]))
    probability = _PROBABILITY.fullmatch(words)
    if probability is not None:
        threshold = level_of(probability[2], metric, f"statistic '{text}'", atmosphere)
        return probability_of(threshold, probability[1] == "above", probability[2])
    raise StudyError(f"statistic '{text}' is not known; give {GRAMMAR}, with a fraction above 0 and below 1")


FEWEST_SEEN = 3000
"""Draws from which a mean is believed: one in a thousand that differs would have come (95 %)."""
_RULE_OF_THREE = 3.0
"""Over the draws: probability of an event that 95 of 100 such sets of draws show."""


@dataclass(frozen=True, slots=True)
class StoppingRule:
    """When to stop: at an interval of this width, or after ``maximum`` draws.

    ``width`` is in the SI unit of the statistic, or a fraction of its value where ``is_relative``. The first look is
    after ``first`` draws, each later one after twice as many; ``confidence`` holds for all looks together. Draws are
    refused where more than the fraction ``maximum_failed`` of them fails.
    """

    width: float
    is_relative: bool
    first: int = 256
    maximum: int = 2**20
    confidence: float = 0.95
    maximum_failed: float = 0.01

    def __post_init__(self) -> None:
        """Refuse a rule that can never be met or that asks for nothing."""
        if not (math.isfinite(self.width) and self.width > 0.0):
            raise StudyError(f"width = {self.width!r}: must be more than 0")
        if not FEWEST_DRAWS <= self.first <= self.maximum <= MAXIMUM_DRAWS:
            raise StudyError(
                f"first = {self.first!r} and maximum = {self.maximum!r} draws: must be at least {FEWEST_DRAWS}, the "
                f"first not more than the maximum, and the maximum not above {MAXIMUM_DRAWS:,}"
            )
        check_fraction(self.confidence, *CONFIDENCE)
        check_fraction(self.maximum_failed, "maximum_failed")

    @property
    def sizes(self) -> tuple[int, ...]:
        """The numbers of draws at which it is looked at the interval, at most."""
        # Doubled each time: few looks have to share the allowed error, and the last takes half of all draws.
        sizes = [self.first]
        while sizes[-1] < self.maximum:
            sizes.append(min(2 * sizes[-1], self.maximum))
        return tuple(sizes)

    @property
    def confidence_of_look(self) -> float:
        """Confidence of each single look, so that all of them together keep ``confidence``."""
        return 1.0 - (1.0 - self.confidence) / len(self.sizes)

    def is_narrow(self, interval: Interval) -> bool:
        """Tell whether an interval is narrow enough."""
        return interval.width <= self.width * (abs(interval.value) if self.is_relative else 1.0)


@dataclass(frozen=True, slots=True)
class Look:
    """What was seen after some draws: how many, how many of them without a value, and the interval [SI].

    ``effective_size`` is how many of them determine the estimate: fewer than there are where a few large values decide.
    """

    draws: int
    missing: int
    interval: Interval
    effective_size: float

    @property
    def is_carried(self) -> bool:
        """Tell whether enough draws determine the estimate."""
        return is_carried(self.effective_size, self.draws - self.missing)


@dataclass(frozen=True, slots=True)
class OfMean:
    """The mean of a further metric [SI] over the same draws, with its interval, and how many draws have it."""

    draws: int
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Estimate:
    """A statistic of a metric, with its interval [SI] and the looks one after the other.

    ``is_met`` is true where the last interval is narrow enough and can be believed. ``share_of_noise`` is the fraction
    of the variance that is due to sensor noise, None where there is none; ``values`` are the metric's [SI].
    """

    metric: str
    statistic: str
    unit: str
    is_met: bool
    draws: int
    failed: int
    interval: Interval
    remarks: list[str]
    also: dict[str, OfMean]
    share_of_noise: Interval | None
    seed: int
    rule: dict[str, float | str]
    looks: list[Look]
    values: Floats = field(compare=False, repr=False)
    folder: str = field(default="", compare=False)

    def json_document(self) -> dict[str, Any]:
        """Return the numbers, and the folder in which they are written."""
        document: dict[str, Any] = plain(self)
        return document | ({"folder": self.folder} if self.folder else {})


def draw_until(
    runs: Runs,
    uncertainty: Uncertainty,
    metric: str,
    statistic: Statistic,
    rule: StoppingRule,
    seed: int,
    also: Sequence[str] = (),
) -> Finding[Estimate]:
    """Draw from one stream until the rule is met or there are no more looks.

    An interval that few draws determine is not trusted, however narrow it is: drawing continues. So does that of a mean
    until what happens once in a thousand runs would have come, or there are no more draws: no interval from draws that
    lack it could bound it.
    Runs that fail have no value: up to the fraction that the rule allows they are left out and counted, above it
    StudyError.
    """
    looks: list[Look] = []
    drawn: Columns = {}
    is_met = False
    for size in rule.sizes:
        done = looks[-1].draws if looks else 0
        columns = statistic.columns(uncertainty, done, size - done, seed)
        # Draws of the first look are kept: they are repeated with new noise to find its share of the variance.
        drawn = drawn or columns
        runs.run(columns)
        rows = runs.table
        runs.check(rows, rule.maximum_failed, "sweep --statistic", [metric])
        found = rows[metric]
        missing, interval = np.count_nonzero(~np.isfinite(found)), statistic.estimate(found, rule.confidence_of_look)
        looks.append(Look(found.size, int(missing), interval, statistic.effective_size(found)))
        # A mean is moved by what happens seldom; quantiles and probabilities are not.
        has_shown = not statistic.is_of_replicates or found.size >= min(FEWEST_SEEN, rule.maximum)
        is_met = has_shown and rule.is_narrow(interval) and looks[-1].is_carried
        if is_met:
            break
    # Failures are counted here: below, some of the same draws run again with other noise.
    failures, last, noise = runs.failures, looks[-1], None
    if uncertainty.has_noise:
        noise = noise_interval(rows[metric], runs.run(with_new_noise(drawn))[metric], rule.confidence)
    values = rows[metric][np.isfinite(rows[metric])]
    means = {}
    for name in also:
        mean = floored_interval(rows[name], REPLICATES, rule.confidence_of_look)
        means[name] = OfMean(int(np.count_nonzero(np.isfinite(rows[name]))), mean.value, mean.low, mean.high)
    estimate = Estimate(
        metric=metric,
        statistic=statistic.label,
        unit=statistic.unit,
        is_met=is_met,
        draws=last.draws,
        failed=failures,
        interval=last.interval,
        remarks=_remarks(last, values, statistic, _kind(metric, statistic), noise),
        also=means,
        share_of_noise=noise,
        seed=seed,
        rule={**plain(rule), "looks": len(rule.sizes), "correction": "Bonferroni"},
        looks=looks,
        values=values,
    )
    return _finding(estimate, statistic, rule)


DEFAULT_WIDTH = "1 %"
PROBABILITY_WIDTH = "0.02"
FIRST_DRAWS, MOST_DRAWS = 256, 2**20


@checked("study", "metric", "statistic", "width", "configuration", "overrides", "seed", "first_draws", "draws")
def estimate(
    study: Study | str | Path | Mapping[str, Any],
    *,
    metric: Name,
    statistic: Name = "mean",
    width: Name | None = None,
    also: Sequence[Name] = (),
    configuration: Name | None = None,
    first_draws: Count = FIRST_DRAWS,
    overrides: Overrides = (),
    draws: Count = MOST_DRAWS,
    seed: Seed | None = None,
    confidence: Confidence = 0.95,
    maximum_failed: MaximumFailed = 0.01,
    threads: Threads | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Estimate]:
    """Return a statistic of a metric over the distributions of a study, drawn until its interval is ``width`` wide.

    ``statistic`` is ``mean``, ``quantile 0.95`` or ``probability above 3 N m``; ``width`` a fraction of its value
    (default ``1 %``) or a difference with its unit (``0.01 N m``; for a probability a number, 0.02). Draws are
    those that the interval needs, whatever the study's sampling method: randomised Sobol replicates for a mean, else
    independent ones. ``seed`` is the study's by default. ``also`` names further metrics: means over the same draws.
    StudyError for bad input and where more than the fraction ``maximum_failed`` of the runs fails.

    ``plugins`` are modules of your own whose objects files may name, as of ``simulate``.

    >>> import ppafo
    >>> study = "torque-task-uncertainty"
    >>> print(ppafo.estimate(study, metric="rms_error", configuration="solenoid", width="5 %").said[0])
    mean of rms_error: 1.0375 [1.0317, 1.0433] N m after 4,096 draws, 95 % confidence
    """
    name_plugins(plugins)
    chosen, base, uncertainty = drawn_in(study, overrides, configuration)
    wanted = tuple(dict.fromkeys((metric, *also)))
    check_metrics(wanted, base.scenario)
    what = parse_statistic(statistic, metric, atmosphere_of(base.scenario, {*uncertainty.paths, *uncertainty.same}))
    # A probability may be 0, of which a fraction says nothing: its width is a difference.
    asked = width or (PROBABILITY_WIDTH if what.threshold is not None else DEFAULT_WIDTH)
    rule = stopping_rule(what, metric, asked, StoppingRule(1.0, False, first_draws, draws, confidence, maximum_failed))
    runs = Runs(base.scenario, wanted, Tally(rule.first, progress), uncertainty.gauge, threads)
    with shown_in(base.scenario.device.shown):
        first = chosen.sample.seed if seed is None else seed
        return draw_until(runs, uncertainty, metric, what, rule, first, wanted[1:])


def stopping_rule(statistic: Statistic, metric: str, width: str, like: StoppingRule) -> StoppingRule:
    """Return the rule with the width that a text says, else like another one."""
    text = width.strip()
    if statistic.threshold is not None:
        try:
            return replace(like, width=float(number_text(text)), is_relative=False)
        except ValueError as error:
            raise StudyError(f"width = '{text}': for a probability give a plain number, such as 0.01") from error
    if not text.endswith("%"):
        return replace(like, width=difference_of(text, metric, f"width = '{width}'"), is_relative=False)
    with refused_as(StudyError, f"width = '{text}'", UnitError):
        return replace(like, width=parse_quantity(text, ""), is_relative=True)


def _kind(metric: str, statistic: Statistic) -> Kind:
    return Kind("Probability", form=".5g") if statistic.unit == "-" else of_metric(metric, ".5g")


def _remarks(last: Look, values: Floats, statistic: Statistic, kind: Kind, noise: Interval | None) -> list[str]:
    """Return what the number must not be read without: draws that decide alone, and noise."""
    said = []
    are_equal = values.size > 0 and float(np.ptp(values)) == 0.0
    known = last.draws - last.missing
    if not last.is_carried and are_equal:
        said.append(
            f"do not trust this interval: all {known:,} values are equal, which do not show how far a rare one lies; "
            f"draw at least {FEWEST_SEEN:,}"
        )
    elif not last.is_carried:
        said.append(
            f"do not trust this interval: the mean has an effective sample size of {last.effective_size:.3g} of "
            f"{known:,} draws, so that the true value lies outside more often than stated; request a quantile or a "
            "probability"
        )
    if statistic.is_of_replicates and known:
        share, span = _RULE_OF_THREE / known, float(np.ptp(values))
        moved = (
            f"if it lay beyond the others by their range, {kind.change(span)}, the mean would move by up to "
            f"{kind.change(share * span)}, and more the further it lies"
        )
        if are_equal:
            moved = f"it would move the mean by up to {share:.2g} times its distance"
        said.append(
            f"what happens in fewer than {100.0 * share:.2g} % of the runs may be missing among these draws (95 %): "
            f"{moved}"
        )
    if noise is not None:
        said.append(f"sensor noise causes {fraction_text(noise)} of the variance over the draws")
    return said


_ENDS = ("estimate", "low", "high")
_MAXIMUM_BINS = 80
_CAPTION = "Left: estimate and interval at each look; grey: the target width. Right: the values of all draws."


def _finding(estimated: Estimate, statistic: Statistic, rule: StoppingRule) -> Finding[Estimate]:
    """Return an estimate in words, its looks as a table, the trace and the histogram of the values."""
    kind, of_values, looks = _kind(estimated.metric, statistic), of_metric(estimated.metric), estimated.looks
    unit = kind.shown_unit if kind.quantity else ""
    ending = "" if rule.is_narrow(estimated.interval) else "; the target width was not reached with the maximum of "
    ending += f"{rule.maximum:,} draws" if ending else ""
    verdict = (
        f"{estimated.statistic} of {estimated.metric}: {kind.interval(estimated.interval)} {unit}".rstrip()
        + f" after {estimated.draws:,} draws, {100.0 * rule.confidence:g} % confidence{ending}"
    )
    width = f"{100.0 * rule.width:g} % of the value" if rule.is_relative else kind.change(rule.width)
    policy = (
        f"target width: {width}; at most {len(rule.sizes)} looks at doubling numbers of draws, each with "
        f"{100.0 * rule.confidence_of_look:.4g} % confidence (Bonferroni), so that all of them hold simultaneously; "
        f"{looks[-1].missing:,} draws have no value and are left out"
    )
    rows = []
    for look in looks:
        said_of_look = ["narrow enough"] if rule.is_narrow(look.interval) else []
        said_of_look += [] if look.is_carried else ["its effective sample size is small"]
        met = ", but ".join(said_of_look)
        ends = (kind.number(value) for value in (look.interval.value, look.interval.low, look.interval.high))
        reach = kind.change(look.interval.width) if math.isfinite(look.interval.width) else f"{look.interval.width:.3g}"
        rows.append((f"{look.draws:,}", f"{look.missing:,}", *ends, reach, met))
    further = [
        (of_metric(name).title, f"{mean.draws:,}", *map(of_metric(name).number, (mean.value, mean.low, mean.high)))
        for name, mean in estimated.also.items()
    ]
    also = Part(
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
            Part(
                "Trace",
                columns_of(("draws", "without value", *_ENDS, "width", ""), rows),
                said=[policy],
                panels=partial(_panels, estimated, kind, rule, statistic, of_values),
                name="trace",
                caption=_CAPTION,
                across=2,
                size=(4.1, 3.3),
            ),
        ),
        found=estimated,
        passed=estimated.is_met,
    )


def _panels(estimated: Estimate, kind: Kind, rule: StoppingRule, statistic: Statistic, of_values: Kind) -> list[Panel]:
    return [_trace(estimated, kind, rule), _histogram(estimated, statistic, of_values)]


def _trace(estimated: Estimate, kind: Kind, rule: StoppingRule) -> Panel:
    """Return estimate and interval at each look, and the target width."""
    draws = np.array([look.draws for look in estimated.looks])
    values = np.array([(look.interval.value, look.interval.low, look.interval.high) for look in estimated.looks]).T
    known, last = np.isfinite(values).all(axis=0), float(values[0, -1])
    reach = 0.5 * rule.width * (abs(last) if rule.is_relative else 1.0)
    label = f"{estimated.statistic[:1].upper()}{estimated.statistic[1:]}"
    marks = (
        Mark("upright", draws[known], values[1:, known], style={"linewidth": 3, "alpha": 0.45}),
        Mark("line", draws, values[0], style={"marker": "o", "markersize": 5, "linewidth": 1.0}),
        Mark("strip", (), (last - reach, last + reach), colour=GREY, style={"alpha": 0.18}),
    )
    return Panel(Kind("Draws"), kind, marks, label, then=lambda axes: axes.set_xscale("log", base=2))


def _histogram(estimated: Estimate, statistic: Statistic, kind: Kind) -> Panel:
    """Return the values of all draws, and the estimate or the value that a probability is about."""
    bins = min(_MAXIMUM_BINS, max(10, int(np.sqrt(estimated.values.size))))
    counts, edges = np.histogram(estimated.values, bins)
    at = estimated.interval.value if statistic.threshold is None else statistic.threshold
    marks = (Mark("bars", edges, counts), Mark("at", at, colour=VERMILION, style={"linewidth": 1.4}))
    return Panel(kind, Kind("Draws"), marks, f"{estimated.values.size:,} values")
