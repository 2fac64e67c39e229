"""The page on measuring an orthosis, followed on the simulated bench, whose recordings a foreign logger has written."""

import math
import re
import shlex
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.parameters.loading import load_device, load_parameter_set
from ppafo.rig.experiments import record
from ppafo.signals import Recording
from tests.page_code import code_blocks

PAGE = "how-to/measure-an-orthosis.md"
SEED = 21
LEVELS = (20.0, 40.0, 60.0, 80.0)

Column = tuple[str, str, float, float, int]
"""Channel, title, zero [SI], SI units per unit, decimals."""


def gauge(channel: str, title: str, unit: float = PASCALS_PER_PSI, decimals: int = 2) -> Column:
    return channel, title, STANDARD_ATMOSPHERE, unit, decimals


SCALE: tuple[Column, ...] = (
    ("pressure_difference", "p (psi)", 0.0, PASCALS_PER_PSI, 2),
    ("torque", "M (Nm)", 0.0, 1.0, 2),
    ("direction", "up", 0.0, 1.0, 0),
    ("repetition", "round", 0.0, 1.0, 0),
)
FLOW: tuple[Column, ...] = (
    ("command", "u (%)", 0.0, 0.01, 1),
    gauge("upstream_pressure", "before (bar)", 1.0e5, 3),
    gauge("downstream_pressure", "behind (bar)", 1.0e5, 3),
    ("mass_flow", "flow (g/s)", 0.0, 1.0e-3, 3),
)
LEAK: tuple[Column, ...] = (gauge("pressure_1", "p1 (psi)"), gauge("pressure_2", "p2 (psi)"))
RIG: tuple[Column, ...] = (
    ("angle", "angle (deg)", 0.0, math.radians(1.0), 2),
    *LEAK,
    gauge("supply_pressure", "inlet 1 (psi)"),
    gauge("dorsiflexion_pressure", "inlet 2 (psi)"),
    ("command", "u (%)", 0.0, 0.01, 1),
    ("torque", "M (Nm)", 0.0, 1.0, 3),
)
FILES: Mapping[str, tuple[str, tuple[Column, ...], tuple[str, ...]]] = {
    "torque.csv": ("static-torque", SCALE, ()),
    "flow.csv": ("open-valve-flow", FLOW, ()),
    "sweep.csv": ("valve-map", FLOW, ()),
    "leak.csv": ("vane-leak", LEAK, ()),
    "step.csv": ("step-response", RIG, ("motion.kind=free",)),
    "task.csv": ("torque-task", RIG, ()),
}


def foreign(recording: Recording, columns: tuple[Column, ...]) -> str:
    """What the logger of a laboratory writes: semicolons, decimal commas, milliseconds, gauge psi and bar."""
    rows = np.ones(len(recording), dtype=bool)
    if "pressure_difference" in recording:
        rising = np.arange(5.0, 100.0, 5.0)
        levels = np.tile([*rising, *rising[::-1]], 3)
        rows = np.isin(levels, LEVELS)
    cells = [[f"{time:.0f}" for time in 1.0e3 * recording.time[rows]]]
    for channel, _, zero, unit, decimals in columns:
        cells.append([f"{value:.{decimals}f}" for value in (recording[channel][rows] - zero) / unit])
    head = ";".join(("t (ms)", *(column[1] for column in columns)))
    lines = [";".join(row).replace(".", ",") for row in zip(*cells, strict=True)]
    return "\n".join(["# synthetic: the simulated test bench in the place of a laboratory", head, *lines, ""])


def write_laboratory(folder: Path, seed: int = SEED) -> None:
    """Write the recordings of an afternoon on the default bench, and the problem of the page beside them."""
    for name, (experiment, columns, changes) in FILES.items():
        recording = record(experiment, "paper-bench", seed=seed, overrides=list(changes)).recording
        (folder / name).write_text(foreign(recording, columns), encoding="utf-8")
    (folder / "ankle.toml").write_text(code_blocks(PAGE, "toml")[0], encoding="utf-8")


def torque_error(printed: str) -> float:
    """The RMS error of the torque [N m] in what the command prints."""
    (shown,) = re.findall(r"^torque +([\d.]+) N m", printed, re.MULTILINE)
    return float(shown)


@pytest.mark.long
def test_the_commands_of_the_page_lead_from_a_foreign_logger_to_a_torque_that_no_fit_has_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_laboratory(tmp_path)
    monkeypatch.chdir(tmp_path)
    commands = [shlex.split(line)[1:] for line in code_blocks(PAGE, "sh")[0].splitlines()]
    assert len(commands) <= 10
    assert main(commands[0]) == 1, "the step holds for this model only"
    found = load_parameter_set(tmp_path / "identified" / "ankle.toml").numbers
    device = load_device("ppafo2011")
    for path, true in (
        ("actuator.torque_constant", device.actuator.torque_constant),
        ("valves.proportional.discharge_coefficient", 0.113),
    ):
        assert abs(found[path].value - true) <= (found[path].uncertainty or 0.0), path
    assert found["actuator.torque_constant"].origin == "identified"
    capsys.readouterr()
    assert main(commands[1]) == 0
    assert "torque.csv sha256:" in capsys.readouterr().out
    assert main(commands[2]) == 1
    assert torque_error(capsys.readouterr().out) == pytest.approx(0.0296, rel=0.05)
    assert main(commands[3]) == 1
    assert torque_error(capsys.readouterr().out) == pytest.approx(0.28, rel=0.05)
