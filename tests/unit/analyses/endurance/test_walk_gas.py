"""The gas of a walk, from its folder as from its result, and how long a bottle lasts for it."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.endurance.answer import Endurance, finding_of
from ppafo.analyses.endurance.gas_demand import largest_flow
from ppafo.analyses.endurance.question import bottle as endurance
from ppafo.analyses.endurance.walk_gas import WalkGas, demand_of_walk, read_walk_gas, walk_gas
from ppafo.errors import DataError, ScenarioError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE
from ppafo.signals import Channel, Recording
from ppafo.simulation.numbers import with_numbers
from ppafo.storage.netcdf import netcdf_bytes
from ppafo.walking import WalkResult, load_walk, walk
from ppafo.walking.bottle.course import SupplyBalance
from ppafo.walking.loading import on_bottle
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.result import WALK_FORMAT

SMALL = ["bottle.gas_mass=20 g", "bottle.volume=30 cm^3"]
"""A bottle that is walked to its end in a second."""
STRIDE = 1.0


@cache
def solenoid() -> WalkResult:
    return walk("solenoid", minutes=0.1)


def pulses(strides: float) -> WalkGas:
    """A made-up walk that takes 0.6 g a stride."""
    time = np.arange(0.0, strides * STRIDE + 5e-4, 1e-3)
    channels = {"supplied_mass": Channel(6e-4 * time / STRIDE, "kg")}
    recording = Recording("pulses", time, channels, kind="simulated")
    return WalkGas("pulses", recording, 6e-4, STRIDE, scenario=load_walk("solenoid"))


def folder_of(walk: WalkGas, path: Path) -> Path:
    """What ``ppafo walk`` writes, as far as the gas goes."""
    path.mkdir(parents=True)
    configuration = {"name": walk.name, "gait": {"stride_time": walk.stride_time}}
    if walk.scenario is not None:
        origin = walk.scenario.origin
        said = {"content": origin.content, "overrides": list(origin.overrides), "file": origin.file}
        configuration |= said
    metrics = {"gas": {"value": walk.gas_per_stride, "unit": "kg"}}
    document = {"format": WALK_FORMAT, "configuration": configuration, "metrics": metrics}
    (path / "walk.json").write_text(json.dumps(document))
    (path / "recording.nc").write_bytes(netcdf_bytes(walk.recording, None))
    return path


def test_a_folder_says_what_the_walk_says(tmp_path: Path) -> None:
    here = walk_gas(solenoid())
    read = read_walk_gas(folder_of(here, tmp_path / "walk"))
    assert replace(read, recording=here.recording, scenario=here.scenario) == here
    assert demand_of_walk(read) == demand_of_walk(here)
    assert read.gas_per_stride == solenoid().metrics["gas"].value


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('{"format": "ppafo endurance"}', "is not a result of 'ppafo walk'"),
        ('{"format": "ppafo walk", "configuration": {}}', "'configuration.gait.stride_time' must be a number"),
        (
            '{"format": "ppafo walk", "status": {"kind": "diverged"}}',
            "the walk diverged, so its gas demand cannot be repeated",
        ),
        ("[", "is not JSON"),
        ('{"format": "ppafo walk", "status": "completed"}', "'status' must be a JSON object"),
        ('{"format": "ppafo walk", "configuration": 3}', "'configuration' must be a JSON object"),
    ],
)
def test_a_folder_that_says_too_little_is_refused(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "walk.json").write_text(content)
    with pytest.raises(DataError, match=words):
        read_walk_gas(tmp_path)


def test_the_gas_on_a_bottle_differs_by_its_regulator_and_its_cold() -> None:
    walked = ppafo.walk("solenoid", minutes=0.2)
    draw = ppafo.bottle(walked, bottle="co2-16g").found.draw
    assert "the device walks on the bottle: mean over its strides (0.678 g at constant set pressure; on" in draw.origin
    # The regulator of that cartridge, and the mean temperature of its gas at the device, without any bottle.
    causes = {"supply_line.plantarflexion.droop": "3e6 Pa s/kg", "gas.temperature": "11 degC"}
    alone = ppafo.walk("solenoid", overrides=causes, minutes=0.2).metrics["gas"].value
    assert alone == pytest.approx(draw.mass_per_stride, rel=0.01)
    assert alone < 0.97 * walked.metrics["gas"].value


def test_a_warm_bottle_ends_as_the_walk_does_and_gives_no_fewer_strides() -> None:
    walked = walk("solenoid", overrides=["gas.species=air"], minutes=0.1)
    found = endurance(walked, bottle="air-48ci-3000psi", overrides=["bottle.volume=100 cm^3"]).found
    assert isinstance(found, Endurance)
    assert found.discharge.ending.kind == "empty"
    # The walk goes on below the pressure that the regulator needs, with less torque.
    regulator = found.bottle.regulator
    assert found.discharge.recording["bottle_pressure"][-1] < regulator.set_pressure + regulator.pressure_margin
    assert found.discharge.strides <= found.strides_when_warm <= 1.05 * found.discharge.strides
    assert "regulator set to                 50 psi_g, the supply pressure of the device" in str(finding_of(found))


def test_a_walk_without_gas_lasts_for_ever() -> None:
    with pytest.raises(DataError, match="would become empty"):
        demand_of_walk(replace(pulses(5.0), gas_per_stride=0.0))


def test_the_largest_flow_is_that_of_the_bottles_regulator_where_there_are_lines() -> None:
    recording = walk("solenoid-regulators", minutes=0.1).recording
    channels = {name: Channel(recording[name], recording.unit(name)) for name in ("supplied_mass", "regulated_mass")}
    both = Recording("both", recording.time, channels)
    alone = Recording("alone", recording.time, {"supplied_mass": channels["regulated_mass"]})
    assert largest_flow(both) == largest_flow(alone)
    assert largest_flow(both) != largest_flow(
        Recording("valve", recording.time, {"supplied_mass": channels["supplied_mass"]})
    )


def test_rests_warm_the_bottle_that_is_walked_on() -> None:
    without, rested = (endurance(solenoid(), overrides=SMALL, walk=10.0, rest=rest).found for rest in (0.0, 120.0))
    assert isinstance(without, Endurance)
    assert isinstance(rested, Endurance)
    assert rested.discharge.walking_time > without.discharge.walking_time
    assert isinstance(rested.discharge.balance, SupplyBalance)
    assert isinstance(without.discharge.balance, SupplyBalance)
    assert rested.discharge.balance.room > 8.0 * without.discharge.balance.room
    rests = round((rested.discharge.total_time - rested.discharge.walking_time) / 120.0)
    assert rests == int(rested.discharge.walking_time / 10.0)
    mass = rested.discharge.recording["bottle_mass"]
    assert mass[0] - mass[-1] == pytest.approx(rested.draw.mass_per_stride * rested.discharge.strides)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("proportional", {"wearer.body_mass": 80.0}),
        ("solenoid", {"sensors.force_bandwidth": 20.0}),
        ("solenoid-regulators", {"supply_line.plantarflexion.droop": 1.0e9}),
    ],
)
def test_any_number_that_was_changed_in_python_is_noticed_and_another_length_is_none(
    name: str, numbers: dict[str, float]
) -> None:
    whole = load_walk(name)
    assert walk_of(on_bottle(with_duration(whole, 12.0), PAPER_BOTTLE)).bottle is not None
    with pytest.raises(ScenarioError, match="changed after loading"):
        on_bottle(with_numbers(whole, numbers), PAPER_BOTTLE)
