"""Estimation of a statistic over the distributions of a study, with draws until its interval is narrow enough.

``statistic_kind.py`` defines the statistics and their draws, ``stopping.py`` the stopping rule, and the reason why
intervals stay valid although the estimate is examined repeatedly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.analyses.sweep.statistic_answer import finding_of, kind_of, remarks_on
from ppafo.analyses.sweep.statistic_kind import FEWEST_SEEN, Statistic, parse_statistic
from ppafo.analyses.sweep.stopping import InterimEstimate, MetricMean, StatisticEstimate, StoppingRule, target_width
from ppafo.arguments import Confidence, Count, MaximumFailed, Name, Overrides, Seed, Threads, checked
from ppafo.documents.json_text import plain
from ppafo.errors import at_fault
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report
from ppafo.report.finding import Finding
from ppafo.simulation.gains import warn_of_gains
from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs
from ppafo.studies.draws import REPLICATES, Columns, Uncertainty, drawn_in
from ppafo.studies.intervals import floored_interval, noise_interval
from ppafo.studies.limits import atmosphere_of, check_metrics
from ppafo.studies.sampling import with_new_noise
from ppafo.studies.study import Study
from ppafo.study.runs import RunCounter, Runs, scenario_runs
from ppafo.units.shown import shown_in
from ppafo.wording import argument_text

DEFAULT_WIDTH = "1 %"
"""Default target width of the confidence interval, as a fraction of the value."""
PROBABILITY_WIDTH = "0.02"
"""Default target width of the confidence interval of a probability [-]."""
FIRST_DRAWS = 256
"""Number of draws before the first interim estimate."""
MOST_DRAWS = 2**20
"""Default of the maximum number of draws for a statistic."""


@checked
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
) -> Finding[StatisticEstimate]:
    """Estimate a statistic of a metric over the distributions of a study, to a target width of its confidence interval.

    The sampling method of the study is not used: a mean takes randomised Sobol replicates, other statistics take
    independent draws.

    Arguments:
        study: a study, its name, its file or its content
        metric: name of the metric
        statistic: ``mean``, ``quantile 0.95``, ``probability above 3 N m`` or ``probability below 3 N m``
        width: target width of the interval: ``1 %`` of the value (default), ``0.01 N m``, or 0.02 for a probability
        also: further metrics, whose means over the same draws are given
        configuration: configuration of the study, needed if it has several
        first_draws: draws before the first estimate
        overrides: changes of every configuration, as texts or a dictionary
        draws: maximum number of draws
        seed: random seed; default: the study's
        confidence: confidence of the interval
        maximum_failed: fraction of the runs that may fail before the study is refused
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with the Progress of the draws

    Returns:
        Finding with the estimate, its interval and the draws that it took

    Raises:
        StudyError: a study or setting that cannot be used, or too many failed runs

    >>> import ppafo
    >>> study = "torque-task-uncertainty"
    >>> print(ppafo.estimate(study, metric="rms_error", configuration="solenoid", width="5 %").said[0])
    mean of rms_error: 1.0372 [1.0343, 1.0402] N m after 16,384 draws, 95 % confidence
    """
    name_plugins(plugins)
    chosen, base, uncertainty = drawn_in(study, overrides, configuration)
    check_metrics((metric,), base.scenario)
    with at_fault("also"):
        check_metrics(also, base.scenario)
    metrics = tuple(dict.fromkeys((metric, *also)))
    parsed = parse_statistic(statistic, metric, atmosphere_of(base.scenario, {*uncertainty.paths, *uncertainty.same}))
    # A probability may be 0, of which a fraction says nothing: its width is a difference.
    width_text = width or (PROBABILITY_WIDTH if parsed.threshold is not None else DEFAULT_WIDTH)
    target = target_width(parsed, metric, width_text)
    rule = StoppingRule(*target, first_draws, draws, confidence, maximum_failed)
    warn_of_coarse_pairs([base.scenario])
    warn_of_gains(base.scenario, uncertainty.paths)
    runs = scenario_runs(base.scenario, metrics, RunCounter(rule.first, progress), uncertainty.gauge, threads)
    with shown_in(chosen.shown_for(base.scenario)):
        seed = chosen.sample.seed if seed is None else seed
        found = draw_until(runs, uncertainty, metric, parsed, rule, seed, metrics[1:])
        return replace(found, overrides=chosen.changes)


def draw_until(
    runs: Runs,
    uncertainty: Uncertainty,
    metric: str,
    statistic: Statistic,
    rule: StoppingRule,
    seed: int,
    also: Sequence[str] = (),
) -> Finding[StatisticEstimate]:
    """Draw from one stream until the stopping rule is met or its maximum number of draws is reached.

    A narrow interval from few draws is not sufficient. For a mean, drawing continues until an event of one run in 3,300
    would have been drawn, and until rarer events within 100 standard deviations of the mean cannot change the interval
    beyond the target width.

    Failed runs have no value: up to the fraction that the rule allows they are left out and counted; above, StudyError
    is raised.
    """
    looks: list[InterimEstimate] = []
    first_drawn: Columns = {}
    is_met = False
    for size in rule.sizes:
        done = looks[-1].draws if looks else 0
        # Sobol replicates for a mean, else independent draws.
        draw = uncertainty.replicated_columns if statistic.is_of_replicates else uncertainty.random_columns
        columns = draw(done, size - done, seed)
        # Draws of the first look are kept: they are repeated with new noise to find its share of the variance.
        first_drawn = first_drawn or columns
        runs.run(columns)
        rows = runs.table
        runs.check(rows, rule.maximum_failed, argument_text("statistic", option="sweep --statistic"), [metric])
        values = rows[metric]
        look = InterimEstimate(
            draws=values.size,
            missing=int(np.count_nonzero(~np.isfinite(values))),
            interval=statistic.estimate(values, rule.confidence_of_look),
            effective_size=statistic.effective_size(values),
            unseen=statistic.unseen(values, rule.confidence),
        )
        looks.append(look)
        # A mean is moved by what happens seldom; quantiles and probabilities are not.
        has_shown = not statistic.is_of_replicates or look.draws >= FEWEST_SEEN
        is_met = has_shown and rule.is_narrow(look) and look.is_carried
        if is_met:
            break
    # Failures are counted here: below, some of the same draws run again with other noise.
    failures, last, noise = runs.failures, looks[-1], None
    if uncertainty.has_noise:
        noise = noise_interval(rows[metric], runs.run(with_new_noise(first_drawn))[metric], rule.confidence)
    values = rows[metric][np.isfinite(rows[metric])]
    further = {}
    for name in also:
        mean = floored_interval(rows[name], REPLICATES, rule.confidence_of_look)
        further[name] = MetricMean(int(np.count_nonzero(np.isfinite(rows[name]))), mean.value, mean.low, mean.high)
    estimated = StatisticEstimate(
        metric=metric,
        statistic=statistic.label,
        unit=statistic.unit,
        is_met=is_met,
        draws=last.draws,
        failed=failures,
        interval=last.interval,
        remarks=remarks_on(last, values, statistic, kind_of(metric, statistic), noise),
        also=further,
        share_of_noise=noise,
        seed=seed,
        rule={**plain(rule), "looks": len(rule.sizes), "correction": "Bonferroni"},
        looks=looks,
        values=values,
    )
    return finding_of(estimated, statistic, rule)
