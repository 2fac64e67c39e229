"""Pictures of a walk: what they show is what was walked."""

from functools import lru_cache

import numpy as np
import pytest
from ppafo.analyses.walk.wearers import wearers_finding
from ppafo.walking.figures.population import population_figure

from ppafo.report.finding import text_of
from ppafo.walking import WalkComparison, compare_walks, load_walk, walk_population
from ppafo.walking.figures.legs import legs_of, phases_of_last_stride

CONFIGURATIONS = ("solenoid", "proportional")


@lru_cache(maxsize=4)
def compared(name: str) -> WalkComparison:
    return compare_walks(load_walk(name), minutes=0.15)


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_drop_foot_is_seen_without_the_device_and_lifted_with_it(name: str) -> None:
    pair = compared(name)
    turns = phases_of_last_stride(pair.with_device, 100)
    late = np.flatnonzero(turns % 1.0 > 0.7)
    bare, worn = legs_of(pair.without_device, turns), legs_of(pair.with_device, turns)
    lowest = [legs.worn.toe[late, 1].min() for legs in (bare, worn)]
    assert lowest[0] < -0.06, "the toes drag"
    assert lowest[1] > lowest[0] + 0.05, "and are lifted"
    assert legs_of(pair.with_device, turns).healthy.toe[late, 1].min() > -0.002
    assert sum(worn.drags) < sum(bare.drags)


def test_histograms_hold_every_wearer() -> None:
    people = walk_population(load_walk("proportional"), minutes=0.1, wearers=60, seed=2)
    figure = population_figure(people)
    filled = next(patch for patch in figure.axes[0].patches if patch.get_fill())
    assert filled.get_data().values.sum() == 60  # type: ignore[attr-defined]
    dashes = [line.get_linestyle() for line in figure.axes[0].lines[:3]]
    assert dashes == ["--", "-", "--"], "percentiles and median differ in grey too"
    lines = text_of(wearers_finding(people)).splitlines()
    assert lines[0] == "proportional: 60 wearers, 0.1 min each"
    gas = [float(cell) for cell in next(line for line in lines if line.startswith("Gas")).split()[4:]]
    assert gas == sorted(gas)
    assert len(gas) == 5
