"""Wearer files: the shipped ones, those based on another, and what is wrong with a file in one line."""

import re
from pathlib import Path

import pytest

from ppafo.engine.rows import numbers
from ppafo.errors import DataError
from ppafo.wearer.loading import find_wearer, list_wearers, wearer_of
from ppafo.wearer.model.walker import Assist, next_walker
from ppafo.wearer.published import felt_at, first_answer, start_of, start_with_size, with_size

HEALTHY = tuple(name for name in list_wearers() if name.startswith("healthy-"))


def written(folder: Path, text: str) -> Path:
    file = folder / "own.toml"
    file.write_text(f'schema_version = 1\nname = "own"\nsource = "a test"\nstart_speed = "1.3 m/s"\n{text}')
    return file


@pytest.mark.parametrize("name", list_wearers())
def test_every_shipped_wearer_says_how_it_was_found(name: str) -> None:
    wearer = find_wearer(name)
    assert wearer.name == name
    assert wearer.title
    assert wearer.source
    start = re.match("by search: from (.+) seed", wearer.found)
    assert wearer.found == "published" or (start and start[1] in list_wearers())
    assert wearer_of(wearer).weight == pytest.approx(80.0 * 9.81)


def test_at_least_five_healthy_wearers_have_gains_of_their_own() -> None:
    gains = {find_wearer(name).left_gains for name in HEALTHY}
    assert len(gains) == len(HEALTHY) >= 5
    assert all(find_wearer(name).left_gains == find_wearer(name).right_gains for name in HEALTHY)


def test_a_disease_changes_one_leg_and_keeps_the_gains() -> None:
    healthy, spastic = find_wearer("healthy-128"), find_wearer("spastic-calf")
    assert spastic.right_gains == healthy.right_gains
    assert spastic.left_gains == healthy.left_gains._replace(soleus_stretch=0.05, gastrocnemius_stretch=0.05)
    weak = wearer_of(find_wearer("drop-foot"))
    assert weak.left.tibialis.force == 0.25 * weak.right.tibialis.force
    stiff = wearer_of(find_wearer("stiff-ankle"))
    assert (stiff.left.ankle_stiffness, stiff.right.ankle_stiffness) == (40.0, 0.0)
    old, young = wearer_of(find_wearer("elderly")), wearer_of(healthy)
    assert old.right.soleus.force == pytest.approx(0.7 * young.right.soleus.force)
    assert old.left.flexor.velocity == pytest.approx(0.8 * young.left.flexor.velocity)
    adapted = wearer_of(find_wearer("elderly-adapted"))
    assert (adapted.left, adapted.right) == (old.left, old.right)
    assert adapted.left_gains != old.left_gains


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "give [gains] and [found], or based_on alone with the name of a wearer"),
        ('based_on = "healthy-128"\n[found]\nby = "search"\n', "give [gains] and [found], or based_on alone"),
        ('based_on = "drop-foot"\n', "own.toml: based_on = 'drop-foot': 'drop-foot' has no gains of its own"),
        ('based_on = "own.toml"\n', "own.toml' has no gains of its own"),
        ('based_on = ""\n', "based_on = '': must have at least 1 character"),
        ('based_on = "healthy-128"\n[left.gains]\nsoleus_force = true\n', "must be a valid number"),
        ('based_on = "healthy-128"\n[left.gains]\nsoleus_force = "1.2"\n', "must be a valid number"),
        ('based_on = "healthy-128"\n[left.gains]\nknee_stop_angle = 170\n', "must be less than or equal to 4"),
        ('based_on = "healthy-12"\n', "there is no wearer 'healthy-12', did you mean 'healthy-1"),
        ('based_on = "healthy-128"\n[left]\nankle_stiffness = "40 N"\n', "ankle_stiffness = '40 N'"),
        (
            'based_on = "healthy-128"\n[left]\nankle_stiffness = "4 kN m/rad"\n',
            "must be at least 0 and at most 500 N m/rad",
        ),
        ('based_on = "healthy-128"\n[left.strength]\ntibials = 0.1\n', "tibialis"),
        ('based_on = "healthy-128"\n[left.strength]\ntibialis = -0.1\n', "tibialis"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DataError) as refused:
        find_wearer(written(tmp_path, text))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("speed", "said"),
    [("0.1 m/s", "must be at least 0.5 and at most 2 m/s"), ("nan m/s", "does not start with a number; write for")],
)
def test_a_start_speed_is_one_that_a_setting_can_have(tmp_path: Path, speed: str, said: str) -> None:
    file = written(tmp_path, 'based_on = "healthy-128"\n')
    file.write_text(file.read_text().replace("1.3 m/s", speed))
    with pytest.raises(DataError, match=f"own.toml: start_speed = '{speed}'.* {said}"):
        find_wearer(file)


