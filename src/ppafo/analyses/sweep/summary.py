"""The summary of a study that is read again: what everybody may rely on in it, and that it fits its study."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from ppafo.analyses.sweep.results import SUMMARY
from ppafo.documents.models import validate
from ppafo.errors import DataError
from ppafo.storage.places import Place, read_document
from ppafo.study.manifest import MANIFEST

_Count = Annotated[int, Field(ge=0)]


def _fraction(text: str) -> str:
    """Return a text that is a fraction; ValueError for any other."""
    if not 0.0 <= float(text) <= 1.0:
        raise ValueError("must be a fraction from 0 to 1")
    return text


class _Table(BaseModel):
    """A table of which more may be written than is read."""

    model_config = ConfigDict(strict=True)


class _Described(_Table):
    """A metric over the runs of a configuration: ``count`` of them have it."""

    count: _Count
    mean: float = 0.0
    sd: float = 0.0
    quantiles: dict[Annotated[str, AfterValidator(_fraction)], float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.count and not {"mean", "quantiles"} <= self.model_fields_set:
            raise ValueError("has values, and no mean or no quantiles")
        return self


class _Failure(_Table):
    """A run without metrics, and why."""

    run: _Count
    configuration: str
    reason: str


class _Summary(_Table):
    """What everybody may rely on in a summary."""

    completed: _Count
    diverged: _Count
    refused: _Count
    completed_by_configuration: dict[str, _Count]
    oscillating: dict[str, _Count] = Field(default_factory=dict)
    failures: list[_Failure]
    quantile_definition: str
    configurations: dict[str, dict[str, _Described]]


def read_summary(location: Place, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the summary of the study with this ``study.json``; DataError where it is not finished, or damaged."""
    try:
        summary: dict[str, Any] = read_document(location, SUMMARY)
    except (OSError, ValueError) as error:
        raise DataError(
            f"{location.address}: the study is not finished (no complete {SUMMARY}); run it again to resume"
        ) from error
    whose = f"{location.address}: {SUMMARY} is damaged; run the study again into this folder"
    described = validate(_Summary, summary, whose, DataError)
    names = {configuration["name"] for configuration in document["study"]["configurations"]}
    # A configuration or a metric in one of the two documents alone would be looked up in vain.
    has_same_names = names == described.configurations.keys() == described.completed_by_configuration.keys()
    metrics = document["metrics"].keys()
    if not has_same_names or any(own.keys() != metrics for own in described.configurations.values()):
        raise DataError(f"{whose}: its configurations and metrics differ from {MANIFEST}")
    return summary
