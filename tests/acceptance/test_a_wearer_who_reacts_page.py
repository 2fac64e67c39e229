"""Pressures and gas of the neuromuscular gait model on the page of evidence are found, and its study is shipped."""

import re
from pathlib import Path

import numpy as np
import pytest

from ppafo.simulation.ensemble import run_ensemble
from ppafo.studies.loading import load_study
from ppafo.units import to_si
from ppafo.walking import load_walk
from ppafo.walking.motion import walk_of

PAGE = (Path(__file__).parents[2] / "docs" / "evidence.md").read_text(encoding="utf-8")
ROOM = 2.0
"""Pressures [psi] by which the condition is surely met, or surely not: about the limit it changes several times."""


@pytest.mark.long
def test_the_pressures_of_the_page_keep_the_toes_clear_at_its_gas() -> None:
    rows = re.findall(r"\| (\d+) % \| (below )?(\d+) psi_g \| ([\d.]+) g \|", PAGE)
    assert len(rows) == 5
    strength = np.array([float(row[0]) / 100.0 for row in rows])
    pressure = np.array([float(row[2]) for row in rows])
    found = run_ensemble(
        load_walk("reacting", ["wearer.name=healthy-128", "run.duration=20 s"]),
        {
            "wearer.tibialis_strength": np.tile(strength, 3),
            "supply.dorsiflexion_pressure": np.array(
                [to_si(float(value), "psi_g", "Pa_a") for value in (*pressure, *(pressure + ROOM), *(pressure - ROOM))]
            ),
        },
        ["lowest_toes", "gas", "stays_up"],
    ).metrics
    at, above, below = np.split(found["lowest_toes"], 3)
    assert (above > 0.01).all()
    assert (below[:4] < 0.01).all()
    assert at[4] > 0.01, "the last one is a bound"
    assert found["stays_up"][:10].min() == 1.0
    np.testing.assert_allclose(found["gas"][:5] * 1e3, [float(row[3]) for row in rows], atol=0.011)


def test_the_study_of_the_page_is_the_one_that_is_shipped() -> None:
    study = load_study("pressure-for-a-weak-tibialis")
    assert f"--out out/{study.name}" in PAGE
    assert [item.scenario.name for item in study.configurations] == ["reacting"]
    assert "healthy-128" in walk_of(study.configurations[0].scenario).label
    assert "12 strengths" in PAGE
    assert "10 pressures" in PAGE
    assert sorted(len(axis.values) for axis in study.axes) == [10, 12]
