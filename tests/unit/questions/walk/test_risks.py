"""The table of what can go wrong in a walk: every fault, its worst instant, and what the table says of itself."""

import csv
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.model.plant_faults import PLANT_FAULTS
from ppafo.questions.walk.risks import SAYS, Risks, answer_of, risks_csv, risks_of_walk
from ppafo.storage.result_folder import write_marked_folder
from ppafo.walking.declaration import FAULTY
from ppafo.walking.loading import load_walk

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def bare() -> Risks:
    return risks_of_walk(load_walk("solenoid"))


@pytest.fixture(scope="module")
def safe() -> Risks:
    return risks_of_walk(load_walk("solenoid", ["shut_off.area=10 mm^2"]))


def left(risks: Risks, part: str) -> float:
    return max(item.left for item in risks.risks if item.part == part)


def test_every_fault_of_the_plant_and_each_sensor_is_in_the_table(bare: Risks) -> None:
    causes = {(item.part, item.kind) for item in bare.risks}
    assert {(part, kind) for part, kinds in PLANT_FAULTS.items() for kind in kinds} <= causes
    assert {(sensor, "stuck") for sensor in FAULTY} <= causes


def test_a_shut_off_valve_takes_the_torque_of_a_valve_that_is_stuck_open(bare: Risks, safe: Risks) -> None:
    assert left(bare, "valve_1") > 8.0
    assert left(safe, "valve_1") < 2.0
    (stuck,) = (item for item in bare.risks if item.part == "valve_1")
    assert stuck.hazard == "torque against the wearer"
    assert stuck.time_to_safe_state is None


def test_the_table_says_that_it_is_a_simulation_in_every_form(safe: Risks) -> None:
    answer = answer_of(safe)
    assert SAYS in answer.lead
    assert answer.data["simulated"] is True
    head, *rows = risks_csv(safe).decode().splitlines()
    assert head.startswith("# simulated")
    assert len(list(csv.DictReader(rows))) == len(safe.risks)


def test_a_walk_does_not_replace_a_table_of_risks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_marked_folder(tmp_path / "risks", {"risks.csv": b"kept"}, "walk --risks")
    assert main(["walk", "solenoid", "--minutes", "0.1", "--out", str(tmp_path / "risks")]) == 2
    assert "--out" in capsys.readouterr().err
    assert (tmp_path / "risks" / "risks.csv").read_bytes() == b"kept"
