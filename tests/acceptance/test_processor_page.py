"""What the pages say of firmware is run as it stands there."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.processor.simulated import missing_tools, try_firmware
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

DOCS = Path(__file__).parents[2] / "docs"
SECTION, EVIDENCE = (
    (DOCS / name).read_text(encoding="utf-8").partition("\n## Firmware\n")[2].partition("\n## ")[0]
    for name in ("how-to/export.md", "evidence.md")
)
COMPILER = "14.0.6"
"""Version of clang that the table of the page was made with."""
simulated = pytest.mark.skipif(bool(missing_tools()), reason=f"not on this machine: {', '.join(missing_tools())}")


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(line, marks=simulated if "--try" in line else ())
        for line in re.findall(r"^ppafo .*$", SECTION, re.MULTILINE)
    ],
)
def test_a_command_of_the_page_runs(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)[1:]) == 0
    assert "--try" in command or any((tmp_path / "out").iterdir())


@simulated
@pytest.mark.parametrize(
    "row", re.findall(r"^\| `(torque-.*?)` \| (.*) \|$", EVIDENCE, re.MULTILINE), ids=lambda row: row[0]
)
def test_the_simulated_processor_needs_what_the_table_says(row: tuple[str, str]) -> None:
    name, *words = shlex.split(row[0])
    found = try_firmware(load_scenario(name, words[1:]), 1000)
    assert found.differences == 0
    version = subprocess.run(["clang", "-dumpversion"], capture_output=True, text=True, check=True).stdout.strip()
    if version == COMPILER:
        numbers = f"{found.flash} | {found.ram} | {found.worst_cycles}, {found.mean_cycles:.0f} | {found.samples} | 0"
        assert numbers == row[1]


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
