"""Recordings of a simulator of another author: the set with the planted numbers predicts them best."""

from pathlib import Path

import pytest

import ppafo
from ppafo.storage import write_csv
from scripts.planted_disagreements import PLANTED, SUPPLY, recorded

pytestmark = [pytest.mark.long, pytest.mark.thorough]

RIGHT = "ppafo2011:actuator.leak.area=0.9 mm^2"


@pytest.mark.parametrize("seed", range(3))
def test_the_planted_leak_wins(seed: int, tmp_path: Path) -> None:
    files = [tmp_path / "first.csv", tmp_path / "second.csv"]
    for number, file in enumerate(files):
        write_csv(file, recorded(PLANTED[0], 100 + 2 * seed + number))
    found = ppafo.validate("ppafo2011", files, overrides=SUPPLY, against=[RIGHT])
    assert PLANTED[0].title == "leak 3 times"
    assert found.ranking is not None
    assert found.ranking.alike == (RIGHT,)
    assert f"{RIGHT} predicts these recordings best; worse" in found.answer().lead[1]
