"""Layout of the section [trajectory] of a problem file: quantities as text with units, files by name."""

from typing import Annotated, Literal

from pydantic import Field

from ppafo.documents.models import StrictTable, Text, Texts
from ppafo.documents.toml_text import NAME
from ppafo.identification.keys import Columns, Confidence
from ppafo.identification.trajectory.experiment import ALL_INPUTS

_Label = Annotated[
    str, Field(pattern=NAME, max_length=60, description="name of the experiment, also used in file names")
]
_Noise = dict[str, Text]


class PriorSection(StrictTable):
    """Prior of a parameter: a normal distribution."""

    mean: Annotated[Text, Field(description="most likely value, with its unit")]
    relative: Annotated[float, Field(gt=0.0, description="standard deviation over the mean")]


class ParameterSection(StrictTable):
    """Table [[trajectory.parameters]]: parameter to fit, with start, bounds and prior."""

    path: Text = Field(description="dotted path, such as friction.viscous_damping or initial.pressure_1")
    start: Text | None = Field(
        None, description="start of the search; default: from the bench procedures, else the set"
    )
    low: Text | None = Field(None, description="lower bound")
    high: Text | None = Field(None, description="upper bound")
    prior: PriorSection | Literal["bench"] | None = Field(
        None, description="what is known beforehand; 'bench': the interval of a bench procedure of this file"
    )
    recordings: Texts = Field((), description="experiments in which it acts, by label; default: all")


class ExperimentSection(StrictTable):
    """Table [[trajectory.experiments]]: recording with the scenario that models it.

    The scenario is run with the device of the problem. Without a scenario, the recorded command, supply and external
    torque drive the run, which starts from the recorded state.
    """

    label: _Label
    recording: Text = Field(description="file, relative to this one")
    columns: Columns = None
    scenario: Text | None = Field(None, description="name or relative file of a scenario; default: the recorded inputs")
    overrides: Texts = Field((), description="changes to the scenario, or to the device without one")
    start: Text | None = Field(
        None, description="time of the recording at which the run begins; 0 s, or the first sample"
    )
    step: Text | None = Field(None, description="longest step of time in the run, such as '0.1 ms'")
    channels: Texts | None = Field(
        None, description="compared channels; default: angle and pressures, unless locked or prescribed"
    )
    noise: _Noise = Field({}, description="least standard deviation by channel, '0.1 deg', '500 Pa_d'; default: none")
    inputs: Texts | None = Field(
        None, description=f"recorded channels used as inputs of the run: {', '.join(ALL_INPUTS)}"
    )
    locked: Text | None = Field(
        None, description="angle at which the vane is locked, such as '75 deg'; without a scenario"
    )
    volume: Text | None = Field(None, description="fixed volume in place of the vane, '60 cm^3'; without a scenario")
    initial_state: Literal["scenario", "recording", "fitted"] | None = Field(
        None,
        description="state at the start; 'recording' and 'fitted' are one; default: the scenario, else the recording",
    )
    time_offset: Text | None = Field(None, description="limit of a fitted delay of the samples behind the run, '20 ms'")


class CandidateSection(StrictTable):
    """Table [[trajectory.candidates]]: possible next experiment."""

    label: _Label
    scenario: Text = Field(description="name of a scenario, or a file relative to this one")
    overrides: Texts = Field((), description="changes to the scenario")
    noise: _Noise = Field({}, description="by channel; default: what the fit finds")
    interval: Text = Field("1 ms", description="time between two samples")


class TrajectorySection(StrictTable):
    """Table [trajectory] of a problem file."""

    parameters: tuple[ParameterSection, ...] = Field(strict=False, min_length=1, description="free parameters")
    experiments: tuple[ExperimentSection, ...] = Field(strict=False, min_length=1, description="recordings to explain")
    confidence: Confidence = 0.95
    candidates: tuple[CandidateSection, ...] = Field(
        (), strict=False, description="experiments to rank by the information that they would bring"
    )
