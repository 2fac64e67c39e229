"""``ppafo new``."""

import json
import re
from pathlib import Path

import pytest

from ppafo import load_device, load_parameter_set, simulate
from ppafo.cli.main import main
from ppafo.cli.new import KINDS
from ppafo.kinds import kind_at
from ppafo.parameters.audit import findings_of

SHIPPED = [(kind, name) for kind, new in KINDS.items() for name in new.library.names()]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_every_template_loads_as_it_is_under_its_new_name(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, "my-own", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == "my-own.toml"
    made = kind_at(f"{KINDS[kind].module}:{KINDS[kind].loader}")("my-own.toml")
    assert getattr(made, "name", "my-own") == "my-own"
    text = Path("my-own.toml").read_text(encoding="utf-8")
    assert 'name = "template"' not in text
    assert text.count("#") > 3


def test_the_set_of_the_template_passes_the_audit() -> None:
    main(["new", "set", "bench"])
    found = findings_of(load_parameter_set("bench.toml"))
    assert [finding.id for finding in found if finding.severity != "note"] == ["template-sources"]
    assert load_device("bench.toml").valve.kind == "proportional"


@pytest.mark.parametrize("device", ["ppafo2011", "my-device.toml"])
def test_the_task_of_the_template_is_followed_smoothly_by_the_device_of_the_paper_and_by_that_of_the_template(
    device: str,
) -> None:
    main(["new", "set", "my-device"])
    main(["new", "scenario", "my-task"])
    metrics = simulate("my-task.toml", [f"device.set={device}"]).metrics
    assert metrics["rms_error"].value < 0.1
    assert metrics["switchings"].value <= 2


@pytest.mark.parametrize(("kind", "source"), SHIPPED)
def test_every_file_of_the_package_is_copied_under_a_new_name_and_loads(kind: str, source: str) -> None:
    assert main(["new", kind, "my-own", "--from", source]) == 0
    made = Path("my-own.toml").read_text(encoding="utf-8")
    first = KINDS[kind].library.read(source).decode()
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
