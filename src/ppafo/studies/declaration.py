"""Layout of a study file: configurations, varied paths, sampling, and outputs of each run.

Values are texts with their unit, as in a scenario file; ``loading`` converts them, because the unit depends on the path
of a value.
"""

from functools import partial
from typing import Annotated, Literal, get_args

from pydantic import Field

from ppafo.documents.models import LABEL, SchemaVersion, StrictTable, Text, Texts, make_schema
from ppafo.documents.toml_text import NAME
from ppafo.simulation.scenario import LARGEST_SEED

MAXIMUM_RUNS = 2**32
"""Largest number of draws: the period of a 32-bit Sobol sequence; no other method needs a lower limit."""
MAXIMUM_RUNS_OF_CHUNK = 1_000_000
"""Largest number of runs of a chunk, whose rows stay in memory until written: about 100 MB for ten columns."""
DEFAULT_SEED = 1
"""Default random seed of the draws of a study."""
MAXIMUM_GRID_VALUES = 1_000_000
"""Largest number of values of a grid axis; all of them are computed before the first run."""
DEFAULT_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Default quantiles: the central 90 % of the runs, the central 50 %, and the median."""

_Value = Annotated[str | float | int, Field(description="text with unit; a plain number if there is no unit")]
_Values = Annotated[tuple[_Value, ...], Field(strict=False, min_length=1)]


class ConfigurationSection(StrictTable):
    """Section of a study file for one configuration: scenario and overrides; all configurations get the same draws."""

    name: Annotated[str, Field(pattern=LABEL, max_length=100, description="label in tables and figures")]
    scenario: Annotated[Text, Field(description="name of a scenario, or a path relative to this file")]
    overrides: Annotated[Texts, Field(description="such as 'valve.area=12.6mm^2'")] = ()


class _Varying(StrictTable):
    path: Annotated[Text, Field(description="what is varied: a path as for --set, such as 'supply.pressure'")]
    only: Annotated[Texts, Field(description="names of the configurations in which it varies; default: all")] = ()


class _Bounded(_Varying):
    minimum: _Value
    maximum: _Value


class Grid(_Varying):
    """Grid of values of a path, equally spaced on a linear or logarithmic scale, ends included."""

    kind: Literal["grid"]
    first: _Value
    last: _Value
    count: Annotated[int, Field(ge=2, le=MAXIMUM_GRID_VALUES, description="number of values")]
    spacing: Annotated[Literal["linear", "logarithmic"], Field(description="default: linear")] = "linear"


class Listed(_Varying):
    """Explicit list of values of a path; combined with every value of all other lists and grids."""

    kind: Literal["list"]
    values: _Values


class Uniform(_Bounded):
    """Uniform distribution of a varied path between two bounds."""

    kind: Literal["uniform"]


class LogUniform(_Bounded):
    """Distribution whose logarithm is uniform between the logarithms of two bounds above 0."""

    kind: Literal["log_uniform"]


class Normal(_Varying):
    """Normal distribution of a varied path, given by mean and standard deviation."""

    kind: Literal["normal"]
    mean: _Value
    standard_deviation: _Value


class TruncatedNormal(_Bounded):
    """Normal distribution truncated to two bounds; mean and standard deviation are the values before truncation."""

    kind: Literal["truncated_normal"]
    mean: _Value
    standard_deviation: _Value


class LogNormal(_Varying):
    """Log-normal distribution given by its median and its geometric standard deviation."""

    kind: Literal["log_normal"]
    median: _Value
    factor: Annotated[float, Field(gt=1.0, description="geometric standard deviation, above 1")]


class Triangular(_Bounded):
    """Triangular distribution: its density rises linearly to the mode and falls linearly from there."""

    kind: Literal["triangular"]
    mode: _Value


class Choice(_Varying):
    """Discrete distribution: values with weights, equal by default."""

    kind: Literal["choice"]
    values: _Values
    weights: Annotated[tuple[float, ...], Field(strict=False, description="one weight for each value")] = ()


class WholeNumbers(_Varying):
    """Discrete uniform distribution of integers, bounds included; used for random seeds of sensor noise."""

    kind: Literal["whole_numbers"]
    minimum: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 0
    maximum: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = LARGEST_SEED


class Stated(_Varying):
    """Normal distribution from the parameter set's uncertainty; a 95 % half width is 1.96 standard deviations."""

    kind: Literal["stated"]


class SameAs(_Varying):
    """Varied path that takes the value of another varied path in every run."""

    kind: Annotated[Literal["same_as"], Field(description="optional")] = "same_as"
    same_as: Annotated[Text, Field(description="a path that varies in this study")]


class Correlation(StrictTable):
    """Correlation of two distributions: correlation coefficient of their normal scores (a Gaussian copula)."""

    between: Annotated[tuple[Text, Text], Field(strict=False, description="two paths that have distributions")]
    coefficient: Annotated[float, Field(ge=-1.0, le=1.0, description="1: both values at the same quantile")]


class SamplingSection(StrictTable):
    """Section of a study file for random draws: method, number and seed; every grid point gets the whole sample."""

    method: Literal["random", "latin_hypercube", "sobol"]
    runs: Annotated[int, Field(ge=1, le=MAXIMUM_RUNS, description="draws; each is run in every configuration")]
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = DEFAULT_SEED


class OutputsSection(StrictTable):
    """Section of a study file for outputs: metrics, traces and quantile bands to keep."""

    metrics: Annotated[Texts | Literal["all"], Field(description="names of metrics, or 'all'")] = ()
    trajectories: Annotated[Texts, Field(description="channels kept for every run")] = ()
    bands: Annotated[Texts, Field(description="channels whose quantiles over all runs are kept")] = ()
    errors: Annotated[
        bool, Field(description="estimated error of each metric from the steps, in five times the time")
    ] = False
    every: Annotated[Text, Field(description="time between two kept samples; default 10 ms")] = "10 ms"
    quantiles: Annotated[tuple[Annotated[float, Field(ge=0.0, le=1.0)], ...], Field(strict=False, min_length=1)] = (
        DEFAULT_QUANTILES
    )


Varied = (
    SameAs
    | Grid
    | Listed
    | Uniform
    | LogUniform
    | Normal
    | TruncatedNormal
    | LogNormal
    | Triangular
    | Choice
    | WholeNumbers
    | Stated
)
VARIED = get_args(Varied)
"""Classes of ``Varied``, one for each kind of ``[[vary]]``."""
NOT_RANDOM = (SameAs, Grid, Listed)
"""Classes of ``Varied`` that are not distributions."""


class StudyFile(StrictTable):
    """Study file: configurations, varied paths, correlations, sampling and outputs."""

    schema_version: SchemaVersion
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: Annotated[str, Field(description="what this study asks, and why")] = ""
    configurations: Annotated[tuple[ConfigurationSection, ...], Field(strict=False, min_length=1)]
    vary: Annotated[tuple[Annotated[Varied, Field(discriminator="kind")], ...], Field(strict=False)] = ()
    correlations: Annotated[tuple[Correlation, ...], Field(strict=False)] = ()
    runs_of_chunk: Annotated[
        int | None,
        Field(
            ge=1,
            le=MAXIMUM_RUNS_OF_CHUNK,
            description="runs computed and written together; default: chosen automatically",
        ),
    ] = None
    sample: Annotated[SamplingSection | None, Field(description="for 'sweep': required if there are distributions")] = (
        None
    )
    outputs: Annotated[OutputsSection, Field(description="for 'sweep': what is kept of each run")] = OutputsSection()


json_schema = partial(make_schema, StudyFile, "ppafo study")
"""JSON Schema of a study file."""
