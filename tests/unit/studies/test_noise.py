"""Noise is drawn like everything else that is uncertain, and how much of a spread it makes is known."""

import copy
import math
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.analyses.compare import compare
from ppafo.simulation.numbers import NOISE_SEED
from ppafo.studies.draws import other_noise, uncertainty_of
from ppafo.studies.intervals import noise_interval
from ppafo.studies.loading import load_study
from ppafo.study.blocks import drawn_values

NOISY = ["run.duration=0.3 s", "sensors.pressure_noise=5 kPa_d"]
DOCUMENT: dict[str, Any] = {
    "schema_version": 1,
    "name": "noisy",
    "configurations": [
        {"name": "one", "scenario": "torque-task-proportional", "overrides": NOISY},
        {"name": "other", "scenario": "torque-task-proportional", "overrides": [*NOISY, "sensors.seed=9"]},
    ],
    "vary": [{"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "55 psi_g"}],
    "sample": {"method": "random", "runs": 64, "seed": 3},
    "outputs": {"metrics": ["rms_error"]},
}


def changed(**changes: Any) -> dict[str, Any]:
    return copy.deepcopy(DOCUMENT) | changes


@pytest.mark.parametrize("with_study", [True, False])
def test_scenarios_that_differ_in_nothing_but_their_seed_are_equal_in_every_draw(with_study: bool) -> None:
    one, other = (ppafo.load_scenario("torque-task-proportional", [*NOISY, f"sensors.seed={seed}"]) for seed in (1, 9))
    found = compare({"one": one, "other": other}, study=changed() if with_study else None, draws=64)
    (cases,) = found.found.tasks.values()
    error = cases[1].pairs["rms_error"]
    assert error.equal == 1.0
    assert error.better is not None
    assert error.better.value == 0.0
    rows = cases[0].rows
    assert rows is not None
    assert np.unique(rows["rms_error"]).size == 64, "every draw has its own noise"
    drawn = "1 uncertain value and of the sensor noise" if with_study else "64 draws of the sensor noise"
    assert drawn in found.said[0]


def test_without_noise_nothing_is_drawn_for_it() -> None:
    quiet = changed()
    for item in quiet["configurations"]:
        item["overrides"] = [text for text in item["overrides"] if "noise" not in text]
    assert NOISE_SEED not in load_study(quiet).paths
    assert NOISE_SEED in load_study(changed()).paths
    assert not compare(
        {"a": ppafo.load_scenario("step-response"), "b": ppafo.load_scenario("step-response")}
    ).found.draws


def test_the_noise_is_independent_of_what_is_correlated_and_leaves_its_correlation() -> None:
    from scipy import stats

    document = changed()
    document["vary"].append({"path": "valve.area", "kind": "uniform", "minimum": "10 mm^2", "maximum": "12 mm^2"})
    document["correlations"] = [{"between": ["supply.pressure", "valve.area"], "coefficient": 0.8}]
    columns = uncertainty_of(load_study(document)).random_columns(0, 4000, 1)
    ranks = np.array([stats.rankdata(columns[path]) for path in ("supply.pressure", "valve.area", NOISE_SEED)])
    found = np.corrcoef(ranks)
    assert found[0, 1] == pytest.approx(6.0 / np.pi * np.arcsin(0.4), abs=0.02)
    assert found[:2, 2] == pytest.approx([0.0, 0.0], abs=0.05)
    assert np.array_equal(columns[NOISE_SEED], np.floor(columns[NOISE_SEED]))


def test_a_seed_varies_as_whole_numbers() -> None:
    document = changed(configurations=DOCUMENT["configurations"][:1])
    document["vary"].append({"path": NOISE_SEED, "kind": "whole_numbers", "minimum": 3, "maximum": 5})
    values = drawn_values(load_study(document), np.arange(64))[NOISE_SEED]
    assert set(values) == {3.0, 4.0, 5.0}
    document["vary"][-1] = {"path": NOISE_SEED, "kind": "list", "values": [1, 2]}
    assert set(drawn_values(load_study(document), np.arange(128))[NOISE_SEED]) == {1.0, 2.0}


def test_the_share_of_noise_is_the_planted_one_and_its_interval_holds() -> None:
    random, truth, held = np.random.default_rng(5), 0.3, []
    for _ in range(400):
        device = random.normal(0.0, math.sqrt(1.0 - truth), 256)
        first, second = (device + random.normal(0.0, math.sqrt(truth), 256) for _ in range(2))
        share = noise_interval(first, second, 0.9)
        assert share is not None
        held.append(share.low <= truth <= share.high)
    assert 0.85 <= np.mean(held) <= 0.95
    assert noise_interval(np.ones(9), np.ones(9), 0.9) is None
    only = random.normal(size=(2, 500))
    assert noise_interval(only[0], only[1], 0.95) == pytest.approx(noise_interval(only[1], only[0], 0.95))


def test_a_share_of_noise_and_both_ends_are_between_nothing_and_all() -> None:
    values = np.array([1.0, -1.1, 1.0, -0.9, 1.0])
    share = noise_interval(values, -values, 0.95)
    assert share is not None
    assert 0.0 <= share.low <= share.value <= share.high <= 1.0


def test_another_stream_is_another_seed_for_every_seed() -> None:
    seeds = np.arange(1000.0)
    assert np.all(other_noise(seeds) != seeds)
    assert np.unique(other_noise(seeds)).size == 1000
