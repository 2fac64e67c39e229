"""From a scenario to a result: recordings, status, Python controllers, many at once."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch, write_source
from ppafo.engine.run import TOO_MANY_PARTS, batch_of, state_row_numbers
from ppafo.engine.step import loop
from ppafo.errors import SimulationError
from ppafo.model.sensors import Measurement
from ppafo.running import simulate
from ppafo.simulation.ensemble import COMPLETED, DIVERGED, run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PrescribedMotion, ProfileChoice, Scenario
from ppafo.simulation.simulate import REMEDY, result_of
from tests.reference.reference_solver import compare_with_reference

CHANNELS = {
    "angle",
    "angular_velocity",
    "pressure_1",
    "pressure_2",
    "torque",
    "reference",
    "command",
    "supplied_mass",
    "vented_mass",
    "leaked_mass",
    "external_torque",
    "mass_1",
    "mass_2",
}


class Proportional:
    """A controller as a user would write it."""

    def __init__(self, gain: float = 0.2) -> None:
        self.gain = gain
        self.calls: list[tuple[float, float, Measurement]] = []

    def reset(self) -> None:
        self.calls.clear()

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        self.calls.append((time, reference, measurement))
        return self.gain * (reference - measurement.torque)


def test_recording_has_every_channel_at_every_output_time(torque_task: Callable[[str], Scenario]) -> None:
    result = simulate(torque_task("proportional"))
    assert set(result.recording.names) == CHANNELS
    assert result.recording.time[0] == 0.0
    assert result.recording.time[-1] == pytest.approx(3.0)
    assert np.diff(result.recording.time) == pytest.approx(1e-3)
    assert result.status.kind == "completed"


def test_python_controller_gives_what_the_same_law_in_the_catalogue_gives(
    torque_task: Callable[[str], Scenario],
) -> None:
    base = torque_task("proportional")
    settings = dict.fromkeys(base.controller.settings, 0.0) | {"proportional_gain": 0.2}
    compiled = simulate(dataclasses.replace(base, controller=dataclasses.replace(base.controller, settings=settings)))
    python = simulate(base.controlled_by(Proportional(0.2)))
    assert python.recording["torque"] == pytest.approx(compiled.recording["torque"], abs=1e-9)
    assert np.array_equal(python.recording.time, compiled.recording.time)


def test_python_controller_is_reset_and_then_asked_once_for_every_sample(
    torque_task: Callable[[str], Scenario], shorter: Callable[[Scenario, float], Scenario]
) -> None:
    controller = Proportional()
    scenario = shorter(torque_task("solenoid"), 0.2).controlled_by(controller)
    simulate(scenario)
    simulate(scenario)
    assert [call[0] for call in controller.calls] == pytest.approx([0.0, 0.05, 0.1, 0.15])
    assert [call[1] for call in controller.calls] == pytest.approx([0.0, 0.3, 0.6, 0.9])


def test_python_controller_sees_the_same_late_and_noisy_signals_as_a_compiled_one() -> None:
    loaded = load_scenario("torque-task-slow-valve")
    base = dataclasses.replace(loaded, run=dataclasses.replace(loaded.run, duration=0.3))
    settings = dict.fromkeys(base.controller.settings, 0.0) | {"proportional_gain": 0.2}
    compiled = simulate(dataclasses.replace(base, controller=dataclasses.replace(base.controller, settings=settings)))
    python = simulate(base.controlled_by(Proportional(0.2)))
    assert base.sensors.delay > 0.0
    assert python.recording["command"] == pytest.approx(compiled.recording["command"], abs=1e-9)


def test_a_python_controller_beyond_the_range_of_commands_is_limited_and_a_line_says_so_once(
    torque_task: Callable[[str], Scenario], caplog: pytest.LogCaptureFixture
) -> None:
    class Seven(Proportional):
        def update(self, time: float, reference: float, measurement: Measurement) -> float:
            return 7.0

    scenario = torque_task("proportional").controlled_by(Seven())
    assert simulate(scenario).recording["command"].max() == 1.0
    simulate(scenario)
    assert caplog.messages == [
        "ppafo: Seven.update returned 7 at t = 0 s; commands must be -1 to 1 and are limited to this range"
    ]


def test_diverging_run_is_a_status_with_time_state_and_remedy(step_response: Scenario) -> None:
    run = plan_run(step_response)
    batch = batch_of(run)
    # No file can say it, and no scenario is taken with it: gas below nothing at the start.
    batch.states[state_row_numbers(run)["state.mass_1"]] = -1.0e-4
    result = result_of(step_response, run, run_batch(batch))
    assert result.status.kind == "diverged"
    assert result.status.time is not None
    assert result.status.time < 0.01
    for part in ("diverged at t =", "angle", "mass 1", "smaller run.step"):
        assert part in result.status.message
    assert all(np.isfinite(result.recording[name]).all() for name in result.recording.names)


def test_chamber_too_fast_for_the_shortest_part_is_a_status_that_names_the_volumes() -> None:
    status = simulate(load_scenario("step-response", ["actuator.dead_volume_1=1e-12 m^3"])).status
    assert status.kind == "diverged"
    assert "volumes" in status.message


@pytest.mark.parametrize(
    ("rate", "step", "overrides"),
    [("997 Hz", 1.0 / 997.0 / 2.0, ()), ("29.97 Hz", 1.0 / 29.97 / 34.0, ("sensors.delay=1.3 ms",))],
)
def test_a_sample_period_that_fits_nothing_keeps_a_long_step_and_whole_milliseconds(
    rate: str, step: float, overrides: tuple[str, ...]
) -> None:
    asked = (f"controller.rate={rate}", "run.output_interval=1 ms", "run.duration=0.5 s", *overrides)
    scenario = load_scenario("torque-task-proportional", asked)
    result = simulate(scenario)
    assert result.engine["step"] == pytest.approx(step, rel=1e-12)
    assert result.recording.time == pytest.approx(1e-3 * np.arange(501), abs=1e-12)
    agreement = compare_with_reference(plan_run(scenario))
    assert agreement.worst_pressure <= 1e-3
    assert agreement.worst_rms <= 1e-4


def test_led_vane_follows_its_path_and_reports_the_torque_that_it_takes(
    torque_task: Callable[[str], Scenario],
) -> None:
    sine = ProfileChoice("sine", {"level": 1.3, "amplitude": 0.2, "frequency": 1.0, "phase": 0.0})
    result = simulate(dataclasses.replace(torque_task("proportional"), motion=PrescribedMotion(sine)))
    time = result.recording.time
    assert result.recording["angle"] == pytest.approx(1.3 + 0.2 * np.sin(2 * np.pi * time), abs=1e-8)
    device = result.scenario.device
    rate = result.recording["angular_velocity"]
    acceleration = -0.2 * (2 * np.pi) ** 2 * np.sin(2 * np.pi * time)
    expected = (
        result.recording["torque"]
        - device.friction.viscous_damping * rate
        - device.friction.dynamic_torque * np.sign(rate)
        - device.foot_plate.inertia * acceleration
    )
    assert result.recording["external_torque"] == pytest.approx(expected, abs=1e-6)


def test_separate_dorsiflexion_pressure_is_what_chamber_2_gets() -> None:
    overrides = ["supply.dorsiflexion_pressure=30 psi_g", "controller.command=-1", "motion.angle=90 deg"]
    result = simulate(load_scenario("step-response", [*overrides, "run.duration=1 s", "initial.pressure_2=0 psi_g"]))
    assert result.recording["pressure_2"][-1] == pytest.approx(101325.0 + 30.0 * 6894.757, rel=1e-3)
    assert result.recording["angle"][-1] == pytest.approx(result.scenario.device.actuator.angle_min)


def test_restitution_makes_the_vane_rebound() -> None:
    def largest_backward_speed(restitution: float) -> float:
        result = simulate(load_scenario("step-response", [f"actuator.restitution={restitution}"]))
        return float(-result.recording["angular_velocity"].min())

    assert largest_backward_speed(0.0) < 0.5
    assert largest_backward_speed(0.5) > 1.0


def test_a_step_that_is_not_done_in_the_most_parts_ends_the_run_with_time_and_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A coil that switches inside a step, after 10.3 ms, cuts it in two; here one part is the most."""
    monkeypatch.setattr(loop, "MAXIMUM_PARTS", 1)
    write_source.cache_clear()
    try:
        result = simulate("torque-task-solenoid", ["run.duration=0.1 s", "valve.opening_delay=10.3 ms"])
    finally:
        write_source.cache_clear()
    assert result.status.kind == "diverged"
    assert result.status.time == pytest.approx(0.0103, rel=1e-9)
    assert result.status.message.startswith("diverged at t = 0.0103 s")
    assert result.status.message.endswith(TOO_MANY_PARTS)
    assert result.recording.time[-1] == pytest.approx(0.01)
    assert all(np.isfinite(result.recording[name]).all() for name in result.recording.names)


