"""Content of a study file: configurations, varied paths, sampling, and outputs of each run.

Values are texts with their unit, as in a scenario file; ``loading`` converts them, because the unit depends on the path
of a value.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from ppafo.model.declaration import Number, Quantity
from ppafo.parameters.declared import KIND, LABEL, SHORT_NAME, Fields, Many, Words
from ppafo.parameters.records import SchemaVersion, keyed, record_schema
from ppafo.simulation.scenario import LARGEST_SEED
from ppafo.studies.study import Outputs, SamplingPlan

MAXIMUM_RUNS_OF_CHUNK = 1_000_000
"""Largest number of runs of a chunk, whose rows stay in memory until written: about 100 MB for ten columns."""
MAXIMUM_GRID_VALUES = 1_000_000
"""Largest number of values of a grid axis; all of them are computed before the first run."""
SAME_AS = "same_as"
NOT_RANDOM = (SAME_AS, "grid", "list")
"""Kinds of ``[[vary]]`` that are not distributions."""


def _whole(summary: str, least: int, most: int, optional: bool = True) -> Quantity:
    return Quantity("", "", summary, None, least, most, optional=optional, whole=True)


_VALUE = Words("", True, form=float)
_VALUES = Many(_VALUE, "explicit values", True, 1)
_SEED = _whole("", 0, LARGEST_SEED)
_BOUNDS: Fields = {"minimum": _VALUE, "maximum": _VALUE}


class VaryKind(NamedTuple):
    """Kind of ``[[vary]]``: its meaning, and its keys beside those of all kinds."""

    summary: str
    fields: Fields


KINDS: Mapping[str, VaryKind] = {
    SAME_AS: VaryKind(
        "the value of another varied path in every run", {SAME_AS: Words("a path that varies in this study", True)}
    ),
    "grid": VaryKind(
        "values equally spaced on a linear or logarithmic scale, ends included",
        {
            "first": _VALUE,
            "last": _VALUE,
            "count": _whole("number of values", 2, MAXIMUM_GRID_VALUES, optional=False),
            "spacing": Words("default: linear", allowed=("linear", "logarithmic")),
        },
    ),
    "list": VaryKind("values, each combined with every value of all other lists and grids", {"values": _VALUES}),
    "uniform": VaryKind("uniform distribution between two bounds", _BOUNDS),
    "log_uniform": VaryKind("distribution whose logarithm is uniform between two bounds above 0", _BOUNDS),
    "normal": VaryKind("normal distribution", {"mean": _VALUE, "standard_deviation": _VALUE}),
    "truncated_normal": VaryKind(
        "normal distribution truncated to two bounds; mean and standard deviation are those before truncation",
        {**_BOUNDS, "mean": _VALUE, "standard_deviation": _VALUE},
    ),
    "log_normal": VaryKind(
        "log-normal distribution",
        {
            "median": _VALUE,
            "factor": Quantity(
                "", "", "geometric standard deviation, above 1", minimum=1.0, minimum_allowed=False, plain=True
            ),
        },
    ),
    "triangular": VaryKind("density that rises linearly to the mode and falls from there", {**_BOUNDS, "mode": _VALUE}),
    "choice": VaryKind(
        "one of the values, by weights that are equal by default",
        {"values": _VALUES, "weights": Many(Quantity("", "", "", plain=True), "one weight for each value")},
    ),
    "whole_numbers": VaryKind(
        "whole numbers, bounds included, all as likely; for seeds of sensor noise", {"minimum": _SEED, "maximum": _SEED}
    ),
    "stated": VaryKind("normal distribution from the uncertainty that the parameter set states", {}),
}
"""Kinds of ``[[vary]]``; ``distributions`` has the quantile functions of the random ones."""


def _vary(table: Mapping[str, Any]) -> Fields:
    """Return the fields of a ``[[vary]]`` table; one with the key ``same_as`` needs no kind."""
    kind = table.get(KIND, SAME_AS if SAME_AS in table else "")
    of_kind = KINDS[kind].fields if isinstance(kind, str) and kind in KINDS else {}
    return {
        KIND: Words("", kind != SAME_AS, KINDS, default=SAME_AS if kind == SAME_AS else ""),
        "path": Words("what is varied: a path as for --set, such as 'supply.pressure'", True),
        "only": Many(Words("", True), "names of the configurations in which it varies; default: all"),
        **of_kind,
    }


@dataclass(frozen=True, slots=True)
class ConfigurationSection:
    """Section of a study file for one configuration: scenario and overrides; all configurations get the same draws."""

    name: str = keyed(Words("label in tables and figures", pattern=LABEL))
    scenario: str = keyed("name of a scenario, or a path relative to this file")
    overrides: tuple[str, ...] = keyed("such as 'valve.area=12.6mm^2'", ())


@dataclass(frozen=True, slots=True)
class Correlation:
    """Correlation of two distributions: correlation coefficient of their normal scores (a Gaussian copula)."""

    between: tuple[str, str] = keyed(Many(Words("", True), "two paths that have distributions", least=2, most=2))
    coefficient: float = keyed(Number("", "1: both values at the same quantile", None, -1.0, 1.0, plain=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFile:
    """Study file: configurations, varied paths, correlations, sampling and outputs."""

    schema_version: SchemaVersion
    name: str = keyed(Words(pattern=SHORT_NAME))
    description: str = keyed("what this study asks, and why", "")
    configurations: tuple[ConfigurationSection, ...] = keyed("each is run with the same draws")
    vary: tuple[Mapping[str, Any], ...] = keyed(Many(_vary, "varied paths"), ())
    correlations: tuple[Correlation, ...] = ()
    runs_of_chunk: int | None = keyed(_whole("runs computed and written together", 1, MAXIMUM_RUNS_OF_CHUNK), None)
    sample: SamplingPlan | None = keyed("for 'sweep': required if there are distributions", None)
    outputs: Outputs = keyed("for 'sweep': what is kept of each run", Outputs())


json_schema = partial(record_schema, StudyFile, "ppafo study")
"""JSON Schema of a study file."""
