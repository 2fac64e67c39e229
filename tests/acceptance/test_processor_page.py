"""What the pages say of firmware and the processor in the loop is run as it stands there."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.processor.catalog import CATALOG, TARGETS
from ppafo.processor.images import missing_tools
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

DOCS = Path(__file__).parents[2] / "docs"
SECTION = (
    (DOCS / "how-to" / "export.md").read_text(encoding="utf-8").partition("\n## Firmware\n")[2].partition("\n## ")[0]
)
COMMANDS = re.findall(r"^ppafo .*$", SECTION, re.MULTILINE)
EVIDENCE = (
    (DOCS / "evidence.md")
    .read_text(encoding="utf-8")
    .partition("\n## Processor in the loop\n")[2]
    .partition("\n## ")[0]
)
FIGURE_8 = re.findall(r"^    (flash .*(?:\n    .*)*)", EVIDENCE, re.MULTILINE)[0].splitlines()
OF_PAGE = {"msp430f2013": "14.0.6", "cortex": "12.2.1"}
"""Versions of the compilers that the table of the page was made with."""


@pytest.mark.parametrize("command", [line for line in COMMANDS if "--try" not in line])
def test_a_command_of_the_page_runs(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)[1:]) == 0
    assert any((tmp_path / "out").iterdir())


def of_target(command: str) -> Any:
    """A command, which is skipped where a tool of its target is missing."""
    words = shlex.split(command)
    given = words[words.index("--target") + 1] if "--target" in words else TARGETS[0]
    names = [] if "--table" in words else [given]
    missing = sorted({tool for name in names for tool in missing_tools(CATALOG[name])})
    reason = f"not on this machine: {', '.join(missing)}"
    return pytest.param(command, marks=pytest.mark.skipif(bool(missing), reason=reason))


@pytest.mark.parametrize("command", [of_target(line) for line in COMMANDS if "--try" in line])
def test_the_simulated_processor_decides_as_the_page_says(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)[1:]) == 0
    text = capsys.readouterr().out.strip()
    said = text.splitlines()
    if "--samples" in command:
        assert said[-1].endswith("1000, 0 different from the fixed-point controller in Python")
    elif "--table" in command:
        check_table(said)
    else:
        # Another clang may need other bytes and cycles; decisions and what they come to are the same.
        wanted = [line.strip() for line in FIGURE_8]
        solenoid, proportional = (lines.splitlines() for lines in text.split("\n\n")[1::2])
        assert proportional[-4:] == wanted[-4:]
        assert [line.split()[0] for line in proportional] == [line.split()[0] for line in wanted]
        assert solenoid[3:5] == [wanted[3].replace("3000", "60"), wanted[4]]
        assert (tmp_path / "out" / "figure-8" / "processor.png").read_bytes().startswith(b"\x89PNG")


def check_table(said: list[str]) -> None:
    """The table is that of the page, where the compilers are; targets without their tools are left out."""
    shown = re.findall(r"^\|(?: target| msp| cortex|---).*$", EVIDENCE, re.MULTILINE)
    table = [line for line in shown if line.count("|") == said[0].count("|")]
    assert len(said) == len(table) == 2 + 4 * len(CATALOG)
    assert said[:2] == table[:2]
    for found, wanted in zip(said[2:], table[2:], strict=True):
        if "not run" in found:
            continue
        cells, others = ([cell.strip() for cell in line.split("|")[1:-1]] for line in (found, wanted))
        assert cells[-2:] == others[-2:] == ["1,000", "0"]
        assert cells[:2] == others[:2]
        if compiler_of(cells[0]) == OF_PAGE[cells[0].partition("-")[0]]:
            assert cells == others


def compiler_of(target: str) -> str:
    """The version of the compiler of a target."""
    tool = "arm-none-eabi-gcc" if target.startswith("cortex") else "clang"
    return subprocess.run([tool, "-dumpversion"], capture_output=True, text=True, check=True).stdout.strip()


def test_what_fixed_point_costs_is_as_in_the_table() -> None:
    rows = dict(re.findall(r"^\| (.*?) \| ([\d.]+ N m \| [\d.]+ g) \|$", EVIDENCE, re.MULTILINE))
    fixed = "controller.kind=pid_fixed_point"
    for row, overrides in {
        "floating point": (),
        "fixed point, 12 bits": (fixed,),
        "fixed point, 8 bits": (fixed, "controller.converter_bits=8"),
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