LIGHT = ["motion.kind=free", "foot_plate.inertia=1e-12 kg m^2"]


def test_a_vane_too_light_to_follow_ends_with_time_and_remedy_at_every_door() -> None:
    result = simulate("step-response", LIGHT)
    assert result.status.kind == "diverged"
    assert result.status.message.endswith(REMEDY)
    assert "check the inertia" in REMEDY
    # No sample that is kept has more than sources and compression can give.
    supply = result.scenario.device.supply
    assert max(result.recording[name].max() for name in ("pressure_1", "pressure_2")) < 1.01 * supply.pressure
    base = load_scenario("step-response", ["motion.kind=free"])
    rows = run_ensemble(base, {"foot_plate.inertia": np.array([1e-12, 1e-9])}, ["largest_pressure"])
    assert rows.status.tolist() == [DIVERGED, COMPLETED]
    assert rows.reasons[0].endswith(REMEDY)
    assert rows.metrics["largest_pressure"][1] < 1.01 * supply.pressure


def test_a_chamber_that_is_driven_far_above_its_supply_completes() -> None:
    driven = ["motion.external_torque=30 N m", "motion.angle=120 deg", "controller.command=0"]
    result = simulate("step-response", ["motion.kind=free", "actuator.dead_volume_1=1 cm^3", *driven])
    assert result.status.is_completed
    assert result.recording["pressure_1"].max() > 3.0 * result.scenario.device.supply.pressure


