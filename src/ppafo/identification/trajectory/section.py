"""The layout of the section [trajectory] of a problem file."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from ppafo.documents.models import NAME
from ppafo.identification.trajectory.experiment import ALL_INPUTS
from ppafo.identification.trajectory.problem import Loss
from ppafo.identification.trajectory.ranges import Scale

_STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
_Text = Annotated[str, Field(min_length=1)]
_Texts = Annotated[tuple[_Text, ...], Field(strict=False)]
_Label = Annotated[str, Field(pattern=NAME, max_length=60, description="how it is called, also in names of files")]
_Noise = dict[str, _Text]


class PriorSection(BaseModel):
    """What is known beforehand: a normal distribution."""

    model_config = _STRICT

    mean: Annotated[_Text, Field(description="most likely value, with its unit")]
    relative: Annotated[float, Field(gt=0.0, description="standard deviation over the mean")]


class ParameterSection(BaseModel):
    """A number to be fitted."""

    model_config = _STRICT

    path: Annotated[_Text, Field(description="dotted path, such as friction.viscous_damping or initial.pressure_1")]
    start: Annotated[
        _Text | None,
        Field(description="where the search begins; unless given, what the bench procedures found, else the set's"),
    ] = None
    low: Annotated[_Text | None, Field(description="lower bound")] = None
    high: Annotated[_Text | None, Field(description="upper bound")] = None
    scale: Annotated[Scale | None, Field(description="whether steps are ratios")] = None
    prior: Annotated[
        PriorSection | Literal["bench"] | None,
        Field(description="what is known beforehand; 'bench': the interval of the bench procedure that came before"),
    ] = None
    recordings: Annotated[_Texts, Field(description="experiments in which it acts, by label; all unless given")] = ()


class ExperimentSection(BaseModel):
    """A recording and the scenario that is to explain it."""

    model_config = _STRICT

    label: _Label
    recording: Annotated[_Text, Field(description="file, relative to this one")]
    columns: Annotated[
        _Text | None, Field(description="name of a column map; without one the file has units in its header")
    ] = None
    scenario: Annotated[
        _Text | None,
        Field(
            description="name of a scenario, or a file relative to this one; its device is that of the problem. "
            "Without one the run follows what the recording has of command, supply and external torque"
        ),
    ] = None
    overrides: Annotated[_Texts, Field(description="changes to the scenario, or to the device without one")] = ()
    start: Annotated[
        _Text | None, Field(description="time of the recording at which the run begins; 0 s, or the first sample")
    ] = None
    step: Annotated[_Text | None, Field(description="longest step of time in the run, such as '0.1 ms'")] = None
    channels: Annotated[
        _Texts | None,
        Field(description="what is compared; angle and both pressures unless given, without what is held or followed"),
    ] = None
    noise: Annotated[_Noise, Field(description="standard deviation by channel, '0.1 deg', '500 Pa_d'")] = {}
    inputs: Annotated[
        _Texts | None, Field(description=f"what the run follows in the recording: {', '.join(ALL_INPUTS)}")
    ] = None
    held: Annotated[
        _Text | None, Field(description="angle at which the vane is held, such as '75 deg'; without a scenario")
    ] = None
    volume: Annotated[
        _Text | None,
        Field(description="no vane: a fixed volume, such as '60 cm^3', is chamber 1; without a scenario"),
    ] = None
    initial_state: Annotated[
        Literal["scenario", "recording", "fitted"] | None,
        Field(
            description="where the state at the start comes from; 'fitted': from the recording, and its pressures are "
            "fitted too. The scenario, if there is one, unless given"
        ),
    ] = None
    time_offset: Annotated[
        _Text | None,
        Field(description="fit how much later the samples are than the run, at most this: '20 ms'"),
    ] = None


class CandidateSection(BaseModel):
    """An experiment that could be done next."""

    model_config = _STRICT

    label: _Label
    scenario: Annotated[_Text, Field(description="name of a scenario, or a file relative to this one")]
    overrides: Annotated[_Texts, Field(description="changes to the scenario")] = ()
    noise: Annotated[_Noise, Field(description="by channel; that of the first recording unless given")] = {}
    interval: Annotated[_Text, Field(description="time between two samples")] = "1 ms"


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
    profiles: Annotated[_Texts, Field(description="parameters whose profile likelihood is wanted, by path")] = ()
    candidates: Annotated[
        tuple[CandidateSection, ...], Field(strict=False, description="experiments to rank by what they would bring")
    ] = ()
