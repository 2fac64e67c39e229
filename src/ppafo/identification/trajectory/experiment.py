"""One recording with the scenario that is to explain it, and the numbers of a scenario that can be fitted."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.model.declaration import Quantity
from ppafo.model.effects.catalog import EFFECTS, find_effects
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.declaration import AREA_FORM, SECTIONS, SONIC_FORM
from ppafo.parameters.device import Device, Orifice
from ppafo.signals import Recording
from ppafo.simulation import numbers
from ppafo.simulation.declaration import FREE, INITIAL
from ppafo.simulation.recorded.checks import check_absolute, check_command, check_gaps
from ppafo.simulation.recorded.inputs import ANGLE, COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY, between_stops
from ppafo.simulation.recorded.scenario import replay_control, with_highest_supply
from ppafo.simulation.scenario import PYTHON_CONTROLLER, FreeMotion, Scenario, Sensors

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""What a recording is compared in [rad], [Pa], [Pa]."""

INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Channels that a run follows where they were recorded, sample by sample, if it has no scenario."""

ALL_INPUTS = (*INPUTS, DORSIFLEXION_SUPPLY, ANGLE)
"""Channels that a run may follow instead of its scenario; a recorded angle prescribes that of the vane."""

InitialState = Literal["scenario", "recording"]


@dataclass(frozen=True, slots=True)
class Experiment:
    """A recording and the scenario that is to explain it; time ``start`` [s] of the recording is time 0 of the run.

    ``noise`` is the standard deviation by channel [rad], [Pa]; channels without one have it estimated from the
    recording. ``channels`` are those that are compared, to the end of the recording. ``inputs`` names measured channels
    that the run follows sample by sample: ``command``, in place of the scenario's controller, ``supply_pressure`` (of
    both inlets where they have one pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``.
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
    """Refuse an experiment that cannot be fitted; the message begins with its label. It is an IdentificationError."""
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
        raise IdentificationError(f"{said}: there is no channel to compare")
    if ANGLE in experiment.inputs and ANGLE in experiment.channels:
        raise IdentificationError(
            f"{said}: the angle of the vane is prescribed by the recording, so it cannot be compared"
        )
    if experiment.channels == ("angle",) and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(
            f"{said}: the angle of the vane is prescribed, so it carries no information; add a pressure"
        )
    if experiment.scenario.control.kind == PYTHON_CONTROLLER and COMMAND not in experiment.inputs:
        raise IdentificationError(f"{said}: a Python controller cannot run in lanes; use one of the catalogue")
    _check_given(experiment, said)


def _check_given(experiment: Experiment, said: str) -> None:
    for name in experiment.inputs:
        if name not in ALL_INPUTS:
            hint = nearest_name(name, ALL_INPUTS)
            raise IdentificationError(f"{said}: '{name}' is not a measured input{hint}; use {', '.join(ALL_INPUTS)}")
        if name not in experiment.recording:
            have = ", ".join(experiment.recording.names)
            raise IdentificationError(
                f"{said}: {experiment.recording.label} has no channel '{name}' to follow; it has {have}"
            )
    if EXTERNAL_TORQUE in experiment.inputs and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(
            f"{said}: the angle of the vane is prescribed, so a torque on it has no effect; remove it from inputs"
        )
    if COMMAND in experiment.inputs:
        check_command(experiment.recording, said)
    if experiment.inputs:
        check_gaps(experiment.recording, said)
        check_absolute(experiment.recording, experiment.scenario.device.supply.atmospheric_pressure, said)
    for name, deviation in experiment.noise.items():
        if not (math.isfinite(deviation) and deviation > 0.0):
            raise IdentificationError(f"{said}: the noise of '{name}' must be above 0, not {deviation!r}")


_FITS = 1.0e-6


def scenario_of(experiment: Experiment) -> Scenario:
    """Return the scenario of an experiment with all that it takes from the recording, but for the samples of inputs."""
    scenario, recording = experiment.scenario, experiment.recording
    if {SUPPLY, DORSIFLEXION_SUPPLY} & set(experiment.inputs):
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, experiment.inputs))
    if COMMAND in experiment.inputs:
        # Nobody measures for a controller that nobody asks.
        scenario = replace(scenario, control=replay_control(recording), sensors=Sensors())
    if ANGLE in experiment.inputs:
        scenario = replace(scenario, motion=FreeMotion(_angle_at_start(experiment, scenario)))
    return scenario if experiment.initial_state == "scenario" else _with_initial_state(experiment, scenario)


def _angle_at_start(experiment: Experiment, scenario: Scenario) -> float:
    """Return the recorded angle at the start [rad], from which the angle of the vane is prescribed."""
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


_CHOSEN_VALVE = "valve."
_DEVICE_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow")
TIME_OFFSET = "recording.time_offset"
"""Path of a number that no scenario has: the time by which the samples of a recording are later than the run."""

RECORDING = (
    Quantity("time_offset", "s", "time by which the samples are later than the run, a late trigger", 0.0, -1.0, 1.0),
)


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as a parameter set has it: ``valve.area`` becomes ``valves.NAME.area`` of the chosen valve."""
    name = scenario.device.valve_name
    return f"valves.{name}.{path.removeprefix(_CHOSEN_VALVE)}" if path.startswith(_CHOSEN_VALVE) else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return every number that can be fitted in this scenario, with its declaration, by path."""
    device = scenario.device
    found = {f"{section}.{item.name}": item for section in _DEVICE_SECTIONS for item in SECTIONS[section]}
    found |= {f"{effect.section}.{item.name}": item for effect in EFFECTS.values() for item in effect.quantities}
    found |= {f"actuator.leak.{item.name}": item for item in _orifice_form(device.actuator.leak)}
    valve = (*_orifice_form(device.valve.orifice), *VALVES[device.valve.kind].quantities)
    found |= {f"valves.{device.valve_name}.{item.name}": item for item in valve}
    if isinstance(scenario.motion, FreeMotion):
        found |= {f"motion.{item.name}": item for item in FREE}
    found |= {f"initial.{item.name}": item for item in INITIAL}
    return found | {f"recording.{item.name}": item for item in RECORDING}


def declaration_of(path: str, scenario: Scenario) -> Quantity:
    """Return the declaration of the number at a path; IdentificationError with the nearest name for an unknown one."""
    find_effects([path])
    known = declared_numbers(scenario)
    full = full_path(path, scenario)
    if full not in known:
        hint = nearest_name(full, known)
        raise IdentificationError(f"{scenario.name}: no number '{path}' can be fitted{hint}; known: {', '.join(known)}")
    return known[full]


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path in SI units; the time offset of a recording is 0 before it is fitted."""
    declaration_of(path, scenario)
    return 0.0 if path == TIME_OFFSET else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with numbers [SI] replaced, by paths of ``declared_numbers``; a time offset is none of it."""
    return numbers.with_numbers(scenario, {path: number for path, number in changed.items() if path != TIME_OFFSET})


def _orifice_form(orifice: object) -> tuple[Quantity, ...]:
    return AREA_FORM if isinstance(orifice, Orifice) else SONIC_FORM


def broken_rule(device: Device) -> str:
    """Return which rule of a device a set of numbers breaks, as a parameter set would say it; empty for none."""
    if device.friction.dynamic_torque > device.friction.static_torque:
        return "friction.dynamic_torque came out above friction.static_torque"
    if device.actuator.angle_min >= device.actuator.angle_max:
        return "actuator.angle_min came out above actuator.angle_max"
    return ""
