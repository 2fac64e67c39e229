"""The file of a walk is that of a scenario: one loading, a motion that says it, the older form, and one run of it."""

import json
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.errors import ScenarioError
from ppafo.loading import json_schema, list_all_scenarios, load_scenario, scenario_from_dict
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of

NAME, SHORT = "proportional", "run.duration=6 s"
MOTION = '\n[motion]\nkind = "walk"\n'


def shipped(name: str) -> str:
    folder = "walking/configurations" if name in ppafo.list_walks() else "scenarios"
    return (resources.files("ppafo") / folder / f"{name}.toml").read_text(encoding="utf-8")


def text_of(name: str) -> str:
    """The file of a walk in its older form, without a motion."""
    return shipped(name).replace(MOTION, "")


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_every_shipped_walk_says_in_its_motion_that_it_is_one() -> None:
    template = (resources.files("ppafo.cli") / "templates" / "walk.toml").read_text(encoding="utf-8")
    texts = {name: shipped(name) for name in ppafo.list_walks()} | {"template": template}
    assert {name: tomllib.loads(text)["motion"]["kind"] for name, text in texts.items()} == {
        name: "walk" for name in texts
    }


def test_a_gait_may_stand_in_the_motion_or_above_and_not_in_both(tmp_path: Path) -> None:
    gait = 'gait = "falisse2019-subject1"\n'
    inside = load_scenario(written(tmp_path, text_of(NAME) + MOTION + gait))
    above = load_scenario(written(tmp_path, gait + text_of(NAME) + MOTION))
    assert walk_of(inside) == walk_of(above)
    assert (
        walk_of(inside).wearer.body_mass == walk_of(inside).gait.body_mass != walk_of(load_walk(NAME)).wearer.body_mass
    )
    with pytest.raises(ScenarioError, match=r"mine\.toml: give either motion\.gait or gait, not both"):
        load_scenario(written(tmp_path, gait + text_of(NAME) + MOTION + gait))


def test_a_gait_beside_a_file_in_another_folder_is_found_by_its_relative_path(tmp_path: Path) -> None:
    gait = (resources.files("ppafo") / "gait" / "normative" / "falisse2019-subject1.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(gait)
    found = load_scenario(written(tmp_path, text_of(NAME) + MOTION + 'gait = "own.toml"\n'))
    shipped = load_scenario(NAME, ["gait=falisse2019-subject1"])
    assert walk_of(found).gait.ankle_angle == walk_of(shipped).gait.ankle_angle


def test_a_dictionary_may_describe_a_walk() -> None:
    content = tomllib.loads(text_of(NAME) + MOTION)
    assert scenario_from_dict(content, [SHORT]).motion == load_scenario(NAME).motion
    assert ppafo.scenario_from_dict(content, ["wearer.body_mass=80 kg"]).name == NAME


MISTAKES: dict[str, tuple[str, str]] = {
    "a reference": (
        '[reference]\nkind = "constant"\nlevel = "3 N m"\n',
        "unknown key 'reference'; allowed here: .*motion",
    ),
    "an angle": (
        'angle = "90 deg"\n',
        r"unknown key 'motion\.angle'; allowed here: kind",
    ),
    "a gait that is a number": ("gait = 3\n", "gait = 3 must be a text"),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_a_mistake_in_a_walk_is_one_line(what: str, tmp_path: Path) -> None:
    added, message = MISTAKES[what]
    with pytest.raises(ScenarioError, match=message):
        load_scenario(written(tmp_path, text_of(NAME) + MOTION + added))


def test_the_schema_of_scenarios_takes_every_shipped_one_and_a_motion_that_is_a_walk() -> None:
    schema = json_schema()
    validator = jsonschema.Draft202012Validator(schema)
    validator.check_schema(schema)
    documents = [tomllib.loads(form(name)) for name in list_all_scenarios() for form in (shipped, text_of)]
    documents.append(tomllib.loads(text_of(NAME) + MOTION + 'gait = "mine.toml"\n'))
    assert [list(validator.iter_errors(document)) for document in documents] == [[]] * len(documents)
    assert list(validator.iter_errors(documents[-1] | {"reference": {"kind": "constant", "level": "1 N m"}}))


def test_simulate_runs_a_walk_with_its_metrics_and_its_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    assert main(["simulate", NAME, "--set", SHORT, "--out", str(folder), "--json"]) == 0
    metrics: Any = json.loads(capsys.readouterr().out)["metrics"]
    walked = ppafo.walk(NAME, overrides=[SHORT]).metrics
    assert {name: metrics[name]["value"] for name in walked} == {name: item.value for name, item in walked.items()}
    assert "rms_error" not in metrics
    assert {"figure.svg", "recording.nc", "report.html", "run.json"} <= {path.name for path in folder.iterdir()}
