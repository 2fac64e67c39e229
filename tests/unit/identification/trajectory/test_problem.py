import dataclasses

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.fit import FitNumber
from ppafo.identification.trajectory.experiment import (
    TIME_OFFSET,
    FittedExperiment,
    TrajectoryProblem,
    broken_rule,
    declared_numbers,
    full_path,
    number_at,
    with_numbers,
)
from ppafo.identification.trajectory.fitting import prepare, signals_of
from ppafo.running import simulate
from ppafo.simulation.scenario import Scenario

INERTIA = FitNumber("foot_plate.inertia")


def problem(experiment: FittedExperiment, *parameters: FitNumber) -> TrajectoryProblem:
    return TrajectoryProblem(parameters, (experiment,))


def test_bounds_and_scale_follow_from_the_declaration(experiment: FittedExperiment) -> None:
    sought = INERTIA, FitNumber("friction.static_torque"), FitNumber("motion.angle")
    inertia, friction, angle = problem(experiment, *sought).numbers
    assert (inertia.scale, inertia.low, inertia.high) == pytest.approx((8.4e-3, 8.4e-5, 0.84))
    assert (friction.low, friction.unit) == (pytest.approx(0.0045), "N m")
    assert (angle.low, angle.unit) == (-10.0, "rad")


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        (FitNumber("foot_plate.inertia", low=1.0, high=2.0), "must lie between the bounds"),
        (FitNumber("foot_plate.inertia", high=5.0e3), "exceed the allowed range"),
        (FitNumber("actuator.torque_constant", start=0.0, low=0.0), "start = 0 needs bounds"),
        (FitNumber("foot_plate.inertia", deviation=0.0), "standard deviation of its prior"),
        (FitNumber("foot_plate.inertia", recordings=("stop",)), "did you mean 'step'"),
        (FitNumber("foot_plate.weight"), "'foot_plate.weight' cannot be fitted"),
    ],
)
def test_a_parameter_that_makes_no_sense_is_refused(
    experiment: FittedExperiment, parameter: FitNumber, message: str
) -> None:
    with pytest.raises(IdentificationError, match=message):
        problem(experiment, parameter)


def test_the_same_parameter_twice_is_refused(experiment: FittedExperiment) -> None:
    with pytest.raises(IdentificationError, match="given twice"):
        problem(experiment, FitNumber("valve.area"), FitNumber("valves.proportional.area"))


def test_every_parameter_that_0_leaves_out_of_the_model_is_refused_before_the_fit(experiment: FittedExperiment) -> None:
    late, spool = FitNumber("valve.delay"), FitNumber("valve.spool_frequency", start=30.0, low=0.0)
    words = r"0 leaves it out of the model, so it cannot be fitted from there; start and low must be above 0"
    with pytest.raises(
        IdentificationError, match=rf"\(1\) valve\.delay: {words}; \(2\) valve\.spool_frequency: {words}$"
    ):
        problem(experiment, late, INERTIA, spool)
    problem(experiment, FitNumber("valve.delay", start=0.015, low=0.001))


def test_samples_on_the_grid_are_taken_from_the_record_as_they_are(experiment: FittedExperiment) -> None:
    prepared = prepare(experiment, {})
    assert prepared.run.record_every == prepared.run.steps_per_sample
    assert len(prepared.measured) == len(experiment.recording)


def test_samples_off_the_grid_lie_between_two_records(experiment: FittedExperiment) -> None:
    recording = experiment.recording.resample(np.linspace(0.0, 0.35, 223))
    (signals,) = signals_of([prepare(dataclasses.replace(experiment, recording=recording), {})], (), np.zeros((0, 1)))
    clean = simulate(experiment.scenario).recording
    assert signals["angle"][:, 0] == pytest.approx(np.interp(recording.time, clean.time, clean["angle"]), abs=2e-3)


def test_the_initial_state_is_that_in_which_the_samples_up_to_the_start_end(experiment: FittedExperiment) -> None:
    clean = simulate(experiment.scenario).recording
    shifted = dataclasses.replace(clean, time=clean.time - 0.01)
    prepared = prepare(dataclasses.replace(experiment, recording=shifted, is_recorded_start=True), {})
    before = shifted.time <= 1e-9
    assert before.sum() == 11
    assert prepared.scenario.initial.pressure_1 == pytest.approx(float(clean["pressure_1"][before][-1]), rel=1e-3)
    assert prepared.scenario.initial.pressure_2 == pytest.approx(float(clean["pressure_2"][before][-1]), rel=1e-3)


_SECOND = ("supply.dorsiflexion_pressure", "initial.pressure_2")
FOLLOWERS = {
    "supply.pressure": _SECOND,
    "supply.dorsiflexion_pressure": ("initial.pressure_2",),
    "supply.atmospheric_pressure": ("supply.pressure", *_SECOND, "initial.pressure_1"),
    "actuator.torque_constant": ("actuator.displacement_per_radian",),
}
"""One pressure is that of both regulators, gauge ones count from the atmosphere, and chambers begin at a word.

The displacement of a vane follows its torque constant.
"""


def test_every_declared_number_can_be_read_and_replaced(step: Scenario) -> None:
    paths = [path for path in declared_numbers(step) if not path.startswith("recording.")]
    assert len(paths) > 25
    for path in paths:
        changed = with_numbers(step, {path: number_at(step, path) + 0.125})
        assert number_at(changed, path) == number_at(step, path) + 0.125
        others = [other for other in paths if number_at(changed, other) != number_at(step, other)]
        assert others == [other for other in paths if other == path or other in FOLLOWERS.get(path, ())]


def test_a_time_offset_belongs_to_the_recording_and_leaves_the_scenario_alone(step: Scenario) -> None:
    assert number_at(step, TIME_OFFSET) == 0.0
    assert with_numbers(step, {TIME_OFFSET: 0.01}) is step


def test_the_chosen_valve_has_the_path_that_a_parameter_set_has(step: Scenario) -> None:
    assert full_path("valve.area", step) == "valves.proportional.area"
    assert number_at(step, "valve.area") == number_at(step, "valves.proportional.area") == pytest.approx(31.6e-6)


def test_dynamic_friction_above_static_friction_is_named(step: Scenario) -> None:
    assert broken_rule(step.device) == ""
    above = with_numbers(step, {"friction.dynamic_torque": 0.5})
    static = step.device.friction.static_torque
    assert f"fitted to 0.5 N m, above friction.static_torque of {static:.3g} N m" in broken_rule(above.device)


def test_a_clipped_channel_is_called_so_and_not_without_noise(experiment: FittedExperiment) -> None:
    values = np.array(experiment.recording["pressure_1"])
    random = np.random.default_rng(0)
    level = float(np.quantile(values, 0.1))
    clipped = np.minimum(values + 300.0 * random.standard_normal(values.size), level)
    recording = experiment.recording.with_channel("pressure_1", clipped, "Pa")
    without = dataclasses.replace(experiment, recording=recording, noise={"angle": 1e-3, "pressure_2": 500.0})
    with pytest.raises(
        IdentificationError, match=r"stays at its largest value for .* the sensor is probably saturated"
    ):
        prepare(without, {})
