"""The scenario of an experiment, completed by what its recording says: inputs that are followed, state at the start."""

from dataclasses import replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.experiment import Experiment
from ppafo.simulation.recorded.inputs import ANGLE, COMMAND, SUPPLY, between_stops
from ppafo.simulation.recorded.scenario import recorded_control, with_highest_supply
from ppafo.simulation.scenario import FreeMotion, Scenario, Sensors

_FITS = 1.0e-6


def scenario_of(experiment: Experiment) -> Scenario:
    """Return the scenario of an experiment with all that it takes from the recording, but for the samples of inputs."""
    scenario, recording = experiment.scenario, experiment.recording
    if SUPPLY in experiment.inputs:
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording))
    if COMMAND in experiment.inputs:
        # Nobody measures for a controller that nobody asks.
        scenario = replace(scenario, control=recorded_control(recording), sensors=Sensors())
    if ANGLE in experiment.inputs:
        scenario = replace(scenario, motion=FreeMotion(_angle_at_start(experiment, scenario)))
    return scenario if experiment.initial_state == "scenario" else _with_initial_state(experiment, scenario)


def _angle_at_start(experiment: Experiment, scenario: Scenario) -> float:
    """Return the recorded angle at the start [rad], from which the vane is led on."""
    recording = experiment.recording
    angle = np.interp([experiment.start], recording.time, recording[ANGLE])
    return float(between_stops(angle, scenario.device, f"experiment '{experiment.label}'")[0])


def _with_initial_state(experiment: Experiment, scenario: Scenario) -> Scenario:
    """Return the scenario that starts where the recording says: at the means of the samples up to the start."""
    recording, said = experiment.recording, f"experiment '{experiment.label}'"
    before = recording.time <= experiment.start + _FITS
    if not before.any():
        raise IdentificationError(
            f"{said}: {recording.label} has no sample up to {experiment.start:g} s, from which the initial state could "
            f"be taken"
        )
    means = {name: float(np.mean(recording[name][before])) for name in recording.names}
    scenario = replace(
        scenario,
        initial_pressure_1=means.get("pressure_1", scenario.initial_pressure_1),
        initial_pressure_2=means.get("pressure_2", scenario.initial_pressure_2),
    )
    if ANGLE in means and ANGLE not in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        angle = float(between_stops(np.array([means["angle"]]), scenario.device, said)[0])
        scenario = replace(scenario, motion=replace(scenario.motion, angle=angle))
    return scenario
