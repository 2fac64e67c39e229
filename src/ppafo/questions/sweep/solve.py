"""Runs a study into a folder, from where it stands, and sums it up; chunks that are whole are not computed again.

Only completed runs that have the metric count, and how many those are is said beside each. Columns are read chunk by
chunk; mean, spread and quantiles are exact and in bounded memory. The quantile of fraction q of n sorted values is the
value at place (n - 1) q, on a line between its neighbours: definition 7 of Hyndman and Fan (The American Statistician,
1996). The standard deviation divides by n - 1.
"""

import json
import math
import os
import platform
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.documents.json_text import json_text
from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.progress import Progress, Report
from ppafo.questions.sweep.answer import BANDS, SUMMARY, Columns, StudyResults
from ppafo.questions.sweep.manifest import (
    BINS,
    COUNTS_FOLDER,
    MANIFEST,
    RUNS_FOLDER,
    STUDY_COPY,
    Bins,
    BinsOf,
    Counts,
    check_room,
    check_same_study,
    manifest,
    manifest_bytes,
    outside_fraction,
    quantiles_of,
    read_manifest,
    stored_bins,
)
from ppafo.questions.sweep.results import (
    STATUSES,
    Finished,
    Task,
    all_chunks,
    bins_of_trials,
    completed_rows,
    compute_chunk,
    finished_chunk,
    note_file,
    stored_unit,
    write_chunk,
)
from ppafo.signals.recording import CHANNELS
from ppafo.storage.parquet import TableColumn, encode_texts, parquet_bytes, table_of
from ppafo.storage.places import Place, place_at
from ppafo.studies.distributions import Floats
from ppafo.studies.loading import list_studies, load_study
from ppafo.studies.study import Study
from ppafo.version import __version__

_EXAMPLES = 5
QUANTILE_DEFINITION = (
    "value at place (n - 1) q of the n sorted values, on a line between neighbours (Hyndman and Fan 1996, definition 7)"
)
MAXIMUM_IN_MEMORY = 16_000_000
"""Values up to which a column is sorted in memory; beyond, order statistics are looked up digit by digit."""
_DIGIT_BITS, _DIGITS = 16, 4
_SIGN = np.uint64(1 << 63)
Parts = Callable[[], Iterator[Floats]]
"""Gives the finite values of a column anew each time, in parts whose order is always the same."""


def _completed_runs(results: StudyResults, configuration: str) -> int:
    parts = results.chunks(RUNS_FOLDER, ["status"], configuration)
    return sum(int(np.count_nonzero(completed_rows(part))) for part in parts)


def _metric(study: Study, results: StudyResults, configuration: str, metric: str) -> dict[str, Any]:
    kind = METRICS[metric]
    said = {"unit": kind.unit, "summary": kind.summary}
    return said | describe(lambda: results.parts(configuration, metric), study.outputs.quantiles)


def _failures(results: StudyResults) -> list[dict[str, Any]]:
    """Return the first few runs that failed, with their reasons."""
    found: list[dict[str, Any]] = []
    for part in results.chunks(RUNS_FOLDER, ["run", "configuration", "status", "reason"]):
        rows = [row for row in part.to_pylist() if row["status"] != STATUSES[0]]
        found += rows[: _EXAMPLES - len(found)]
        if len(found) == _EXAMPLES:
            break
    return found


def bands_file(study: Study, results: StudyResults, bins: BinsOf) -> tuple[bytes, float]:
    """Return the content of ``bands.parquet``, and the fraction of values that lay beyond the bins."""
    # The counts over all chunks by configuration and channel, shape (times, BINS + 2).
    merged: dict[str, dict[str, Counts]] = {}
    for item in study.configurations:
        samples = int(item.scenario.duration / study.outputs.every + 1.0e-9) + 1
        merged[item.name] = {name: np.zeros((samples, BINS + 2), dtype=np.int64) for name in study.outputs.bands}
        for part in results.chunks(COUNTS_FOLDER, configuration=item.name):
            channels = part.column("channel").cast("string").to_numpy()
            sample, place, count = (part.column(key).to_numpy() for key in ("sample", "bin", "count"))
            for channel, total in merged[item.name].items():
                own = channels == channel
                total[sample[own], place[own]] += count[own]
    parts = [
        _band(study, number, channel, bins[item.name][channel], merged[item.name][channel])
        for number, item in enumerate(study.configurations)
        for channel in study.outputs.bands
    ]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    names = [item.name for item in study.configurations]
    columns = {
        "configuration": TableColumn(
            encode_texts(joined.pop("configuration"), names), "-", "name of the base scenario"
        ),
        "channel": TableColumn(encode_texts(joined.pop("channel"), study.outputs.bands), "-", "name of the channel"),
        "time": TableColumn(joined.pop("time"), "s", "time since the start"),
        "runs": TableColumn(joined.pop("runs"), "-", "completed runs, without a fall so far"),
        **{name: TableColumn(values, _si_of_channel(study), "quantile over runs") for name, values in joined.items()},
    }
    beyond = max(outside_fraction(counts) for counts in merged.values())
    return parquet_bytes(table_of(columns, {"study": study.name, "bins": str(BINS)})), beyond


