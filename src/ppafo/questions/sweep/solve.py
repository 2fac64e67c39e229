"""Runs a study into a folder, from where it stands: chunks that are there and whole are not computed again."""

import json
import os
import platform
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.documents.json_text import json_text
from ppafo.errors import StudyError
from ppafo.progress import Progress, Report
from ppafo.questions.sweep.chunks import check_room
from ppafo.questions.sweep.compute import (
    Finished,
    Task,
    all_chunks,
    bins_of_trials,
    compute_chunk,
    finished_chunk,
    note_file,
    write_chunk,
)
from ppafo.questions.sweep.manifest import (
    MANIFEST,
    STUDY_COPY,
    BinsOf,
    check_same_study,
    manifest,
    manifest_bytes,
    read_manifest,
    stored_bins,
)
from ppafo.questions.sweep.results import BANDS, SUMMARY, StudyResults
from ppafo.questions.sweep.summary import bands_file, summary_of
from ppafo.storage.places import Place, place_at
from ppafo.studies.loading import list_studies, load_study
from ppafo.studies.study import Study
from ppafo.version import __version__

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
    return replace(finish_results(chosen, place, bins), kept=kept)


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


def finish_results(study: Study, place: Place, bins: BinsOf) -> StudyResults:
    """Write summary and bands of a study all of whose chunks are there, and return its results."""
    results = StudyResults(place, read_manifest(place), {})
    summary = summary_of(study, results)
    if study.outputs.bands:
        content, beyond = bands_file(study, results, bins)
        place.write(BANDS, content)
        summary["bands"] = {
            "share_beyond_bins": beyond,
            "definition": "uniformly distributed inside each of the equal bins",
        }
    place.write(SUMMARY, f"{json_text(summary)}\n".encode())
    return replace(results, summary=summary)


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
        from ppafo.questions.sweep.cluster import compute_on_cluster

        compute_on_cluster(means.scheduler, task, missing, tally.add)
        _check_shared(place, missing, means.scheduler)
    else:
        _compute_here(task, place, missing, tally.add)
    _log(place, means, tally, time.monotonic() - started)


def _check_shared(place: Place, numbers: Iterable[int], scheduler: str) -> None:
    """Refuse workers that wrote somewhere else, and remove what those of them that died left half written."""
    place.tidy()
    names = place.names()
    if any(note_file(number) not in names for number in numbers):
        raise StudyError(
            f"--scheduler {scheduler}: the workers finished chunks that are not in {place.address}: "
            "--out must be a folder that they share with this machine, or an address such as s3://bucket/study"
        )


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


def _log(place: Place, means: Means, tally: _Tally, elapsed: float) -> None:
    """Add a line on this session to the log."""
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
