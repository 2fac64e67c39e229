"""Each remedy that a verdict prints is pasted: as words of the command line, and as tables of the scenario's file."""

import re
import shlex
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.counterfactuals import verdict_of
from ppafo.documents.toml_text import table_lines
from ppafo.loading import load_scenario, reloaded, usage_text
from ppafo.simulation.simulate import simulate
from ppafo.wording import read_by

RAMP = [
    "reference.kind=ramp_hold",
    "reference.start_level=90 deg",
    "reference.level=80 deg",
    "reference.ramp_time=0.2 s",
]
STUCK = ["friction.static_torque=2 N m", "friction.dynamic_torque=1 N m", "run.duration=1 s"]
LEARNS_NOTHING = ["controller.static_torque=0 N m", "controller.load_time=0 s", "controller.friction_torque=0 N m"]
NO_INTEGRAL = ["controller.integral_gain=0 1/(N m s)", "reference.level=4 N m"]
REMEDIES = {
    "supply": ("torque-task-slow-valve", ["reference.level=9 N m"]),
    "gain": ("torque-task-proportional", ["controller.proportional_gain=0.001 1/(N m)", *NO_INTEGRAL]),
    "duration": (
        "torque-task-proportional",
        ["valve.area=1 mm^2", "reference.level=4 N m", "reference.ramp_time=0.3 s"],
    ),
    "pair": ("torque-task-solenoid", ["valve.area=60 mm^2", "valve.opening_delay=20 ms", "reference.level=4 N m"]),
    "kind": ("cylinder-servo", ["controller.kind=pid", "motion.external_torque=1.5 N m", "run.duration=2 s"]),
    "initial": ("cylinder-servo", [*RAMP, "run.duration=1 s", "motion.external_torque=4 N m"]),
    "reference": ("cylinder-servo", ["sensors.delay=10 ms", "reference.frequency=2 Hz", "run.duration=2 s"]),
    "stiffness": ("cylinder-servo", [*STUCK, "controller.angle_stiffness=4 N m/rad", *LEARNS_NOTHING]),
    "dead band": (
        "torque-task-slow-valve",
        [
            "controller.dead_band=0",
            "controller.integral_gain=0 1/(N m s)",
            "reference.level=4 N m",
            "valve.dead_band=0.3",
        ],
    ),
}
"""Set-ups of which each is told another kind of remedy."""


def in_file(scenario: str, tables: str, file: Path) -> Path:
    """Copy a shipped scenario into ``file``, with the tables of a text in place of its own."""
    content = tomllib.loads((files("ppafo") / "scenarios" / f"{scenario}.toml").read_text("utf-8"))
    content |= tomllib.loads(tables)
    top = {name: value for name, value in content.items() if not isinstance(value, dict)}
    lines = [line for name, table in content.items() if name not in top for line in table_lines(name, table)]
    head = [f"{name} = {value if isinstance(value, int) else repr(value)}" for name, value in top.items()]
    file.write_text("\n".join((*head, *lines)), encoding="utf-8")
    return file


@pytest.mark.parametrize(("scenario", "changes"), REMEDIES.values(), ids=REMEDIES)
def test_a_remedy_is_pasted_into_a_command_and_into_a_file_and_both_are_the_run_that_follows(
    scenario: str, changes: list[str], tmp_path: Path
) -> None:
    loaded = load_scenario(scenario, changes)
    with read_by("command line"):
        verdict = verdict_of(simulate(loaded))
        assert verdict.fails
        assert verdict.mended
        (printed,) = re.findall(
            r"; (?:for example, )?with (--set .*) it follows, as a further run shows", verdict.sentence
        )
    mended = reloaded(loaded, verdict.mended)
    # The words are exactly those of the override set.
    assert [word for word in shlex.split(printed) if word != "--set"] == list(verdict.mended)
    command, _, tables = usage_text(mended).partition("\n")
    name, *words = shlex.split(command)[2:]
    assert name == scenario
    assert load_scenario(name, [word for word in words if word != "--set"]) == mended
    pasted = load_scenario(in_file(scenario, tables, tmp_path / "mine.toml"))
    assert simulate(pasted).tracking.follows
    assert simulate(pasted).metrics == simulate(mended).metrics


def test_a_run_prints_its_remedy_in_both_forms_at_the_end_of_its_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    main(["simulate", "torque-task-slow-valve", "--set", "reference.level=9 N m"])
    said = capsys.readouterr().out
    (command,) = re.findall(r"^Command with the remedy\n(ppafo simulate .*)$", said, re.MULTILINE)
    (tables,) = re.findall(r'^set = "ppafo2011"\nvalve = "proportional"\noverrides = (.*)$', said, re.MULTILINE)
    assert '"supply.pressure=90 psi_g"' in tables
    assert main(shlex.split(command)[1:]) == 0
    assert "the torque follows its reference" in capsys.readouterr().out
