"""The gas path for a weak leg on the page of evidence: its table of gas, toes and minutes, and its study."""

import re
from pathlib import Path

import pytest

import ppafo
from ppafo.studies.loading import load_study
from ppafo.walking import load_walk, walk

PAGE = (Path(__file__).parents[2] / "docs" / "evidence.md").read_text(encoding="utf-8")
ROWS = re.findall(
    r"^\| [^|]+ \| (`[^|]+`)? ?\| ([\d.]+) cm \| ([\d.]+) g \| ([\d.]+) s \| ([\d.]+) min \|$", PAGE, re.M
)
WEARER = ("wearer.name=healthy-128", "wearer.tibialis_strength=0.1", "supply.dorsiflexion_pressure=32 psi_g")


@pytest.mark.long
@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_a_gas_path_of_the_page_has_the_toes_the_gas_and_the_time_that_it_says(row: tuple[str, ...]) -> None:
    changes, toes, gas, time, _ = row
    found = walk(load_walk("reacting", [*WEARER, "run.duration=30 s", *changes.strip("`").split()])).metrics
    assert found["stays_up"].value == 1.0
    assert found["lowest_toes"].value == pytest.approx(0.01 * float(toes), abs=0.001)
    assert found["gas"].value == pytest.approx(1e-3 * float(gas), abs=2e-6)
    assert found["stride_time"].value == pytest.approx(float(time), abs=0.002)


def test_the_bottle_of_the_page_lasts_as_long_as_it_says() -> None:
    assert len(ROWS) == 5
    for _, _, gas, time, minutes in ROWS:
        lasts = ppafo.bottle(gas_per_stride=1e-3 * float(gas), stride_time=float(time), bottle="paper-co2-9oz")
        assert lasts.to_dict()["result"]["walking_time"] / 60.0 == pytest.approx(float(minutes), abs=0.06)


def test_the_study_of_the_page_is_the_one_that_is_shipped() -> None:
    study = load_study("gas-path-for-a-weak-tibialis")
    assert f"--out out/{study.name}" in PAGE
    assert [item.name for item in study.configurations][1:] == [
        "half-the-area",
        "twice-the-area",
        "40-ms-late",
        "twice-the-dead-volume",
    ]
    assert sorted(len(axis.values) for axis in study.axes) == [5, 7]
    assert 5 * 5 * 7 * study.sample.runs == 700
