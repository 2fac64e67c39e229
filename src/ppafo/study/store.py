"""Results of a study in a folder: Parquet files of chunks, each with a note that contains its checksum.

A chunk counts as finished once its note is written, after the chunk itself; a file that does not match its note is
recomputed. Page checksums of Parquet miss some flipped bits; SHA-256 does not.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.documents.json_text import json_text
from ppafo.engine.lanes import Count
from ppafo.errors import DataError, ScenarioError, StudyError, refused_as
from ppafo.metrics import METRICS
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.ensemble import EnsembleResult, run_ensemble
from ppafo.simulation.ensemble.columns import absolute
from ppafo.storage.parquet import (
    TableColumn,
    encode_texts,
    lists_of,
    parquet_bytes,
    read_parquet,
    table_of,
    texts_of_some,
)
from ppafo.storage.result_folder import MANIFEST
from ppafo.studies.distributions import Floats
from ppafo.studies.study import Study
from ppafo.study.blocks import Chunk, chunk, chunk_count, drawn_values, samples_of, varied_columns
from ppafo.study.folder import StudyFolder
from ppafo.study.manifest import STUDY_COPY, check_same_study, manifest, read_manifest
from ppafo.study.runs import excess, unvaried, with_companions
from ppafo.wording import argument_text, one_line

if TYPE_CHECKING:
    import pyarrow as pa

_TRIED_RUNS = 8
"""Number of trial runs of each configuration before a study starts, to detect errors at once."""
STATUSES = ("completed", "diverged", "refused")
_PLAIN, _OVER_TIME = "-", "_over_time"
"""Unit of a dimensionless column, and suffix of the name of a column with a trace."""
OSCILLATES, FOLLOWS, ON_PURPOSE = "oscillates", "follows", "beyond_reach_on_purpose"
"""Names of the columns of flags: the loop of the run oscillates; the run follows its reference."""
_TEXT_COLUMNS = ("configuration", "status", "reason", "channel")
ASKED_ABOVE = 10_000_000_000
"""Size [bytes] above which a study only starts with ``--yes``."""
_FIXED_BYTES_OF_ROW, _BYTES_OF_NUMBER, _BYTES_OF_SAMPLE = 3, 8, 4
"""Bytes of the texts of a row, each stored as an index into a list of texts, per number of a row, and per sample of a
trace, which has single precision unless needed for bands."""
_BYTES_OF_FILE = 12_000
"""Overhead of a chunk file and its note [bytes]: names, units and meanings of the columns."""


@dataclass(frozen=True, slots=True)
class FinishedChunk:
    """Written chunk: chunk number, number of runs, and number of failed runs."""

    number: int
    runs: int
    failed: int


@dataclass(frozen=True, slots=True)
class StudyStore:
    """Results of a study in a folder, written chunk by chunk."""

    study: Study
    folder: StudyFolder

    @classmethod
    def claim(
        cls, study: Study, folder: StudyFolder, agreed: bool, threads: int | None, report: Report
    ) -> "StudyStore":
        """Use a folder for a study; StudyError for results of another study or version, or too little disk space."""
        names = folder.names()
        if MANIFEST in names:
            check_same_study(folder, read_manifest(folder), manifest(study))
        elif names:
            raise StudyError(
                f"{folder.path}: is not empty and contains no study results (it has no {MANIFEST}); choose "
                "another folder"
            )
        else:
            check_room(study, folder, agreed)
            report(Progress("preparing", 0, study.runs))
            # A few runs of each configuration, spread evenly: a path that cannot vary is refused at once.
            total = study.runs_of_configuration
            runs = np.unique(np.linspace(0, total - 1, min(total, _TRIED_RUNS)).astype(np.int64))
            for number in range(len(study.configurations)):
                _result(study, Chunk(0, number, 0, runs.size), drawn_values(study, runs), threads)
            folder.write(MANIFEST, f"{json_text(manifest(study))}\n".encode())
        folder.tidy()
        # After study.json, by which the folder is known to be ours.
        if study.text and STUDY_COPY not in names:
            folder.write(STUDY_COPY, study.text)
        return cls(study, folder)

    def finished(self) -> list[FinishedChunk]:
        """Return the chunks whose files match their notes."""
        names, chunks = self.folder.names(), []
        for number in range(chunk_count(self.study)):
            name = chunk_file(number)
            if note_file(number) not in names:
                continue
            try:
                note = self.folder.read_document(note_file(number))
                finished = FinishedChunk(number, int(note["runs"]), int(note["failed"]))
                with self.folder.open(name) as file:
                    is_intact = hashlib.file_digest(file, "sha256").hexdigest() == note["sha256"][name]
            except (OSError, ValueError, KeyError, TypeError, OverflowError):
                continue
            # An intact file of another size is of a study that was divided into other chunks.
            if is_intact and finished.runs == chunk(self.study, number).runs:
                chunks.append(finished)
        return chunks

    def write(self, finished: FinishedChunk, content: bytes) -> FinishedChunk:
        """Write the file of a chunk, then the note that marks it as finished; return the chunk."""
        name = chunk_file(finished.number)
        self.folder.write(name, content)
        checksums = {name: hashlib.sha256(content).hexdigest()}
        note = {"runs": finished.runs, "failed": finished.failed, "sha256": checksums}
        self.folder.write(note_file(finished.number), f"{json_text(note)}\n".encode())
        return finished


def stored_rows(
    folder: StudyFolder, numbers: Sequence[int], columns: Sequence[str] | None = None
) -> "Iterator[pa.Table]":
    """Yield the tables of chunks by number; DataError for a missing or damaged chunk."""
    for number in numbers:
        name = chunk_file(number)
        try:
            table = read_parquet(folder.open(name), name, columns)
            check_types(table, name)
            yield table
        except (DataError, OSError) as error:
            raise DataError(
                f"{folder.path}/{name}: is missing or damaged; run the study again into this folder to recompute "
                "this chunk"
            ) from error


def check_types(table: "pa.Table", name: str) -> None:
    """Raise DataError for a column that is neither text, nor number, nor a trace (lists of numbers of equal length)."""
    import pyarrow as pa

    for field in table.schema:
        kind = field.type
        if field.name.endswith(_OVER_TIME):
            is_list = pa.types.is_list(kind) and pa.types.is_floating(kind.value_type)
            # As many samples in each row, or they are no matrix.
            lengths = table.column(field.name).combine_chunks().value_lengths().to_numpy() if is_list else np.arange(2)
            fits = bool(np.all(lengths == lengths[:1]))
        elif field.name in _TEXT_COLUMNS:
            fits = pa.types.is_string(kind) or pa.types.is_dictionary(kind)
        else:
            fits = pa.types.is_floating(kind) or pa.types.is_integer(kind)
        if not fits:
            raise DataError(
                f"{name}: column '{one_line(field.name)}' has the type {kind}, which a study never "
                "writes; run the study again"
            )


def compute_chunk(
    study: Study, number: int, threads: int | None, count: Count = report_nothing
) -> tuple[FinishedChunk, bytes]:
    """Compute a chunk; returns the content of its file: a row per run in SI units, nan for missing values."""
    part = chunk(study, number)
    values = drawn_values(study, np.arange(part.first, part.first + part.runs))
    result = _result(study, part, values, threads, count)
    columns = {**_columns_of_runs(study, part, values), **_columns_of_endings(study, part, values, result)}
    outputs = study.outputs
    for name in outputs.metrics:
        metric = METRICS[name]
        values_of_metric = result.metrics.get(name, np.full(part.runs, np.nan))
        columns[name] = TableColumn(values_of_metric, stored_unit(metric.unit), metric.summary)
        if name in result.errors:
            unit = "Pa_d" if metric.unit == "Pa" else metric.unit
            columns[f"{name}_error"] = TableColumn(result.errors[name], unit, f"estimated error of {name}")
    samples = samples_of(study, study.configurations[part.configuration])
    for channel in outputs.traces:
        trace = result.traces[channel].T
        trace = trace if trace.size else np.full((part.runs, samples), np.nan)
        # What bands are read from is kept as it was computed, all else in single precision.
        trace = trace.astype(np.float64 if channel in outputs.bands else np.float32)
        summary = f"{CHANNELS[channel].summary}, every {outputs.every:g} s"
        columns[trace_column(channel)] = TableColumn(lists_of(trace), stored_unit(CHANNELS[channel].unit), summary)
    facts = {"study": study.name, "chunk": str(number), "rows": str(part.runs), "every": f"{study.outputs.every!r} s"}
    content = parquet_bytes(table_of(columns, facts))
    return FinishedChunk(number, part.runs, int(np.count_nonzero(result.status))), content


def _columns_of_runs(study: Study, part: Chunk, values: dict[str, Floats]) -> dict[str, TableColumn]:
    """Return the columns of run number, configuration and varied values; nan for a path fixed in the configuration."""
    configuration = study.configurations[part.configuration]
    first = part.configuration * study.runs_of_configuration + part.first
    numbers = np.arange(first, first + part.runs, dtype=np.int64)
    names = [each.name for each in study.configurations]
    of_configuration = encode_texts(np.full(part.runs, part.configuration), names)
    columns = {
        "run": TableColumn(numbers, _PLAIN, "number of the run in the study"),
        "configuration": TableColumn(of_configuration, _PLAIN, "name of the base scenario"),
    }
    # Gauge pressures as absolute ones, each from the atmosphere of its run.
    in_effect = absolute(configuration.scenario, varied_columns(study, configuration, dict(values)), study.gauge)
    for path, drawn in values.items():
        varies = study.varies(path, configuration.name)
        shown = in_effect.get(path, drawn) if varies else np.full(part.runs, np.nan)
        columns[path] = TableColumn(shown, study.units[path], "varied value")
    return columns


def _columns_of_endings(
    study: Study, part: Chunk, values: dict[str, Floats], result: EnsembleResult
) -> dict[str, TableColumn]:
    """Return the columns of status, time and reason of failure, oscillation, and tracking of the reference."""
    configuration = study.configurations[part.configuration]
    varied = varied_columns(study, configuration, dict(values))
    judged = excess(result.metrics, configuration.scenario, varied, study.gauge)
    return {
        "status": TableColumn(encode_texts(result.status, STATUSES), _PLAIN, "how the run ended"),
        "failure_time": TableColumn(result.failure_time, "s", "time at which the run diverged"),
        "reason": TableColumn(texts_of_some(result.reasons, result.status.size), _PLAIN, "why the run has no metrics"),
        OSCILLATES: TableColumn(
            judged.oscillates, _PLAIN, "1 where the loop oscillates, empty where that is not known"
        ),
        FOLLOWS: TableColumn(
            judged.follows, _PLAIN, "1 where the run follows its reference, 0 where not, empty where that is not known"
        ),
        ON_PURPOSE: TableColumn(
            judged.excused.astype(float),
            _PLAIN,
            "1 where it does not, because the reference is beyond reach on purpose",
        ),
    }


def trace_column(channel: str) -> str:
    """Return the name of the column with the trace of a channel."""
    return f"{channel}{_OVER_TIME}"


def chunk_file(number: int) -> str:
    """Return the file name of a chunk, relative to the folder."""
    return f"runs/chunk-{number:07d}.parquet"


def note_file(number: int) -> str:
    """Return the file name of the note that marks a chunk as finished."""
    return f"finished/chunk-{number:07d}.json"


def _result(
    study: Study, part: Chunk, values: dict[str, Floats], threads: int | None, count: Count = report_nothing
) -> EnsembleResult:
    """Return the results of a chunk with varied ``values`` [SI] by path; StudyError for a path that cannot vary."""
    configuration, outputs = study.configurations[part.configuration], study.outputs
    columns = varied_columns(study, configuration, values) or unvaried(configuration.scenario, part.runs)
    every = outputs.every if outputs.traces else 0.0
    with refused_as(StudyError, f"configuration '{configuration.name}'", ScenarioError):
        return run_ensemble(
            configuration.scenario,
            columns,
            with_companions(outputs.metrics, configuration.scenario),
            outputs.traces,
            every,
            threads,
            study.gauge,
            outputs.errors,
            count,
        )


def stored_unit(unit: str) -> str:
    """Return the unit for tables: pressures are absolute (``Pa_a``) or differences (``Pa_d``), never plain Pa.

    Pa as the unit of a metric or channel is absolute.
    """
    return "Pa_a" if unit == "Pa" else unit


def estimate_bytes(study: Study) -> int:
    """Return an upper estimate of the disk space [bytes], without compression."""
    outputs, samples = study.outputs, max(samples_of(study, configuration) for configuration in study.configurations)
    numbers = 2 + len(study.paths) + len(outputs.metrics) * (2 if outputs.errors else 1)
    traces = sum(_BYTES_OF_NUMBER if name in outputs.bands else _BYTES_OF_SAMPLE for name in outputs.traces)
    row = _FIXED_BYTES_OF_ROW + _BYTES_OF_NUMBER * numbers + samples * traces
    return study.runs * row + chunk_count(study) * _BYTES_OF_FILE


def check_room(study: Study, folder: StudyFolder, agreed: bool) -> None:
    """Raise StudyError for a study that does not fit onto the disk, or is very large without ``--yes``."""
    needed, free = estimate_bytes(study), folder.free_bytes()
    size = f"{study.runs:,} runs of '{study.name}' need about {_bytes_text(needed)}"
    if needed > free:
        raise StudyError(
            f"{folder.path}: {size}, but only {_bytes_text(free)} are free: use fewer runs, metrics or trajectories"
        )
    if needed > ASKED_ABOVE and not agreed:
        raise StudyError(f"{folder.path}: {size}; give {argument_text('agreed', option='--yes')} to start the study")


def _bytes_text(size: int) -> str:
    """Return a number of bytes as text, such as ``1.2 GB``."""
    for unit, scale in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size / 1e3:.3g} kB"
