"""Files of others run no code: whatever they say, the module that lies beside them is not imported."""

import json
import os
import sys
import tomllib
from collections.abc import Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

import ppafo
from ppafo import plugins
from ppafo.cli.main import main
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import DataError, PpafoError
from ppafo.metrics import METRICS
from tests.contract.test_hostile_documents import LOADERS

PACKAGE = resources.files("ppafo")
FILES = {
    "parameters": "parameters/sets/ppafo2011.toml",
    "scenario": "scenarios/torque-task-proportional.toml",
    "study": "studies/library/torque-task-uncertainty.toml",
    "tuning": "analyses/tunings",
    "design": "analyses/design/library",
    "walk": "walking/configurations/solenoid.toml",
    "rig": "rig/presets",
    "gait": "gait/normative",
    "bottle": "parameters/bottles/files",
    "publication": "parameters/publications/files/ppafo-2011.toml",
}
"""A file of the package of each kind, or a folder of which the first is taken."""

WRITTEN = {
    "identification": """
schema_version = 1
[set]
name = "evil:KIND"
parent = "evil:KIND"
valve = "evil:KIND"
[[procedures]]
kind = "evil:KIND"
""",
    "columns": """
schema_version = 1
[columns.a]
kind = "evil:KIND"
time = { name = "evil:KIND", unit = "evil:KIND" }
""",
    "gait-map": """
schema_version = 1
[shank_angle]
terms = ["evil:KIND"]
[ankle_angle]
terms = ["evil:KIND"]
positive = "evil:KIND"
""",
}
MOST = 20
"""Texts of a file that are changed, evenly chosen."""

EVIL = """
import builtins
builtins.evil_was_run = True
from dataclasses import replace
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
KIND = replace(CONTROLLERS["on_off"], name="evil")
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The working folder of a notebook, on the search path, with somebody's module and an entry point for it."""
    (tmp_path / "evil.py").write_text(EVIL, encoding="utf-8")
    about = tmp_path / "evil-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n", encoding="utf-8")
    groups = ("controllers", "walking_controllers", "profiles", "metrics", "valves", "actuators", "effects", "motions")
    more = ("gait_forms", "commands")
    text = "".join(f"[ppafo.{group}]\nevil = evil:KIND\n" for group in (*groups, *more))
    (about / "entry_points.txt").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")
    monkeypatch.setattr(plugins, "_named", {})
    monkeypatch.delenv(plugins.VARIABLE, raising=False)
    yield tmp_path
    sys.modules.pop("evil", None)
    for catalogue in (CONTROLLERS, WALKING_CONTROLLERS):
        if "evil:KIND" in set(catalogue):
            del catalogue["evil:KIND"]
    assert not is_run()


def is_run() -> bool:
    return bool(vars(__import__("builtins")).pop("evil_was_run", False))


def text_of(kind: str) -> str:
    if kind in WRITTEN:
        return WRITTEN[kind]
    place = PACKAGE / FILES[kind]
    if place.is_dir():
        place = min((item for item in place.iterdir() if item.name.endswith(".toml")), key=lambda item: item.name)
    return place.read_text(encoding="utf-8")


def with_evil(value: Any, word: str) -> Iterator[Any]:
    """A document, once for each text in it, with a word in the place of that text; and with the word for each key."""
    if isinstance(value, str):
        yield word
    elif isinstance(value, Mapping):
        for key in value:
            yield {word if name == key else name: item for name, item in value.items()}
            yield from ({**value, key: changed} for changed in with_evil(value[key], word))
    elif isinstance(value, list):
        for place, item in enumerate(value):
            yield from ([*value[:place], changed, *value[place + 1 :]] for changed in with_evil(item, word))


