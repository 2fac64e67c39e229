"""How a run ends and why, rests, and gas uses from recordings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.endurance.discharge import Endurance, discharge, gas_of_recording
from ppafo.analyses.endurance.question import bottle as endurance
from ppafo.errors import DataError, ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
from ppafo.signals import Channel, Recording
from ppafo.walking.bottle.coupling import Schedule

WITHOUT_REST = Schedule(600.0, 0.0, 86400.0)


def lasting(grams: float, *overrides: str, schedule: Schedule = WITHOUT_REST, peak: float | None = None) -> Endurance:
    """The paper's bottle under a gas use per stride of 1.1 s."""
    mass = grams * 1e-3
    return discharge(load_bottle(PAPER_BOTTLE, overrides), mass, 1.1, peak or mass / 1.1, schedule)


def staircase(mass: float, duration: float, opened: float) -> Recording:
    """A recording in which the gas is taken evenly within the first part [s]."""
    time = np.linspace(0.0, duration, 1001)
    supplied = np.minimum(time / opened, 1.0) * mass
    return Recording("walk", time, {"supplied_mass": Channel(supplied, "kg")}, kind="simulated")


def test_a_small_use_empties_the_bottle_and_a_large_one_freezes_it_out() -> None:
    small, large = lasting(0.05), lasting(1.0)
    assert small.ending == "empty"
    assert large.ending == "too cold"
    assert large.usable_when_warm > 0.03
    assert large.recording["bottle_temperature"][-1] < 230.0
    assert large.strides < 0.8 * large.strides_when_warm
    assert small.strides == pytest.approx(small.strides_when_warm, rel=0.01)


def test_the_end_is_where_the_regulator_just_needs_all_that_the_bottle_has() -> None:
    made = lasting(0.3)
    regulator = made.bottle.regulator
    needed = regulator.set_pressure + regulator.pressure_margin - regulator.droop * made.peak_flow
    pressure = made.recording["bottle_pressure"]
    assert pressure[-1] == pytest.approx(needed, rel=1e-5)
    assert (pressure[:-1] > needed).all()


def test_steps_are_what_was_drawn_over_what_a_step_takes() -> None:
    made = lasting(0.3)
    assert made.strides == pytest.approx(made.balance["regulated"] / 0.3e-3, rel=1e-9)
    assert made.walking_time == pytest.approx(made.strides * 1.1, rel=1e-9)


def test_liquid_begins_to_freeze_where_the_regulator_asks_for_little() -> None:
    made = lasting(3.0, "regulator.set_pressure=20 psi_g")
    assert made.ending == "frozen"
    assert made.recording["bottle_temperature"][-1] == pytest.approx(216.6, abs=0.05)


def test_a_narrow_regulator_ends_the_run_early_for_want_of_flow() -> None:
    wide, narrow = lasting(0.3, peak=4.5e-3), lasting(0.3, "regulator.area=0.5 mm^2", peak=4.5e-3)
    assert narrow.strides < 0.8 * wide.strides
    assert narrow.recording["bottle_pressure"][-1] > 3e6
    assert "is too low to drive the largest flow" in narrow.message
    assert "is too low to maintain the supply pressure" in lasting(0.3).message


def test_a_flow_that_even_the_full_bottle_cannot_give_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"the full bottle passes at most .* g/s"):
        lasting(0.3, "regulator.area=0.01 mm^2", peak=4.5e-3)


def test_the_time_that_was_asked_for_ends_a_run_too() -> None:
    made = lasting(0.1, schedule=Schedule(600.0, 0.0, 300.0))
    assert made.ending == "time is up"
    assert made.total_time == 300.0


def test_rests_let_the_bottle_warm_up_and_give_more_steps() -> None:
    without, rested = lasting(0.5), lasting(0.5, schedule=Schedule(180.0, 900.0, 86400.0))
    assert rested.strides > 1.1 * without.strides
    assert rested.total_time > rested.walking_time
    mass = rested.recording["bottle_mass"]
    resting = (rested.recording.time > 200.0) & (rested.recording.time < 1000.0)
    assert np.ptp(mass[resting]) == 0.0


def test_a_cold_room_shortens_the_run() -> None:
    assert lasting(0.3, "room.temperature=0 degC").strides < lasting(0.3).strides


