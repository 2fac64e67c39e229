"""The contents of a results folder, read on demand."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel

from ppafo.answers import Solved
from ppafo.errors import DataError, StudyError, nearest_name
from ppafo.questions.sweep.compute import RUNS_FOLDER, TRAJECTORIES_FOLDER, chunk_file
from ppafo.questions.sweep.manifest import read_manifest
from ppafo.storage.parquet import as_numpy, read_parquet
from ppafo.storage.places import Place, place_at, read_document

if TYPE_CHECKING:
    import pyarrow as pa

SUMMARY = "summary.json"
BANDS = "bands.parquet"

Columns = dict[str, np.ndarray[Any, Any]]


@dataclass(frozen=True, slots=True, repr=False)
class StudyResults(Solved):
    """The results of a study: ``document`` is its ``study.json``, ``summary`` its ``summary.json``.

    ``kept`` holds a temporary folder as long as its results are used; None for a folder of one's own.
    """

    place: Place
    document: Mapping[str, Any]
    summary: Mapping[str, Any]
    kept: tempfile.TemporaryDirectory[str] | None = None

    def __repr__(self) -> str:
        """Return name, runs, how many completed, and the metrics."""
        counted = ", ".join(f"{self.summary[key]:,} {key}" for key in ("completed", "diverged", "refused"))
        return (
            f"StudyResults of '{self.name}' in {self.place.address}\n  {self.document['runs']:,} runs: {counted}\n  "
            f"varied: {', '.join(self.varied) or 'nothing'}\n  metrics: "
            f"{', '.join(self.document['metrics']) or 'none'}"
        )

    @property
    def name(self) -> str:
        """Name of the study."""
        return str(self.document["study"]["name"])

    @property
    def configurations(self) -> tuple[str, ...]:
        """Names of the configurations."""
        return tuple(item["name"] for item in self.document["study"]["configurations"])

    @property
    def varied(self) -> tuple[str, ...]:
        """The varied paths."""
        return tuple(self.document["varied"])

    @property
    def metrics(self) -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
        """For each configuration and metric: unit, count, mean, standard deviation, extremes and quantiles."""
        found: Mapping[str, Mapping[str, Mapping[str, Any]]] = self.summary["configurations"]
        return found

    def table(self, columns: Sequence[str] | None = None) -> Columns:
        """Return the rows of all runs, or some columns of them, as arrays by name; SI units, nan where none."""
        parts = [as_numpy(part) for part in self.chunks(RUNS_FOLDER, columns)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def by_configuration(self, column: str) -> dict[str, np.ndarray[Any, Any]]:
        """Return a column of all runs, by name of the configuration; runs of the same place got the same draw."""
        values = self.table([column])[column]
        return dict(zip(self.configurations, np.split(values, len(self.configurations)), strict=True))

    def trajectories(self, channel: str) -> np.ndarray[Any, Any]:
        """Return a kept channel of all runs, shape (runs, samples), nan where a run failed."""
        kept = self.document["study"]["outputs"].get("trajectories", ())
        if channel not in kept:
            raise StudyError(
                f"no trajectories of '{channel}' were kept{nearest_name(channel, kept)}; available: {kept}"
            )
        rows = [row for part in self.chunks(TRAJECTORIES_FOLDER, [channel]) for row in part.column(channel).to_numpy()]
        return np.stack(rows)

    def bands(self) -> Columns:
        """Return the bands: configuration, channel, time and a column for each quantile."""
        return as_numpy(read_parquet(self.place.open(BANDS), BANDS))

    def thin(self, column: str, maximum: int) -> dict[str, np.ndarray[Any, Any]]:
        """Return a column by name of the configuration, of about ``maximum`` runs in all: every so many of them."""
        step = -(-int(self.document["runs"]) // maximum) | 1
        return {name: self._every(name, column, step) for name in self.configurations}

    def _every(self, configuration: str, column: str, step: int) -> np.ndarray[Any, Any]:
        parts, first = [], 0
        for table in self.chunks(RUNS_FOLDER, [column], configuration):
            parts.append(table.column(column).to_numpy()[first::step])
            first = (first - table.num_rows) % step
        return np.concatenate(parts)

    def parts(self, configuration: str, column: str) -> Iterator[np.ndarray[Any, Any]]:
        """Give the finite values of a column of a configuration, chunk by chunk."""
        for table in self.chunks(RUNS_FOLDER, [column], configuration):
            values = table.column(column).to_numpy()
            yield values[np.isfinite(values)]

    def chunks(
        self, folder: str, columns: Sequence[str] | None = None, configuration: str | None = None
    ) -> "Iterator[pa.Table]":
        """Give the tables of the chunks one after the other, of all configurations or of one."""
        numbers = range(self.document["chunks"])
        if configuration is not None:
            own = len(numbers) // len(self.configurations)
            start = own * self.configurations.index(configuration)
            numbers = numbers[start : start + own]
        for number in numbers:
            name = chunk_file(folder, number)
            try:
                yield read_parquet(self.place.open(name), name, columns)
            except (DataError, OSError) as error:
                raise DataError(
                    f"{self.place.address}/{name}: is missing or damaged; run the study again into this folder to "
                    "recompute this chunk"
                ) from error


def load_study_results(folder: str | Path) -> StudyResults:
    """Return the finished results of a study in a folder or at an address; DataError where there are none."""
    place = place_at(folder)
    document = read_manifest(place)
    try:
        summary = read_document(place, SUMMARY)
        _Summary.model_validate(summary)
    except (OSError, ValueError) as error:
        raise DataError(
            f"{place.address}: the study is not finished (no complete {SUMMARY}); run it again to resume"
        ) from error
    return StudyResults(place, document, summary)


class _Summary(BaseModel):
    """What everybody may rely on in a summary."""

    completed: int
    diverged: int
    refused: int
    configurations: dict[str, dict[str, dict[str, Any]]]
