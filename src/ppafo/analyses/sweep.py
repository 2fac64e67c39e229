"""Study: its runs into a folder, a row each, where an interrupted study resumes, and the statistics of all rows."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Iterable, Mapping
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.analyses import ask, np
from ppafo.arguments import Count, Executor, Overrides, Seed, Threads, Word, checked
from ppafo.errors import StudyError
from ppafo.plugins import Plugins
from ppafo.progress import Progress, Report, report_nothing
from ppafo.wording import said_of_configuration

if TYPE_CHECKING:
    from ppafo.analyses.study_results import StudyResults
    from ppafo.report.finding import Finding
    from ppafo.studies.study import Study

StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY")]
Folder = Annotated[str | Path, Word("DIR")]
Agreed = Annotated[bool, Word(option="--yes")]
LOG = "log.jsonl"
"""Name of the log file, the only file with date, machine and speed; all other files are equal on any machine."""


@checked
def sweep(
    study: StudyLike,
    *,
    overrides: Overrides = (),
    draws: Count | None = None,
    seed: Seed | None = None,
    threads: Threads | None = None,
    executor: Executor | None = None,
    out: Folder | None = None,
    agreed: Agreed = False,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[StudyResults]:
    """Run a study, given as a name, a TOML file, data with the layout of such a file, or a Study.

    Columns of the results are arrays of shape (runs,), trajectories (runs, samples), in SI units, pressures absolute.
    A failed run has a row with its status and nan for all results.

    Arguments:
        study: name of a study, or a .toml file; in Python also data laid out as one, or a Study
        overrides: values to change, for example 'valve.area=12.6 mm^2'; of one configuration: 'NAME:PATH=VALUE'; may be
            repeated
        draws: number of draws; default: the file's
        seed: random seed; default: the file's
        threads: threads of each process; default: all cores, one of a worker
        executor: an Executor of concurrent.futures, such as a cluster's, or the MODULE:OBJECT of one; default: this
            process
        out: folder for the results, where an interrupted study resumes; default: out/NAME with the name of the study,
            in Python a temporary one that exists as long as the returned object
        agreed: start even if the results will fill much of the disk
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
    from ppafo.analyses.study_results import SUMMARY, StudyResults, finding_of, summarise
    from ppafo.simulation.gains import warn_of_gains
    from ppafo.storage.files import temporary_folder
    from ppafo.studies.study import NO_SAMPLE
    from ppafo.study.executing import computed_by
    from ppafo.study.store import claim, compute_chunk, read_manifest, study_folder
    from ppafo.version import __version__

    workers = ask.executor_of(executor)
    chosen = ask.study_of(study, overrides, draws, seed)
    if chosen.drawn and chosen.sample.method is None:
        raise StudyError(f"study '{chosen.name}': {NO_SAMPLE}")
    if not (chosen.outputs.metrics or chosen.outputs.traces):
        said = f"(such as {', '.join(list(ask.METRICS)[:4])}), trajectories or bands"
        raise StudyError(f"study '{chosen.name}': [outputs] is empty: give metrics {said}")
    kept = temporary_folder("ppafo-study") if out is None else None
    folder = study_folder(kept.name if kept is not None else str(out))
    for configuration in chosen.configurations:
        varied = [path for path in {*chosen.paths, *chosen.same} if chosen.varies(path, configuration.name)]
        with said_of_configuration(configuration.name):
            warn_of_gains(configuration.scenario, varied)
    report = progress or report_nothing
    started = time.monotonic()
    chunks, finished = claim(chosen, folder, agreed, threads, report)
    missing = [chunk for chunk in chunks if chunk.number not in finished]
    earlier = sum(chunk.runs for chunk in chunks) - sum(chunk.runs for chunk in missing)
    counter = ask.RunCounter(chosen.runs, progress, earlier, sum(finished.values()))
    # The first chunk may wait for a compiler.
    counter.add(0, 0)
    # Rows change below: an old summary would pass for a finished study meanwhile.
    if missing:
        (folder.path / SUMMARY).unlink(missing_ok=True)
    work = partial(compute_chunk, chosen, threads=threads if workers is None else threads or 1)
    computed: Iterable[tuple[int, tuple[int, bytes]]]
    computed = (
        enumerate(work(chunk, count=counter.count_ended) for chunk in missing)
        if workers is None
        else computed_by(workers, work, missing)
    )
    for number, (failed, content) in computed:
        folder.write_chunk(missing[number].number, failed, content)
        counter.add(missing[number].runs, failed)
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
    log = folder.path / LOG
    folder.write(LOG, (log.read_bytes() if log.is_file() else b"") + f"{json.dumps(line)}\n".encode())
    report(Progress("summarising", chosen.runs, chosen.runs))
    # Read as everybody reads it, from what was written.
    return finding_of(summarise(chosen, StudyResults(folder, read_manifest(folder), {}, kept)))


@checked
@wraps(sweep)
def sweep_into_folder(
    study: StudyLike,
    *,
    out: Folder | None = None,
    overrides: Overrides = (),
    draws: Count | None = None,
    seed: Seed | None = None,
    **running: Any,
) -> Finding[StudyResults]:
    """Run a study: many runs, one row each, resumable.

    The command: it writes the folder with figure, page and text. An interrupt is raised again with a message on whether
    the same command resumes the study.
    """
    from ppafo.report.finding import page_files, text_of
    from ppafo.report.style import load_drawing
    from ppafo.study.store import study_folder

    # A module imported below may import Matplotlib, slowly: load_drawing imports it first, without its slow parts.
    load_drawing()
    chosen = ask.study_of(study, overrides, draws, seed)
    # A text stays a text: in a Path, a URL is no longer recognised as one.
    folder = study_folder(out or Path("out") / chosen.name)
    try:
        swept = sweep(chosen, out=out or folder.path, **running)
        # No file contains the path of the folder, so the same study gives the same bytes anywhere.
        for name, content in {**page_files(swept), "summary.txt": f"{text_of(swept)}\n".encode()}.items():
            folder.write(name, content)
    except KeyboardInterrupt:
        is_begun = any(name.startswith("finished/") for name in folder.names())
        said = "interrupted before the first chunk was finished; the same command starts the study again"
        said = "interrupted; finished chunks are kept, and the same command resumes the study" if is_begun else said
        raise KeyboardInterrupt(said) from None
    return swept
