"""``ppafo new``."""

import json
import re
import shlex
from importlib import resources
from pathlib import Path

import pytest

from ppafo import load_device, load_parameter_set, load_scenario, load_study, load_walk, simulate
from ppafo.cli.main import build_parser, main
from ppafo.cli.new import KINDS
from ppafo.kinds import kind_at
from ppafo.parameters.audit import findings_of

SHIPPED = [
    (kind, Path(item.name).stem)
    for kind, new in KINDS.items()
    for item in resources.files("ppafo").joinpath(*new.shipped.split("/")).iterdir()
    if item.name.endswith(".toml")
]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_there_is_one_template_for_each_kind() -> None:
    templates = (resources.files("ppafo.cli") / "templates").iterdir()
    assert {item.name for item in templates} == {f"{kind}.toml" for kind in KINDS}


@pytest.mark.parametrize("kind", KINDS)
def test_every_template_loads_as_it_is_under_its_new_name(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, "my-own", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == "my-own.toml"
    made = kind_at(KINDS[kind].load)("my-own.toml")
    assert getattr(made, "name", "my-own") == "my-own"
    text = Path("my-own.toml").read_text(encoding="utf-8")
    assert 'name = "template"' not in text
    assert text.count("#") > 3


def test_the_set_of_the_template_passes_the_audit() -> None:
    main(["new", "set", "bench"])
    found = findings_of(load_parameter_set("bench.toml"))
    assert [finding.id for finding in found if finding.severity != "note"] == ["template-sources"]
    assert load_device("bench.toml").valve.kind == "proportional"


def test_what_a_copy_of_a_set_accepts_lapses_where_it_changes_a_value_of_the_finding(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shipped = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text("utf-8")
    of_child = re.sub(r"^parent = .*$", 'parent = "ppafo2011"', shipped, count=1, flags=re.MULTILINE)
    Path("own.toml").write_text(of_child.replace('name = "ppafo2011"', 'name = "own"', 1), encoding="utf-8")
    same = {finding.id: finding.accepted for finding in findings_of(load_parameter_set("own.toml"))}
    assert same["flow-of-solenoid"].startswith("As for the proportional valve")
    text = Path("own.toml").read_text(encoding="utf-8")
    Path("own.toml").write_text(text.replace("value = 12.6\n", "value = 5.0\n", 1), encoding="utf-8")
    changed = {finding.id: finding for finding in findings_of(load_parameter_set("own.toml"))}
    assert (changed["flow-of-solenoid"].severity, changed["flow-of-solenoid"].accepted) == ("error", "")
    assert changed["flow-of-proportional"].accepted == same["flow-of-proportional"]
    capsys.readouterr()
    assert main(["sets", "audit", "own.toml"]) == 1
    few = capsys.readouterr().out
    assert "[flow-of-solenoid]" in few
    assert "[flow-of-proportional]" not in few
    assert "of them concern no changed value; --all shows them" in few
    assert main(["sets", "audit", "own.toml", "--all"]) == 1
    assert "[flow-of-proportional]" in capsys.readouterr().out


def test_what_was_reported_of_the_paper_s_device_is_no_evidence_on_a_copy(capsys: pytest.CaptureFixture[str]) -> None:
    main(["new", "set", "own", "--from", "ppafo2011"])
    assert "written: own.toml, still with values, sources and citation of ppafo2011; next: " in capsys.readouterr().out
    text = Path("own.toml").read_text(encoding="utf-8")
    assert ("[reported." in text, "[[accepted]]" in text) == (False, False)
    # A valve of one's own, whose flow nobody reported.
    Path("own.toml").write_text(text.replace("value = 12.6\n", "value = 5.0\n", 1), encoding="utf-8")
    assert not [one.id for one in findings_of(load_parameter_set("own.toml")) if one.id.startswith("flow-of")]


@pytest.mark.parametrize("device", ["ppafo2011", "my-device.toml"])
def test_the_task_of_the_template_is_followed_smoothly_by_the_device_of_the_paper_and_by_that_of_the_template(
    device: str,
) -> None:
    main(["new", "set", "my-device"])
    main(["new", "scenario", "my-task"])
    metrics = simulate("my-task.toml", [f"device.set={device}"]).metrics
    assert metrics["rms_error"].value < 0.1
    assert metrics["switchings"].value <= 2


def test_the_walk_of_the_template_takes_the_device_of_the_template() -> None:
    main(["new", "set", "my-device"])
    main(["new", "walk", "my-walk"])
    assert load_walk("my-walk.toml", ["device.set=my-device.toml"]).device.valve_name == "main"


@pytest.mark.parametrize(("kind", "source"), SHIPPED)
def test_every_file_of_the_package_is_copied_under_a_new_name_and_loads(kind: str, source: str) -> None:
    assert main(["new", kind, "my-own", "--from", source]) == 0
    made = Path("my-own.toml").read_text(encoding="utf-8")
    first = (resources.files("ppafo").joinpath(*KINDS[kind].shipped.split("/")) / f"{source}.toml").read_text("utf-8")
    if kind == "set":
        assert f'parent = "{source}"' in made.split("\n")
        # Title and notes are of the device that was copied.
        assert f'title = "my-own, from {source}"' in made.split("\n")
        own = r'^(parent|title) = [^\n]*\n|^notes = """.*?"""\n'
        made, first = (re.sub(own, "", text, flags=re.MULTILINE | re.DOTALL) for text in (made, first))
        parts = re.split(r"^(?=\[)", first, flags=re.MULTILINE)
        first = "".join(part for part in parts if not part.startswith(("[reported.", "[[accepted]]")))
    differing = [line for old, line in zip(first.split("\n"), made.split("\n"), strict=True) if old != line]
    assert 'name = "my-own"' in differing
    assert all(line == 'name = "my-own"' or line.startswith("#   ppafo ") for line in differing)


def test_a_copy_has_the_values_of_its_source() -> None:
    for words in (["scenario", "a", "--from", "step-response"], ["walk", "b", "--from", "solenoid"]):
        main(["new", *words])
    main(["new", "study", "c", "--from", "pressure-and-area"])
    assert load_scenario("a.toml").device == load_scenario("step-response").device
    assert load_walk("b.toml").controller.settings == load_walk("solenoid").controller.settings
    assert load_study("c.toml").paths == load_study("pressure-and-area").paths


def test_a_file_of_ones_own_is_copied_too_and_only_its_own_name_is_changed() -> None:
    main(["new", "study", "first"])
    Path("first.toml").write_text(Path("first.toml").read_text().replace('name = "first"', "name = 'first'"))
    assert main(["new", "study", "second", "--from", "first.toml"]) == 0
    study = load_study("second.toml")
    assert study.name == "second"
    assert [item.name for item in study.configurations] == ["proportional", "solenoid"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_next_command_is_one_that_there_is(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, "my-own", "--out", "out of the way/mine.toml"]) == 0
    line = capsys.readouterr().out.splitlines()
    assert len(line) == 1
    words = shlex.split(line[0].partition("; next: ")[2])
    assert "out of the way/mine.toml" in words
    assert build_parser(words[1:]).parse_args(words[1:]).command == words[1]


def test_a_copy_that_does_not_load_is_not_left(capsys: pytest.CaptureFixture[str]) -> None:
    main(["new", "set", "bench"])
    main(["new", "scenario", "task"])
    text = Path("task.toml").read_text().replace('"ppafo2011"', '"bench.toml"')
    Path("task.toml").write_text(text)
    assert main(["new", "scenario", "task", "--from", "task.toml", "--out", "other/task.toml"]) == 2
    assert "bench.toml" in capsys.readouterr().err
    assert not list(Path().glob("other/*"))


def test_the_command_in_a_new_study_writes_into_a_folder_whatever_the_name_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "st.toml"
    assert main(["new", "study", "st", "--from", "pressure-and-area", "--out", str(file)]) == 0
    assert f"#   ppafo sweep {file} --out out/st\n" in file.read_text(encoding="utf-8")
