"""Chunks of a study computed, here or on a cluster, and the contents of a results folder, read on demand."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, PpafoError, ScenarioError, StudyError, one_line, refused_as
from ppafo.metrics import METRICS
from ppafo.questions.sweep.answer import SUMMARY, StudyResults
from ppafo.questions.sweep.manifest import (
    BINS,
    COUNTS_FOLDER,
    NOTES_FOLDER,
    RUNS_FOLDER,
    TRAJECTORIES_FOLDER,
    Bins,
    BinsOf,
    Chunk,
    bins_around,
    chunk,
    chunk_count,
    chunk_file,
    counts_of,
    drawn_values,
    read_manifest,
    varied_columns,
)
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.ensemble import EnsembleResult, run_ensemble
from ppafo.simulation.numbers import absolute
from ppafo.storage.parquet import TableColumn, encode_texts, lists_of, parquet_bytes, table_of, texts_of_some
from ppafo.storage.places import Place, place_at, read_document
from ppafo.studies.distributions import Floats
from ppafo.studies.study import Study

if TYPE_CHECKING:
    import pyarrow as pa

_TRIAL_RUNS = 256
_TRIED_RUNS = 8
"""Of a study without bands: its paths are tried, and no bins are placed."""
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
    # A row for every run: number, configuration, varied values, status, metrics; SI units, nan where none.
    configuration = study.configurations[part.configuration]
    name = configuration.name
    own = absolute(configuration.scenario, varied_columns(study, configuration, dict(values)), study.gauge)
    names = [item.name for item in study.configurations]
    columns = {
        "run": TableColumn(_numbers(study, part), _PLAIN, "number of the run in the study"),
        "configuration": TableColumn(
            encode_texts(np.full(part.runs, part.configuration), names), _PLAIN, "name of the base scenario"
        ),
    }
    for path, column in values.items():
        given = own.get(path, column) if study.varies(path, name) else np.full(part.runs, np.nan)
        columns[path] = TableColumn(given, study.units[path], "varied value")
    columns["status"] = TableColumn(encode_texts(result.status, STATUSES), _PLAIN, "how the run ended")
    columns["failure_time"] = TableColumn(result.failure_time, "s", "time at which the run diverged")
    columns["reason"] = TableColumn(texts_of_some(result.reasons, part.runs), _PLAIN, "why the run has no metrics")
    for metric in study.outputs.metrics:
        computed = result.metrics.get(metric, np.full(part.runs, np.nan))
        columns[metric] = TableColumn(computed, stored_unit(METRICS[metric].unit), METRICS[metric].summary)
        if metric in result.errors:
            unit = "Pa_d" if METRICS[metric].unit == "Pa" else METRICS[metric].unit
            columns[f"{metric}_error"] = TableColumn(result.errors[metric], unit, f"estimated error of {metric}")
    tables = {RUNS_FOLDER: table_of(columns, chunk_facts(study, part))}
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
    tried = min(total, _TRIAL_RUNS if study.outputs.bands else _TRIED_RUNS)
    runs = np.unique(np.linspace(0, total - 1, tried).astype(np.int64))
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
    columns = varied_columns(study, configuration, values) or {
        "supply.pressure": np.full(part.runs, configuration.scenario.device.supply.pressure)
    }
    every = outputs.every if outputs.traces else 0.0
    with refused_as(StudyError, f"configuration '{configuration.name}'", ScenarioError):
        return run_ensemble(
            configuration.scenario,
            columns,
            outputs.metrics,
            outputs.traces,
            every,
            threads,
            study.gauge,
            outputs.errors,
        )


def stored_unit(unit: str) -> str:
    """Return the unit as tables state it: a pressure is absolute (``Pa_a``) or a difference (``Pa_d``), never bare.

    What metrics and channels call Pa is absolute.
    """
    return "Pa_a" if unit == "Pa" else unit


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


_TASKS_PER_THREAD = 3
"""Tasks that wait at the scheduler for every thread of the workers: enough to keep them busy, few for 10^9 runs."""
_SECONDS_TO_CONNECT = 30


def compute_on_cluster(address: str, task: Task, numbers: Iterable[int], finish: Callable[[Finished], None]) -> None:
    """Compute chunks on the workers of the scheduler at an address; ``finish`` hears of each one.

    A chunk whose worker dies is given to another one by the scheduler.
    """
    distributed = _import_distributed()
    try:
        client = distributed.Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise StudyError(f"--scheduler {address}: cannot be reached: {one_line(error)}") from error
    with client:
        _work_through(client, task, iter(numbers), finish, distributed)


def _work_through(client: Any, task: Task, numbers: Any, finish: Callable[[Finished], None], distributed: Any) -> None:
    queue = distributed.as_completed(loop=client.loop)

    sweep = f"{task.study.name}-{uuid4().hex[:8]}"

    def submit(count: int) -> None:
        for _, number in zip(range(count), numbers, strict=False):
            queue.add(client.submit(work_on_chunk, task, number, key=f"{sweep}-{number}", pure=False))

    submit(max(4, _TASKS_PER_THREAD * sum(client.nthreads().values())))
    for future in queue:
        try:
            finished: Finished = future.result()
        except PpafoError:
            raise
        except distributed.scheduler.KilledWorker as error:
            raise StudyError(f"chunk {future.key}: its workers died repeatedly: {one_line(error)}") from error
        future.release()
        finish(finished)
        submit(1)


def _import_distributed() -> Any:
    try:
        import distributed
    except ModuleNotFoundError as error:
        raise StudyError("--scheduler needs the extra 'cluster': pip install 'ppafo[cluster]'") from error
    return distributed


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
