"""The commands of the page on trajectory fits are run as they stand there, on recordings of the simulated bench."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from tests.page_code import assert_shows

WHOLE = (Path(__file__).parents[2] / "docs" / "how-to" / "identify.md").read_text(encoding="utf-8")
PAGE = WHOLE.partition("\n## Fit recordings of motion\n")[2].partition("\n## ")[0]
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.strip().splitlines()]
PLANTED = {
    "foot_plate.inertia": 0.010,
    "friction.viscous_damping": 0.025,
    "valves.proportional.discharge_coefficient": 0.13,
    "friction.static_torque": 0.45,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The working folder after the commands of the page."""
    home = tmp_path_factory.mktemp("page")
    toml = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0]
    (home / "problem.toml").write_text(toml)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(home)
        for command in COMMANDS:
            assert main(shlex.split(command)[1:]) == 0
    return home


@pytest.fixture(scope="module")
def document(folder: Path) -> dict[str, Any]:
    """What the fit says of itself."""
    found: dict[str, Any] = json.loads((folder / "identified" / "identify.json").read_text())["trajectory"]
    return found


@pytest.mark.short
def test_what_was_planted_in_the_rig_is_found(document: dict[str, Any]) -> None:
    estimates = {item["path"]: item for item in document["estimates"]}
    for path, planted in PLANTED.items():
        half_width = 0.5 * (estimates[path]["high"] - estimates[path]["low"])
        assert estimates[path]["verdict"] == "identified"
        # Three standard errors: 3/1.96 half widths.
        assert abs(estimates[path]["value"] - planted) < 3.0 / 1.96 * half_width, path


def test_the_trigger_was_not_late_and_the_recordings_agree(document: dict[str, Any]) -> None:
    (offset,) = [item for item in document["tolerances"] if item["name"].startswith("recording.time_offset")]
    assert abs(offset["after"]) < 1e-4
    assert document["conflict"] is None
    assert document["remarks"] == []
    assert document["recordings_are"] == "synthetic"


def test_the_output_on_the_page_is_that_of_the_command(folder: Path) -> None:
    shown = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)[0]
    printed = (folder / "identified" / "identify.txt").read_text()

    def without_digits(text: str) -> str:
        # Last digits may differ from computer to computer.
        return "\n".join(" ".join(re.sub(r"[-+]?\d[\d.e+-]*\d", "0", line).split()) for line in text.splitlines())

    assert_shows(without_digits(shown), without_digits(printed))