@pytest.mark.parametrize(
    "given",
    [
        {"walk": 0.0, "rest": 1.0, "longest": 100.0},
        {"walk": 1.0, "rest": 1.0},
        {"longest": 0.0},
        {"walk": 60.0},
        {"stride_time": 0.0},
        {"peak_flow": 1e-4},
    ],
)
def test_schedules_and_numbers_that_cannot_be_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(ParameterError):
        endurance(gas_per_stride=3e-4, **given)  # type: ignore[arg-type]


def test_the_draw_of_a_recording_is_its_gain_its_time_and_its_largest_flow() -> None:
    mass, time, peak = gas_of_recording(staircase(6e-4, 2.2, 0.4), 1.1)
    assert mass == pytest.approx(3e-4)
    assert mass / time == pytest.approx(6e-4 / 2.2)
    assert peak == pytest.approx(6e-4 / 0.4, rel=1e-9)


def test_all_of_a_recording_is_one_step_unless_the_time_of_a_step_is_given() -> None:
    assert gas_of_recording(staircase(6e-4, 2.2, 0.4), None)[0] == pytest.approx(6e-4)


def test_a_recording_lasts_as_the_same_numbers_do() -> None:
    repeated = endurance(staircase(3e-4, 1.1, 1.1)).found
    assert repeated.strides == pytest.approx(lasting(0.3).strides, rel=1e-6)


def test_a_little_gas_that_flows_back_into_the_line_is_taken_off() -> None:
    supplied = Channel(np.array([0.0, 3e-4, 2.9e-4, 6e-4]), "kg")
    recording = Recording("walk", np.array([0.0, 1.0, 1.5, 2.0]), {"supplied_mass": supplied})
    assert gas_of_recording(recording, None)[0] == pytest.approx(6e-4)


@pytest.mark.parametrize(
    ("recording", "stride_time", "words"),
    [
        (staircase(0.0, 2.2, 0.4), None, "would become empty"),
        (staircase(6e-4, 2.2, 0.4), 3.0, "at most 2.2 s"),
        (Recording("a", np.array([0.0, 1.0]), {"angle": Channel(np.zeros(2), "rad")}), None, "no channel"),
        (
            Recording("a", np.arange(3.0), {"supplied_mass": Channel(np.array([0.0, 2e-4, 1e-4]), "kg")}),
            None,
            "falls",
        ),
    ],
)
def test_recordings_that_say_nothing_of_a_gas_use_are_refused(
    recording: Recording, stride_time: float | None, words: str
) -> None:
    with pytest.raises(DataError, match=words):
        gas_of_recording(recording, stride_time)


def test_the_verb_takes_recordings_one_or_several() -> None:
    one, two = staircase(1e-3, 1.0, 0.2), staircase(2e-3, 1.0, 0.2)
    alone = endurance(one)
    assert isinstance(alone.found, Endurance)
    several = endurance([one, replace(two, label="other")], rest=60.0)
    assert [use.mass_per_stride for use in several.found.values()] == pytest.approx([1e-3, 2e-3])
    with pytest.raises(ParameterError, match="the same recording is given twice"):
        endurance([one, one])
    # Two walks of one scenario with other overrides have one name.
    alike = endurance([one, two], rest=60.0).found
    assert list(alike) == [one.label, f"{one.label} (2)"]


def test_a_run_on_another_gas_than_the_bottle_holds_is_refused(tmp_path: Path) -> None:
    ppafo.simulate("torque-task-proportional", ["gas.species=air"]).save(tmp_path / "task")
    with pytest.raises(ppafo.DataError, match=r"uses gas of 28\.9. g/mol, but bottle 'paper-co2-9oz' contains CO2"):
        ppafo.bottle(tmp_path / "task")
    assert ppafo.bottle(tmp_path / "task", bottle="air-48ci-3000psi").found.walking_time > 0.0


def test_the_regulator_of_a_bottle_is_set_to_the_supply_pressure_of_a_run_unless_it_is_stated(tmp_path: Path) -> None:
    ppafo.simulate("torque-task-proportional", ["supply.pressure=6 bar_g"]).save(tmp_path / "task")
    found = ppafo.bottle(tmp_path / "task")
    assert found.found.bottle.regulator.set_pressure == pytest.approx(701325.0)
    assert found.found.recording["bottle_pressure"][-1] >= 701325.0
    assert "(values changed: regulator.set_pressure=6 bar_g)" in str(found)
    stated = ppafo.bottle(tmp_path / "task", overrides=["regulator.set_pressure=5 bar_g"]).found
    assert stated.bottle.regulator.set_pressure == pytest.approx(601325.0)
