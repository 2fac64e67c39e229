"""Synthetic recordings with planted values: the fit finds them, and its intervals hold them as often as they say."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.intervals import (
    EIGHT_PARAMETERS,
    Coverage,
    Planted,
    coverage,
    coverage_text,
    eight_parameters,
    noisy_recordings,
    planted_problem,
    two_step_responses,
)
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import Search, TrajectoryFit, fit

REPETITIONS, STRAY_REPETITIONS = 10, 5
UNLIKELY = 1.0e-4
"""Chance at which a right implementation would fail one of these checks by bad luck, were the seed drawn anew."""


@pytest.fixture(scope="module")
def planted() -> Planted:
    """Two step responses of 1 s at 1 kHz, there and back."""
    return two_step_responses()


@pytest.fixture(scope="module")
def found(planted: Planted) -> TrajectoryFit:
    """Eight parameters, each started up to 20 % away."""
    random = np.random.default_rng(11)
    return fit(planted_problem(planted, eight_parameters(planted, random), noisy_recordings(planted, random)))


@pytest.fixture(scope="module")
def study() -> Coverage:
    """The coverage study in small: fewer repetitions, and recordings that end soon after the vane stops."""
    return coverage(two_step_responses(0.4), repetitions=REPETITIONS, seed=5)


def binomial_below(count: int, draws: int, chance: float) -> float:
    """Chance of at most ``count`` hits in ``draws``."""
    return sum(math.comb(draws, hits) * chance**hits * (1.0 - chance) ** (draws - hits) for hits in range(count + 1))


def test_eight_parameters_come_back_from_two_step_responses(found: TrajectoryFit, planted: Planted) -> None:
    assert len(found.estimates) == len(EIGHT_PARAMETERS) == 8
    for estimate in found.estimates:
        error = abs(estimate.value - planted.truth(estimate.path))
        # Four standard errors on either side.
        assert error < 4.0 / 1.96 * estimate.half_width, estimate


def test_only_the_dynamic_friction_is_weak_and_it_says_against_what_it_trades(found: TrajectoryFit) -> None:
    verdicts = {estimate.path: estimate.verdict for estimate in found.estimates}
    assert verdicts.pop("friction.dynamic_torque") == "weak"
    assert set(verdicts.values()) == {"identified"}
    assert "trades off against friction.viscous_damping" in found.estimate("friction.dynamic_torque").explanation


def test_the_fit_leaves_nothing_but_noise(found: TrajectoryFit) -> None:
    assert found.remarks == ()
    assert [channel.chi_square for channel in found.channels] == pytest.approx([1.0] * 6, abs=0.2)
    assert max(abs(channel.autocorrelation) for channel in found.channels) < 0.12


def test_recordings_and_what_is_made_of_them_say_that_they_are_synthetic(found: TrajectoryFit) -> None:
    assert {recording.kind for recording in found.measurements} == {"synthetic"}
    assert all("synthetic" in source for estimate in found.estimates for source in estimate.recordings)


@pytest.mark.thorough
def test_intervals_hold_the_planted_values_as_often_as_they_claim(study: Coverage) -> None:
    for path, inside in zip(study.paths, study.inside, strict=True):
        assert binomial_below(inside, REPETITIONS, study.confidence) > UNLIKELY, path


@pytest.mark.thorough
def test_scores_are_neither_too_wide_nor_too_narrow(study: Coverage) -> None:
    from scipy.stats import chi2

    # Intervals twice too wide or too narrow would move these sums by a factor of four.
    for path, square in zip(study.paths, np.sum(np.square(study.scores), axis=0), strict=True):
        assert chi2.ppf(UNLIKELY, REPETITIONS) < square < chi2.ppf(1.0 - UNLIKELY, REPETITIONS), path


@pytest.mark.thorough
def test_scores_have_no_preferred_side(study: Coverage) -> None:
    # The mean of normal scores has the standard deviation 1 / sqrt(repetitions); 3.9 of these are one in 10 000.
    assert np.abs(study.scores.mean(axis=0)).max() < 3.9 / math.sqrt(REPETITIONS)


@pytest.mark.thorough
def test_a_robust_fit_of_recordings_with_stray_samples_knows_its_uncertainty() -> None:
    from scipy.stats import chi2

    thrown = dataclasses.replace(two_step_responses(0.4), stray=0.02)
    robust = coverage(thrown, repetitions=STRAY_REPETITIONS, seed=6, search=Search(loss="soft_l1"))
    for path, square in zip(robust.paths, np.sum(np.square(robust.scores), axis=0), strict=True):
        assert chi2.ppf(UNLIKELY, STRAY_REPETITIONS) < square < chi2.ppf(1.0 - UNLIKELY, STRAY_REPETITIONS), path
    for path, inside in zip(robust.paths, robust.inside, strict=True):
        assert binomial_below(inside, STRAY_REPETITIONS, robust.confidence) > UNLIKELY, path


@pytest.mark.thorough
def test_the_study_prints_a_line_for_each_parameter_and_one_for_all(study: Coverage) -> None:
    lines = coverage_text(study).splitlines()
    assert len(lines) == len(EIGHT_PARAMETERS) + 4
    assert f"{REPETITIONS} synthetic repetitions" in lines[0]
    assert lines[-2].startswith("all ")
    assert f"{sum(study.inside)}" in lines[-2]
    assert study.share == sum(study.inside) / (REPETITIONS * 8)


def test_a_study_without_repetitions_is_refused() -> None:
    with pytest.raises(IdentificationError, match="at least one repetition"):
        coverage(repetitions=0)


def test_the_example_of_the_how_to_page_runs_and_calls_its_numbers_identified(
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "fit-trajectories.md"
    (code,) = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(code, str(page), "exec"), {"__name__": "example"})
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 8
    assert all(line.endswith(", identified") for line in lines[::2])
