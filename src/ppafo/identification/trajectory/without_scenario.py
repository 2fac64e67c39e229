"""An experiment without a scenario: the run begins and goes on as the recording says."""

from collections.abc import Mapping

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.source import Source
from ppafo.identification.trajectory.experiment import FITTED_CHANNELS, INPUTS, Experiment
from ppafo.identification.trajectory.section import ExperimentSection
from ppafo.identification.trajectory.setting import Setting, noise_of_channels, quantity_of
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.simulation.recorded.inputs import ANGLE, COMMAND, between_stops
from ppafo.simulation.recorded.scenario import fixed_volume, held_at, recorded_scenario
from ppafo.simulation.recorded.start import Start, samples_at_rest


def experiment_without_scenario(item: ExperimentSection, source: Source, setting: Setting) -> Experiment:
    """Return the experiment of a recording on the device of the set; it begins at the first sample unless told."""
    said = f"{setting.file}: experiment '{item.label}'"
    if setting.parameter_set is None:
        raise IdentificationError(f"{said}: needs a scenario, because no device was given")
    if item.initial_state == "scenario":
        raise IdentificationError(f"{said}: initial_state = 'scenario', but it has none; leave it out")
    recording = source.recording
    first = float(recording.time[0]) if item.start is None else quantity_of(f"{said}: start", item.start, "s")
    used = recording.between(first, float(recording.time[-1]))
    device = build_device(apply_overrides(setting.parameter_set, item.overrides, setting.valve), setting.valve)
    device, fixed = _fixed(item, device, said)
    inputs = _inputs(item, recording, said)
    start = _start_of(used, device, fixed, said)
    motion = held_at(start.angle) if fixed else None
    scenario = recorded_scenario(recording, device, start, used.duration, said, motion)
    noise, channels = noise_of_channels(item.noise, said), compared_channels(item)
    return Experiment(item.label, scenario, recording, first, channels, noise, inputs, source=source.trace)


def compared_channels(item: ExperimentSection) -> tuple[str, ...]:
    """Return what an experiment is compared in: as given, else all that is neither held nor followed."""
    if item.channels is not None:
        return item.channels
    if item.volume is not None:
        return ("pressure_1",)
    is_led = item.held is not None or ANGLE in (item.inputs or ())
    return FITTED_CHANNELS[1:] if is_led else FITTED_CHANNELS


def _fixed(item: ExperimentSection, device: Device, said: str) -> tuple[Device, dict[str, float]]:
    """Return the device and what of its state is known where the vane is held, or where there is none."""
    if (item.held is not None or item.volume is not None) and ANGLE in (item.inputs or ()):
        raise IdentificationError(f"{said}: the vane is held or absent, and inputs has '{ANGLE}': leave one out")
    if item.held is not None and item.volume is not None:
        raise IdentificationError(f"{said}: held and volume: with a fixed volume there is no vane; leave one out")
    if item.held is not None:
        return device, {ANGLE: quantity_of(f"{said}: held", item.held, "rad")}
    if item.volume is None:
        return device, {}
    volume = quantity_of(f"{said}: volume", item.volume, "m^3")
    if not volume > 0.0:
        raise IdentificationError(f"{said}: volume = '{item.volume}' must be above zero")
    known = {ANGLE: device.actuator.angle_min, "pressure_2": device.supply.atmospheric_pressure}
    return fixed_volume(device, volume), known


def _inputs(item: ExperimentSection, recording: Recording, said: str) -> tuple[str, ...]:
    if COMMAND not in recording:
        have = ", ".join(recording.names)
        raise IdentificationError(
            f"{said}: has no scenario, so its recording needs a channel '{COMMAND}'; it has {have}"
        )
    if item.inputs is None:
        return tuple(name for name in INPUTS if name in recording)
    if COMMAND not in item.inputs:
        raise IdentificationError(f"{said}: has no scenario, so inputs must have '{COMMAND}'")
    return item.inputs


def _start_of(recording: Recording, device: Device, known: Mapping[str, float], said: str) -> Start:
    """Return the mean of the samples at rest, at most 50 ms; the first one where the valve is open from the start."""
    count = samples_at_rest(recording)

    def mean(name: str) -> float:
        if name in known:
            return known[name]
        if name not in recording:
            raise IdentificationError(
                f"{said}: there is no channel '{name}' to start from; give a scenario that says how it starts"
            )
        return float(np.mean(recording[name][:count]))

    angle, pressure_1, pressure_2 = (mean(name) for name in FITTED_CHANNELS)
    rate = mean("angular_velocity") if "angular_velocity" in recording and ANGLE not in known else 0.0
    return Start(float(between_stops(np.array([angle]), device, said)[0]), rate, pressure_1, pressure_2)
