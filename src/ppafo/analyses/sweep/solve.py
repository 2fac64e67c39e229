"""Execution of a study into a folder, with resumption and summary; finished chunks are not computed again.

Statistics use the completed runs that have the metric; their number is stated with each. Mean, standard deviation and
quantiles are exact; for quantiles, one column of one configuration is in memory at a time. The quantile of fraction q
of n sorted values is interpolated linearly at position (n - 1) q: definition 7 of Hyndman and Fan (The American
Statistician, 1996). The standard deviation divides by n - 1.
"""

import json
import math
import os
import platform
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.sweep.answer import finding_of
from ppafo.analyses.sweep.results import BANDS, SUMMARY, Columns, StudyResults
from ppafo.arguments import Count, Overrides, Seed, Threads, checked
from ppafo.documents.json_text import json_text
from ppafo.metrics import METRICS
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Progress, Report, report_nothing
from ppafo.report.finding import Finding
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.gains import warn_of_gains
from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs
from ppafo.storage.files import temporary_folder
from ppafo.storage.parquet import TableColumn, encode_texts, matrix_of, parquet_bytes, table_of
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import study_of
from ppafo.studies.loading import list_studies, load_study
from ppafo.studies.study import Study, check_can_be_swept
from ppafo.study.blocks import MAXIMUM_RUNS_OF_CHUNK, chunk_count, samples_of
from ppafo.study.folder import study_folder
from ppafo.study.manifest import read_manifest
from ppafo.study.runs import RunCounter, joined
from ppafo.study.store import (
    FOLLOWS,
    ON_PURPOSE,
    OSCILLATES,
    STATUSES,
    FinishedChunk,
    StudyStore,
    compute_chunk,
    stored_unit,
    trace_column,
)
from ppafo.version import __version__
from ppafo.wording import said_of_configuration

_EXAMPLES = 5
QUANTILE_DEFINITION = (
    "value at place (n - 1) q of the n sorted values, on a line between neighbours (Hyndman and Fan 1996, definition 7)"
)
MAXIMUM_IN_MEMORY = 16_000_000
"""Largest number of samples of a channel in memory when quantile bands are computed."""


def _summary(study: Study, results: StudyResults) -> dict[str, Any]:
    """Return the content of ``summary.json``: numbers of runs, first failed runs, and statistics of each metric."""
    completed = dict.fromkeys((configuration.name for configuration in study.configurations), 0)
    failures: list[dict[str, Any]] = []
    for name in completed:
        for part in results.chunks(["run", "configuration", "status", "reason"], name):
            rows = np.asarray(part.column("status").to_numpy() == STATUSES[0])
            completed[name] += int(np.count_nonzero(rows))
            if len(failures) < _EXAMPLES and not rows.all():
                failures += part.filter(~rows).slice(0, _EXAMPLES - len(failures)).to_pylist()
    # A run that diverged has a time at which it did; one that was refused never began.
    failed = study.runs - sum(completed.values())
    diverged = sum(part.size for name in completed for part in results.parts(name, "failure_time"))
    flags, excused = (
        {each.name: np.concatenate(list(results.parts(each.name, column))) for each in study.configurations}
        for column in (FOLLOWS, ON_PURPOSE)
    )
    verdicts = {
        name: (int(np.count_nonzero(own == 0.0) - np.count_nonzero(excused[name])), own.size)
        for name, own in flags.items()
    }
    return {
        "study": study.name,
        "runs": study.runs,
        "completed": study.runs - failed,
        "diverged": diverged,
        "refused": failed - diverged,
        "completed_by_configuration": completed,
        "oscillating": {
            name: int(sum(np.count_nonzero(part) for part in results.parts(name, OSCILLATES))) for name in completed
        },
        "not_following": {name: off for name, (off, _) in verdicts.items()},
        "without_verdict": {
            each.name: completed[each.name] - verdicts[each.name][1]
            for each in study.configurations
            if verdicts[each.name][1] or each.scenario.follows_reference
        },
        "failures": failures,
        "quantile_definition": QUANTILE_DEFINITION,
        "configurations": {
            configuration.name: {
                metric: {"unit": METRICS[metric].unit, "summary": METRICS[metric].summary}
                | describe(results.parts(configuration.name, metric), study.outputs.quantiles)
                for metric in study.outputs.metrics
            }
            for configuration in study.configurations
        },
    }


