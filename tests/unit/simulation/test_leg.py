"""A foot on a shank that is led: equation (11) without ground, beside the vane of equation (1)."""

import math
from typing import Any

import numpy as np
import pytest

from ppafo.constants import STANDARD_GRAVITY
from ppafo.control.catalog import PROFILES
from ppafo.control.profiles import Knot, TabulatedProfile, smooth_bounds, smooth_value
from ppafo.engine.rows import rebuilt
from ppafo.errors import ScenarioError
from ppafo.gait import load_gait
from ppafo.metrics import METRICS
from ppafo.model.gait import shank_in_gait
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot
from ppafo.simulation.ensemble import lacking, run_ensemble
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.simulate import simulate
from tests.reference.reference_solver import compare_with_reference

GAIT = "falisse2019-subject1"
OPEN = {"kind": "constant", "command": 1, "rate": "1 kHz"}
SHUT = {"kind": "constant", "command": 0, "rate": "1 kHz"}


def on_leg(shank: dict[str, Any], *overrides: str, law: dict[str, Any] = OPEN, **motion: Any) -> Scenario:
    document = {
        "schema_version": 1,
        "name": "leg",
        "device": {"set": "ppafo2011"},
        "run": {"duration": "0.3 s"},
        "motion": {"kind": "leg", "angle": "60 deg", "shank": shank, **motion},
        "controller": law,
    }
    return scenario_from_dict(document, overrides)


AT_REST = {"kind": "constant", "level": "10 deg"}
SHANKS: dict[str, dict[str, Any]] = {
    "at rest": AT_REST,
    "sine": {"kind": "sine", "amplitude": "20 deg", "frequency": "2 Hz"},
    "smooth": {
        "kind": "smooth",
        "period": "0.3 s",
        **{"value_01": "-5 deg", "time_02": "0.1 s", "value_02": "20 deg", "time_03": "0.2 s", "value_03": "0 deg"},
    },
    "gait": {"kind": "gait", "gait": GAIT, "start": 0.62},
}


@pytest.mark.parametrize("shank", SHANKS.values(), ids=SHANKS)
def test_the_lanes_agree_with_the_reference_solver(shank: dict[str, Any]) -> None:
    found = compare_with_reference(plan_run(on_leg(shank)))
    assert found.angle < 2e-4
    assert found.worst_pressure < 1e-3


def test_the_paper_foot_adds_9_1_g_m2_and_a_weight_of_0_883_n_m() -> None:
    alone = plan_run(load_scenario("torque-task-proportional", ("motion.kind=free", "motion.angle=60 deg")))
    run = plan_run(on_leg(AT_REST))
    assert run.leg is not None
    assert run.plant.inertia - alone.plant.inertia == pytest.approx(9.1e-3)
    upright = ShankNow(0.0, 0.0, 0.0, 0.0, 0.0)
    assert torque_on_foot(run.leg.load, upright, math.radians(90.0)) == pytest.approx(0.883, abs=5e-4)
    assert torque_on_foot(run.leg.load, upright, math.radians(30.0)) == pytest.approx(0.883 * 0.5, abs=5e-4)
    # A shank that lies, ankle in front: the foot points up, and its weight has no lever.
    lying = ShankNow(math.radians(90.0), 0.0, 0.0, 0.0, 0.0)
    assert torque_on_foot(run.leg.load, lying, math.radians(90.0)) == pytest.approx(0.0, abs=1e-9)


def test_a_foot_that_floats_with_its_shank_needs_no_torque_but_its_inertia() -> None:
    load = FootLoad(0.0, 0.02, 0.4, 0.0)
    assert torque_on_foot(load, ShankNow(0.3, 2.0, 5.0, 1.0, 1.0), 1.2) == pytest.approx(0.02 * 5.0)


def test_a_knee_that_falls_freely_takes_the_weight_away() -> None:
    load = FootLoad(0.09, 0.02, 0.4, STANDARD_GRAVITY)
    falling = ShankNow(0.2, 0.0, 0.0, 0.0, -STANDARD_GRAVITY)
    assert torque_on_foot(load, falling, 1.4) == pytest.approx(0.0, abs=1e-12)


def test_energy_of_a_foot_without_friction_on_a_shank_at_rest_is_kept() -> None:
    # No gas, no friction: a pendulum about the ankle, here from 60 deg to wherever 50 ms lead it.
    scenario = on_leg(
        {"kind": "constant", "level": "-30 deg"},
        *("friction.static_torque=0 N m", "friction.dynamic_torque=0 N m", "friction.viscous_damping=0 N m s/rad"),
        *("actuator.torque_constant=1e-9 m^3", "run.duration=50 ms"),
        law=SHUT,
    )
    run = plan_run(scenario)
    assert run.leg is not None
    recording = simulate(scenario).recording
    angle, rate = recording["angle"], recording["angular_velocity"]
    alpha = math.radians(-30.0) - angle + 0.5 * math.pi
    height = run.leg.load.mass_moment * STANDARD_GRAVITY * np.sin(alpha)
    energy = 0.5 * run.leg.load.inertia * rate**2 + height
    assert float(np.ptp(angle)) > 0.05
    assert float(np.ptp(energy)) < 1e-4 * float(np.ptp(height))


