"""Results of a study, read from its folder on demand."""

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.errors import DataError, StudyError, UnitError, refused_as
from ppafo.report.kind import YES_OR_NO, Kind, of_stored_metric
from ppafo.signals.recording import CHANNELS
from ppafo.storage.parquet import as_numpy, column_names, matrix_of, read_parquet
from ppafo.study.folder import StudyFolder
from ppafo.study.runs import joined
from ppafo.study.store import FOLLOWS, OSCILLATES, check_types, chunk_file, stored_rows, trace_column
from ppafo.units import from_si
from ppafo.wording import known_names, nearest_name

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped]
    import pyarrow as pa

SUMMARY = "summary.json"
BANDS = "bands.parquet"
_OF_BANDS = ("configuration", "channel", "time", "runs")
_QUANTILE = re.compile(r"q[0-9]*\.?[0-9]+(e-[0-9]+)?")
"""Pattern of the column name of a quantile in the bands file, such as q0.05."""
Columns = dict[str, np.ndarray[Any, Any]]


@dataclass(frozen=True, slots=True, repr=False)
class StudyResults:
    """Results of a study in a folder, from which rows are read on demand.

    ``folder``: folder of the results
    ``document``, ``summary``: content of ``study.json`` and of ``summary.json``
    ``kept``: temporary folder, which exists as long as its results are in use; None for a folder of the user
    """

    folder: StudyFolder
    document: Mapping[str, Any]
    summary: Mapping[str, Any]
    kept: tempfile.TemporaryDirectory[str] | None = None

    def __repr__(self) -> str:
        """Return name, number of runs, number of completed runs, and metrics."""
        counted = ", ".join(f"{self.summary[key]:,} {key}" for key in ("completed", "diverged", "refused"))
        return (
            f"StudyResults of '{self.name}' in {self.folder.path}\n  {self.document['runs']:,} runs: {counted}\n  "
            f"varied: {', '.join(self.varied) or 'nothing'}\n  metrics: "
            f"{', '.join(self.document['metrics']) or 'none'}"
        )

    @property
    def name(self) -> str:
        """Name of the study."""
        return str(self.document["study"]["name"])

    @property
    def configurations(self) -> tuple[str, ...]:
        """Names of the configurations of the study."""
        return tuple(configuration["name"] for configuration in self.document["study"]["configurations"])

    @property
    def varied(self) -> tuple[str, ...]:
        """Paths of the varied values of the study."""
        return tuple(self.document["varied"])

    @property
    def metrics(self) -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
        """Statistics by configuration and metric: unit, count, mean, standard deviation, extremes and quantiles."""
        metrics: Mapping[str, Mapping[str, Mapping[str, Any]]] = self.summary["configurations"]
        return metrics

    def table(self, columns: Sequence[str] | None = None) -> Columns:
        """Return the rows of all runs, or some of their columns, as arrays by name; SI units, nan for missing values.

        Channels over time are not part of the table; ``trajectories`` returns them.
        """
        # All chunks have the columns of the first.
        first = chunk_file(0)
        known = column_names(self.folder.open(first), first)
        for name in columns or ():
            if name not in known:
                raise StudyError(f"the study has no column '{name}'{known_names(name, known)}")
        traces = {trace_column(name) for name in CHANNELS}
        columns = columns or [name for name in known if name not in traces]
        return joined([as_numpy(part) for part in self.chunks(columns)])

    def to_dataframe(self, units: Mapping[str, str] | None = None) -> "pandas.DataFrame":
        """Return the rows of all runs, like ``table``, in SI or in ``units``, such as ``{"supply.pressure": "bar_g"}``.

        ``attrs["units"]`` has the unit of each column; answers such as ``follows`` are booleans. Gauge pressures are
        relative to the standard atmosphere.
        """
        from pandas import DataFrame

        frame = DataFrame(self.table())
        schema = next(self.chunks(list(frame))).schema
        shown = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}
        for name, unit in (units or {}).items():
            if name not in shown:
                raise StudyError(f"the table has no column '{name}'{known_names(name, shown)}")
            with refused_as(UnitError, f"column '{name}' in '{unit}'", UnitError):
                # Units are affine, so that two values decide all.
                zero, one = (from_si(number, unit, shown[name]) for number in (0.0, 1.0))
            frame[name] = zero + (one - zero) * frame[name]
        # A truth that is not known stays empty.
        frame = frame.astype({name: "boolean" for name in (OSCILLATES, FOLLOWS) if name in frame})
        frame.attrs = {"title": self.name, "units": shown | dict(units or {})}
        return frame

    def by_configuration(self, column: str) -> dict[str, np.ndarray[Any, Any]]:
        """Return a column of all runs, by name of the configuration.

        Runs with the same index have the same draw in all configurations.
        """
        values = self.table([column])[column]
        return dict(zip(self.configurations, np.split(values, len(self.configurations)), strict=True))

    def trajectories(self, channel: str) -> np.ndarray[Any, Any]:
        """Return a stored channel of all runs, shape (runs, samples), nan for failed runs and after a fall."""
        outputs = self.document["study"]["outputs"]
        stored = list(dict.fromkeys([*outputs.get("trajectories", ()), *outputs.get("bands", ())]))
        if channel not in stored:
            raise StudyError(
                f"the study stores no trajectories of '{channel}'{nearest_name(channel, stored)}; available: {stored}"
            )
        column = trace_column(channel)
        return np.concatenate([matrix_of(part.column(column)) for part in self.chunks([column])])

    def bands(self) -> Columns:
        """Return quantile bands over time as columns: configuration, channel, time, and a column for each quantile."""
        try:
            table = read_parquet(self.folder.open(BANDS), BANDS)
            check_types(table, BANDS)
            others = set(table.column_names) - set(_OF_BANDS)
            if not set(_OF_BANDS) < set(table.column_names) or not all(map(_QUANTILE.fullmatch, others)):
                raise DataError(f"{BANDS}: must have the columns of percentile bands; run the study again")
        except (DataError, OSError) as error:
            raise DataError(
                f"{self.folder.path}/{BANDS}: is missing or damaged; run the study again into this folder"
            ) from error
        return as_numpy(table)

    def thin(self, column: str, maximum: int) -> dict[str, np.ndarray[Any, Any]]:
        """Return a column by name of the configuration, thinned to every n-th run for about ``maximum`` runs in all."""
        # An odd step: an even one would see one half of a grid whose last axis has two values.
        step = -(-int(self.document["runs"]) // maximum) | 1
        thinned = {}
        for name in self.configurations:
            parts, start = [], 0
            for table in self.chunks([column], name):
                parts.append(table.column(column).to_numpy()[start::step])
                start = (start - table.num_rows) % step
            thinned[name] = np.concatenate(parts)
        return thinned

    def parts(self, configuration: str, column: str) -> Iterator[np.ndarray[Any, Any]]:
        """Yield the finite values of a column of a configuration, chunk by chunk."""
        for table in self.chunks([column], configuration):
            values = table.column(column).to_numpy()
            yield values[np.isfinite(values)]

    def chunks(self, columns: Sequence[str], configuration: str | None = None) -> "Iterator[pa.Table]":
        """Yield some columns chunk by chunk, of one configuration or of all."""
        # No chunk holds runs of two configurations, and each configuration has the same number of them.
        numbers = range(self.document["chunks"])
        if configuration is not None:
            chunks_of_each = len(numbers) // len(self.configurations)
            start = chunks_of_each * self.configurations.index(configuration)
            numbers = numbers[start : start + chunks_of_each]
        return stored_rows(self.folder, numbers, columns)

    def json_document(self) -> dict[str, Any]:
        """Return the summary, and the path of the folder."""
        return {**self.summary, "folder": str(self.folder.path)}


def metric_kind(results: StudyResults, metric: str) -> Kind:
    """Return label, unit and format of a metric from the stored unit, also for a metric that no longer exists."""
    if metric == FOLLOWS:
        # A column of every study, not a requested metric.
        return Kind(f"Follows its reference{YES_OR_NO}")
    return of_stored_metric(metric, results.document["metrics"][metric]["unit"])