def test_a_leg_keeps_what_both_legs_have_and_a_base_beside_the_file_the_gains_of_each_leg(tmp_path: Path) -> None:
    base = written(tmp_path, 'based_on = "healthy-128"\n').rename(tmp_path / "base.toml")
    gains = "".join(f"{name} = {value!r}\n" for name, value in find_wearer("geyer-herr").left_gains._asdict().items())
    legs = "[right.gains]\ntone = 0.02\n"
    base.write_text(
        base.read_text().replace('based_on = "healthy-128"', f'[found]\nby = "search"\n[gains]\n{gains}{legs}')
    )
    own = find_wearer(
        written(
            tmp_path,
            'based_on = "base.toml"\n[both.strength]\nsoleus = 0.7\nflexor = 0.9\n'
            "[left.strength]\ntibialis = 0.1\nflexor = 0.8\n[left.gains]\nlean = 2.0\n",
        )
    )
    assert own.left_strengths == {"soleus": 0.7, "flexor": 0.8, "tibialis": 0.1}
    assert own.right_strengths == {"soleus": 0.7, "flexor": 0.9}
    published = find_wearer("geyer-herr").left_gains
    assert own.left_gains == published._replace(lean=2.0)
    assert own.right_gains == published._replace(tone=0.02)


def test_who_is_heavier_by_all_masses_and_forces_moves_the_same_way() -> None:
    light = wearer_of(find_wearer("healthy-128"))
    heavy, free, ordered = with_size(light, 1.0, 1.3), Assist(0.0, 0.0, 0.0), first_answer()
    ends = []
    for wearer in (light, heavy):
        walker = start_of(wearer, 1.3)
        for _ in range(300):
            walker = next_walker(wearer, walker, ordered.to_left, ordered.to_right, free, free, 0.0, 1e-4).after
        ends.append(walker)
    assert numbers(ends[1].pose) == pytest.approx(numbers(ends[0].pose), rel=1e-9, abs=1e-12)
    assert numbers(ends[1].left.fibres) == pytest.approx(numbers(ends[0].left.fibres), rel=1e-9, abs=1e-12)
    assert ends[0].left.heel.touches or ends[0].left.ball.touches, "the ground is felt"
    assert heavy.weight == pytest.approx(1.3 * 80.0 * 9.81)


def test_who_is_longer_starts_in_proportion_and_feels_the_same() -> None:
    short = wearer_of(find_wearer("healthy-128"))
    long, start = with_size(short, 1.1, 1.0), start_of(short, 0.0)
    longer = start_with_size(start, 1.1)
    assert longer.pose.y == pytest.approx(start_of(long, 0.0).pose.y, abs=4e-4), "the heel is 3 mm in the ground"
    for felt, again in zip(felt_at(short, start, 1e-4)[:2], felt_at(long, longer, 1e-4)[:2], strict=True):
        assert again._replace(load=felt.load) == pytest.approx(felt, rel=1e-9, abs=1e-9)


def test_of_the_same_size_nothing_changes_by_a_bit() -> None:
    wearer = wearer_of(find_wearer("spastic-calf"))
    assert with_size(wearer, 1.0, 1.0) == wearer
    assert start_with_size(start_of(wearer, 1.3), 1.0) == start_of(wearer, 1.3)