def _si_of_channel(study: Study) -> str:
    units = {stored_unit(CHANNELS[name].unit) for name in study.outputs.bands}
    return units.pop() if len(units) == 1 else "SI unit of the channel"


def _band(study: Study, configuration: int, channel: str, bins: Bins, counts: Counts) -> Columns:
    rows = counts.shape[0]
    quantiles = quantiles_of(counts, bins, study.outputs.quantiles)
    return {
        "configuration": np.full(rows, configuration),
        "channel": np.full(rows, study.outputs.bands.index(channel)),
        "time": study.outputs.every * np.arange(rows),
        "runs": counts.sum(axis=1),
        **{f"q{fraction:g}": values for fraction, values in quantiles.items()},
    }


def describe(parts: Parts, fractions: Sequence[float]) -> dict[str, Any]:
    """Return count, and unless it is 0 mean, standard deviation (from 2 values on), extremes, quantiles by fraction."""
    sums = [(part.size, float(np.sum(part)), float(part.min()), float(part.max())) for part in parts() if part.size]
    count = sum(item[0] for item in sums)
    if count == 0:
        return {"count": 0}
    mean = math.fsum(item[1] for item in sums) / count
    squares = math.fsum(float(np.sum((part - mean) ** 2)) for part in parts())
    return {
        "count": count,
        "mean": mean,
        **({"sd": math.sqrt(squares / (count - 1))} if count > 1 else {}),
        "minimum": min(item[2] for item in sums),
        "maximum": max(item[3] for item in sums),
        "quantiles": {f"{fraction:g}": value for fraction, value in quantiles(parts, count, fractions).items()},
    }


def quantiles(parts: Parts, count: int, fractions: Sequence[float]) -> dict[float, float]:
    """Return the quantile of each fraction."""
    if count <= MAXIMUM_IN_MEMORY:
        values = np.quantile(np.concatenate(list(parts())), fractions, method="linear", overwrite_input=True)
        return dict(zip(fractions, values.tolist(), strict=True))
    places = {fraction: divmod((count - 1) * fraction, 1.0) for fraction in fractions}
    ranks = sorted({min(int(low) + up, count - 1) for low, _ in places.values() for up in (0, 1)})
    sorted_values = order_statistics(parts, ranks)
    found = {}
    for fraction, (low, inside) in places.items():
        below, above = sorted_values[int(low)], sorted_values[min(int(low) + 1, count - 1)]
        found[fraction] = below + inside * (above - below)
    return found


def order_statistics(parts: Parts, ranks: Sequence[int]) -> dict[int, float]:
    """Return the values at ranks (from 0) of the sorted column, by a radix selection: four passes over the parts."""
    known = dict.fromkeys(ranks, (0, 0))
    for digit in range(_DIGITS):
        counts = _digit_counts(parts, digit, {prefix for prefix, _ in known.values()})
        for rank, (prefix, below) in known.items():
            cumulated = np.cumsum(counts[prefix])
            place = int(np.searchsorted(cumulated, rank - below, side="right"))
            before = int(cumulated[place - 1]) if place else 0
            known[rank] = ((prefix << _DIGIT_BITS) | place, below + before)
    return {rank: _number(key) for rank, (key, _) in known.items()}


def _digit_counts(parts: Parts, digit: int, prefixes: set[int]) -> dict[int, NDArray[np.int64]]:
    """Return how often each value of a digit comes behind each prefix of higher digits."""
    shift = np.uint64(_DIGIT_BITS * (_DIGITS - 1 - digit))
    size = 1 << _DIGIT_BITS
    counts = {prefix: np.zeros(size, dtype=np.int64) for prefix in prefixes}
    for part in parts():
        # Whole numbers in the same order as the values.
        bits = np.ascontiguousarray(part).view(np.uint64)
        keys = np.where(bits & _SIGN != 0, ~bits, bits | _SIGN) >> shift
        for prefix in prefixes:
            own = keys if digit == 0 else keys[(keys >> np.uint64(_DIGIT_BITS)) == np.uint64(prefix)]
            counts[prefix] += np.bincount((own & np.uint64(size - 1)).astype(np.int64), minlength=size)
    return counts