def bands_file(study: Study, results: StudyResults) -> bytes:
    """Return the content of ``bands.parquet``: exact quantiles over the runs at each time."""
    fractions = study.outputs.quantiles
    parts: list[Columns] = []
    for number, configuration in enumerate(study.configurations):
        samples = samples_of(study, configuration)
        for row, channel in enumerate(study.outputs.bands):
            counts, levels = _band(study, results, configuration.name, channel, samples)
            parts.append(
                {
                    "configuration": np.full(samples, number),
                    "channel": np.full(samples, row),
                    "time": study.outputs.every * np.arange(samples),
                    "runs": counts,
                    **{f"q{fraction:g}": level for fraction, level in zip(fractions, levels, strict=True)},
                }
            )
    rows = joined(parts)
    units = {stored_unit(CHANNELS[name].unit) for name in study.outputs.bands}
    unit = units.pop() if len(units) == 1 else "SI unit of the channel"
    names = [configuration.name for configuration in study.configurations]
    columns = {
        "configuration": TableColumn(encode_texts(rows.pop("configuration"), names), "-", "name of the base scenario"),
        "channel": TableColumn(encode_texts(rows.pop("channel"), study.outputs.bands), "-", "name of the channel"),
        "time": TableColumn(rows.pop("time"), "s", "time since the start"),
        "runs": TableColumn(rows.pop("runs"), "-", "completed runs, without a fall so far"),
        **{name: TableColumn(values, unit, "quantile over runs") for name, values in rows.items()},
    }
    return parquet_bytes(table_of(columns, {"study": study.name}))


