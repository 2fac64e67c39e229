"""The layout of the section [trajectory] of a problem file, what it leans on, and how its texts with units are read."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import NAME, STRICT, Text, Texts
from ppafo.errors import DataError, IdentificationError, UnitError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source, Use
from ppafo.identification.trajectory.experiment import ALL_INPUTS
from ppafo.identification.trajectory.problem import Loss, Scale
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.units import parse_quantity

_Label = Annotated[str, Field(pattern=NAME, max_length=60, description="its name, also in the names of files")]
_Noise = dict[str, Text]


class PriorSection(BaseModel):
    """What is known beforehand: a normal distribution."""

    model_config = STRICT

    mean: Annotated[Text, Field(description="most likely value, with its unit")]
    relative: Annotated[float, Field(gt=0.0, description="standard deviation over the mean")]


class ParameterSection(BaseModel):
    """A number to be fitted."""

    model_config = STRICT

    path: Annotated[Text, Field(description="dotted path, such as friction.viscous_damping or initial.pressure_1")]
    start: Annotated[
        Text | None,
        Field(
            description="where the search begins; default: what the bench procedures found, else the value of the set"
        ),
    ] = None
    low: Annotated[Text | None, Field(description="lower bound")] = None
    high: Annotated[Text | None, Field(description="upper bound")] = None
    scale: Annotated[Scale | None, Field(description="whether steps are ratios")] = None
    prior: Annotated[
        PriorSection | Literal["bench"] | None,
        Field(description="what is known beforehand; 'bench': the interval of a bench procedure of this file"),
    ] = None
    recordings: Annotated[Texts, Field(description="experiments in which it acts, by label; default: all")] = ()


class ExperimentSection(BaseModel):
    """A recording and the scenario that is to explain it."""

    model_config = STRICT

    label: _Label
    recording: Annotated[Text, Field(description="file, relative to this one")]
    columns: Annotated[
        Text | None, Field(description="name of a column map; without one the file has units in its header")
    ] = None
    scenario: Annotated[
        Text | None,
        Field(
            description="name of a scenario, or a file relative to this one; its device is that of the problem. "
            "Without one the run follows what the recording has of command, supply and external torque"
        ),
    ] = None
    overrides: Annotated[Texts, Field(description="changes to the scenario, or to the device without one")] = ()
    start: Annotated[
        Text | None, Field(description="time of the recording at which the run begins; 0 s, or the first sample")
    ] = None
    step: Annotated[Text | None, Field(description="longest step of time in the run, such as '0.1 ms'")] = None
    channels: Annotated[
        Texts | None,
        Field(description="channels to compare; default: angle and both pressures, without what is held or followed"),
    ] = None
    noise: Annotated[_Noise, Field(description="standard deviation by channel, '0.1 deg', '500 Pa_d'")] = {}
    inputs: Annotated[
        Texts | None, Field(description=f"what the run follows in the recording: {', '.join(ALL_INPUTS)}")
    ] = None
    held: Annotated[
        Text | None, Field(description="angle at which the vane is held, such as '75 deg'; without a scenario")
    ] = None
    volume: Annotated[
        Text | None,
        Field(description="no vane: a fixed volume, such as '60 cm^3', is chamber 1; without a scenario"),
    ] = None
    initial_state: Annotated[
        Literal["scenario", "recording", "fitted"] | None,
        Field(
            description="where the state at the start comes from; 'fitted': from the recording, and its pressures are "
            "fitted too. Default: the scenario, if there is one"
        ),
    ] = None
    time_offset: Annotated[
        Text | None,
        Field(description="fit the delay of the samples behind the run, up to this: '20 ms'"),
    ] = None


class CandidateSection(BaseModel):
    """An experiment that could be done next."""

    model_config = STRICT

    label: _Label
    scenario: Annotated[Text, Field(description="name of a scenario, or a file relative to this one")]
    overrides: Annotated[Texts, Field(description="changes to the scenario")] = ()
    noise: Annotated[_Noise, Field(description="by channel; default: that of the first recording")] = {}
    interval: Annotated[Text, Field(description="time between two samples")] = "1 ms"


class TrajectorySection(BaseModel):
    """A trajectory fit, as it is written."""

    model_config = STRICT

    parameters: Annotated[
        tuple[ParameterSection, ...], Field(strict=False, min_length=1, description="free parameters")
    ]
    experiments: Annotated[
        tuple[ExperimentSection, ...], Field(strict=False, min_length=1, description="recordings to be explained")
    ]
    loss: Annotated[Loss, Field(description="how outliers are weighted")] = "linear"
    other_starts: Annotated[int, Field(ge=0, le=100, description="number of starts besides the first")] = 0
    seed: Annotated[int, Field(ge=0, description="random seed of the draws of starts")] = 1
    confidence: Annotated[float, Field(gt=0.5, lt=1.0, description="confidence of the intervals")] = 0.95
    profiles: Annotated[Texts, Field(description="parameters whose profile likelihood is wanted, by path")] = ()
    candidates: Annotated[
        tuple[CandidateSection, ...],
        Field(strict=False, description="experiments to rank by the information that they would bring"),
    ] = ()


_NOISE_UNITS = {"angle": "rad", "pressure_1": "Pa_d", "pressure_2": "Pa_d"}


@dataclass(frozen=True, slots=True)
class Setting:
    """What a section leans on.

    ``read`` gives the recording of an experiment, ``folder`` is where paths of scenarios begin, ``file`` what messages
    call the section. ``parameter_set`` takes the place of the sets that scenarios name, ``valve`` that of their valves.
    ``bench`` are estimates that came before, by path; ``used`` are the recordings from which they came.
    """

    read: Callable[[ExperimentSection], Source]
    folder: Path
    file: str
    parameter_set: ParameterSet | None = None
    valve: str | None = None
    bench: Mapping[str, Estimate] = field(default_factory=dict)
    used: tuple[Use, ...] = ()


@contextmanager
def name_in_refusals(file: str) -> Iterator[None]:
    """Begin the line of every refusal with the file, where it does not yet.

    IdentificationError and DataError keep their kind.
    """
    try:
        yield
    except (IdentificationError, DataError) as error:
        if str(error).startswith(file):
            raise
        raise type(error)(f"{file}: {error}") from error


def quantity_of(said: str, text: str, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return the number in a text in ``unit``; IdentificationError where it is none. ``said`` is file and key."""
    try:
        return parse_quantity(text, unit, atmosphere)
    except UnitError as error:
        raise IdentificationError(f"{said} = '{text}': {error}") from error


def noise_of_channels(given: Mapping[str, str], said: str) -> dict[str, float]:
    """Return the standard deviations [rad], [Pa] that are given by channel.

    IdentificationError for a channel that has none here.
    """
    for name in given:
        if name not in _NOISE_UNITS:
            hint = nearest_name(name, _NOISE_UNITS)
            raise IdentificationError(f"{said}: noise of '{name}'{hint}: only {', '.join(_NOISE_UNITS)} have one here")
    return {name: quantity_of(f"{said}: noise.{name}", text, _NOISE_UNITS[name]) for name, text in given.items()}
