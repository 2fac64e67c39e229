"""A reference of an angle or a pressure, from the file to the numbers, through every door."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.running import simulate
from ppafo.simulation.ensemble import COMPLETED, REFUSED, run_ensemble
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario

PSI = 6894.757293168361


def document(of: str, level: str, law: str = "pid", **sections: Mapping[str, Any]) -> dict[str, Any]:
    """A scenario that goes to a level of something and stays there."""
    return {
        "schema_version": 1,
        "name": "held",
        "device": {"set": "ppafo2011", "valve": "proportional"},
        "run": {"duration": "0.5 s", "step": "1 ms", "output_interval": "1 ms"},
        "motion": {"kind": "locked", "angle": "90 deg"},
        "controller": {"kind": law, "rate": "1 kHz"},
        "reference": {"of": of, "kind": "constant", "level": level},
        **sections,
    }


FREE = {"motion": {"kind": "free", "angle": "80 deg"}}
LEVELS = {"pressure_1": "20 psi_g", "pressure_2": "20 psi_g", "pressure_difference": "-12 psi_d"}


@pytest.mark.parametrize("law", ["pid", "sliding_mode", "damped_proportional"])
@pytest.mark.parametrize("of", LEVELS)
def test_every_law_of_the_error_holds_a_pressure_with_gains_of_the_device(of: str, law: str) -> None:
    run = simulate(scenario_from_dict(document(of, LEVELS[of], law)))
    assert run.metrics[f"final_{of}_error"].value < 0.2 * PSI
    assert run.metrics[f"final_{of}_error"].unit == "Pa_d"
    assert run.metrics["command_reversals"].value <= 4.0
    assert not {"rms_error", "peak_error", "oscillations_hold"} & set(run.metrics)
    assert f"reference_{of}" in run.recording
    assert "reference" not in run.recording


def test_a_gauge_level_counts_from_the_atmosphere_of_the_set_and_moves_with_it() -> None:
    mountain = ["supply.atmospheric_pressure=80 kPa_a"]
    high = scenario_from_dict(document("pressure_1", "20 psi_g"), mountain)
    assert high.reference.level == pytest.approx(80e3 + 20 * PSI)
    low = scenario_from_dict(document("pressure_1", "20 psi_g"))
    assert with_numbers(low, {"supply.atmospheric_pressure": 80e3}).reference.level == pytest.approx(80e3 + 20 * PSI)
    absolute = scenario_from_dict(document("pressure_1", "300 kPa_a"), mountain)
    assert absolute.reference.level == pytest.approx(300e3)


def test_a_profile_has_levels_and_differences() -> None:
    sine = {"reference": {"of": "pressure_1", "kind": "sine", "level": "20 psi_g", "amplitude": "5 psi_d"}}
    scenario = scenario_from_dict({**document("pressure_1", "0 psi_g"), **sine})
    assert scenario.reference.amplitude == pytest.approx(5 * PSI)
    no_level = {"reference": {"of": "angle", "kind": "sine", "amplitude": "5 deg"}}
    with pytest.raises(ScenarioError, match=r"'reference[.]level' is missing"):
        scenario_from_dict({**document("angle", "90 deg", "cascade", **FREE), **no_level})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (document("angle", "170 deg", "cascade", **FREE), r"\[reference\] leaves the stops"),
        (document("angle", "90 deg", "pid"), "prescribes the angle"),
        (document("torque", "2 N m", "cascade", **FREE), "follows a reference of angle, not torque"),
        (document("angle", "90 deg", "feedback_linearisation", **FREE), "reference of torque, not angle.*of = "),
        (document("pressure_1", "20 psi_g", "pid_fixed_point"), "follows a reference of torque"),
        (document("angel", "90 deg", "cascade", **FREE), "reference.*of.*angle"),
        (document("angle", "2 N m", "cascade", **FREE), "reference.level = '2 N m'"),
        (
            document("angle", "90 deg", "cascade", device={"set": "ppafo2011", "valve": "solenoid"}, **FREE),
            "vents both chambers at command 0 and holds no angle",
        ),
        (document("angle", "90 deg", "on_off_dead_zone", **FREE), "'controller.dead_zone' is missing"),
        (
            document("pressure_1", "60 psi_g"),
            "leaves the range of supply and valve.*60 psi_g at 0 s",
        ),
        (document("pressure_2", "-1 psi_g"), "leaves the range of supply and valve.*-1 psi_g"),
        (document("pressure_difference", "-51 psi_d"), "leaves the range.*-50 psi_d to 50 psi_d"),
    ],
    ids=[
        *("beyond stops", "locked", "cascade of torque", "torque law", "fixed point", "name", "unit", "pair", "zone"),
        *("above supply", "below atmosphere", "difference"),
    ],
)
def test_what_cannot_be_followed_is_refused_in_a_line(content: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message) as error:
        scenario_from_dict(content)
    assert "\n" not in str(error.value)


def test_metered_runs_have_what_a_recording_has_whatever_is_controlled() -> None:
    for of, level, rest in (
        ("angle", "95 deg", FREE),
        ("pressure_2", "15 psi_g", {}),
        ("pressure_difference", "9 psi_d", {}),
    ):
        law = "cascade" if of == "angle" else "pid"
        scenario = scenario_from_dict(document(of, level, law, **rest))
        names = [f"rms_{of}_error", f"peak_{of}_error", f"final_{of}_error", f"{of}_oscillations_hold"]
        found = run_ensemble(scenario, {"run.duration": np.full(1, 0.5)}, names, bands=[f"reference_{of}"])
        metrics = simulate(scenario).metrics
        for name in names:
            assert found.metrics[name][0] == pytest.approx(metrics[name].value, rel=1e-9, abs=1e-15), name
        assert found.traces[f"reference_{of}"][-1, 0] == pytest.approx(scenario.reference.level)


def test_an_ensemble_refuses_the_run_whose_pressure_no_supply_gives() -> None:
    scenario = scenario_from_dict(document("pressure_1", "40 psi_g"))
    supplies = 101325.0 + np.array([50.0, 30.0]) * PSI
    found = run_ensemble(scenario, {"supply.pressure": supplies}, ["rms_pressure_1_error"])
    assert found.status.tolist() == [COMPLETED, REFUSED]
    assert ": 40 psi_g" in found.reasons[1]


def test_an_ensemble_refuses_the_run_whose_reference_is_beyond_the_stops() -> None:
    scenario = scenario_from_dict(document("angle", "95 deg", "cascade", **FREE))
    levels = np.radians([90.0, 170.0])
    found = run_ensemble(scenario, {"reference.level": levels}, ["rms_angle_error"])
    assert found.status.tolist() == [COMPLETED, REFUSED]
    assert "[reference] leaves the stops" in found.reasons[1]
    with pytest.raises(ScenarioError, match="'reference'"):
        run_ensemble(scenario, {"reference.level": levels[:1]}, [], bands=["reference"])


def held_angle(scenario: Scenario) -> tuple[float, float, float]:
    """Largest error of the last 0.3 s [rad], reversals of the command, and how far the angle overshoots [rad]."""
    run = simulate(scenario)
    error = run.recording["reference_angle"] - run.recording["angle"]
    late = error[run.recording.time > run.recording.time[-1] - 0.3]
    return float(np.max(np.abs(late))), run.metrics["command_reversals"].value, float(-np.min(error))


def drawn(seed: int) -> tuple[str, ...]:
    """A vane of another size with another joint, valve and clock."""
    draw = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(math.exp(draw.uniform(math.log(low), math.log(high))))

    growth = between(5.0, 50.0)
    return (
        f"actuator.torque_constant={growth} cm^3",
        f"actuator.displacement_per_radian={growth} cm^3/rad",
        f"actuator.dead_volume_1={between(0.5, 2.0) * growth} cm^3",
        f"actuator.dead_volume_2={between(0.5, 2.0) * growth} cm^3",
        f"supply.pressure={between(40.0, 100.0)} psi_g",
        f"valve.area={between(5.0, 30.0)} mm^2",
        f"valve.delay={between(0.5, 6.0)} ms",
        f"foot_plate.inertia={between(4.0, 60.0)} g m^2",
        f"friction.static_torque={0.012 * growth / 10.0} N m",
        f"friction.dynamic_torque={0.009 * growth / 10.0} N m",
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_cascade_with_the_gains_of_a_drawn_device_holds_an_angle(seed: int) -> None:
    content = document("angle", "100 deg", "cascade", **FREE)
    content["run"] = {"duration": "3 s", "step": "1 ms", "output_interval": "1 ms"}
    late, reversals, beyond = held_angle(scenario_from_dict(content, drawn(seed)))
    assert late < math.radians(1.0)
    assert reversals <= 6.0
    assert beyond < math.radians(4.0)


def test_gains_of_a_cascade_move_with_the_device_and_with_the_foot_on_it() -> None:
    content = document("angle", "95 deg", "cascade", **FREE)
    light = scenario_from_dict(content)
    heavy = scenario_from_dict(content, ["foot_plate.inertia=30 g m^2"])
    moved = with_numbers(light, {"foot_plate.inertia": 30e-3})
    assert moved.controller.angle_stiffness == heavy.controller.angle_stiffness != light.controller.angle_stiffness
    swing = load_scenario("swing-foot-angle")
    foot = swing.motion.leg
    assert swing.controller.inertia == pytest.approx(
        swing.device.foot_plate.inertia + foot.foot_inertia + foot.foot_mass * foot.foot_mass_centre**2
    )


@pytest.mark.parametrize(
    ("name", "limit"), [("swing-foot-angle", 2.0), ("cylinder-servo", 0.6)], ids=["swing-foot-angle", "cylinder-servo"]
)
def test_the_servos_that_ship_stay_within_their_degrees(name: str, limit: float) -> None:
    run = simulate(load_scenario(name))
    assert math.degrees(run.metrics["rms_angle_error"].value) < limit
    error = np.degrees(run.recording["reference_angle"] - run.recording["angle"])
    assert np.max(np.abs(error[run.recording.time > 0.1])) < limit
    assert "oscillates" not in str(run)


def test_the_pressure_loop_that_ships_settles_on_its_level() -> None:
    metrics = simulate(load_scenario("pressure-loop")).metrics
    assert metrics["rms_pressure_1_error"].value < 0.3 * PSI
    assert metrics["final_pressure_1_error"].value < 0.03 * PSI