def _band(
    study: Study, results: StudyResults, configuration: str, channel: str, samples: int
) -> tuple[NDArray[np.int64], Floats]:
    """Return the number of runs at each time, and each quantile over them (quantiles, times).

    Samples are read in blocks that fit into the memory for all runs.
    """
    column, at_once = trace_column(channel), max(1, MAXIMUM_IN_MEMORY // study.runs_of_configuration)
    counts, levels = [], []
    for start in range(0, samples, at_once):
        parts = results.chunks([column], configuration)
        values = np.concatenate([matrix_of(part.column(column))[:, start : start + at_once] for part in parts])
        counts.append(np.count_nonzero(np.isfinite(values), axis=0))
        levels.append(sorted_quantiles(np.sort(values, axis=0), counts[-1], study.outputs.quantiles))
    return np.concatenate(counts), np.concatenate(levels, axis=1)


def sorted_quantiles(ordered: Floats, counts: NDArray[np.int64], fractions: Sequence[float]) -> Floats:
    """Return quantiles (fractions, columns) of the first ``counts`` values of sorted columns; nan for empty ones."""
    places = np.maximum(counts - 1, 0) * np.asarray(fractions)[:, None]
    low = places.astype(np.int64)
    columns = np.arange(counts.size)
    below, above = ordered[low, columns], ordered[np.minimum(low + 1, np.maximum(counts - 1, 0)), columns]
    return np.asarray(below + (places - low) * (above - below), dtype=np.float64)


def describe(parts: Iterable[Floats], fractions: Sequence[float]) -> dict[str, Any]:
    """Return count, mean, standard deviation, extremes, and quantiles by fraction, for any division into parts.

    Without values there is only the count; the standard deviation needs two values.
    """
    values = np.concatenate([np.empty(0), *parts])
    count = values.size
    if count == 0:
        return {"count": 0}
    # Squares about the mean, in a second pass: about 0 they would cancel where the spread is small.
    blocks = np.split(values, range(MAXIMUM_RUNS_OF_CHUNK, count, MAXIMUM_RUNS_OF_CHUNK))
    mean = math.fsum(float(np.sum(block)) for block in blocks) / count
    squares = math.fsum(float(np.sum((block - mean) ** 2)) for block in blocks)
    levels = np.quantile(values, fractions, method="linear", overwrite_input=True)
    return {
        "count": count,
        "mean": mean,
        **({"sd": math.sqrt(squares / (count - 1))} if count > 1 else {}),
        "minimum": float(values.min()),
        "maximum": float(values.max()),
        "quantiles": dict(zip((f"{fraction:g}" for fraction in fractions), levels.tolist(), strict=True)),
    }


LOG = "log.jsonl"
"""Name of the log file, the only file with date, machine and speed; all other files are equal on any machine."""
INTERRUPTED = "interrupted; finished chunks are kept, and the same command resumes the study"
INTERRUPTED_AT_ONCE = "interrupted before the first chunk was finished; the same command starts the study again"


@checked
def sweep(
    study: Study | str | Path | Mapping[str, Any],
    *,
    overrides: Overrides = (),
    draws: Count | None = None,
    seed: Seed | None = None,
    threads: Threads | None = None,
    out: str | Path | None = None,
    agreed: bool = False,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[StudyResults]:
    """Run a study, given as a name, a TOML file, data with the layout of such a file, or a Study.

    Columns of the results are arrays of shape (runs,), trajectories (runs, samples), in SI units, pressures absolute.
    A failed run has a row with its status and nan for all results.

    Arguments:
        study: name of a study, a .toml file, data laid out as one, or a Study
        overrides: values to change, texts or a dictionary as of ``simulate``; of one configuration: 'NAME:PATH=VALUE'
        draws: number of draws in place of the file's
        seed: random seed in place of the file's
        threads: threads of this process; default: all cores
        out: a folder, where an interrupted study resumes; default: a temporary folder that exists as long as the
            returned object
        agreed: consent to a folder that takes much of the disk
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with counts of the runs

    Returns:
        a Finding whose ``found`` is the StudyResults: columns by name, and ``summary``

    Raises:
        StudyError: a study that cannot be used or does not fit onto the disk, and a folder with another study's results
        DataError: a folder that cannot be used

    >>> import ppafo
    >>> study = ppafo.sweep("torque-task-uncertainty", draws=4).found
    >>> study.summary["runs"], study.summary["completed"]
    (8, 8)
    """
    name_plugins(plugins)
    chosen = study_of(study, overrides, draws, seed)
    check_can_be_swept(chosen)
    kept = temporary_folder("ppafo-study") if out is None else None
    folder = study_folder(kept.name if kept is not None else str(out))
    for configuration in chosen.configurations:
        varied = [path for path in {*chosen.paths, *chosen.same} if chosen.varies(path, configuration.name)]
        with said_of_configuration(configuration.name):
            warn_of_coarse_pairs([configuration.scenario], varied)
            warn_of_gains(configuration.scenario, varied)
    report = progress or report_nothing
    store = StudyStore.claim(chosen, folder, agreed, threads, report)
    _compute_missing_chunks(store, threads, progress)
    report(Progress("summarising", chosen.runs, chosen.runs))
    results = StudyResults(folder, read_manifest(folder), {}, kept)
    summary = _summary(chosen, results)
    if chosen.outputs.bands:
        folder.write(BANDS, bands_file(chosen, results))
    # Last, because a study counts as finished once its summary is there.
    folder.write(SUMMARY, f"{json_text(summary)}\n".encode())
    return finding_of(replace(results, summary=summary))


def studies_of_the_package() -> list[dict[str, Any]]:
    """Return name, number of runs and description of each study of the package."""
    studies = [load_study(name) for name in list_studies()]
    return [{"name": study.name, "runs": study.runs, "description": study.description} for study in studies]


def _compute_missing_chunks(store: StudyStore, threads: int | None, progress: Report | None) -> None:
    """Compute the missing chunks, and add a line on this process to the log."""
    study, folder, started = store.study, store.folder, time.monotonic()
    known = store.finished()
    earlier = sum(chunk.runs for chunk in known)
    counter = RunCounter(study.runs, progress, earlier, sum(chunk.failed for chunk in known))
    # The first chunk may wait for a compiler.
    counter.add(0, 0)
    missing = sorted(set(range(chunk_count(study))) - {chunk.number for chunk in known})
    # Rows change below: an old summary would pass for a finished study meanwhile.
    if missing and SUMMARY in folder.names():
        folder.remove(SUMMARY)

    def count(writing: Future[FinishedChunk]) -> None:
        chunk = writing.result()
        counter.add(chunk.runs, chunk.failed)

    # Each chunk is written while the next one is computed.
    with ThreadPoolExecutor(1, "ppafo-writing") as writer:
        writing: Future[FinishedChunk] | None = None
        for number in missing:
            computed = compute_chunk(study, number, threads, counter.count_ended)
            if writing is not None:
                count(writing)
            writing = writer.submit(store.write, *computed)
        if writing is not None:
            count(writing)
    line = {
        "ended": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "machine": platform.platform(),
        "processors": os.cpu_count(),
        "versions": {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__},
        "threads": threads,
        "runs": counter.done - earlier,
        "failed": counter.failed,
        "seconds": round(time.monotonic() - started, 3),
    }
    try:
        with folder.open(LOG) as file:
            before = file.read()
    except OSError:
        before = b""
    folder.write(LOG, before + f"{json.dumps(line)}\n".encode())