class WithASlip:
    """A controller with an attribute or a name that is not there."""

    def __init__(self, attribute: bool) -> None:
        self.attribute = attribute

    def reset(self) -> None:
        pass

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        return float(measurement.torqe if self.attribute else refernce)  # type: ignore[attr-defined, name-defined]  # noqa: F821


@pytest.mark.parametrize(("attribute", "nearest"), [(False, "reference"), (True, "torque")])
def test_a_slip_in_a_controller_is_one_line_with_its_file_and_line(attribute: bool, nearest: str) -> None:
    scenario = load_scenario("torque-task-proportional", ["run.duration=0.1 s"])
    said = rf"test_simulate\.py, line \d+: WithASlip: .*, did you mean '{nearest}'\?$"
    with pytest.raises(SimulationError, match=said):
        simulate(scenario.controlled_by(WithASlip(attribute)))


def test_a_weight_below_0_pulls_the_other_way() -> None:
    swing = ("motion.kind=free", "controller.command=0", "actuator.torque_constant=0.001 cm^3", "device.valve=solenoid")
    stops = ("actuator.angle_min=20 deg", "actuator.angle_max=160 deg", "run.duration=0.3 s")
    foot, elbow = (
        simulate("step-response", overrides=[*swing, *stops, angle, weight]).recording["angle"]
        for angle, weight in (
            ("motion.angle=120 deg", "foot_plate.gravity_torque=0.6 N m"),
            ("motion.angle=60 deg", "foot_plate.gravity_torque=-0.6 N m"),
        )
    )
    assert foot[-1] - foot[0] > math.radians(20.0)
    np.testing.assert_allclose(elbow, math.pi - foot, atol=1e-3)