def _number(key: int) -> float:
    """Return the value that has a key."""
    bits = key ^ (1 << 63) if key >> 63 else key ^ (2**64 - 1)
    return float(np.array(bits, dtype=np.uint64).view(np.float64))


LOG = "log.jsonl"
"""The only file that says when, where and how fast; all others are the same wherever they are made."""
_INTERRUPTED = "interrupted; finished chunks are kept, and the same command resumes the study"


@dataclass(frozen=True, slots=True)
class Means:
    """How a study is computed: threads of this process, a Dask scheduler, consent to a large folder, who watches."""

    threads: int | None = None
    scheduler: str | None = None
    agreed: bool = False
    progress: Report | None = None


def sweep(
    study: Study | str | Path | Mapping[str, Any],
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    draws: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
    scheduler: str | None = None,
    agreed: bool = False,
    progress: Report | None = None,
) -> StudyResults:
    """Return the results of a study: a name, a TOML file, data laid out as one, or a Study.

    ``out`` is a folder, or an address that fsspec knows; a study that was begun there resumes. Without it the results
    live in a temporary folder as long as the returned object. ``overrides`` change every configuration, ``draws``
    and ``seed`` replace the number of draws and the random seed of the file. ``threads`` are those of this process, all
    cores by default; ``scheduler`` is the address of a Dask scheduler whose workers do the work, ``agreed`` the consent
    to a folder that takes much of the disk, and ``progress`` hears of every finished chunk.

    Columns of the results are arrays of shape (runs,), trajectories (runs, samples), in SI units, pressures absolute;
    nan where a run failed, which is a row that says so. StudyError for a study that cannot be used or does not fit onto
    the disk, and where the folder has results of another one; DataError for a folder that cannot be used.
    """
    means = Means(threads, scheduler, agreed, progress)
    chosen = _study_of(study, overrides, draws, seed)
    kept = tempfile.TemporaryDirectory(prefix="ppafo-study-") if out is None else None
    place = place_at(kept.name if kept is not None else str(out))
    bins = _claim(chosen, place, means)
    _work(Task(chosen, bins, place.address, means.threads), place, means)
    # Write summary and bands of a study all of whose chunks are there, and return its results.
    results = StudyResults(place, read_manifest(place), {})
    # The content of ``summary.json``.
    completed = {item.name: _completed_runs(results, item.name) for item in chosen.configurations}
    failed = chosen.runs - sum(completed.values())
    diverged = sum(part.size for item in chosen.configurations for part in results.parts(item.name, "failure_time"))
    summary = {
        "study": chosen.name,
        "runs": chosen.runs,
        "completed": chosen.runs - failed,
        "diverged": diverged,
        "refused": failed - diverged,
        "completed_by_configuration": completed,
        "failures": _failures(results) if failed else [],
        "quantile_definition": QUANTILE_DEFINITION,
        "configurations": {
            item.name: {metric: _metric(chosen, results, item.name, metric) for metric in chosen.outputs.metrics}
            for item in chosen.configurations
        },
    }
    if chosen.outputs.bands:
        content, beyond = bands_file(chosen, results, bins)
        place.write(BANDS, content)
        summary["bands"] = {
            "share_beyond_bins": beyond,
            "definition": "uniformly distributed inside each of the equal bins",
        }
    place.write(SUMMARY, f"{json_text(summary)}\n".encode())
    return replace(replace(results, summary=summary), kept=kept)


def sweep_into_folder(
    study: Study | str | Path | Mapping[str, Any],
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    draws: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
    scheduler: str | None = None,
    agreed: bool = False,
    progress: Report | None = None,
) -> StudyResults:
    """Return the results of ``sweep`` in ``out``, ``out/NAME`` by default, with figure, page and text beside them."""
    chosen = _study_of(study, overrides, draws, seed)
    place = out or Path("out") / chosen.name
    try:
        results = sweep(chosen, place, threads=threads, scheduler=scheduler, agreed=agreed, progress=progress)
        from ppafo.questions.sweep.answer import write_report

        write_report(results)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_INTERRUPTED) from None
    return results


