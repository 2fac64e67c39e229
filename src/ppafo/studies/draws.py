"""Draws from the distributions of a study, as columns of values for runs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import StudyError
from ppafo.simulation.numbers import NOISE_SEED
from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.loading import load_configuration, load_study
from ppafo.studies.sampling import Factor, correlate, uniform_numbers, with_noise
from ppafo.studies.study import Configuration, RandomValue, SamplingPlan, Study, with_followers
from ppafo.wording import known_names

FEWEST_DRAWS, MAXIMUM_DRAWS = 32, 2**26
"""Limits of the number of draws: two per replicate, and the largest number with balanced Sobol replicates."""
# Few enough that each keeps the evenness of a Sobol sequence, enough for Student's interval (2.13 for 95 %).
REPLICATES = 16
"""Number of independent scrambles of the Sobol sequence to which draws are assigned in turn."""
Columns = dict[str, Floats]


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Distributions of varied paths, and the Cholesky factor of their correlated normal scores (None: uncorrelated).

    ``same`` maps a path to the path whose draws it shares. Paths in ``gauge`` hold gauge pressures relative to the
    atmosphere of each run.
    """

    drawn: tuple[RandomValue, ...]
    scores: tuple[tuple[float, ...], ...] | None = None
    same: Mapping[str, str] = field(default_factory=dict)
    gauge: frozenset[str] = frozenset()

    @property
    def paths(self) -> tuple[str, ...]:
        """Varied paths that have a distribution."""
        return tuple(drawn.path for drawn in self.drawn)

    def columns(self, uniform: Floats) -> Columns:
        """Return values [SI] (draws,) by path from uniform numbers in (0, 1), shape (draws, paths)."""
        return with_followers(columns_of(self.drawn, self.scores, uniform), self.same)

    def random_columns(self, first: int, count: int, seed: int) -> Columns:
        """Return independent draws ``first`` to ``first + count - 1`` of the sequence given by ``seed``."""
        sample = SamplingPlan("random", first + count, seed)
        return self.columns(uniform_numbers(sample, len(self.drawn), first, count))

    def replicated_columns(self, count: int, seed: int) -> Columns:
        """Return ``count`` draws of randomised Sobol replicates.

        Draw j is point j // REPLICATES of scramble j % REPLICATES. The scrambles are independent, so that the spread
        between their means estimates the error of a mean (Owen, 1997).
        """
        # Dealt out in turn: any number of draws from the start has all replicates to within one draw.
        uniform = np.empty((count, len(self.drawn)))
        for replicate in range(min(REPLICATES, count)):
            own = slice(replicate, count, REPLICATES)
            length = len(range(count)[own])
            sample = SamplingPlan("sobol", length, replicate_seed(seed, replicate))
            uniform[own] = uniform_numbers(sample, len(self.drawn), 0, length)
        return self.columns(uniform)

    def with_noise_of(self, scenarios: Iterable[Scenario]) -> "Uncertainty":
        """Return the distributions with an independent noise seed for each draw, if any of the scenarios has noise."""
        drawn, scores = with_noise(self.drawn, self.scores, scenarios, self.paths)
        return replace(self, drawn=drawn, scores=scores)

    @property
    def has_noise(self) -> bool:
        """True if each draw has its own seed of the sensor noise."""
        return NOISE_SEED in self.paths


def columns_of(drawn: Sequence[RandomValue], scores: Factor | None, uniform: Floats) -> Columns:
    """Return values [SI] (draws,) by path from uniform numbers in (0, 1), shape (draws, paths)."""
    rows = np.ascontiguousarray((uniform if scores is None else correlate(uniform, scores)).T)
    return {number.path: number.distribution.values(row) for number, row in zip(drawn, rows, strict=True)}


def replicate_seed(seed: int, replicate: int) -> int:
    """Return the seed of one replicate, independent of the seeds of the others."""
    return int(np.random.SeedSequence([seed, replicate]).generate_state(1, np.uint64)[0])


