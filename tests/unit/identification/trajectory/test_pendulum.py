"""The swing of a pendulum with planted inertia and friction, recorded by its angle alone."""

import math

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.fit import FitNumber
from ppafo.identification.tolerances import Tolerances
from ppafo.identification.trajectory.experiment import (
    FittedExperiment,
    TrajectoryProblem,
    tolerance_parameters,
    with_numbers,
)
from ppafo.identification.trajectory.fitting import TrajectoryFit, fit
from ppafo.running import simulate
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario

PLANTED = {
    "foot_plate.inertia": 0.118,
    "friction.viscous_damping": 0.045,
    "friction.dynamic_torque": 0.16,
    "friction.static_torque": 0.17,
}
HANGING = """
schema_version = 1
name = "hanging"

[device]
set = "ppafo2011"
valve = "solenoid"
overrides = [
    "foot_plate.gravity_torque=3.05 N m",
    "actuator.angle_min=100 deg",
    "actuator.angle_max=260 deg",
    "actuator.torque_constant=0.001 cm^3",
]

[run]
duration = "6 s"
output_interval = "20 ms"

[motion]
kind = "free"
angle = "218.2 deg"

[controller]
kind = "constant"
command = 0
rate = "1 kHz"
"""
LOOSE = {"low": 0.0, "high": 0.5}


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> FittedExperiment:
    """Recording that starts 0.2 deg from the angle of its scenario, with white noise."""
    file = tmp_path_factory.mktemp("pendulum") / "hanging.toml"
    file.write_text(HANGING, encoding="utf-8")
    hanging = load_scenario(str(file))
    true = with_numbers(hanging, {**PLANTED, "motion.angle": math.radians(218.0)})
    clean = simulate(true).recording
    noise = math.radians(0.12) * np.random.default_rng(1).standard_normal(len(clean))
    angle = {"angle": Channel(clean["angle"] + noise, "rad")}
    recording = Recording("swing", clean.time, angle, kind="synthetic")
    return FittedExperiment("swing", hanging, recording, channels=("angle",))


def fitted(swing: FittedExperiment, *friction: FitNumber) -> TrajectoryFit:
    parameters = (
        FitNumber("foot_plate.inertia", 0.1, 0.01, 1.0),
        FitNumber("friction.viscous_damping", math.nan, 0.0, 0.5),
        *friction,
    )
    tolerances = tolerance_parameters(Tolerances(held=0.0), (swing,), parameters)
    return fit(TrajectoryProblem((*parameters, *tolerances), (swing,)))


@pytest.mark.parametrize("starts", [(math.nan, math.nan), (0.10, 0.40)])
def test_bounds_of_friction_change_nothing_where_they_are_wide(
    swing: FittedExperiment, starts: tuple[float, float]
) -> None:
    dynamic, static = starts
    found = fitted(
        swing,
        FitNumber("friction.dynamic_torque", dynamic, **LOOSE),
        FitNumber("friction.static_torque", static, **LOOSE),
    )
    assert found.faults == ()
    for estimate in found.estimates:
        assert estimate.verdict == "identified", estimate.explanation
        assert estimate.low <= PLANTED[estimate.path] <= estimate.high
    # The start of the scenario is as inexact as the sensor, so that its error does not pass for a drift.
    assert all(found[path].wider_half_width < 0.1 * PLANTED[path] for path in list(PLANTED)[:3])
    assert found["friction.static_torque"].value >= found["friction.dynamic_torque"].value


def test_friction_at_rest_keeps_the_bounds_that_it_was_given(swing: FittedExperiment) -> None:
    dynamic = FitNumber("friction.dynamic_torque", **LOOSE)
    static = fitted(swing, dynamic, FitNumber("friction.static_torque", math.nan, 0.25, 0.5)).estimates[3]
    assert static.low == static.value == pytest.approx(0.25)
    assert not static.is_usable


def test_bounds_without_any_friction_at_rest_above_that_in_motion_are_refused(swing: FittedExperiment) -> None:
    dynamic = FitNumber("friction.dynamic_torque", 0.3, 0.2, 0.5)
    with pytest.raises(IdentificationError, match=r"high = 0\.17 N m must be above low = 0\.2 N m"):
        fitted(swing, dynamic, FitNumber("friction.static_torque", 0.1, 0.0, 0.17))