def _study_of(
    study: Study | str | Path | Mapping[str, Any], overrides: Sequence[str], draws: int | None, seed: int | None
) -> Study:
    """Return the study; StudyError where one that is loaded already comes with what only loading can change."""
    if not isinstance(study, Study):
        return load_study(study, overrides, draws, seed)
    if overrides or draws is not None or seed is not None:
        raise StudyError("a loaded Study takes no overrides, draws or seed; give them to load_study")
    return study


def studies_of_the_package() -> list[dict[str, Any]]:
    """Return name, number of runs and description of each study that comes with the package."""
    studies = [load_study(name) for name in list_studies()]
    return [{"name": study.name, "runs": study.runs, "description": study.description} for study in studies]


def _claim(study: Study, place: Place, means: Means) -> BinsOf:
    """Make the folder that of this study, or refuse it; returns the bins of its bands."""
    names = place.names()
    if MANIFEST in names:
        stored = read_manifest(place)
        check_same_study(place, stored, manifest(study, {}))
        place.tidy()
        _keep_copy(study, place, names)
        return stored_bins(stored)
    if names:
        raise StudyError(
            f"{place.address}: is not empty and contains no study results (it has no {MANIFEST}); choose another folder"
        )
    check_room(study, place, means.agreed)
    bins = bins_of_trials(study, means.threads)
    place.write(MANIFEST, manifest_bytes(manifest(study, bins)))
    place.tidy()
    _keep_copy(study, place, names)
    return bins


def _keep_copy(study: Study, place: Place, names: Collection[str]) -> None:
    """Put the study file beside its results; after study.json, by which the folder is known to be ours."""
    if study.text and STUDY_COPY not in names:
        place.write(STUDY_COPY, study.text)


def _work(task: Task, place: Place, means: Means) -> None:
    study, started = task.study, time.monotonic()
    there = place.names()
    noted = [number for number in all_chunks(study) if note_file(number) in there]
    found = {number: finished_chunk(place, study, number) for number in noted}
    known = [item for item in found.values() if item is not None]
    tally = _Tally(study, means.progress, started, known)
    missing = [number for number in all_chunks(study) if found.get(number) is None]
    if missing and SUMMARY in there:
        place.remove(SUMMARY)
    if means.scheduler is not None:
        from ppafo.questions.sweep.results import compute_on_cluster

        compute_on_cluster(means.scheduler, task, missing, tally.add)
        place.tidy()
        names = place.names()
        if any(note_file(number) not in names for number in missing):
            raise StudyError(
                f"--scheduler {means.scheduler}: the workers finished chunks that are not in {place.address}: "
                "--out must be a folder that they share with this machine, or an address such as s3://bucket/study"
            )
    else:
        _compute_here(task, place, missing, tally.add)
    # Add a line on this session to the log.
    elapsed = time.monotonic() - started
    line = {
        "ended": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "machine": platform.platform(),
        "processors": os.cpu_count(),
        "versions": {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__},
        "scheduler": means.scheduler,
        "threads": means.threads,
        "runs": tally.done - tally.earlier,
        "failed": tally.failed,
        "seconds": round(elapsed, 3),
    }
    try:
        with place.open(LOG) as file:
            before = file.read()
    except OSError:
        before = b""
    place.write(LOG, before + f"{json.dumps(line)}\n".encode())


def _compute_here(task: Task, place: Place, numbers: Iterable[int], finish: Callable[[Finished], None]) -> None:
    """Compute chunks one after the other; while one is written, the next one is computed."""
    with ThreadPoolExecutor(1, "ppafo-writing") as writer:
        writing: tuple[Finished, Future[None]] | None = None
        for number in numbers:
            finished, files = compute_chunk(task, number)
            if writing is not None:
                writing[1].result()
                finish(writing[0])
            writing = finished, writer.submit(write_chunk, place, finished, files)
        if writing is not None:
            writing[1].result()
            finish(writing[0])


class _Tally:
    """What is done so far, reported to whoever watches."""

    def __init__(self, study: Study, progress: Report | None, started: float, known: Sequence[Finished]) -> None:
        self._report, self._started, self._runs = progress, started, study.runs
        self.earlier = self.done = sum(item.runs for item in known)
        self.failed = sum(item.failed for item in known)

    def add(self, finished: Finished) -> None:
        """Count a chunk."""
        self.done += finished.runs
        self.failed += finished.failed
        if self._report is not None:
            elapsed = time.monotonic() - self._started
            self._report(Progress("", self.done, self._runs, self.failed, self.earlier, elapsed))
