"""The section [trajectory] of a problem file: quantities as texts with units, scenarios and recordings by name."""

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.problems import first_problem
from ppafo.errors import IdentificationError, UnitError
from ppafo.identification.source import Source
from ppafo.identification.trajectory.paths import declaration_of
from ppafo.identification.trajectory.problem import (
    FITTED_CHANNELS,
    Experiment,
    FreeParameter,
    InitialState,
    Loss,
    Prior,
    Scale,
    Search,
    TrajectoryProblem,
)
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.files import read_bytes
from ppafo.units import parse_quantity

_STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
_Text = Annotated[str, Field(min_length=1)]
_Texts = Annotated[tuple[_Text, ...], Field(strict=False)]
_NOISE_UNITS = {"angle": "rad", "pressure_1": "Pa_d", "pressure_2": "Pa_d"}


class PriorSection(BaseModel):
    """What is known beforehand."""

    model_config = _STRICT

    mean: Annotated[_Text, Field(description="most likely value, with its unit")]
    relative: Annotated[float, Field(gt=0.0, description="standard deviation over the mean")]


class ParameterSection(BaseModel):
    """A number to be fitted."""

    model_config = _STRICT

    path: Annotated[_Text, Field(description="dotted path, such as friction.viscous_damping or initial.pressure_1")]
    start: Annotated[_Text | None, Field(description="where the search begins; the scenario's value unless given")] = (
        None
    )
    low: Annotated[_Text | None, Field(description="lower bound")] = None
    high: Annotated[_Text | None, Field(description="upper bound")] = None
    scale: Annotated[Scale | None, Field(description="whether steps are ratios")] = None
    prior: Annotated[PriorSection | None, Field(description="what is known beforehand")] = None
    recordings: Annotated[_Texts, Field(description="experiments in which it acts, by label; all unless given")] = ()


class ExperimentSection(BaseModel):
    """A recording and the scenario that is to explain it."""

    model_config = _STRICT

    label: Annotated[_Text, Field(description="how it is called")]
    scenario: Annotated[_Text, Field(description="name of a scenario, or a file relative to this one")]
    overrides: Annotated[_Texts, Field(description="changes to the scenario")] = ()
    recording: Annotated[_Text, Field(description="file, relative to this one")]
    start: Annotated[_Text, Field(description="time of the recording at which the run begins")] = "0 s"
    channels: Annotated[_Texts, Field(description="what is compared")] = FITTED_CHANNELS
    noise: Annotated[dict[str, _Text], Field(description="standard deviation by channel, '0.1 deg', '500 Pa_d'")] = {}
    inputs: Annotated[_Texts, Field(description="constants taken from the recording")] = ()
    initial_state: Annotated[InitialState, Field(description="where the state at the start comes from")] = "scenario"


class TrajectorySection(BaseModel):
    """A trajectory fit, as it is written."""

    model_config = _STRICT

    parameters: Annotated[tuple[ParameterSection, ...], Field(strict=False, min_length=1, description="what is free")]
    experiments: Annotated[
        tuple[ExperimentSection, ...], Field(strict=False, min_length=1, description="what is to be explained")
    ]
    loss: Annotated[Loss, Field(description="how stray samples count")] = "linear"
    other_starts: Annotated[int, Field(ge=0, le=100, description="starts besides the first")] = 0
    seed: Annotated[int, Field(ge=0, description="of the draws of starts")] = 1
    confidence: Annotated[float, Field(gt=0.5, lt=1.0, description="of the intervals")] = 0.95
    kind: Annotated[Literal["trajectory"], Field(description="what this is")] = "trajectory"


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
    return trajectory_problem(section, lambda name: _read(home / name), home, file)


def trajectory_problem(
    section: TrajectorySection, read: Callable[[str], Source], folder: Path, file: str
) -> TrajectoryProblem:
    """Return the problem of a section; ``read`` gives a recording by the name that the section has for it."""
    experiments = tuple(_experiment(item, read, folder, file) for item in section.experiments)
    scenarios = {item.label: item.scenario for item in experiments}
    parameters = tuple(_parameter(item, scenarios, file) for item in section.parameters)
    search = Search(
        loss=section.loss,
        other_starts=section.other_starts,
        seed=section.seed,
        confidence=section.confidence,
    )
    return TrajectoryProblem(parameters, experiments, search)


def _read(path: Path) -> Source:
    digest = hashlib.sha256(read_bytes(path)).hexdigest()
    return Source(read_csv(path), f"{path.name} sha256:{digest}")


def _experiment(item: ExperimentSection, read: Callable[[str], Source], folder: Path, file: str) -> Experiment:
    said = f"{file}: experiment '{item.label}'"
    source = read(item.recording)
    for name in item.noise:
        if name not in _NOISE_UNITS:
            raise IdentificationError(f"{said}: noise of '{name}': only {', '.join(_NOISE_UNITS)} have one here")
    noise = {name: _quantity(f"{said}: noise.{name}", text, _NOISE_UNITS[name]) for name, text in item.noise.items()}
    return Experiment(
        label=item.label,
        scenario=_scenario(item, folder),
        recording=source.recording,
        start=_quantity(f"{said}: start", item.start, "s"),
        channels=item.channels,
        noise=noise,
        inputs=item.inputs,
        initial_state=item.initial_state,
        source=source.trace,
    )


def _scenario(item: ExperimentSection, folder: Path) -> Scenario:
    name = item.scenario if item.scenario in list_scenarios() else str(folder / item.scenario)
    return load_scenario(name, item.overrides)


def _parameter(item: ParameterSection, scenarios: Mapping[str, Scenario], file: str) -> FreeParameter:
    scenario = next((scenarios[label] for label in item.recordings if label in scenarios), None)
    quantity = declaration_of(item.path, scenario or next(iter(scenarios.values())))
    atmosphere = (scenario or next(iter(scenarios.values()))).device.supply.atmospheric_pressure

    def number(name: str, text: str | None) -> float | None:
        said = f"{file}: parameter '{item.path}': {name}"
        return None if text is None else _quantity(said, text, quantity.unit, atmosphere)

    mean = number("prior.mean", None if item.prior is None else item.prior.mean)
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


def _quantity(said: str, text: str, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    try:
        return parse_quantity(text, unit, atmosphere)
    except UnitError as error:
        raise IdentificationError(f"{said} = '{text}': {error}") from error
