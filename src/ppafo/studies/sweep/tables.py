"""One chunk as tables: a row for every run, the kept trajectories, and the counts for the bands."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ppafo.metrics import METRICS
from ppafo.signals.channels import CHANNELS
from ppafo.simulation.ensemble import EnsembleResult
from ppafo.storage.parquet import TableColumn, coded_texts, lists_of, table_of, texts_of_some
from ppafo.studies.sweep.bands import BINS, Bins, counts_of
from ppafo.studies.sweep.chunks import Chunk
from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.sweep.study import Study

if TYPE_CHECKING:
    import pyarrow as pa

STATUSES = ("completed", "diverged", "refused")
_PLAIN = "-"


def stored_unit(unit: str) -> str:
    """Return the unit as tables state it: a pressure is absolute (``Pa_a``) or a difference (``Pa_d``), never bare.

    What metrics and channels call Pa is absolute.
    """
    return "Pa_a" if unit == "Pa" else unit


def runs_table(study: Study, chunk: Chunk, values: Mapping[str, Floats], result: EnsembleResult) -> "pa.Table":
    """Return a row for every run: number, configuration, varied values, status, metrics; SI units, nan where none."""
    name = study.configurations[chunk.configuration].name
    names = [item.name for item in study.configurations]
    columns = {
        "run": TableColumn(_numbers(study, chunk), _PLAIN, "number of the run in the study"),
        "configuration": TableColumn(
            coded_texts(np.full(chunk.runs, chunk.configuration), names), _PLAIN, "name of the base scenario"
        ),
    }
    for path, column in values.items():
        given = column if study.varies(path, name) else np.full(chunk.runs, np.nan)
        columns[path] = TableColumn(given, study.units[path], "varied value")
    columns["status"] = TableColumn(coded_texts(result.status, STATUSES), _PLAIN, "how the run ended")
    columns["failure_time"] = TableColumn(result.failure_time, "s", "time at which the run diverged")
    columns["reason"] = TableColumn(texts_of_some(result.reasons, chunk.runs), _PLAIN, "why the run has no metrics")
    for metric in study.outputs.metrics:
        computed = result.metrics.get(metric, np.full(chunk.runs, np.nan))
        columns[metric] = TableColumn(computed, stored_unit(METRICS[metric].unit), METRICS[metric].summary)
    return table_of(columns, described(study, chunk))


def trajectories_table(study: Study, chunk: Chunk, result: EnsembleResult) -> "pa.Table":
    """Return a row for every run with a list of values for each kept channel, in single precision."""
    columns = {"run": TableColumn(_numbers(study, chunk), _PLAIN, "number of the run in the study")}
    for name in study.outputs.trajectories:
        lists = lists_of(result.traces[name].T.astype(np.float32))
        columns[name] = TableColumn(
            lists, stored_unit(CHANNELS[name].unit), f"{CHANNELS[name].summary}, every {study.outputs.every:g} s"
        )
    return table_of(columns, described(study, chunk) | {"every": f"{study.outputs.every!r} s"})


def counts_table(study: Study, chunk: Chunk, bins: Mapping[str, Bins], result: EnsembleResult) -> "pa.Table":
    """Return the counts that are not 0, of each channel, sample and bin; bin 0 and the last lie beyond the bins."""
    parts = {name: counts_of(result.traces[name], bins[name]) for name in study.outputs.bands}
    places = {name: np.nonzero(counts) for name, counts in parts.items()}
    channel = np.concatenate([np.full(place[0].size, number) for number, place in enumerate(places.values())])
    columns = {
        "channel": TableColumn(coded_texts(channel, study.outputs.bands), _PLAIN, "name of the channel"),
        "sample": TableColumn(_joined([place[0] for place in places.values()]), _PLAIN, "number of the sample in time"),
        "bin": TableColumn(_joined([place[1] for place in places.values()]), _PLAIN, f"from 0 to {BINS + 1}"),
        "count": TableColumn(_joined([parts[name][place] for name, place in places.items()]), _PLAIN, "runs in it"),
    }
    return table_of(columns, described(study, chunk))


def described(study: Study, chunk: Chunk) -> dict[str, str]:
    """Return what the files of a chunk say of themselves, by which they are recognised."""
    return {"study": study.name, "chunk": str(chunk.number), "rows": str(chunk.runs)}


def _numbers(study: Study, chunk: Chunk) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    first = chunk.configuration * study.runs_of_configuration + chunk.first
    return np.arange(first, first + chunk.runs, dtype=np.int64)


def _joined(parts: "list[np.ndarray[tuple[int], np.dtype[np.int64]]]") -> "np.ndarray[tuple[int], np.dtype[np.int32]]":
    return np.concatenate(parts).astype(np.int32)
