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
    # Between two steps nothing presses for a moment: a torque that comes back in every stride is never safe.
    (other,) = (item for item in bare.risks if item.part == "valve_2")
    assert (other.time_to_safe_state, other.left > 8.0) == (None, True)


def test_numbers_are_the_worst_of_all_instants_and_an_instant_without_an_alarm_shows(bare: Risks, safe: Risks) -> None:
    (late,) = (item for item in bare.risks if (item.part, item.kind) == ("controller", "late"))
    assert "none" in late.sign.split(", ")
    assert late.time_to_alarm is None
    (found,) = (item for item in safe.risks if (item.part, item.kind) == ("controller", "late"))
    assert (found.sign, found.what_is_left) == ("silent_controller", "no help until it is switched on again")
    (creeping,) = (item for item in bare.risks if (item.part, item.kind) == ("regulator_1", "creeping"))
    assert creeping.time_to_safe_state is not None
    assert creeping.time_to_safe_state >= (creeping.time_to_alarm or 0.0) > 4.0


def test_causes_have_their_size_signs_their_meaning_and_what_follows(bare: Risks) -> None:
    causes = {item.cause for item in bare.risks}
    assert {"valve 1 stuck (opening 1)", "hose 2 kinked (share 0.1)", "regulator 1 high (pressure 120 psi_g)"} <= causes
    shown = answer_of(bare).sections[1].table
    assert shown is not None
    meanings = {str(name): str(left) for name, _, left in shown.rows}
    assert meanings["no_heel"] == "the foot is lifted, without push-off"
    assert {name for item in bare.risks for name in item.sign.split(", ")} - {"none"} == set(meanings)


def test_without_a_fault_the_walk_is_what_it_is_and_the_toes_are_clear(bare: Risks) -> None:
    assert bare.sound_peak < 2.0
    assert bare.sound_toes > bare.bare_toes


def test_the_table_says_that_it_is_a_simulation_in_every_form(safe: Risks) -> None:
    answer = answer_of(safe)
    assert SAYS in answer.lead
    assert answer.data["simulated"] is True
    head, *rows = risks_csv(safe).decode().splitlines()
    assert head.startswith("# simulated")
    given = list(csv.DictReader(rows))
    assert len(given) == len(safe.risks)
    assert all(row["severity"] == row["probability"] == "" and row["hazard"] for row in given)


def test_a_walk_does_not_replace_a_table_of_risks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_marked_folder(tmp_path / "risks", {"risks.csv": b"kept"}, "walk --risks")
    assert main(["walk", "solenoid", "--minutes", "0.1", "--out", str(tmp_path / "risks")]) == 2
    assert "--out" in capsys.readouterr().err
    assert (tmp_path / "risks" / "risks.csv").read_bytes() == b"kept"
