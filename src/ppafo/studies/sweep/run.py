"""Runs a study into a folder, from where it stands: chunks that are there and whole are not worked out again."""

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

import ppafo
from ppafo.errors import StudyError
from ppafo.storage.places import Place, place_at
from ppafo.studies.sweep.compute import (
    Finished,
    Task,
    all_chunks,
    bins_of_trials,
    compute_chunk,
    finished_chunk,
    note_file,
    write_chunk,
)
from ppafo.studies.sweep.loading import load_study
from ppafo.studies.sweep.manifest import (
    MANIFEST,
    STUDY_COPY,
    BinsOf,
    check_same_study,
    manifest,
    manifest_bytes,
    read_manifest,
    stored_bins,
)
from ppafo.studies.sweep.progress import Progress
from ppafo.studies.sweep.results import BANDS, SUMMARY, StudyResults
from ppafo.studies.sweep.room import check_room
from ppafo.studies.sweep.study import Study
from ppafo.studies.sweep.summary import bands_file, summarised

LOG = "log.jsonl"
"""The only file that says when, where and how fast; all others are the same wherever they are made."""

Watch = Callable[[Progress], None]


@dataclass(frozen=True, slots=True)
class Means:
    """How a study is worked out: threads of this process, a Dask scheduler, consent to a large folder, who watches."""

    threads: int | None = None
    scheduler: str | None = None
    agreed: bool = False
    watch: Watch | None = None


def run_study(
    study: Study | str | Path | Mapping[str, Any],
    out: str | Path | None = None,
    overrides: Sequence[str] = (),
    runs: int | None = None,
    threads: int | None = None,
    scheduler: str | None = None,
    agreed: bool = False,
    watch: Watch | None = None,
) -> StudyResults:
    """Run a study: a name, a TOML file, data laid out as one, or a Study; returns its results.

    ``out`` is a folder, or an address that fsspec knows; a study that was begun there goes on. Without it the results
    live in a temporary folder as long as the returned object. ``overrides`` change every configuration, ``runs`` is the
    number of draws in place of the file's. ``threads`` are those of this process, all cores unless given;
    ``scheduler`` is the address of a Dask scheduler whose workers do the work, ``agreed`` the consent to a folder that
    takes much of the disk, and ``watch`` is told of every finished chunk. StudyError for bad input; a run that fails is
    a row that says so.
    """
    means = Means(threads, scheduler, agreed, watch)
    chosen = study if isinstance(study, Study) else load_study(study, overrides, runs)
    kept = tempfile.TemporaryDirectory(prefix="ppafo-study-") if out is None else None
    place = place_at(kept.name if kept is not None else str(out))
    bins = _claimed(chosen, place, means)
    _work(Task(chosen, bins, place.address, means.threads), place, means)
    return replace(finished_results(chosen, place, bins), kept=kept)


def finished_results(study: Study, place: Place, bins: BinsOf) -> StudyResults:
    """Write summary and bands of a study all of whose chunks are there, and return its results."""
    results = StudyResults(place, read_manifest(place), {})
    summary = summarised(study, results)
    if study.outputs.bands:
        content, beyond = bands_file(study, results, bins)
        place.write(BANDS, content)
        summary["bands"] = {"share_beyond_bins": beyond, "definition": "evenly spread inside each of the equal bins"}
    place.write(SUMMARY, f"{json.dumps(summary, indent=2)}\n".encode())
    return replace(results, summary=summary)


def _claimed(study: Study, place: Place, means: Means) -> BinsOf:
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
            f"{place.address}: is not empty and holds no results of a study (it has no {MANIFEST}); "
            "choose another folder"
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
    tally = _Tally(study, means.watch, started, known)
    missing = [number for number in all_chunks(study) if found.get(number) is None]
    if missing and SUMMARY in there:
        place.remove(SUMMARY)
    if means.scheduler is not None:
        from ppafo.studies.sweep.cluster import compute_on_cluster

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
    """Work out chunks one after the other; while one is written, the next one is computed."""
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
    """What is done so far, told to whoever watches."""

    def __init__(self, study: Study, watch: Watch | None, started: float, known: Sequence[Finished]) -> None:
        self._watch, self._started, self._runs = watch, started, study.runs
        self.earlier = self.done = sum(item.runs for item in known)
        self.failed = sum(item.failed for item in known)

    def add(self, finished: Finished) -> None:
        """Count a chunk."""
        self.done += finished.runs
        self.failed += finished.failed
        if self._watch is not None:
            elapsed = time.monotonic() - self._started
            self._watch(Progress(self._runs, self.done, self.earlier, self.failed, elapsed))


def _log(place: Place, means: Means, tally: _Tally, elapsed: float) -> None:
    """Add a line on this session to the log."""
    line = {
        "ended": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "machine": platform.platform(),
        "processors": os.cpu_count(),
        "versions": {"ppafo": ppafo.__version__, "python": platform.python_version(), "numpy": np.__version__},
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
