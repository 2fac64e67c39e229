"""From the section [trajectory] of a problem file to a problem: texts with units, scenarios and recordings by name."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.documents.models import validate
from ppafo.errors import IdentificationError
from ppafo.identification.estimate import interval_factor
from ppafo.identification.source import Source, common_use, source_of
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    INPUTS,
    TIME_OFFSET,
    Experiment,
    declaration_of,
    full_path,
)
from ppafo.identification.trajectory.follow_up import Candidate
from ppafo.identification.trajectory.problem import FreeParameter, Prior, Search, TrajectoryProblem, use_of
from ppafo.identification.trajectory.section import (
    CandidateSection,
    ExperimentSection,
    ParameterSection,
    Setting,
    TrajectorySection,
    noise_of_channels,
    quantity_of,
)
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.recorded.inputs import ANGLE, COMMAND, LONGEST_STEP, between_stops
from ppafo.simulation.recorded.scenario import held_vane, replay_scenario, with_fixed_volume
from ppafo.simulation.recorded.start import Start, samples_at_rest
from ppafo.simulation.scenario import Scenario
from ppafo.storage.comma_separated import read_csv

_VALVE = "device.valve"
_PRESSURES = ("pressure_1", "pressure_2")
SHORTEST_STEP = 1.0e-6
"""Seconds; a shorter step would only cost time."""


def trajectory_from_dict(
    content: Mapping[str, Any], folder: Path | None = None, file: str = "trajectory"
) -> TrajectoryProblem:
    """Return the problem in nested dictionaries laid out as the section of a file; paths in it begin in ``folder``.

    Texts have their units, the problem is in SI. IdentificationError or DataError, one line that names ``file``.
    """
    section = validate(TrajectorySection, dict(content), file, IdentificationError)
    home = folder or Path()

    def read(item: ExperimentSection) -> Source:
        return source_of(home / item.recording, read_csv(home / item.recording))

    return trajectory_problem(section, Setting(read, home, file))


def trajectory_problem(section: TrajectorySection, setting: Setting) -> TrajectoryProblem:
    """Return the problem of a section. IdentificationError where it repeats what the bench settles."""
    experiments = tuple(_experiment(item, setting) for item in section.experiments)
    scenarios = {item.label: item.scenario for item in experiments}
    twice = common_use(setting.used, map(use_of, experiments))
    if twice:
        raise IdentificationError(f"{setting.file}: {twice}; bench values are where the fit starts and what it holds")
    parameters = [_parameter(item, scenarios, setting) for item in section.parameters]
    nuisances = [one for item in section.experiments for one in _nuisances(item, setting)]
    search = Search(
        loss=section.loss,
        other_starts=section.other_starts,
        seed=section.seed,
        confidence=section.confidence,
    )
    return TrajectoryProblem((*parameters, *nuisances), experiments, search)


def candidates_of(section: TrajectorySection, setting: Setting, noise: Mapping[str, float]) -> tuple[Candidate, ...]:
    """Return the experiments that could be done next; ``noise`` [rad], [Pa] by channel where none is given."""
    return tuple(_candidate(item, setting, noise) for item in section.candidates)


def _experiment(item: ExperimentSection, setting: Setting) -> Experiment:
    said = f"{setting.file}: experiment '{item.label}'"
    source = setting.read(item)
    if item.scenario is None:
        made = experiment_without_scenario(item, source, setting)
    else:
        made = _experiment_of(item, item.scenario, source, setting)
    return made if item.step is None else _with_step(made, item.step, f"{said}: step")


def _with_step(experiment: Experiment, text: str, said: str) -> Experiment:
    step = quantity_of(said, text, "s")
    if not SHORTEST_STEP <= step <= LONGEST_STEP:
        raise IdentificationError(f"{said} = '{text}': must be from {SHORTEST_STEP:g} s to {LONGEST_STEP:g} s")
    return replace(experiment, scenario=replace(experiment.scenario, time_step=step))


def _experiment_of(item: ExperimentSection, scenario: str, source: Source, setting: Setting) -> Experiment:
    said = f"{setting.file}: experiment '{item.label}'"
    for name in ("held", "volume"):
        if getattr(item, name) is not None:
            raise IdentificationError(
                f"{said}: {name} and a scenario: the scenario prescribes how the vane moves; omit one of them"
            )
    return Experiment(
        label=item.label,
        scenario=_scenario(scenario, item.overrides, setting),
        recording=source.recording,
        start=quantity_of(f"{said}: start", item.start or "0 s", "s"),
        channels=compared_channels(item),
        noise=noise_of_channels(item.noise, said),
        inputs=item.inputs or (),
        initial_state="scenario" if item.initial_state in (None, "scenario") else "recording",
        source=source.trace,
    )


def _scenario(name: str, overrides: tuple[str, ...], setting: Setting) -> Scenario:
    found = name if name in list_scenarios() else str(setting.folder / name)
    chosen = () if setting.valve is None else (f"{_VALVE}={setting.valve}",)
    return load_scenario(found, (*chosen, *overrides), setting.parameter_set)


def _candidate(item: CandidateSection, setting: Setting, noise: Mapping[str, float]) -> Candidate:
    said = f"{setting.file}: candidate '{item.label}'"
    interval = quantity_of(f"{said}: interval", item.interval, "s")
    if interval <= 0.0:
        raise IdentificationError(f"{said}: interval = '{item.interval}' must be above 0")
    scenario = _scenario(item.scenario, item.overrides, setting)
    return Candidate(item.label, scenario, noise_of_channels(item.noise, said) or noise, interval)


def _nuisances(item: ExperimentSection, setting: Setting) -> list[FreeParameter]:
    """Return the numbers that are fitted to one recording only because nobody knows them exactly."""
    pressures = [FreeParameter(f"initial.{name}", recordings=(item.label,)) for name in _PRESSURES]
    fitted = pressures if item.initial_state == "fitted" else []
    return fitted if item.time_offset is None else [*fitted, _time_offset(item, setting)]


def _time_offset(item: ExperimentSection, setting: Setting) -> FreeParameter:
    said = f"{setting.file}: experiment '{item.label}': time_offset"
    longest = quantity_of(said, item.time_offset or "", "s")
    if longest <= 0.0:
        raise IdentificationError(f"{said} = '{item.time_offset}' must be above 0")
    return FreeParameter(TIME_OFFSET, low=-longest, high=longest, recordings=(item.label,))


def _parameter(item: ParameterSection, scenarios: Mapping[str, Scenario], setting: Setting) -> FreeParameter:
    scenario = next((scenarios[label] for label in item.recordings if label in scenarios), None)
    acting = scenario or next(iter(scenarios.values()))
    quantity = declaration_of(item.path, acting)
    atmosphere = acting.device.supply.atmospheric_pressure

    def number(name: str, text: str | None) -> float | None:
        said = f"{setting.file}: parameter '{item.path}': {name}"
        return None if text is None else quantity_of(said, text, quantity.unit, atmosphere)

    if item.prior == "bench":
        prior: Prior | None = _bench_prior(item, full_path(item.path, acting), setting)
    else:
        mean = None if item.prior is None else number("prior.mean", item.prior.mean)
        prior = None if item.prior is None or mean is None else Prior(mean, abs(mean) * item.prior.relative)
    return FreeParameter(
        path=item.path,
        start=number("start", item.start),
        low=number("low", item.low),
        high=number("high", item.high),
        scale=item.scale,
        prior=prior,
        recordings=item.recordings,
    )


def _bench_prior(item: ParameterSection, path: str, setting: Setting) -> Prior:
    """Return what a bench procedure of the same problem found, as a prior."""
    estimate = setting.bench.get(path)
    if estimate is None or not estimate.is_usable:
        have = ", ".join(path for path, one in setting.bench.items() if one.is_usable) or "none"
        raise IdentificationError(
            f"{setting.file}: parameter '{item.path}': prior = 'bench': no procedure of this problem identified it; "
            f"identified: {have}"
        )
    return Prior(estimate.value, estimate.wider_half_width / interval_factor(estimate.confidence))


def experiment_without_scenario(item: ExperimentSection, source: Source, setting: Setting) -> Experiment:
    """Return the experiment of a recording on the device of the set; it begins at the first sample by default.

    IdentificationError where a scenario is needed.
    """
    said = f"{setting.file}: experiment '{item.label}'"
    if setting.parameter_set is None:
        raise IdentificationError(f"{said}: needs a scenario, because no device was given")
    if item.initial_state == "scenario":
        raise IdentificationError(f"{said}: initial_state = 'scenario', but it has no scenario; omit it")
    recording = source.recording
    first = float(recording.time[0]) if item.start is None else quantity_of(f"{said}: start", item.start, "s")
    used = recording.between(first, float(recording.time[-1]))
    device = build_device(apply_overrides(setting.parameter_set, item.overrides, setting.valve), setting.valve)
    device, fixed = _fix_vane(item, device, said)
    inputs = _inputs(item, recording, said)
    start = _start_of(used, device, fixed, said)
    motion = held_vane(start.angle) if fixed else None
    scenario = replay_scenario(recording, device, start, used.duration, said, motion)
    noise, channels = noise_of_channels(item.noise, said), compared_channels(item)
    return Experiment(item.label, scenario, recording, first, channels, noise, inputs, source=source.trace)


def compared_channels(item: ExperimentSection) -> tuple[str, ...]:
    """Return what an experiment is compared in: as given, else all that is neither held nor followed."""
    if item.channels is not None:
        return item.channels
    if item.volume is not None:
        return ("pressure_1",)
    is_prescribed = item.held is not None or ANGLE in (item.inputs or ())
    return FITTED_CHANNELS[1:] if is_prescribed else FITTED_CHANNELS


def _fix_vane(item: ExperimentSection, device: Device, said: str) -> tuple[Device, dict[str, float]]:
    """Return the device and what of its state is known where the vane is held, or where there is none."""
    if (item.held is not None or item.volume is not None) and ANGLE in (item.inputs or ()):
        raise IdentificationError(f"{said}: the vane is held or absent, but inputs has '{ANGLE}': omit one of them")
    if item.held is not None and item.volume is not None:
        raise IdentificationError(f"{said}: held and volume: with a fixed volume there is no vane; omit one of them")
    if item.held is not None:
        return device, {ANGLE: quantity_of(f"{said}: held", item.held, "rad")}
    if item.volume is None:
        return device, {}
    volume = quantity_of(f"{said}: volume", item.volume, "m^3")
    if not volume > 0.0:
        raise IdentificationError(f"{said}: volume = '{item.volume}' must be above zero")
    known = {ANGLE: device.actuator.angle_min, "pressure_2": device.supply.atmospheric_pressure}
    return with_fixed_volume(device, volume), known


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
                f"{said}: there is no channel '{name}' to start from; give a scenario, which prescribes the "
                "initial state"
            )
        return float(np.mean(recording[name][:count]))

    angle, pressure_1, pressure_2 = (mean(name) for name in FITTED_CHANNELS)
    rate = mean("angular_velocity") if "angular_velocity" in recording and ANGLE not in known else 0.0
    return Start(float(between_stops(np.array([angle]), device, said)[0]), rate, pressure_1, pressure_2)
