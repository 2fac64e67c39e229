"""One chunk from its number to its tables and files; the same on any thread, process or machine."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.documents.json_text import json_text
from ppafo.errors import ScenarioError, StudyError
from ppafo.metrics import METRICS
from ppafo.questions.sweep.bands import BINS, Bins, bins_around, counts_of
from ppafo.questions.sweep.chunks import Chunk, chunk, chunk_count, drawn_values, varied_columns
from ppafo.questions.sweep.manifest import BinsOf
from ppafo.signals.channels import CHANNELS
from ppafo.simulation.ensemble import EnsembleResult, run_ensemble
from ppafo.simulation.ensemble.columns import absolute
from ppafo.simulation.scenario import Scenario
from ppafo.storage.parquet import TableColumn, encode_texts, lists_of, parquet_bytes, table_of, texts_of_some
from ppafo.storage.places import Place, place_at, read_document
from ppafo.studies.distributions import Floats
from ppafo.studies.study import Study

if TYPE_CHECKING:
    import pyarrow as pa

RUNS_FOLDER, TRAJECTORIES_FOLDER, COUNTS_FOLDER, NOTES_FOLDER = "runs", "trajectories", "band-counts", "finished"
_TRIAL_RUNS = 256
STATUSES = ("completed", "diverged", "refused")
_PLAIN = "-"


@dataclass(frozen=True, slots=True)
class Task:
    """What a worker needs beside the number of a chunk: study, bins, address of the folder, threads."""

    study: Study
    bins: BinsOf
    address: str
    threads: int | None


@dataclass(frozen=True, slots=True)
class Finished:
    """A chunk that is written: its number, its runs, and how many of them failed."""

    number: int
    runs: int
    failed: int


Files = dict[str, bytes]


def chunk_file(folder: str, number: int) -> str:
    """Return the name of a file of a chunk."""
    return f"{folder}/chunk-{number:07d}.parquet"


def folders(study: Study) -> tuple[str, ...]:
    """Return the folders in which every chunk has a table."""
    outputs = study.outputs
    kept = [(TRAJECTORIES_FOLDER, outputs.trajectories), (COUNTS_FOLDER, outputs.bands)]
    return (*(folder for folder, is_requested in kept if is_requested), RUNS_FOLDER)


def compute_chunk(task: Task, number: int) -> tuple[Finished, Files]:
    """Return the files of a chunk by name, computed here and not yet written."""
    study, part = task.study, chunk(task.study, number)
    values = drawn_values(study, np.arange(part.first, part.first + part.runs))
    result = _result(study, part, values, task.threads)
    tables = {RUNS_FOLDER: runs_table(study, part, values, result)}
    if study.outputs.trajectories:
        tables[TRAJECTORIES_FOLDER] = trajectories_table(study, part, result)
    if study.outputs.bands:
        bins = task.bins[study.configurations[part.configuration].name]
        tables[COUNTS_FOLDER] = counts_table(study, part, bins, result)
    files = {chunk_file(folder, number): parquet_bytes(tables[folder]) for folder in folders(study)}
    return Finished(number, part.runs, int(np.count_nonzero(result.status))), files


def write_chunk(place: Place, finished: Finished, files: Files) -> None:
    """Write the files of a chunk, and last the note with their checksums by which it counts as finished."""
    for name, content in files.items():
        place.write(name, content)
    checksums = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    note = {"runs": finished.runs, "failed": finished.failed, "sha256": checksums}
    place.write(note_file(finished.number), f"{json_text(note)}\n".encode())


def work_on_chunk(task: Task, number: int) -> Finished:
    """Compute and write a chunk: what a worker of a cluster does."""
    finished, files = compute_chunk(task, number)
    write_chunk(place_at(task.address), finished, files)
    return finished


def finished_chunk(place: Place, study: Study, number: int) -> Finished | None:
    """Return what is known of a chunk whose files are as they were written; None where one is missing or damaged."""
    try:
        note = read_document(place, note_file(number))
        finished = Finished(number, int(note["runs"]), int(note["failed"]))
        whole = all(_is_whole(place, chunk_file(folder, number), note["sha256"]) for folder in folders(study))
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return None
    return finished if whole and finished.runs == chunk(study, number).runs else None


def _is_whole(place: Place, name: str, checksums: dict[str, str]) -> bool:
    with place.open(name) as file:
        return hashlib.file_digest(file, "sha256").hexdigest() == checksums[name]


def note_file(number: int) -> str:
    """Return the name of the note by which a chunk counts as finished."""
    return f"{NOTES_FOLDER}/chunk-{number:07d}.json"


def completed_rows(table: "pa.Table") -> NDArray[np.bool_]:
    """Return which rows of a table of runs completed."""
    import pyarrow.compute as pc

    equal = pc.equal(table.column("status").cast("string"), STATUSES[0])
    return np.asarray(equal.to_numpy(), dtype=np.bool_)


def bins_of_trials(study: Study, threads: int | None) -> BinsOf:
    """Return the bins of the bands from trial runs spread evenly over each configuration; tries every path as well."""
    total = study.runs_of_configuration
    runs = np.unique(np.linspace(0, total - 1, min(total, _TRIAL_RUNS)).astype(np.int64))
    values = drawn_values(study, runs)
    bins: dict[str, dict[str, Bins]] = {}
    for number, configuration in enumerate(study.configurations):
        result = _result(study, Chunk(0, number, 0, runs.size), values, threads)
        bins[configuration.name] = {name: bins_around(result.traces[name]) for name in study.outputs.bands}
    return bins


def all_chunks(study: Study) -> range:
    """Return the numbers of all chunks."""
    return range(chunk_count(study))


def _result(study: Study, part: Chunk, values: dict[str, Floats], threads: int | None) -> EnsembleResult:
    configuration, outputs = study.configurations[part.configuration], study.outputs
    columns = varied_columns(study, configuration, values) or _base_values(configuration.scenario, part)
    every = outputs.every if outputs.traces else 0.0
    try:
        return run_ensemble(
            configuration.scenario, columns, outputs.metrics, outputs.traces, every, threads, study.gauge
        )
    except ScenarioError as error:
        raise StudyError(f"configuration '{configuration.name}': {error}") from error


def _base_values(scenario: Scenario, part: Chunk) -> dict[str, Floats]:
    """Return a column that changes nothing, for a configuration in which nothing varies."""
    return {"supply.pressure": np.full(part.runs, scenario.device.supply.pressure)}


def stored_unit(unit: str) -> str:
    """Return the unit as tables state it: a pressure is absolute (``Pa_a``) or a difference (``Pa_d``), never bare.

    What metrics and channels call Pa is absolute.
    """
    return "Pa_a" if unit == "Pa" else unit


def runs_table(study: Study, chunk: Chunk, values: Mapping[str, Floats], result: EnsembleResult) -> "pa.Table":
    """Return a row for every run: number, configuration, varied values, status, metrics; SI units, nan where none."""
    configuration = study.configurations[chunk.configuration]
    name = configuration.name
    own = absolute(configuration.scenario, varied_columns(study, configuration, dict(values)), study.gauge)
    names = [item.name for item in study.configurations]
    columns = {
        "run": TableColumn(_numbers(study, chunk), _PLAIN, "number of the run in the study"),
        "configuration": TableColumn(
            encode_texts(np.full(chunk.runs, chunk.configuration), names), _PLAIN, "name of the base scenario"
        ),
    }
    for path, column in values.items():
        given = own.get(path, column) if study.varies(path, name) else np.full(chunk.runs, np.nan)
        columns[path] = TableColumn(given, study.units[path], "varied value")
    columns["status"] = TableColumn(encode_texts(result.status, STATUSES), _PLAIN, "how the run ended")
    columns["failure_time"] = TableColumn(result.failure_time, "s", "time at which the run diverged")
    columns["reason"] = TableColumn(texts_of_some(result.reasons, chunk.runs), _PLAIN, "why the run has no metrics")
    for metric in study.outputs.metrics:
        computed = result.metrics.get(metric, np.full(chunk.runs, np.nan))
        columns[metric] = TableColumn(computed, stored_unit(METRICS[metric].unit), METRICS[metric].summary)
    return table_of(columns, chunk_facts(study, chunk))


def trajectories_table(study: Study, chunk: Chunk, result: EnsembleResult) -> "pa.Table":
    """Return a row for every run with a list of values for each kept channel, in single precision."""
    columns = {"run": TableColumn(_numbers(study, chunk), _PLAIN, "number of the run in the study")}
    for name in study.outputs.trajectories:
        lists = lists_of(result.traces[name].T.astype(np.float32))
        columns[name] = TableColumn(
            lists, stored_unit(CHANNELS[name].unit), f"{CHANNELS[name].summary}, every {study.outputs.every:g} s"
        )
    return table_of(columns, chunk_facts(study, chunk) | {"every": f"{study.outputs.every!r} s"})


def counts_table(study: Study, chunk: Chunk, bins: Mapping[str, Bins], result: EnsembleResult) -> "pa.Table":
    """Return the counts that are not 0, of each channel, sample and bin; bin 0 and the last lie beyond the bins."""
    parts = {name: counts_of(result.traces[name], bins[name]) for name in study.outputs.bands}
    places = {name: np.nonzero(counts) for name, counts in parts.items()}
    channel = np.concatenate([np.full(place[0].size, number) for number, place in enumerate(places.values())])
    columns = {
        "channel": TableColumn(encode_texts(channel, study.outputs.bands), _PLAIN, "name of the channel"),
        "sample": TableColumn(_join([place[0] for place in places.values()]), _PLAIN, "number of the sample in time"),
        "bin": TableColumn(_join([place[1] for place in places.values()]), _PLAIN, f"from 0 to {BINS + 1}"),
        "count": TableColumn(_join([parts[name][place] for name, place in places.items()]), _PLAIN, "runs in it"),
    }
    return table_of(columns, chunk_facts(study, chunk))


def chunk_facts(study: Study, chunk: Chunk) -> dict[str, str]:
    """Return what the files of a chunk say of themselves, by which they are recognised."""
    return {"study": study.name, "chunk": str(chunk.number), "rows": str(chunk.runs)}


def _numbers(study: Study, chunk: Chunk) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    first = chunk.configuration * study.runs_of_configuration + chunk.first
    return np.arange(first, first + chunk.runs, dtype=np.int64)


def _join(parts: "list[np.ndarray[tuple[int], np.dtype[np.int64]]]") -> "np.ndarray[tuple[int], np.dtype[np.int32]]":
    return np.concatenate(parts).astype(np.int32)
