"""Experiments of a trajectory fit: recordings with the scenarios that are to explain them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.source import UsedRecording
from ppafo.signals import Recording
from ppafo.simulation.recorded.channels import (
    ANGLE,
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    SUPPLY,
    check_absolute,
    check_command,
    check_gaps,
)
from ppafo.simulation.recorded.inputs import between_stops, with_highest_supply
from ppafo.simulation.recorded.replay import replay_control
from ppafo.simulation.recorded.rest import value_at_rest
from ppafo.simulation.scenario import FreeMotion, Scenario, Sensors, vane_motion, with_control
from ppafo.wording import nearest_name

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""Channels compared with a recording [rad], [Pa], [Pa]."""

INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Channels that a run follows where they were recorded, sample by sample, if it has no scenario."""

ALL_INPUTS = (*INPUTS, DORSIFLEXION_SUPPLY, ANGLE)
"""Channels that a run may follow instead of its scenario; a recorded angle prescribes the vane's."""

InitialState = Literal["scenario", "recording"]
"""Source of the initial angle and pressures of a run."""

_FITS = 1.0e-6
"""Time [s] by which a sample may pass the start of an experiment: rounding of a clock."""


@dataclass(frozen=True, slots=True)
class FittedExperiment:
    """A recording and the scenario that is to explain it; time ``start`` [s] of the recording is time 0 of the run.

    ``noise`` is the least standard deviation by channel [rad], [Pa]; it is estimated from what the fit leaves.
    ``channels`` are those that are compared, to the end of the recording. ``inputs`` names measured channels that the
    run follows sample by sample: ``command``, in place of the scenario's controller, ``supply_pressure`` (of both
    inlets where they have one pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``. ``initial_state``
    takes angle and pressures at the start from the scenario or, by the samples up to the start, from the recording:
    their mean, or where a line through them ends if they move. ``source`` names the file and its hash.
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


def check_experiment(experiment: FittedExperiment) -> None:
    """Refuse an experiment that cannot be fitted; the message begins with its label. It is an IdentificationError."""
    said, recording, inputs = f"experiment '{experiment.label}'", experiment.recording, experiment.inputs
    if len(recording) < 2:
        raise IdentificationError(f"{said}: {recording.label} has only one sample; a fit needs two or more")
    for name in experiment.channels:
        if name not in FITTED_CHANNELS:
            raise IdentificationError(f"{said}: channel '{name}' cannot be fitted; {', '.join(FITTED_CHANNELS)} can")
    for name in inputs:
        if name not in ALL_INPUTS:
            hint = nearest_name(name, ALL_INPUTS)
            raise IdentificationError(f"{said}: '{name}' is not a measured input{hint}; use {', '.join(ALL_INPUTS)}")
    for name, use in (*((name, "") for name in experiment.channels), *((name, " to follow") for name in inputs)):
        if name not in recording:
            have = ", ".join(recording.names)
            raise IdentificationError(f"{said}: {recording.label} has no channel '{name}'{use}; it has {have}")
    scenario, has_torque = experiment.scenario, EXTERNAL_TORQUE in inputs
    motion, follows = vane_motion(scenario), {ANGLE} & set(inputs) & set(experiment.channels)
    is_python = scenario.controller.is_outside and COMMAND not in inputs
    refuse_first(
        said,
        (not experiment.channels, "there is no channel to compare"),
        (bool(follows), "the angle of the vane is prescribed by the recording, so it cannot be compared"),
        (
            experiment.channels == (ANGLE,) and motion.profile is not None,
            "the angle of the vane is prescribed, so it carries no information; add a pressure",
        ),
        (is_python, "a Python controller cannot run in a batch; use one of the catalogue"),
        (
            has_torque and motion.profile is not None,
            "a torque has no effect on a vane whose angle is prescribed; remove it from inputs",
        ),
        (
            has_torque and motion.leg is not None,
            "the leg of the motion prescribes T_ex; remove it from inputs, or let the motion be free",
        ),
        *(
            (not 0.0 < deviation < math.inf, f"the noise of '{name}' must be above 0, not {deviation!r}")
            for name, deviation in experiment.noise.items()
        ),
    )
    if COMMAND in inputs:
        check_command(recording, said)
    experiment.scenario.device.check_pressurised(f"{said}: a fit of motion")
    if inputs:
        check_gaps(recording, said)
        check_absolute(recording, experiment.scenario.device.supply.atmospheric_pressure, said)


def refuse_first(said: str, *checks: tuple[bool, str]) -> None:
    """Refuse the first that is wrong of pairs, whether it is and why; ``said`` begins the line."""
    for is_wrong, why in checks:
        if is_wrong:
            raise IdentificationError(f"{said}: {why}")


def scenario_of(experiment: FittedExperiment) -> Scenario:
    """Return the scenario of an experiment with all that it takes from the recording, but for the samples of inputs.

    A state that is taken from the recording comes from the samples up to the start.
    """
    scenario, recording = experiment.scenario, experiment.recording
    if {SUPPLY, DORSIFLEXION_SUPPLY} & set(experiment.inputs):
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, experiment.inputs))
    if COMMAND in experiment.inputs:
        # A recorded command needs no sensors.
        scenario = replace(with_control(scenario, replay_control(recording)), sensors=Sensors())
    said = f"experiment '{experiment.label}'"
    if ANGLE in experiment.inputs:
        # From here the recorded angle prescribes the vane's.
        angle = np.interp([experiment.start], recording.time, recording[ANGLE])
        scenario = replace(scenario, motion=FreeMotion(float(between_stops(angle, scenario.device, said)[0])))
    if experiment.initial_state == "scenario":
        return scenario
    before = recording.time <= experiment.start + _FITS
    if not before.any():
        raise IdentificationError(
            f"{said}: {recording.label} has no sample up to {experiment.start:g} s, from which the initial state could "
            f"be taken"
        )
    time = recording.time[before]
    rest = {name: value_at_rest(time, recording[name][before], at_end=True) for name in recording.names}
    recorded = {name: rest[name] for name in ("pressure_1", "pressure_2") if name in rest}
    scenario = replace(scenario, initial=replace(scenario.initial, **recorded))
    if ANGLE in rest and ANGLE not in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        start = float(between_stops(np.array([rest[ANGLE]]), scenario.device, said)[0])
        scenario = replace(scenario, motion=replace(scenario.motion, angle=start))
    return scenario


def use_of(experiment: FittedExperiment) -> UsedRecording:
    """Return what of its recording an experiment is compared with."""
    last = float(experiment.recording.time[-1])
    trace = experiment.source or experiment.recording.label
    return UsedRecording(
        f"experiment '{experiment.label}'",
        trace,
        experiment.recording,
        frozenset(experiment.channels),
        experiment.start,
        last,
    )
