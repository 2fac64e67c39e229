"""One recording and the scenario that is to explain it, as values; what makes no sense is refused."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ppafo.errors import IdentificationError, nearest_name
from ppafo.signals import Recording
from ppafo.simulation.recorded.checks import check_absolute, check_command, check_gaps
from ppafo.simulation.recorded.inputs import ANGLE, COMMAND, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.scenario import PYTHON_CONTROLLER, FreeMotion, Scenario

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""What a recording is compared in [rad], [Pa], [Pa]."""

INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Channels that a run follows where they were recorded, sample by sample, if it has no scenario."""

ALL_INPUTS = (*INPUTS, ANGLE)
"""Channels that a run may follow instead of what its scenario says; along the angle the vane is led."""

InitialState = Literal["scenario", "recording"]


@dataclass(frozen=True, slots=True)
class Experiment:
    """A recording and the scenario that is to explain it; time ``start`` [s] of the recording is time 0 of the run.

    ``noise`` is the standard deviation by channel [rad], [Pa]; channels without one have it estimated from the
    recording. ``channels`` are those that are compared. ``inputs`` names measured channels that the run follows sample
    by sample: ``command``, in place of the scenario's controller, ``supply_pressure``, ``external_torque``, ``angle``.
    ``initial_state`` takes angle and pressures at the start from the scenario or, as means of the samples up to the
    start, from the recording. ``source`` names the file and its hash.
    """

    label: str
    scenario: Scenario
    recording: Recording
    start: float = 0.0
    channels: tuple[str, ...] = FITTED_CHANNELS
    noise: Mapping[str, float] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    initial_state: InitialState = "scenario"
    source: str = ""


def check_experiment(experiment: Experiment) -> None:
    """Refuse an experiment that cannot be fitted; the message begins with its label."""
    said = f"experiment '{experiment.label}'"
    if len(experiment.recording) < 2:
        raise IdentificationError(f"{said}: {experiment.recording.label} has only one sample")
    for name in experiment.channels:
        if name not in FITTED_CHANNELS:
            raise IdentificationError(f"{said}: channel '{name}' cannot be fitted; {', '.join(FITTED_CHANNELS)} can")
        if name not in experiment.recording:
            have = ", ".join(experiment.recording.names)
            raise IdentificationError(f"{said}: {experiment.recording.label} has no channel '{name}'; it has {have}")
    if not experiment.channels:
        raise IdentificationError(f"{said}: no channel is to be compared")
    if ANGLE in experiment.inputs and ANGLE in experiment.channels:
        raise IdentificationError(f"{said}: the vane is led along the recorded angle, which is then not compared")
    if experiment.channels == ("angle",) and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(f"{said}: the vane is led, so its angle says nothing; add a pressure")
    if experiment.scenario.control.kind == PYTHON_CONTROLLER and COMMAND not in experiment.inputs:
        raise IdentificationError(f"{said}: a Python controller cannot run in lanes; use one of the catalogue")
    _check_given(experiment, said)


def _check_given(experiment: Experiment, said: str) -> None:
    for name in experiment.inputs:
        if name not in ALL_INPUTS:
            hint = nearest_name(name, ALL_INPUTS)
            raise IdentificationError(f"{said}: '{name}' is no measured input{hint}; {', '.join(ALL_INPUTS)} are")
        if name not in experiment.recording:
            have = ", ".join(experiment.recording.names)
            raise IdentificationError(
                f"{said}: {experiment.recording.label} has no channel '{name}' to follow; it has {have}"
            )
    if EXTERNAL_TORQUE in experiment.inputs and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(f"{said}: the vane is led, so a torque on it says nothing; leave it out of inputs")
    if COMMAND in experiment.inputs:
        check_command(experiment.recording, said)
    if experiment.inputs:
        check_gaps(experiment.recording, said)
        check_absolute(experiment.recording, experiment.scenario.device.supply.atmospheric_pressure, said)
    for name, deviation in experiment.noise.items():
        if not (math.isfinite(deviation) and deviation > 0.0):
            raise IdentificationError(f"{said}: the noise of '{name}' must be above 0, not {deviation!r}")
