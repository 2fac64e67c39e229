"""From the section [trajectory] of a problem file to a problem: texts with units, scenarios and recordings by name."""

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ppafo.documents.problems import first_problem
from ppafo.errors import IdentificationError
from ppafo.identification.source import Source
from ppafo.identification.trajectory.expected import Candidate
from ppafo.identification.trajectory.experiment import Experiment
from ppafo.identification.trajectory.paths import TIME_OFFSET, declaration_of, full_path
from ppafo.identification.trajectory.problem import Search, TrajectoryProblem
from ppafo.identification.trajectory.ranges import FreeParameter, Prior
from ppafo.identification.trajectory.section import (
    CandidateSection,
    ExperimentSection,
    ParameterSection,
    TrajectorySection,
)
from ppafo.identification.trajectory.setting import Setting, noise_of_channels, quantity_of
from ppafo.identification.trajectory.verdicts import interval_factor
from ppafo.identification.trajectory.without_scenario import compared_channels, experiment_without_scenario
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.recorded.inputs import LONGEST_STEP
from ppafo.simulation.scenario import Scenario
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.files import read_bytes

_VALVE = "device.valve"
_PRESSURES = ("pressure_1", "pressure_2")
SHORTEST_STEP = 1.0e-6
"""Seconds; a shorter step would only cost time."""


def trajectory_from_dict(
    content: Mapping[str, Any], folder: Path | None = None, file: str = "trajectory"
) -> TrajectoryProblem:
    """Return the problem in nested dictionaries laid out as the section of a file; paths in it begin in ``folder``."""
    try:
        section = TrajectorySection.model_validate(dict(content))
    except ValidationError as error:
        text = first_problem(error.errors(include_url=False), TrajectorySection)
        raise IdentificationError(f"{file}: {text}") from error
    home = folder or Path()
    return trajectory_problem(section, Setting(lambda item: _read(home / item.recording), home, file))


def trajectory_problem(section: TrajectorySection, setting: Setting) -> TrajectoryProblem:
    """Return the problem of a section."""
    experiments = tuple(_experiment(item, setting) for item in section.experiments)
    scenarios = {item.label: item.scenario for item in experiments}
    sources = {item.label: item.source for item in experiments}
    parameters = [_parameter(item, scenarios, sources, setting) for item in section.parameters]
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


def _read(path: Path) -> Source:
    digest = hashlib.sha256(read_bytes(path)).hexdigest()
    return Source(read_csv(path), f"{path.name} sha256:{digest}")


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
                f"{said}: {name} and a scenario: the scenario says how the vane moves; leave one out"
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


def _parameter(
    item: ParameterSection, scenarios: Mapping[str, Scenario], sources: Mapping[str, str], setting: Setting
) -> FreeParameter:
    scenario = next((scenarios[label] for label in item.recordings if label in scenarios), None)
    acting = scenario or next(iter(scenarios.values()))
    quantity = declaration_of(item.path, acting)
    atmosphere = acting.device.supply.atmospheric_pressure

    def number(name: str, text: str | None) -> float | None:
        said = f"{setting.file}: parameter '{item.path}': {name}"
        return None if text is None else quantity_of(said, text, quantity.unit, atmosphere)

    if item.prior == "bench":
        prior: Prior | None = _bench_prior(item, full_path(item.path, acting), sources, setting)
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


def _bench_prior(item: ParameterSection, path: str, sources: Mapping[str, str], setting: Setting) -> Prior:
    """Return what a bench procedure of the same problem found, as a prior; not from a recording that is fitted too."""
    estimate = setting.bench.get(path)
    if estimate is None or not estimate.is_usable:
        have = ", ".join(path for path, one in setting.bench.items() if one.is_usable) or "none"
        raise IdentificationError(
            f"{setting.file}: parameter '{item.path}': prior = 'bench': no procedure of this problem identified it; "
            f"identified: {have}"
        )
    for label, source in sources.items():
        if source in estimate.recordings and (not item.recordings or label in item.recordings):
            raise IdentificationError(
                f"{setting.file}: parameter '{item.path}': prior = 'bench' comes from {source}, which experiment "
                f"'{label}' fits too: it would count twice; leave the prior out"
            )
    return Prior(estimate.value, estimate.half_width / interval_factor(estimate.confidence))
