"""Sets that are ranked by how well they predict recordings, with noise and differences that are planted."""

import numpy as np
import pytest

from ppafo.identification.noise.choice import sensor_noise
from ppafo.identification.trajectory.prediction import Left, Ranking, log_density, rank
from ppafo.identification.trajectory.residuals import Floats

TIME = np.arange(400) * 1e-3
RISE = np.where(TIME > 0.02, np.exp(-(TIME - 0.02) / 0.04) * (TIME - 0.02) / 0.04, 0.0)


def coloured(memory: float, random: np.random.Generator) -> Floats:
    noise = random.standard_normal(TIME.size)
    for number in range(1, noise.size):
        noise[number] += memory * noise[number - 1]
    return np.asarray(noise)


def ranked(seed: int, memory: float, errors: dict[str, float]) -> Ranking:
    """Sets that are off by these sizes [noise], on two recordings of two channels."""
    random = np.random.default_rng(seed)
    samples = {(name, part): 3.0 * coloured(memory, random) for name in ("angle", "pressure_1") for part in (0, 1)}
    left = [
        [Left(name, part, one + 3.0 * (1 + part) * size * RISE) for (name, part), one in samples.items()]
        for size in errors.values()
    ]
    return rank(list(errors), left)


@pytest.mark.parametrize("tails", ["normal", "heavy"])
def test_the_density_of_all_samples_is_the_likelihood_of_the_noise(tails: str) -> None:
    random = np.random.default_rng(3)
    parts = [coloured(0.9, random), 5.0 * coloured(0.9, random)]
    if tails == "heavy":
        parts = [3.0 * random.standard_t(3.0, 400), 3.0 * random.standard_t(3.0, 400)]
    noise = sensor_noise(parts)
    assert noise.is_heavy == (tails == "heavy")
    densities = [log_density(noise, one, part) for part, one in enumerate(parts)]
    assert sum(densities) == pytest.approx(noise.likelihood, abs=1e-6 * 800)


def test_a_set_that_is_far_off_is_worse_for_certain() -> None:
    found = ranked(1, 0.0, {"off": 3.0, "right": 0.0})
    assert found.alike == ("right",)
    assert found.between("off", "right").is_certain


def test_sets_that_predict_the_same_do_not_differ() -> None:
    found = ranked(1, 0.0, {"one": 0.5, "other": 0.5})
    assert set(found.alike) == {"one", "other"}
    assert found.between("one", "other").value == 0.0


@pytest.mark.long
@pytest.mark.parametrize("memory", [0.0, 0.9])
@pytest.mark.parametrize(
    "size", [pytest.param(0.3, marks=pytest.mark.thorough), 1.0, pytest.param(3.0, marks=pytest.mark.thorough)]
)
def test_equal_sets_are_indistinguishable_and_no_wrong_one_wins(memory: float, size: float) -> None:
    draws = 100
    found = [ranked(seed, memory, {"high": size, "low": -size, "right": 0.0}) for seed in range(draws)]
    assert sum(one.between("high", "low").is_certain for one in found) <= 0.05 * draws
    pairs = [one.between("right", name) for one in found for name in ("high", "low")]
    assert not any(pair.is_certain and pair.better != "right" for pair in pairs)
