"""Experiments of a trajectory fit: recordings paired with the scenarios that model them."""

import json
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
from ppafo.simulation.recorded.clock import sample_period
from ppafo.simulation.recorded.inputs import between_stops, with_highest_supply
from ppafo.simulation.recorded.rest import value_at_rest
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Scenario,
    Sensors,
    vane_motion,
    with_control,
)
from ppafo.wording import nearest_name

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""Channels that a fit can compare with a recording [rad], [Pa], [Pa]."""

INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Recorded channels that drive a run without a scenario, sample by sample."""

ALL_INPUTS = (*INPUTS, DORSIFLEXION_SUPPLY, ANGLE)
"""Recorded channels that may replace inputs of the scenario; a recorded angle is a prescribed motion."""

InitialState = Literal["scenario", "recording"]
"""Source of the initial angle and pressures of a run."""

_FITS = 1.0e-6
"""Rounding tolerance [s] of sample times at the start of an experiment."""


@dataclass(frozen=True, slots=True)
class FittedExperiment:
    """Recording paired with the scenario that models it; time ``start`` [s] of the recording is time 0 of the run.

    ``channels`` are compared from the start to the end of the recording. ``noise`` is a lower bound of the standard
    deviation by channel [rad], [Pa]; the noise itself is estimated from the residuals. ``inputs`` are recorded channels
    that drive the run, sample by sample: ``command`` (replaces the controller), ``supply_pressure`` (of both inlets if
    they share a pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``. ``initial_state`` selects the
    source of the initial angle and pressures: the scenario, or the samples of the recording up to the start (their mean
    or, if they move, the end of a line through them). ``source`` names the file and its hash.
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
    """Raise IdentificationError for an experiment that cannot be fitted; the message begins with the label."""
    where, recording, inputs = f"experiment '{experiment.label}'", experiment.recording, experiment.inputs
    if len(recording) < 2:
        raise IdentificationError(f"{where}: {recording.label} has only one sample; a fit needs two or more")
    for name in experiment.channels:
        if name not in FITTED_CHANNELS:
            raise IdentificationError(f"{where}: channel '{name}' cannot be fitted; use {', '.join(FITTED_CHANNELS)}")
    for name in inputs:
        if name not in ALL_INPUTS:
            hint = nearest_name(name, ALL_INPUTS)
            raise IdentificationError(f"{where}: '{name}' is not a measured input{hint}; use {', '.join(ALL_INPUTS)}")
    for key, names, use in (("channels", experiment.channels, ""), ("inputs", inputs, " to follow")):
        recorded = [name for name in (FITTED_CHANNELS if key == "channels" else inputs) if name in recording]
        for name in names:
            if name not in recording:
                raise IdentificationError(
                    f"{where}: {recording.label} has no channel '{name}'{use}; available: "
                    f"{', '.join(recording.names)}; give {key} = {json.dumps(recorded)}"
                )
    scenario, has_torque = experiment.scenario, EXTERNAL_TORQUE in inputs
    motion, follows = vane_motion(scenario), {ANGLE} & set(inputs) & set(experiment.channels)
    is_python = scenario.controller.is_outside and COMMAND not in inputs
    refuse_first(
        where,
        (not experiment.channels, "has no channel to compare; give channels"),
        (bool(follows), "the recording prescribes the angle, which cannot be compared; remove it from channels"),
        (
            experiment.channels == (ANGLE,) and motion.profile is not None,
            "the angle of the vane is prescribed and carries no information; add a pressure to channels",
        ),
        (is_python, "a Python controller cannot be fitted; use a controller kind of the catalogue"),
        (
            has_torque and motion.profile is not None,
            "a torque has no effect on a vane whose angle is prescribed; remove it from inputs",
        ),
        (
            has_torque and motion.leg is not None,
            "the leg of the motion prescribes T_ex; remove it from inputs, or set motion.kind = 'free'",
        ),
        *(
            (not 0.0 < deviation < math.inf, f"the noise of '{name}' must be above 0, not {deviation!r}")
            for name, deviation in experiment.noise.items()
        ),
    )
    if COMMAND in inputs:
        check_command(recording, where)
    experiment.scenario.device.check_pressurised(f"{where}: a fit of motion")
    if inputs:
        check_gaps(recording, where)
        check_absolute(recording, experiment.scenario.device.supply.atmospheric_pressure, where)


def refuse_first(where: str, *checks: tuple[bool, str]) -> None:
    """Raise IdentificationError for the first failed pair (is wrong, reason); ``where`` is the message prefix."""
    for is_wrong, why in checks:
        if is_wrong:
            raise IdentificationError(f"{where}: {why}")


def scenario_of(experiment: FittedExperiment) -> Scenario:
    """Return the scenario completed from the recording: supply, recorded control, initial angle and pressures.

    Samples of inputs are added later. A recorded initial state is taken from the samples up to the start.
    """
    scenario, recording = experiment.scenario, experiment.recording
    if {SUPPLY, DORSIFLEXION_SUPPLY} & set(experiment.inputs):
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, experiment.inputs))
    if COMMAND in experiment.inputs:
        # A recorded command needs no sensors.
        scenario = replace(
            with_control(scenario, Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))), sensors=Sensors()
        )
    where = f"experiment '{experiment.label}'"
    if ANGLE in experiment.inputs:
        # From here the recorded angle prescribes the vane's.
        angle = np.interp([experiment.start], recording.time, recording[ANGLE])
        scenario = replace(scenario, motion=FreeMotion(float(between_stops(angle, scenario.device, where)[0])))
    if experiment.initial_state == "scenario":
        return scenario
    before = recording.time <= experiment.start + _FITS
    if not before.any():
        raise IdentificationError(
            f"{where}: {recording.label} has no sample at or before {experiment.start:g} s, from which the initial "
            "state is read; give a later start"
        )
    time = recording.time[before]
    rest = {name: value_at_rest(time, recording[name][before], at_end=True) for name in recording.names}
    recorded = {name: rest[name] for name in ("pressure_1", "pressure_2") if name in rest}
    scenario = replace(scenario, initial=replace(scenario.initial, **recorded))
    if ANGLE in rest and ANGLE not in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        start = float(between_stops(np.array([rest[ANGLE]]), scenario.device, where)[0])
        scenario = replace(scenario, motion=replace(scenario.motion, angle=start))
    return scenario


def use_of(experiment: FittedExperiment) -> UsedRecording:
    """Return the part of the recording with which an experiment is compared."""
    used, recording = frozenset(experiment.channels), experiment.recording
    label, trace = f"experiment '{experiment.label}'", experiment.source or recording.label
    return UsedRecording(label, trace, recording, used, experiment.start, float(recording.time[-1]))
