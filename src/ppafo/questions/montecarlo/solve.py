"""Monte Carlo over the distributions of a study file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.errors import StudyError, UnitError
from ppafo.progress import Report
from ppafo.questions.montecarlo.estimate import MonteCarlo, StoppingRule, draw_until
from ppafo.questions.montecarlo.statistic import Probability, Statistic, parse_statistic
from ppafo.studies.draws import choose_configuration, study_of, uncertainty_in
from ppafo.studies.outcomes import Tally, atmosphere_of, check_metrics, difference_of, scenario_model
from ppafo.studies.study import Study
from ppafo.units import parse_quantity

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
) -> MonteCarlo:
    """Estimate a statistic of a metric over the distributions of a study until its interval is ``width`` wide.

    ``statistic`` is ``mean``, ``quantile 0.95`` or ``probability above 3 N m``; ``width`` a fraction of its value
    (default ``1 %``) or a difference with its unit (``0.01 N m``; for a probability a number, 0.02). Draws are
    those that the interval needs, whatever the study's sampling method: randomised Sobol replicates for a mean, else
    independent ones. ``seed`` is the study's by default.
    StudyError for bad input and where more than the fraction ``maximum_failed`` of the runs fails.
    """
    chosen = study_of(study, overrides)
    base = choose_configuration(chosen, configuration)
    uncertainty = uncertainty_in(chosen, base).with_noise_of([base.scenario])
    check_metrics([metric], base.scenario)
    atmosphere = atmosphere_of(base.scenario, {*uncertainty.paths, *uncertainty.same})
    what = parse_statistic(statistic, metric, atmosphere)
    asked = width or (PROBABILITY_WIDTH if isinstance(what, Probability) else DEFAULT_WIDTH)
    rule = stopping_rule(what, metric, asked, StoppingRule(1.0, False, first_draws, draws, confidence, maximum_failed))
    tally = Tally(rule.first, progress)
    model = scenario_model(base.scenario, [metric], threads, tally.add, uncertainty.gauge)
    return draw_until(model, uncertainty, metric, what, rule, chosen.sample.seed if seed is None else seed)


def stopping_rule(statistic: Statistic, metric: str, width: str, like: StoppingRule) -> StoppingRule:
    """Return the rule with the width that a text says, else like another one."""
    text = width.strip()
    is_relative = text.endswith("%")
    if isinstance(statistic, Probability):
        number = _plain(text)
    else:
        number = parse_fraction(text) if is_relative else difference_of(text, metric, f"width = '{width}'")
    return replace(like, width=number, is_relative=is_relative)


def parse_fraction(text: str) -> float:
    """Return a fraction from a text in percent, such as '1 %'."""
    try:
        return parse_quantity(text, "")
    except UnitError as error:
        raise StudyError(f"width = '{text}': {error}") from error


def _plain(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise StudyError(f"width = '{text}': for a probability give a plain number, such as 0.01") from error
