"""What the page on chips shows is run as it stands there."""

import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.control.fixed.kind import TARGETS
from ppafo.exports.firmware.catalog import CATALOG
from ppafo.exports.firmware.simulator import missing_tools
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "run-on-a-chip.md").read_text(encoding="utf-8")
COMMANDS = [
    line for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE) for line in block.splitlines()
]
LINES = re.findall(r"^    (flash .*(?:\n    .*)*)", PAGE, re.MULTILINE)


@pytest.mark.parametrize("command", [line for line in COMMANDS if " chip " not in line])
def test_a_command_of_the_page_runs(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)[1:]) == 0
    assert any((tmp_path / "out").iterdir())


def of_target(command: str) -> Any:
    """A command, which is skipped where a tool of its target is missing."""
    words = shlex.split(command)
    missing = missing_tools(CATALOG[words[words.index("--target") + 1] if "--target" in words else TARGETS[0]])
    reason = f"not on this machine: {', '.join(missing)}"
    return pytest.param(command, marks=pytest.mark.skipif(bool(missing), reason=reason))


@pytest.mark.parametrize("command", [of_target(line) for line in COMMANDS if " chip " in line])
def test_the_simulated_chip_decides_as_the_page_says(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(shlex.split(command)[1:]) == 0
    said = capsys.readouterr().out
    if "--samples" in command:
        assert "1000, 0 other than" in said
        return
    # Another clang may need other bytes and cycles; decisions and what they come to are the same.
    wanted = [line.strip() for line in LINES[0].splitlines()]
    assert said.strip().splitlines()[-4:] == wanted[-4:]
    assert [line.split()[0] for line in said.strip().splitlines()[2:]] == [line.split()[0] for line in wanted]


def test_what_whole_numbers_cost_is_as_in_the_table() -> None:
    rows = dict(re.findall(r"^\| (.*?) \| ([\d.]+ N m \| [\d.]+ g) \|$", PAGE, re.MULTILINE))
    fixed = "controller.arithmetic=fixed"
    for row, overrides in {
        "floats": (),
        "whole numbers, 12 bits": (fixed,),
        "whole numbers, 8 bits": (fixed, "controller.converter_bits=8"),
    }.items():
        metrics = simulate(load_scenario("torque-task-proportional", overrides)).metrics
        found = f"{metrics['rms_error'].value:.4f} N m | {metrics['gas_supplied'].value * 1e3:.4f} g"
        assert found == rows.pop(row)
    assert not rows


@pytest.mark.parametrize(
    ("target", "tools"),
    [
        ("msp430f2013", ("make", "clang", "ld.lld", "mspdebug")),
        ("cortex-m0", ("make", "arm-none-eabi-gcc", "qemu-system-arm")),
    ],
)
def test_the_tools_that_are_asked_for_are_looked_for(target: str, tools: tuple[str, ...]) -> None:
    assert missing_tools(CATALOG[target]) == tuple(tool for tool in tools if shutil.which(tool) is None)
