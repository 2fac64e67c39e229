"""The layout of a tuning file: what is searched, between which bounds, for which goal and under which constraints."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ppafo.documents.models import NAME, published_schema

LARGEST_SEED = 2**32 - 1
MOST_DRAWS = 4096

_STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
_Text = Annotated[str, Field(min_length=1)]
_Texts = Annotated[tuple[_Text, ...], Field(strict=False)]
_Value = Annotated[str | float | int, Field(description="a text with its unit; a plain number where there is no unit")]
_Metric = Annotated[_Text, Field(description="name of a metric, such as 'rms_error'")]


class Searched(BaseModel):
    """A number that is searched, with the bounds between which it may lie."""

    model_config = _STRICT

    path: Annotated[_Text, Field(description="as for --set, such as 'controller.proportional_gain'")]
    minimum: _Value
    maximum: _Value
    spacing: Annotated[Literal["linear", "logarithmic"], Field(description="linear unless given")] = "linear"


class Goal(BaseModel):
    """A term of the objective: weight times metric over scale; less is better, with a weight below 0 more is."""

    model_config = _STRICT

    metric: _Metric
    weight: float = 1.0
    scale: Annotated[_Text | None, Field(description="size that counts as 1; the value before tuning unless given")] = (
        None
    )


class Constraint(BaseModel):
    """A metric that must not be above, or below, a value."""

    model_config = _STRICT

    metric: _Metric
    at_most: Annotated[_Text | None, Field(description="largest value with its unit")] = None
    at_least: Annotated[_Text | None, Field(description="smallest value with its unit")] = None


class Robust(BaseModel):
    """Every candidate is run over the same draws from a study, and judged by the bad end of what comes of it."""

    model_config = _STRICT

    study: Annotated[_Text, Field(description="name of a study, or a path relative to this file")]
    measure: Annotated[
        Literal["mean_and_deviations", "quantile"],
        Field(description="mean plus 'deviations' standard deviations, or the 'share' quantile"),
    ] = "mean_and_deviations"
    deviations: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    share: Annotated[float, Field(ge=0.5, lt=1.0)] = 0.9
    draws: Annotated[int, Field(ge=8, le=MOST_DRAWS)] = 64


class Effort(BaseModel):
    """How long is searched: independent starts, generations of each at most, candidates of a generation per gain."""

    model_config = _STRICT

    starts: Annotated[int, Field(ge=1, le=100)] = 3
    generations: Annotated[int, Field(ge=1, le=100_000)] = 100
    candidates_per_gain: Annotated[int, Field(ge=4, le=1000)] = 10
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 1


class TuningFile(BaseModel):
    """A tuning file, as it is written."""

    model_config = _STRICT

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: str = ""
    scenario: Annotated[_Text, Field(description="name of a scenario, or a path relative to this file")]
    overrides: Annotated[_Texts, Field(description="such as 'valve.area=12.6mm^2'")] = ()
    search: Annotated[tuple[Searched, ...], Field(strict=False, min_length=1)]
    objective: Annotated[tuple[Goal, ...], Field(strict=False, min_length=1)]
    constraints: Annotated[tuple[Constraint, ...], Field(strict=False)] = ()
    robust: Annotated[Robust | None, Field(description="the device as it is said to be unless given")] = None
    effort: Effort = Effort()


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a tuning file."""
    return published_schema(TuningFile, "ppafo tuning")
