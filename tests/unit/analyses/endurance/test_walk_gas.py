"""The gas of a walk, from its folder as from its result, and how long a bottle lasts for it."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.endurance.discharge import Endurance, discharge, gas_of_walk, largest_flow
from ppafo.analyses.endurance.question import bottle as endurance
from ppafo.cli.main import main
from ppafo.errors import DataError, ScenarioError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE
from ppafo.signals import Channel, Recording
from ppafo.simulation.numbers import with_numbers
from ppafo.walking import WalkResult, load_walk, walk
from ppafo.walking.bottle.coupling import Schedule
from ppafo.walking.loading import on_bottle
from ppafo.walking.motion import walk_of, with_duration

SMALL = ["bottle.gas_mass=20 g", "bottle.volume=30 cm^3"]
"""A bottle that is walked to its end in a second."""


@cache
def solenoid() -> WalkResult:
    return walk("solenoid", minutes=0.1)


def test_a_folder_says_what_the_walk_says(tmp_path: Path) -> None:
    assert main(["walk", "solenoid", "--minutes", "0.1", "--out", str(tmp_path / "walk")]) == 0
    here, read = gas_of_walk(solenoid()), gas_of_walk(tmp_path / "walk")
    assert (read[0].device, read[2]) == (here[0].device, here[2])
    assert largest_flow(read[1]) == largest_flow(here[1])
    assert read[2] == solenoid().metrics["gas"].value


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('{"format": "ppafo endurance"}', "format: must be 'ppafo walk'"),
        ('{"format": "ppafo walk", "configuration": {}}', "does not state the walk and its gas"),
        ('{"format": "ppafo walk", "status": {"kind": "diverged"}}', "the walk diverged, so its gas use"),
        ("[", "is not JSON"),
        ('{"format": "ppafo walk", "status": "completed"}', "status = 'completed' must be a table"),
    ],
)
def test_a_folder_that_says_too_little_is_refused(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "walk.json").write_text(content)
    with pytest.raises(DataError, match=words):
        ppafo.bottle(tmp_path)


def test_the_gas_on_a_bottle_differs_by_its_regulator_and_its_cold() -> None:
    walked = ppafo.walk("solenoid", minutes=0.2)
    found = ppafo.bottle(walked, bottle="co2-16g").found
    assert "on the bottle: mean over its strides (0.678 g at constant set pressure)" in found.origin
    # The regulator of that cartridge, and the mean temperature of its gas at the device, without any bottle.
    causes = {"supply_line.plantarflexion.droop": "3e6 Pa s/kg", "gas.temperature": "11 degC"}
    alone = ppafo.walk("solenoid", overrides=causes, minutes=0.2).metrics["gas"].value
    assert alone == pytest.approx(found.mass_per_stride, rel=0.01)
    assert alone < 0.97 * walked.metrics["gas"].value
    # The same bottle under the mean flow of the walk: as cold where as much gas is left.
    mean = discharge(found.bottle, found.mass_per_stride, found.stride_time, found.mean_flow, Schedule(60.0, 0.0, 60.0))
    drawn = np.linspace(0.008, 0.016, 9)
    for name in ("bottle_temperature", "wall_temperature", "hose_temperature"):
        of_walk, of_mean = (
            np.interp(drawn, recording["bottle_mass"][::-1], recording[name][::-1])
            for recording in (found.recording, mean.recording)
        )
        assert np.abs(of_walk - of_mean).max() < 0.3  # K: a stride takes a twentieth of this bottle


def test_a_warm_bottle_ends_as_the_walk_does_and_gives_no_fewer_strides() -> None:
    walked = walk("solenoid", overrides=["gas.species=air"], minutes=0.1)
    whole = endurance(walked, bottle="air-48ci-3000psi", overrides=["bottle.volume=100 cm^3"])
    found = whole.found
    assert isinstance(found, Endurance)
    assert found.ending == "empty"
    # The walk goes on below the pressure that the regulator needs, with less torque.
    regulator = found.bottle.regulator
    assert found.recording["bottle_pressure"][-1] < regulator.set_pressure + regulator.pressure_margin
    assert found.strides <= found.strides_when_warm <= 1.05 * found.strides
    assert "regulator set to                 50 psi_g, the supply pressure of the device" in str(whole)


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
    assert rested.walking_time > without.walking_time
    assert rested.balance["room"] > 8.0 * without.balance["room"]
    rests = round((rested.total_time - rested.walking_time) / 120.0)
    assert rests == int(rested.walking_time / 10.0)
    mass = rested.recording["bottle_mass"]
    assert mass[0] - mass[-1] == pytest.approx(rested.mass_per_stride * rested.strides)


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