def seeds_of_noise(scenarios: Iterable[Scenario], paths: Sequence[str], count: int, seed: int) -> Floats:
    """Return seeds of the first ``count`` noise streams (streams,) of the sequence given by ``seed``.

    The array is empty if no controller of the scenarios receives noise, or if the noise is among the varied ``paths``.
    """
    noise = Uncertainty(with_noise((), None, scenarios, paths)[0])
    return noise.random_columns(0, count, seed)[NOISE_SEED] if noise.has_noise else np.zeros(0)


def study_of(
    study: Study | str | Path | Mapping[str, Any],
    overrides: Iterable[str] = (),
    draws: int | None = None,
    seed: int | None = None,
) -> Study:
    """Load a study by name, file or data; return a loaded study unchanged, with StudyError for changes to it."""
    if not isinstance(study, Study):
        return load_study(study, overrides, draws=draws, seed=seed)
    if tuple(overrides) or draws is not None or seed is not None:
        raise StudyError("a loaded Study accepts no overrides, draws or seed; give these to load_study")
    return study


def uncertainty_of(study: Study) -> Uncertainty:
    """Return the distributions of a study; StudyError if it has none, or has a grid, which has no probabilities."""
    # A grid has values and no probabilities: a mean over it would be of the grid, not of the device.
    if study.axes:
        raise StudyError(
            f"study '{study.name}': '{study.axes[0].path}' is varied over a grid or list, which has no probabilities"
        )
    if not study.drawn:
        raise StudyError(f"study '{study.name}': no value has a distribution")
    return Uncertainty(study.drawn, study.scores, study.same, study.gauge)


def uncertainty_in(study: Study, configuration: Configuration) -> Uncertainty:
    """Return the distributions that apply in one configuration; StudyError if none does."""
    whole = uncertainty_of(study)
    kept = [row for row, drawn in enumerate(whole.drawn) if study.varies(drawn.path, configuration.name)]
    if not kept:
        raise StudyError(f"study '{study.name}': no value has a distribution in configuration '{configuration.name}'")
    same, scores = study.same_in(configuration.name), whole.scores
    if len(kept) == len(whole.drawn):
        return replace(whole, same=same)
    if scores is not None:
        # Rows of a factor are no factor of the correlation among some paths: that is factored anew.
        lower = np.asarray(scores)
        factor = np.linalg.cholesky((lower @ lower.T)[np.ix_(kept, kept)])
        scores = tuple(tuple(float(number) for number in row) for row in factor)
    return Uncertainty(tuple(whole.drawn[row] for row in kept), scores, same, study.gauge)


def choose_configuration(study: Study, name: str | None) -> Configuration:
    """Return a configuration by name, or the only one if ``name`` is None; StudyError if there are several."""
    names = [configuration.name for configuration in study.configurations]
    if name is None:
        if len(names) > 1:
            raise StudyError(f"study '{study.name}' has several configurations; choose one: {', '.join(names)}")
        return study.configurations[0]
    if name not in names:
        raise StudyError(f"study '{study.name}' has no configuration '{name}'{known_names(name, names)}")
    return study.configurations[names.index(name)]


def drawn_in(
    study: Study | str | Path | Mapping[str, Any], overrides: Iterable[str], name: str | None, independent: bool = False
) -> tuple[Study, Configuration, Uncertainty]:
    """Return a study, one of its configurations, and the distributions in this configuration, with sensor noise.

    ``independent`` omits the correlations. Overrides change the chosen configuration only.
    """
    changes = tuple(overrides)
    chosen = study_of(study, changes if isinstance(study, Study) else ())
    base = choose_configuration(chosen, name)
    if changes and not isinstance(study, Study):
        chosen = load_configuration(study, base, changes)
        base = chosen.configurations[0]
    known = uncertainty_in(chosen, base)
    used = replace(known, scores=None) if independent else known
    return chosen, base, used.with_noise_of([base.scenario])
