"""A statistic over the distributions of a study, drawn until its interval is narrow enough, and the answer.

A mean is estimated from randomised Sobol replicates, which know that of a smooth function far better than as many
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
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import (
    change_text,
    display_difference,
    display_unit,
    display_value,
    display_values,
    metric_quantity,
    metric_title,
)
from ppafo.answers.style import BLUE, GREY, VERMILION, Margins, figure_of_free_panels, house_style, mark_kind
from ppafo.errors import StudyError, UnitError, refused_as
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.questions.question import Solved
from ppafo.simulation.scenario import plain
from ppafo.studies.distributions import (
    FEWEST_EFFECTIVE,
    Floats,
    Interval,
    effective_sample_size,
    floored_interval,
    fraction_interval,
    fraction_text,
    noise_interval,
    quantile_interval,
)
from ppafo.studies.draws import (
    MAXIMUM_DRAWS,
    REPLICATES,
    Columns,
    Model,
    Outcomes,
    Tally,
    Uncertainty,
    atmosphere_of,
    check_confidence,
    check_failures,
    check_fraction,
    check_metrics,
    choose_configuration,
    difference_of,
    join,
    level_of,
    scenario_model,
    study_of,
    uncertainty_in,
    with_new_noise,
)
from ppafo.studies.study import Study
from ppafo.units import number_text, parse_quantity

if TYPE_CHECKING:
    import matplotlib.figure

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
        if self.is_of_replicates and 0 < known.size < FEWEST_EQUAL and float(np.ptp(known)) == 0.0:
            return 0.0
        return effective_sample_size(known) if self.is_of_replicates else float(known.size)


def mean_of(unit: str) -> Statistic:
    """Return the mean of a metric in a unit."""
    return Statistic("mean", unit, lambda values, level: floored_interval(values, REPLICATES, level), True)


def quantile_of(unit: str, fraction: float) -> Statistic:
    """Return the value of a metric below which a fraction of the runs lies."""
    return Statistic(
        f"quantile {fraction:g}",
        unit,
        lambda values, level: quantile_interval(values[np.isfinite(values)], fraction, level),
    )


def probability_of(threshold: float, is_above: bool, text: str) -> Statistic:
    """Return the probability that a metric is above (or else below) a value [SI], written as ``text``."""

    def estimate(values: Floats, level: float) -> Interval:
        known = values[np.isfinite(values)]
        hits = known > threshold if is_above else known < threshold
        return fraction_interval(int(np.count_nonzero(hits)), known.size, level)

    return Statistic(f"probability {'above' if is_above else 'below'} {text}", "-", estimate, threshold=threshold)


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


FEWEST_DRAWS = 32
FEWEST_EQUAL = 3000
"""Equal values from which they count as their mean: one in a thousand that differs would have come (95 %)."""
_RULE_OF_THREE = 3.0
"""Over the draws: probability of an event that 95 of 100 such sets of draws show."""
NOISE_DRAWS = 512
"""Draws that are run again with other noise, at most: its fraction of the variance is then known to some percent."""


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
        check_confidence(self.confidence)
        check_fraction(self.maximum_failed, "maximum_failed")

    @property
    def sizes(self) -> tuple[int, ...]:
        """The numbers of draws at which it is looked at the interval, at most."""
        found = [self.first]
        while found[-1] < self.maximum:
            found.append(min(2 * found[-1], self.maximum))
        return tuple(found)

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
        """Tell whether enough draws determine the estimate; an interval without width is carried by all."""
        return self.effective_size >= min(FEWEST_EFFECTIVE, 0.5 * (self.draws - self.missing))


@dataclass(frozen=True, slots=True, repr=False)
class MonteCarlo(Solved):
    """The looks one after the other, whether the last one met the rule, and the values of the metric (draws,) [SI].

    ``noise`` is the fraction of the variance that is due to sensor noise; None where there is none. ``also`` has the
    means [SI] of further metrics over the same draws, and how many draws have each.
    """

    metric: str
    statistic: Statistic
    rule: StoppingRule
    seed: int
    looks: tuple[Look, ...]
    outcomes: Outcomes
    noise: Interval | None
    also: Mapping[str, tuple[int, Interval]] = field(default_factory=dict)

    @property
    def last(self) -> Look:
        """The look at which it stopped."""
        return self.looks[-1]

    @property
    def is_met(self) -> bool:
        """Tell whether the interval became narrow enough, and can be believed."""
        return self.rule.is_narrow(self.last.interval) and self.last.is_carried

    @property
    def quantity(self) -> str:
        """The kind of quantity of the statistic; none for a plain number."""
        return "" if self.statistic.unit == "-" else metric_quantity(self.metric)

    @property
    def values(self) -> Floats:
        """The values that there are [SI]."""
        found = self.outcomes.metrics[self.metric]
        return found[np.isfinite(found)]


def draw_until(
    model: Model,
    uncertainty: Uncertainty,
    metric: str,
    statistic: Statistic,
    rule: StoppingRule,
    seed: int,
    also: Sequence[str] = (),
) -> MonteCarlo:
    """Draw from one stream until the rule is met or there are no more looks.

    An interval that few draws determine is not trusted, however narrow it is: drawing continues.
    Runs that fail have no value: up to the fraction that the rule allows they are left out and counted, above it
    StudyError.
    """
    looks: list[Look] = []
    pieces: list[Outcomes] = []
    drawn: Columns = {}
    for size in rule.sizes:
        done = looks[-1].draws if looks else 0
        columns = statistic.columns(uncertainty, done, size - done, seed)
        drawn = drawn or columns
        pieces.append(model(columns))
        looks.append(_look(join(pieces), metric, statistic, rule))
        if rule.is_narrow(looks[-1].interval) and looks[-1].is_carried:
            break
    outcomes = join(pieces)
    noise = None
    if uncertainty.has_noise:
        again = model(with_new_noise(drawn, NOISE_DRAWS)).metrics[metric]
        noise = noise_interval(outcomes.metrics[metric][: again.size], again, rule.confidence)
    further = {name: _mean(outcomes.metrics[name], rule.confidence_of_look) for name in also}
    return MonteCarlo(metric, statistic, rule, seed, tuple(looks), outcomes, noise, further)


def _mean(values: Floats, level: float) -> tuple[int, Interval]:
    """How many draws have a value, and their mean; its interval is infinite where few do."""
    count = int(np.count_nonzero(np.isfinite(values)))
    return count, floored_interval(values, REPLICATES, level) if count else Interval(math.nan, -math.inf, math.inf)


def _look(outcomes: Outcomes, metric: str, statistic: Statistic, rule: StoppingRule) -> Look:
    check_failures(outcomes, rule.maximum_failed, "Monte Carlo")
    found = outcomes.metrics[metric]
    values = found[np.isfinite(found)]
    missing = outcomes.runs - values.size
    if missing > rule.maximum_failed * outcomes.runs:
        raise StudyError(
            f"Monte Carlo: {missing:,} of {outcomes.runs:,} runs have no '{metric}'; choose another metric"
        )
    interval = statistic.estimate(found, rule.confidence_of_look)
    return Look(outcomes.runs, missing, interval, statistic.effective_size(found))


DEFAULT_WIDTH = "1 %"
PROBABILITY_WIDTH = "0.02"


def monte_carlo(
    study: Study | str | Path | Mapping[str, Any],
    metric: str,
    statistic: str = "mean",
    width: str | None = None,
    configuration: str | None = None,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    first_draws: int = 256,
    draws: int = 2**20,
    confidence: float = 0.95,
    maximum_failed: float = 0.01,
    threads: int | None = None,
    progress: Report | None = None,
    also: Sequence[str] = (),
) -> MonteCarlo:
    """Estimate a statistic of a metric over the distributions of a study until its interval is ``width`` wide.

    ``statistic`` is ``mean``, ``quantile 0.95`` or ``probability above 3 N m``; ``width`` a fraction of its value
    (default ``1 %``) or a difference with its unit (``0.01 N m``; for a probability a number, 0.02). Draws are
    those that the interval needs, whatever the study's sampling method: randomised Sobol replicates for a mean, else
    independent ones. ``seed`` is the study's by default. ``also`` names further metrics: means over the same draws.
    StudyError for bad input and where more than the fraction ``maximum_failed`` of the runs fails.
    """
    chosen = study_of(study, overrides)
    base = choose_configuration(chosen, configuration)
    uncertainty = uncertainty_in(chosen, base).with_noise_of([base.scenario])
    wanted = tuple(dict.fromkeys((metric, *also)))
    check_metrics(wanted, base.scenario)
    atmosphere = atmosphere_of(base.scenario, {*uncertainty.paths, *uncertainty.same})
    what = parse_statistic(statistic, metric, atmosphere)
    asked = width or (PROBABILITY_WIDTH if what.threshold is not None else DEFAULT_WIDTH)
    rule = stopping_rule(what, metric, asked, StoppingRule(1.0, False, first_draws, draws, confidence, maximum_failed))
    tally = Tally(rule.first, progress)
    model = scenario_model(base.scenario, wanted, threads, tally.add, uncertainty.gauge)
    return draw_until(model, uncertainty, metric, what, rule, chosen.sample.seed if seed is None else seed, wanted[1:])


def stopping_rule(statistic: Statistic, metric: str, width: str, like: StoppingRule) -> StoppingRule:
    """Return the rule with the width that a text says, else like another one."""
    text = width.strip()
    is_relative = text.endswith("%")
    if statistic.threshold is not None:
        number = _plain(text)
    else:
        number = parse_fraction(text) if is_relative else difference_of(text, metric, f"width = '{width}'")
    return replace(like, width=number, is_relative=is_relative)


def parse_fraction(text: str) -> float:
    """Return a fraction from a text in percent, such as '1 %'."""
    with refused_as(StudyError, f"width = '{text}'", UnitError):
        return parse_quantity(text, "")


def _plain(text: str) -> float:
    try:
        return float(number_text(text))
    except ValueError as error:
        raise StudyError(f"width = '{text}': for a probability give a plain number, such as 0.01") from error


_SIZE = (8.4, 3.5)
_MARGINS = Margins(left=0.85, right=0.2, top=0.55, bottom=0.55, row_gap=0.0, column_gap=0.95)
_MAXIMUM_BINS = 80


def monte_carlo_figure(estimate: MonteCarlo) -> "matplotlib.figure.Figure":
    """Return trace and histogram side by side."""
    with house_style():
        figure, ((trace, drawn),) = figure_of_free_panels(_SIZE, _MARGINS, 1, 2)
        draws = [look.draws for look in estimate.looks]
        rows = [(look.interval.value, look.interval.low, look.interval.high) for look in estimate.looks]
        values = display_values(np.array(rows), estimate.quantity)
        known = np.isfinite(values).all(axis=1)
        trace.vlines(np.array(draws)[known], values[known, 1], values[known, 2], color=BLUE, linewidth=3, alpha=0.45)
        trace.plot(draws, values[:, 0], "o-", color=BLUE, markersize=5, linewidth=1.0)
        one = abs(values[-1, 0]) if estimate.rule.is_relative else display_difference(1.0, estimate.quantity)
        reach = 0.5 * estimate.rule.width * one
        trace.axhspan(values[-1, 0] - reach, values[-1, 0] + reach, color=GREY, alpha=0.18, linewidth=0)
        trace.set_xscale("log", base=2)
        trace.set_xlabel("Draws")
        trace.set_title(f"{estimate.statistic.label[:1].upper()}{estimate.statistic.label[1:]}")
        trace.set_ylabel("Probability" if estimate.statistic.unit == "-" else metric_title(estimate.metric))
        values = display_values(estimate.values, metric_quantity(estimate.metric))
        drawn.hist(values, bins=min(_MAXIMUM_BINS, max(10, int(np.sqrt(values.size)))), color=BLUE, alpha=0.55)
        threshold = estimate.statistic.threshold
        marked = estimate.last.interval.value if threshold is None else threshold
        drawn.axvline(display_value(marked, metric_quantity(estimate.metric)), color=VERMILION, linewidth=1.4)
        drawn.set_xlabel(metric_title(estimate.metric))
        drawn.set_ylabel("Draws")
        drawn.set_title(f"{values.size:,} values")
        mark_kind(figure, "simulated")
        return figure


_HEAD = ("draws", "without value", "estimate", "low", "high", "width", "")
_CAPTION = "Left: estimate and interval at each look; grey: the target width. Right: the values of all draws."


def answer_of(estimate: MonteCarlo) -> Answer:
    """Return the answer of an estimate; it has passed where the interval became narrow enough."""
    title = f"{estimate.statistic.label} of {estimate.metric}"
    table = Table(tuple(map(Column, _HEAD)), tuple(look_row(estimate, look) for look in estimate.looks))
    figure = Figure("trace", _CAPTION, lambda: monte_carlo_figure(estimate))
    return Answer(
        name="montecarlo",
        kicker="Monte Carlo",
        title=title[:1].upper() + title[1:],
        lead=(verdict(estimate), *remarks(estimate)),
        sections=(*_further(estimate), Section("Trace", (policy(estimate),), table, figure=figure)),
        data={
            "metric": estimate.metric,
            "statistic": estimate.statistic.label,
            "unit": estimate.statistic.unit,
            "is_met": estimate.is_met,
            "draws": estimate.last.draws,
            "failed": estimate.outcomes.failures,
            "interval": plain(estimate.last.interval),
            "remarks": remarks(estimate),
            "also": {name: {"draws": count, **plain(mean)} for name, (count, mean) in estimate.also.items()},
            "share_of_noise": None if estimate.noise is None else plain(estimate.noise),
            "seed": estimate.seed,
            "rule": {**plain(estimate.rule), "looks": len(estimate.rule.sizes), "correction": "Bonferroni"},
            "looks": [plain(look) for look in estimate.looks],
        },
        passed=estimate.is_met,
    )


def _further(estimate: MonteCarlo) -> tuple[Section, ...]:
    """The means of further metrics, where some were requested."""
    rows = []
    for name, (count, mean) in estimate.also.items():
        quantity = metric_quantity(name)
        shown = (f"{display_value(value, quantity):.4g}" for value in (mean.value, mean.low, mean.high))
        rows.append((metric_title(name), f"{count:,}", *shown))
    if not rows:
        return ()
    head = tuple(map(Column, ("mean over the same draws", "with a value", "estimate", "low", "high")))
    said = f"Each with {100.0 * estimate.rule.confidence_of_look:.4g} % confidence, of the draws that have a value."
    return (Section("Further metrics", (said,), Table(head, tuple(rows))),)


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
    are_equal = estimate.values.size > 0 and float(np.ptp(estimate.values)) == 0.0
    if not last.is_carried and are_equal:
        said.append(
            f"do not trust this interval: all {last.draws - last.missing:,} values are equal, which do not show how "
            f"far a rare one lies; draw at least {FEWEST_EQUAL:,}"
        )
    elif not last.is_carried:
        said.append(
            f"do not trust this interval: the mean has an effective sample size of {last.effective_size:.3g} of "
            f"{last.draws - last.missing:,} draws, so that the true value lies outside more often than stated; request "
            "a quantile or a probability"
        )
    known = last.draws - last.missing
    if estimate.statistic.is_of_replicates and known:
        share, span = _RULE_OF_THREE / known, float(np.ptp(estimate.values))
        moved = (
            f"if it lay beyond the others by their range, {_difference(estimate, span)}, the mean would move by up to "
            f"{_difference(estimate, share * span)}, and more the further it lies"
        )
        said.append(
            f"what happens in fewer than {100.0 * share:.2g} % of the runs may be missing among these draws (95 %): "
            f"{f'it would move the mean by up to {share:.2g} times its distance' if are_equal else moved}"
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


def look_row(estimate: MonteCarlo, look: Look) -> tuple[str, ...]:
    """Return the row of a look."""
    interval = look.interval
    met = "narrow enough" if estimate.rule.is_narrow(interval) else ""
    met = met if look.is_carried else f"{met}{', but ' if met else ''}its effective sample size is small"
    levels = [_level(estimate, value) for value in (interval.value, interval.low, interval.high)]
    return (f"{look.draws:,}", f"{look.missing:,}", *levels, _difference(estimate, interval.width), met)


def _level(estimate: MonteCarlo, value: float) -> str:
    return f"{display_value(value, estimate.quantity):.5g}"


def _difference(estimate: MonteCarlo, value: float) -> str:
    if estimate.statistic.unit == "-" or not (abs(value) < float("inf")):
        return f"{value:.3g}"
    return change_text(value, metric_quantity(estimate.metric))
