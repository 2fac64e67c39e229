"""The wearer comes with the gait that is named; what a walk file states wins, and any discrepancy is reported."""

from dataclasses import replace
from pathlib import Path

import pytest

from ppafo.errors import ScenarioError
from ppafo.gait import load_gait
from ppafo.gait.document import gait_toml
from ppafo.walking import load_walk
from ppafo.walking.motion import person_remarks, walk_of
from ppafo.walking.wearer import paper_subject


def gait_file(folder: Path, body_mass: float, stature: float | None = None, tilt: float = 0.0) -> Path:
    gait = load_gait()
    ankle = replace(gait.ankle_angle, mean=gait.ankle_angle.mean + tilt)
    path = folder / "mine.toml"
    path.write_text(gait_toml(replace(gait, name="mine", body_mass=body_mass, stature=stature, ankle_angle=ankle)))
    return path


def test_the_subject_of_a_named_gait_walks(tmp_path: Path) -> None:
    found = load_walk("solenoid", gait=gait_file(tmp_path, 85.07))
    paper = paper_subject()
    assert walk_of(found).wearer.body_mass == pytest.approx(85.07)
    assert walk_of(found).wearer.foot_mass == pytest.approx(paper.foot_mass * 85.07 / 72.5)
    assert walk_of(found).wearer.shank_length == paper.shank_length, "no stature: lengths stay"
    assert person_remarks(found) == ["wearer: 85.07 kg, the subject of gait 'mine'"]


def test_a_stature_scales_lengths_and_inertias(tmp_path: Path) -> None:
    found = walk_of(load_walk("solenoid", gait=gait_file(tmp_path, 85.07, 1.70))).wearer
    paper, taller = paper_subject(), 0.246 * 1.70 / 0.46
    assert found.shank_length == pytest.approx(0.246 * 1.70)
    assert found.toe_lever == pytest.approx(paper.toe_lever * taller)
    assert found.foot_inertia == pytest.approx(paper.foot_inertia * 85.07 / 72.5 * taller**2)
    assert found.ankle_stiffness == paper.ankle_stiffness


def test_segments_follow_a_stature_that_is_given_and_the_body_mass_but_for_those_that_are_given() -> None:
    changes = ("wearer.stature=1.75 m", "wearer.body_mass=90 kg", "wearer.toe_lever=0.2 m")
    found, paper, length = walk_of(load_walk("solenoid", changes)).wearer, paper_subject(), 0.246 * 1.75 / 0.46
    assert (found.stature, found.body_mass, found.toe_lever) == (1.75, 90.0, 0.2)
    assert found.shank_length == pytest.approx(0.246 * 1.75)
    assert found.heel_lever == pytest.approx(paper.heel_lever * length)
    assert found.foot_mass == pytest.approx(paper.foot_mass * 90.0 / 72.5)
    assert found.shank_inertia == pytest.approx(paper.shank_inertia * 90.0 / 72.5 * length**2)
    alone = walk_of(load_walk("solenoid", ["wearer.body_mass=90 kg"])).wearer
    assert alone == replace(paper, body_mass=90.0), "without a stature segments stay as they are"


def test_a_stature_beyond_those_of_adults_is_said() -> None:
    (adult,) = person_remarks(load_walk("solenoid", ["wearer.stature=1.75 m"]))
    assert "1.75 m" in adult
    (child,) = person_remarks(load_walk("solenoid", ["wearer.stature=1.2 m", "wearer.body_mass=20 kg"]))
    assert all(number in child for number in ("1.2 m", "1.45 to 2 m", "37 to 105 kg"))
    (thin,) = person_remarks(load_walk("solenoid", ["wearer.body_mass=30 kg"]))
    assert "72.5 kg; wearer.stature" in thin
    with pytest.raises(ScenarioError, match=r"wearer\.stature=3 m.* 2\.5 m"):
        load_walk("solenoid", ["wearer.stature=3 m"])


def test_a_gait_that_the_walk_file_names_brings_its_subject_too(tmp_path: Path) -> None:
    gait_file(tmp_path, 90.0)
    path = tmp_path / "walk.toml"
    device = "[device]\nset = 'ppafo2011'\nvalve = 'solenoid'\n[controller]\nkind = 'event_on_off'\n"
    path.write_text("schema_version = 1\nname = 'own'\ngait = 'mine.toml'\n" + device)
    assert walk_of(load_walk(path)).wearer.body_mass == 90.0
    path.write_text("schema_version = 1\nname = 'own'\n" + device + "[wearer]\nbody_mass = '75 kg'\n")
    assert walk_of(load_walk(path)).wearer == replace(paper_subject(), body_mass=75.0)


def test_a_stated_body_mass_wins_and_the_difference_is_said(tmp_path: Path) -> None:
    path = gait_file(tmp_path, 85.07)
    found = load_walk("solenoid", ["wearer.body_mass=90 kg"], gait=path)
    assert walk_of(found).wearer.body_mass == 90.0
    (said,) = person_remarks(found)
    assert all(part in said for part in ("90 kg", "wearer.body_mass", "'mine'", "85.07 kg"))
    (same,) = person_remarks(load_walk("solenoid", ["wearer.body_mass=85.07 kg"], gait=path))
    assert "'mine'" not in same


def test_a_subject_who_cannot_wear_the_device_is_refused_with_the_key(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"wearer\.body_mass.* 6 kg.* 10 to 300 kg"):
        load_walk("solenoid", gait=gait_file(tmp_path, 6.0))