def test_t_ex_closes_equation_1_where_the_vane_moves() -> None:
    scenario = on_leg(SHANKS["sine"], "run.duration=80 ms")
    run, recording = plan_run(scenario), simulate(scenario).recording
    rate = recording["angular_velocity"]
    device = scenario.device
    moves = np.flatnonzero(rate > 0.1)[2:-2]
    acceleration = np.gradient(rate, recording.time)[moves]
    assert run.leg is not None
    # The foot plate's own weight and what the turning shank does to it are part of equation (1) on a moving shank.
    plate = FootLoad(0.0, device.foot_plate.inertia, run.leg.load.shank_length, STANDARD_GRAVITY)
    at = [shank_now(scenario, float(time)) for time in recording.time[moves]]
    on_plate = [torque_on_foot(plate, now, angle) for now, angle in zip(at, recording["angle"][moves], strict=True)]
    given = recording["torque"][moves] - device.friction.viscous_damping * rate[moves] - device.friction.dynamic_torque
    left = given + np.array(on_plate) - device.foot_plate.inertia * acceleration
    assert np.allclose(left, recording["external_torque"][moves], atol=0.02)


def shank_now(scenario: Scenario, time: float) -> ShankNow:
    assert isinstance(scenario.motion, FreeMotion)
    assert scenario.motion.leg is not None
    shank = scenario.motion.leg.shank
    kind = PROFILES[shank.kind]
    row = rebuilt(kind.parameters, [shank.settings[item.name] for item in kind.quantities])
    return ShankNow(*kind.value(row, time), 0.0, 0.0)


def test_the_shank_of_a_gait_is_that_of_its_file_from_the_phase_on() -> None:
    gait = load_gait(GAIT)
    run = plan_run(on_leg({**SHANKS["gait"], "start": 0.6}))
    assert run.leg is not None
    now = shank_in_gait(run.leg.shank, 0.1)
    phase = 0.6 + 0.1 / gait.stride_time
    assert now.angle == pytest.approx(float(gait.shank_angle.values_at(phase)), abs=1e-6)
    assert gait.knee_up is not None
    assert now.knee_up == pytest.approx(float(gait.knee_up.values_at(phase)), abs=1e-5)


def test_a_shank_with_corners_is_refused_in_one_line() -> None:
    with pytest.raises(ScenarioError, match=r"motion\.shank\.kind = 'ramp_hold': this profile has corners.* gait"):
        on_leg({"kind": "ramp_hold", "level": "10 deg"})


KNOTS = ((0.0, 1.0), (0.2, 3.0), (0.3, 2.5), (0.9, -1.0))


def table(knots: tuple[tuple[float, float], ...], period: float) -> TabulatedProfile:
    others = [Knot(time, value) for time, value in knots[1:]]
    others += [Knot(1.0e6, 0.0)] * (31 - len(others))
    return TabulatedProfile(0.5, period, knots[0][1], tuple(others))


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_a_smooth_profile_goes_through_its_knots_without_corners(count: int) -> None:
    profile = table(KNOTS[:count], 1.2)
    for time, value in KNOTS[:count]:
        assert smooth_value(profile, time)[0] == pytest.approx(0.5 + value, abs=1e-12)
        assert smooth_value(profile, time + 1.2)[0] == pytest.approx(0.5 + value, abs=1e-9)
    times = np.linspace(0.0, 2.4, 4801)
    values, rates, bends = np.array([smooth_value(profile, float(time)) for time in times]).T
    assert np.allclose(np.gradient(values, times)[2:-2], rates[2:-2], atol=2e-2)
    inner = np.abs(np.diff(bends)) < 1.0
    assert np.allclose(np.diff(rates)[inner], (0.5 * (bends[1:] + bends[:-1]) * np.diff(times))[inner], atol=1e-4)
    lowest, highest = smooth_bounds(profile)
    assert lowest == pytest.approx(values.min(), abs=1e-4)
    assert highest == pytest.approx(values.max(), abs=1e-4)


SWING = "swing-foot"


def test_the_reference_of_the_swing_is_the_torque_that_moves_the_measured_foot() -> None:
    """Newton's second law of the foot on the measured angles, which are differentiated numerically here."""
    scenario = load_scenario(SWING)
    run, device = plan_run(scenario), scenario.device
    gait = load_gait(GAIT)
    assert run.leg is not None
    settings = scenario.reference.settings
    step = 1.0e-4

    def ankle(time: float) -> float:
        phases = gait.stance_share + time / gait.stride_time
        turns = 2.0 * math.pi * np.arange(1, 9) * phases
        curve = gait.ankle_angle
        return curve.mean + float(np.cos(turns) @ curve.cosines[:8] + np.sin(turns) @ curve.sines[:8])

    for number in range(1, 13):
        time = 0.0 if number == 1 else settings[f"time_{number:02}"]
        before, here, after = (ankle(time + shift) for shift in (-step, 0.0, step))
        rate, bend = (after - before) / (2.0 * step), (after - 2.0 * here + before) / step**2
        needed = run.leg.load.inertia * bend - torque_on_foot(run.leg.load, shank_in_gait(run.leg.shank, time), here)
        needed += device.friction.viscous_damping * rate + math.copysign(device.friction.dynamic_torque, rate)
        assert settings[f"value_{number:02}"] == pytest.approx(needed, abs=0.012)


def test_metrics_of_the_swing_are_the_same_in_a_study() -> None:
    pressures = np.array([2.5e5, 3.0e5, 4.0e5])
    names = ("foot_angle_error", "toe_clearance_error")
    study = run_ensemble(load_scenario(SWING), {"initial.pressure_2": pressures}, names)
    for run, pressure in enumerate(pressures):
        alone = simulate(load_scenario(SWING, (f"initial.pressure_2={float(pressure)!r} Pa_a",))).metrics
        for name in names:
            assert study.metrics[name][run] == pytest.approx(alone[name].value, rel=1e-9)


def test_a_leg_at_rest_has_no_error_of_the_foot() -> None:
    assert "foot_angle_error" not in simulate(on_leg(AT_REST)).metrics
    assert lacking(on_leg(AT_REST), METRICS["foot_angle_error"]) == "the metric needs a leg whose shank follows a gait"
    assert lacking(load_scenario(SWING), METRICS["foot_angle_error"]) == ""
