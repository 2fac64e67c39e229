"""The recipe of the how-to pages on the default bench of the simulated bench, end to end: record, identify, compare."""

import json
from pathlib import Path

import pytest

from ppafo.analyses.identify import Identification, identify
from ppafo.cli.main import main

EXPERIMENTS = ("static-torque", "free-decay", "open-valve-flow", "valve-map", "vane-leak-steady", "vane-leak")
PROBLEM = 'schema_version = 1\nname = "bench"\ndevice.set = "ppafo2011"\n' + "".join(
    f'[[procedure]]\nkind = "{kind}"\nrecordings = ["{kind}.csv"]\n' for kind in EXPERIMENTS
)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all that the default bench records, and the problem."""
    folder = tmp_path_factory.mktemp("bench")
    for kind in EXPERIMENTS:
        assert main(["rig", "simulate", kind, "--seed", "7", "--out", str(folder)]) == 0
    (folder / "problem.toml").write_text(f'{PROBLEM}angle = "90 deg"\n')
    return folder


@pytest.fixture(scope="module")
def found(bench: Path) -> Identification:
    """What the procedures make of it."""
    return identify(bench / "problem.toml").found


def test_every_value_lies_inside_its_interval_or_is_flagged(bench: Path, found: Identification) -> None:
    truth = json.loads((bench / "rig.json").read_text())["recordings"]["valve-map.csv"]
    device = truth["device"]
    true = {
        "actuator.torque_constant": device["actuator"]["torque_constant"],
        "friction.static_torque": device["friction"]["static_torque"],
        "effects.seal_friction.static_per_pressure": device["effects"]["seal_friction"]["static_per_pressure"],
        "friction.viscous_damping": device["friction"]["viscous_damping"],
        "friction.dynamic_torque": device["friction"]["dynamic_torque"],
        "valves.proportional.discharge_coefficient": device["valve"]["discharge_coefficient"],
        "valves.proportional.dead_band": device["valve"]["dead_band"],
        "valve_map.hysteresis": truth["preset"]["values"]["bench.hysteresis"],
        "actuator.leak.area": device["actuator"]["leak"]["area"],
    }
    estimates = {item.path: item for item in found.estimates}
    assert set(true) <= set(estimates)
    missed = {path for path, value in true.items() if not estimates[path].low <= value <= estimates[path].high}
    assert all(not estimates[path].is_identified for path in missed)
    assert len(missed) <= 1


def test_sensors_that_are_a_little_off_are_no_reason_to_refuse(found: Identification) -> None:
    assert {item.path for item in found.estimates if item.is_identified} >= {
        "actuator.torque_constant",
        "friction.static_torque",
        "friction.viscous_damping",
        "valves.proportional.discharge_coefficient",
    }