def toml(value: Any) -> str:
    """A value as TOML, tables inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value) if isinstance(value, str | bool) else str(value)


def document(value: Mapping[str, Any]) -> str:
    return "".join(f"{json.dumps(key)} = {toml(item)}\n" for key, item in value.items())


@pytest.mark.parametrize("word", ["evil:KIND", "evil"])
@pytest.mark.parametrize("kind", LOADERS)
def test_no_text_of_a_file_imports_the_module_beside_it(kind: str, word: str, folder: Path) -> None:
    whole = tomllib.loads(text_of(kind))
    # Of long files every so many: what a key means does not depend on how often it is there.
    changes = [*with_evil(whole, word)]
    for changed in changes[:: 1 + len(changes) // MOST]:
        file = folder / "given.toml"
        file.write_text(document(changed), encoding="utf-8")
        try:
            LOADERS[kind]("given.toml")
        except PpafoError as error:
            assert "\n" not in str(error)
        assert "evil" not in sys.modules


SCENARIO = text_of("scenario").replace('kind = "pid"', 'kind = "evil:KIND"')
SET = text_of("parameters").replace('kind = "proportional"', 'kind = "evil:KIND"', 1)
WALK = text_of("walk").replace('"event_on_off"', '"evil:KIND"', 1)
STUDY = """
schema_version = 1
name = "small"
[[configurations]]
name = "a"
scenario = "torque-task-proportional"
overrides = ["run.duration=0.1 s"]
[sample]
method = "sobol"
runs = 4
[[vary]]
path = "supply.pressure"
kind = "uniform"
minimum = "45 psi_g"
maximum = "50 psi_g"
[outputs]
metrics = ["rms_error"]
"""
STUDIES = {
    "scenario": STUDY.replace("torque-task-proportional", "scenario.toml"),
    "override": STUDY.replace("run.duration=0.1 s", "controller.kind=evil:KIND"),
    "metric": STUDY.replace("rms_error", "evil:KIND"),
}
OF_A_SCENARIO = (
    "simulate",
    "workbench",
    "compare",
    "find --vary controller.proportional_gain=0.1..0.2 --such-that rms_error<=1",
    "linearise",
    "export c --out out",
    "export fmu --out out",
    "export firmware --out out",
    "new scenario mine --from",
)
OF_A_SET = (
    "sets show",
    "sets audit",
    "sets audit ppafo2011 --parent",
    "new set mine --from",
    "validate recording.csv",
    "rig simulate valve-map --device",
    "simulate torque-task-proportional --set device.set=",
    "walk solenoid --set device.set=",
)
OF_A_STUDY = ("sweep", "sensitivity", "compare --study")
LINES: dict[str, tuple[str, str]] = {
    **{line: (SCENARIO, f"{line} given.toml") for line in OF_A_SCENARIO},
    **{line: (SET, f"{line} given.toml".replace("= ", "=")) for line in OF_A_SET},
    "validate recording.csv": (SET, "validate given.toml recording.csv"),
    "walk": (WALK, "walk given.toml"),
    "export opensim": (WALK, "export opensim given.toml --out out.mot"),
    **{f"{line}, {name}": (text, f"{line} given.toml") for line in OF_A_STUDY for name, text in STUDIES.items()},
    "design": (text_of("design").replace("torque-task-proportional", "scenario.toml"), "design given.toml"),
    "tune": (text_of("tuning").replace("reference.level=4 N m", "controller.kind=evil:KIND"), "tune given.toml"),
}
"""What a file says, and the line of whoever opens it."""


@pytest.mark.parametrize("line", LINES)
def test_no_command_imports_what_its_file_names(line: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, words = LINES[line]
    (folder / "given.toml").write_text(text, encoding="utf-8")
    (folder / "scenario.toml").write_text(SCENARIO, encoding="utf-8")
    (folder / "recording.csv").write_text("time [s],command [1]\n0,0\n0.1,0\n", encoding="utf-8")
    assert "evil:KIND" in text + SCENARIO
    assert main(words.split()) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "--plugin evil.py" in said
    assert "evil" not in sys.modules


def test_the_remedy_of_the_message_works(folder: Path) -> None:
    (folder / "given.toml").write_text(WITHOUT_GAINS, encoding="utf-8")
    with pytest.raises(PpafoError, match=r"plugins=\['evil.py'\]"):
        ppafo.load_scenario("given.toml")
    assert ppafo.load_scenario("given.toml", plugins=["evil.py"]).controller.kind == "evil:KIND"
    assert is_run()


WITHOUT_GAINS = "\n".join(line for line in SCENARIO.splitlines() if "_gain" not in line and "anti_windup" not in line)


@pytest.mark.parametrize(
    "words",
    [
        ["given.toml", "--plugin", "evil.py"],
        ["given.toml", "--plugin", "evil"],
        ["torque-task-proportional", "--set", "controller.kind=evil:KIND"],
    ],
)
def test_a_module_that_the_person_names_is_imported(words: list[str], folder: Path) -> None:
    (folder / "given.toml").write_text(WITHOUT_GAINS, encoding="utf-8")
    assert main(["export", "c", *words, "--out", "out"]) == 0
    assert is_run()


@pytest.mark.parametrize("words", [["--plugin", "absent.py"], ["--plugin", "absent"], ["--plugin", "../"]])
def test_a_module_that_is_not_there_is_one_line(
    words: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "torque-task-proportional", *words]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"ppafo: plugin '{words[1]}': ")
    assert " not found; give " in said
    assert len(said.splitlines()) == 1


METRIC = """
from dataclasses import replace
from ppafo.metrics import METRICS
KIND = replace(METRICS["rms_error"], name="own")
"""


def test_results_never_import_and_need_no_module_of_their_own(folder: Path) -> None:
    (folder / "own_metric.py").write_text(METRIC, encoding="utf-8")
    (folder / "study.toml").write_text(STUDY.replace("rms_error", "own_metric:KIND"), encoding="utf-8")
    made = ppafo.sweep("study.toml", out="out", plugins=["own_metric.py"])
    single = ppafo.simulate("torque-task-proportional").metrics
    assert single["own"] == single["rms_error"]
    del sys.modules["own_metric"], METRICS["own_metric:KIND"]
    plugins._named.clear()
    os.environ.pop(plugins.VARIABLE)
    loaded = ppafo.load_study_results("out")
    assert str(loaded) == str(made)
    loaded.plot()
    assert "own_metric" not in sys.modules
    # Renamed in all documents, it is a name like any other.
    for name in ("study.json", "summary.json"):
        path = folder / "out" / name
        path.write_text(path.read_text(encoding="utf-8").replace("own_metric:KIND", "evil:KIND"), encoding="utf-8")
    with pytest.raises(DataError, match="is damaged"):
        ppafo.load_study_results("out").plot()
    assert main(["export", "figure", "out"]) == 2
    assert "evil" not in sys.modules


def test_no_text_of_a_file_gives_the_terminal_an_order(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = text_of("parameters").replace('source = "', 'source = "\\u001b[31m\\u0007\\r\\u202e', 1)
    (folder / "given.toml").write_text(text, encoding="utf-8")
    assert main(["sets", "show", "given.toml"]) == 0
    said = capsys.readouterr().out
    assert not set("\x1b\x07\r\u202e") & set(said)
    assert "\N{REPLACEMENT CHARACTER}[31m" in said
