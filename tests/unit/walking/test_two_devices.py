"""A device on either leg of a wearer who reacts: the second is the mirror of the first, and both draw on one supply."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.engine.pieces import OTHER
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.errors import DataError
from ppafo.metrics import METRICS
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.ensemble.running import lacking
from ppafo.storage.opensim import opensim_recording
from ppafo.walking import load_walk, walk
from ppafo.walking.planning import plan_walk

WALK, BOTH, SHORT = "reacting", "wearer.device_on=both", "run.duration=6 s"
SIDES = (("left", "right"), ("right", "left"))
pytestmark = pytest.mark.long

LATE = (
    *(
        "sensors.force_noise=5 N",
        "sensors.pressure_noise=0.1 psi_d",
        "device.valve=proportional",
        "valve.delay=7.35 ms",
    ),
    *("supply_line.plantarflexion.volume=8 cm^3", "supply_line.dorsiflexion.volume=8 cm^3"),
)
"""Noise, commands that come late, and lines."""


def mirrored_path(path: str, paths: dict[str, int]) -> str:
    """The row of the other side; the path itself for what both sides share."""
    if path.startswith(OTHER):
        return path.removeprefix(OTHER)
    if f"{OTHER}{path}" in paths:
        return f"{OTHER}{path}"
    return next((path.replace(one, other, 1) for one, other in SIDES if one in path), path)


def mirrored(rows: Floats, paths: dict[str, int]) -> Floats:
    """Rows (rows, ...) with left and right in each other's place."""
    return rows[[paths[mirrored_path(path, paths)] for path in paths]]


@pytest.mark.parametrize("further", [(), pytest.param(LATE, marks=pytest.mark.thorough)])
def test_a_wearer_who_begins_mirrored_walks_mirrored_to_the_bit(further: tuple[str, ...]) -> None:
    batch = batch_of(plan_walk(load_walk(WALK, [BOTH, SHORT, *further])))
    states, parameters = (
        row_numbers(groups) for groups in (batch.program.state_rows(), batch.program.parameter_rows())
    )
    other_way = Batch(
        batch.program, batch.clock, mirrored(batch.parameters, parameters), mirrored(batch.states, states)
    )
    assert not np.array_equal(other_way.states, batch.states)
    walked, found = (run_batch(one).record[:, :, 0].T for one in (batch, other_way))
    assert np.nanmax(walked[states[f"{OTHER}walk.strides"]]) > 3.0
    assert mirrored(found, states).tobytes() == walked.tobytes()


def test_a_study_reads_what_a_walk_reads_and_gas_is_that_of_both() -> None:
    result = walk(load_walk(WALK, [BOTH, SHORT]))
    names = ["gas", "total_gas", "gas_supplied", "walking_speed", "lowest_toes", "net_push_off_work"]
    scenario = load_walk(WALK, [BOTH, SHORT])
    push, walks = "wearer.push", [result, walk(load_walk(WALK, [BOTH, SHORT, "wearer.push=900 N"]))]
    assert [item.metrics["stays_up"].value for item in walks] == [1.0, 0.0]
    outcome = run_ensemble(scenario, {push: np.array([0.0, 900.0])}, names)
    for run, item in enumerate(walks):
        for name in names:
            value = item.metrics["total_gas" if name == "gas_supplied" else name].value
            assert outcome.metrics[name][run] == pytest.approx(value, rel=1e-12), name
    run = plan_walk(scenario)
    rows, record = row_numbers(run.program.state_rows()), run_batch(batch_of(run)).record
    left, right = (record[-1, rows[f"{side}state.supplied_mass"], 0] for side in ("", OTHER))
    assert min(left, right) > 1.0e-3
    assert result.metrics["total_gas"].value == pytest.approx(left + right, rel=1e-12)
    for name in ("work_per_gas", "mechanical_work", "largest_pressure"):
        assert lacking(scenario, METRICS[name]) == "it is of one device, and there are two"
    with pytest.raises(DataError, match="a wearer who reacts walks on two legs"):
        opensim_recording(result.recording)


@pytest.mark.thorough
def test_a_fault_is_that_of_the_left_device_and_the_right_one_goes_on() -> None:
    stuck = ("faults.valve_1.kind=stuck", "faults.valve_1.time=2 s", "shut_off.area=10 mm^2")
    result = walk(load_walk(WALK, [BOTH, SHORT, *stuck]))
    late = result.recording.time > 3.0
    assert {event.leg for event in result.events} == {"left leg"}
    assert result.metrics["vented_strides"].value > 1.0
    assert np.ptp(result.recording["other_command"][late]) > 1.0
    assert result.recording["pressure_1"][late].max() < 0.5 * result.recording["other_pressure_1"][late].max()


@pytest.mark.thorough
def test_an_empty_bottle_ends_the_help_on_both_legs() -> None:
    empty = ("faults.bottle.kind=empty", "faults.bottle.time=2 s", "faults.bottle.lag=0.2 s")
    result = walk(load_walk(WALK, [BOTH, SHORT, *empty]))
    late = result.recording.time > 3.5
    assert [event.leg for event in result.events] == ["left leg", "right leg"]
    for channel in ("pressure_1", "other_pressure_1"):
        assert result.recording[channel][late].max() < 1.3e5


@pytest.mark.thorough
def test_strides_with_less_help_are_those_of_either_leg() -> None:
    """Noise of the sensors pauses the right controller alone."""
    given = [BOTH, SHORT, "sensors.force_noise=40 N"]
    result = walk(load_walk(WALK, given))
    assert {event.leg for event in result.events} == {"right leg"}
    assert not result.recording["safe_state"].any()
    names = ["helped_strides", "vented_strides", "safe_state_time"]
    assert result.metrics["vented_strides"].value > 0.0
    outcome = run_ensemble(load_walk(WALK, given), {"wearer.start_speed": np.array([1.3])}, names)
    assert [outcome.metrics[name][0] for name in names] == [result.metrics[name].value for name in names]


@pytest.mark.thorough
def test_a_bottle_gives_what_both_devices_take() -> None:
    one, two = (walk(load_walk(WALK, [*more, SHORT], bottle="paper-co2-9oz")) for more in ((), (BOTH,)))
    assert one.supply is not None
    assert two.supply is not None
    for result, supply in ((one, one.supply), (two, two.supply)):
        assert supply.regulated == pytest.approx(result.recording["regulated_mass"][-1], rel=1e-6)
    assert two.supply.regulated > 1.7 * one.supply.regulated


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            ("walk", WALK, "--set", "wearer.device_on=right"),
            "wearer.device_on = 'right' is not allowed; allowed: left, both",
        ),
        (("walk", "solenoid", "--set", BOTH), 'needs a wearer who reacts: give wearer.reacts = "NAME"'),
        (("export", "c", WALK, "--interface", "plant", "--set", BOTH), "knows one device: leave wearer.device_on out"),
    ],
)
def test_what_takes_one_device_says_so_in_a_line(
    given: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*given, *(() if given[0] == "walk" else ("--out", str(tmp_path / "out")))]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
