"""The search of reflexes: what it refuses, what a candidate costs, that it resumes, and files to walk with."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.errors import DataError, PpafoError, StudyError
from ppafo.questions.adapt.answer import Adaptation, Restart, Walked, wearer_text
from ppafo.questions.adapt.problem import line_of, search_of
from ppafo.questions.adapt.solve import JOURNAL, METRICS, adapt, adapt_into_folder, costs_of
from ppafo.storage.result_folder import write_marked_folder
from ppafo.studies.draws import Outcomes
from ppafo.wearers.loading import find_wearer, wearer_of

SHORT = ["run.duration=6 s"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ({"walk": "solenoid"}, "is no walk of a wearer who reacts"),
        ({"walk": "torque-task-solenoid"}, "is no walk of a wearer who reacts"),
        ({"population": 3}, "population = 3: must be at least 4"),
        ({"generations": 0}, "generations = 0: must be at least 1"),
        ({"speed": 4.0}, "speed = 4 m/s: must be at least"),
        ({"adapts": "both"}, "must be one of alike, left, apart"),
        (
            {"overrides": ["wearer.reacts=spastic-calf"]},
            "differ in soleus_stretch, gastrocnemius_stretch; take 'apart'",
        ),
    ],
)
def test_what_cannot_be_searched_is_refused_in_one_line(words: Mapping[str, object], told: str) -> None:
    with pytest.raises(StudyError, match=told) as refusal:
        adapt(**words)  # type: ignore[arg-type]
    assert "\n" not in str(refusal.value)


def test_a_later_fall_costs_less_and_every_walk_less_than_a_fall() -> None:
    search = search_of("reacting", 1.3, "alike", 1, 1, 4, 1, SHORT)
    up, time = [1.0, 0.0, 0.0, 1.0], [6.0, 5.9, 0.5, 6.0]
    shown = {"stays_up": up, "walked_time": time, "walking_speed": [1.3, 1.3, np.nan, 2.0], "muscle_power": [60.0] * 4}

    def model(columns: Mapping[str, NDArray[np.float64]]) -> Outcomes:
        assert set(columns["wearer.start_speed"]) == {0.9 * 1.3, 1.1 * 1.3}
        assert (columns["wearer.left_soleus_force"] == columns["wearer.right_soleus_force"]).all()
        metrics = {name: np.repeat(shown.get(name, [0.0] * 4), 2).astype(float) for name in METRICS}
        return Outcomes(metrics, np.zeros(8, bool), "")

    well, late, early, fast = costs_of(search, model, np.tile(search.before, (4, 1)))
    assert well < fast < late < early
    assert well == pytest.approx(60.0 / (80.0 * 9.81 * 1.3))


@pytest.mark.parametrize("name", ["elderly", "drop-foot", "stiff-ankle", "spastic-calf"])
def test_who_is_found_has_the_muscles_and_joints_of_who_was_searched_with(name: str, tmp_path: Path) -> None:
    search = search_of("reacting", 1.3, "apart", 1, 1, 4, 1, [*SHORT, f"wearer.reacts={name}"])
    nowhere = Walked((), {})
    restart = Restart(1, search.before, (1.0,), nowhere)
    file = tmp_path / "found.toml"
    file.write_text(wearer_text(Adaptation(search, nowhere, (restart,)), restart))
    assert wearer_of(find_wearer(file)) == search.wearer.body


def test_a_search_that_cannot_be_begun_leaves_no_folder(tmp_path: Path) -> None:
    with pytest.raises(PpafoError, match="a walk on a bottle goes by 'ppafo walk' alone"):
        adapt_into_folder("reacting", tmp_path / "out", overrides=[*SHORT, "bottle.name=paper-co2-9oz"])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "line", ['"generation": 1e400, "costs": [1]', '"generation": 0, "costs": [NaN]', '"costs": [1]']
)
def test_a_line_that_no_search_wrote_is_damage(tmp_path: Path, line: str) -> None:
    head = line_of(search_of("reacting", None, "alike", 1, 1, 4, 1, SHORT).document())
    write_marked_folder(tmp_path, {JOURNAL: head + f'{{"restart": 0, "drawn": "", {line}}}\n'.encode()}, "adapt")
    with pytest.raises(DataError, match="is damaged"):
        adapt_into_folder("reacting", tmp_path, restarts=1, generations=1, population=4, overrides=SHORT)


@pytest.mark.long
def test_a_search_that_was_cut_in_the_middle_of_a_line_ends_with_the_same_bits(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    for folder in (whole, cut):
        adapt_into_folder("reacting", folder, restarts=1, generations=2, population=4, overrides=SHORT)
    journal = cut / JOURNAL
    content = journal.read_bytes()
    journal.write_bytes(content[:-20])
    found = adapt_into_folder("reacting", cut, restarts=1, generations=2, population=4, overrides=SHORT)
    assert journal.read_bytes() == content
    contents = [{path.name: path.read_bytes() for path in folder.iterdir()} for folder in (whole, cut)]
    assert contents[0] == contents[1]
    wearer = find_wearer(cut / "wearer-1.toml")
    assert (wearer.left_gains, wearer.right_gains) == found.gains_of(found.restarts[0].gains)
    assert wearer.found == "by search: from healthy-128 seed 1 restart 1 2 generations of 4 towards 1.3 m/s"
    with pytest.raises(StudyError, match=r"holds another search \(seed\)"):
        adapt_into_folder("reacting", cut, restarts=1, generations=2, population=4, seed=2, overrides=SHORT)
    lines = content.splitlines(keepends=True)
    damaged = json.loads(lines[1]) | {"drawn": "0" * 16}
    journal.write_bytes(lines[0] + json.dumps(damaged).encode() + b"\n")
    with pytest.raises(StudyError, match="candidates are not those"):
        adapt_into_folder("reacting", cut, restarts=1, generations=2, population=4, overrides=SHORT)
    journal.write_bytes(lines[0] + b"[1, 2]\n")
    with pytest.raises(DataError, match="is damaged"):
        adapt_into_folder("reacting", cut, restarts=1, generations=2, population=4, overrides=SHORT)
