"""What the page on walks on chips shows is run as it stands there."""

import math
import re
import shlex
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.exports.firmware.catalog import MSP430G2553
from ppafo.exports.firmware.simulators import missing_tools
from ppafo.walking.walk import walk

MISSING = missing_tools(MSP430G2553)
PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "walk-on-a-chip.md").read_text(encoding="utf-8")
COMMANDS = [
    line for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE) for line in block.splitlines()
]
LINES = re.findall(r"^    (flash .*(?:\n    .*)*)", PAGE, re.MULTILINE)


@pytest.mark.parametrize("command", [line for line in COMMANDS if " chip " not in line])
def test_a_command_of_the_page_runs(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)[1:]) == 0
    assert any((tmp_path / "out").iterdir())


@pytest.mark.thorough
@pytest.mark.skipif(bool(MISSING), reason=f"not on this machine: {', '.join(MISSING)}")
@pytest.mark.parametrize("command", [line for line in COMMANDS if " chip " in line])
def test_the_simulated_chip_decides_as_the_page_says(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(shlex.split(command)[1:]) == 0
    said = capsys.readouterr().out
    if "--samples" in command:
        assert "2000, 0 other than" in said
        return
    # Another clang may need other bytes and cycles; decisions and what they come to are the same.
    wanted = [line.strip() for line in LINES[0].splitlines()]
    assert said.strip().splitlines()[-4:] == wanted[-4:]
    assert [line.split()[0] for line in said.strip().splitlines()[2:]] == [line.split()[0] for line in wanted]


def test_what_whole_numbers_cost_is_as_in_the_table() -> None:
    rows = dict(re.findall(r"^\| ([fw].*?) \| ([\d.]+ g \| [\d.]+ deg) \|$", PAGE, re.MULTILINE))
    fixed = "controller.arithmetic=fixed"
    for row, overrides in {
        "floats": (),
        "whole numbers, 12 bits": (fixed, "controller.converter_bits=12"),
        "whole numbers, 10 bits": (fixed,),
        "whole numbers, 8 bits": (fixed, "controller.converter_bits=8"),
    }.items():
        metrics = walk("solenoid", 0.2, overrides).metrics
        angle = math.degrees(metrics["angle_difference"].value)
        assert f"{metrics['gas'].value * 1e3:.4f} g | {angle:.3f} deg" == rows.pop(row)
    assert not rows
