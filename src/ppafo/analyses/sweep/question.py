"""Command ``sweep``: run a study into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Count, Overrides, Seed, Threads, Word, checked
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.sweep.results import StudyResults
    from ppafo.report.finding import Finding
    from ppafo.studies.study import Study

StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY")]
Folder = Annotated[str | Path, Word("DIR")]
Agreed = Annotated[bool, Word(option="--yes")]


@checked
def sweep_into_folder(
    study: StudyLike,
    *,
    out: Folder | None = None,
    overrides: Overrides = (),
    draws: Count | None = None,
    seed: Seed | None = None,
    threads: Threads | None = None,
    agreed: Agreed = False,
    progress: Report | None = None,
) -> Finding[StudyResults]:
    """Run a study: many runs, one row each, resumable.

    Its figure, page and summary are written into the folder too. An interrupt is raised again with a message that tells
    whether the same command resumes the study.

    study: name of a study, or a .toml file
    out: folder for the results; default out/NAME with the name of the study
    draws: number of draws, instead of the number in the file
    agreed: start even if the results will fill much of the disk

    >>> from pathlib import Path
    >>> print(sweep_into_folder("torque-task-uncertainty", draws=4, out=Path("four")).said[0])
    torque-task-uncertainty: 8 runs: 8 completed
    """
    from ppafo.analyses.sweep.answer import write_sweep_report
    from ppafo.analyses.sweep.solve import INTERRUPTED, INTERRUPTED_AT_ONCE, sweep
    from ppafo.report.drawing import load_drawing
    from ppafo.studies.draws import study_of
    from ppafo.study.blocks import chunk_count
    from ppafo.study.folder import study_folder
    from ppafo.study.store import note_file

    # A module imported below may import Matplotlib, slowly: load_drawing imports it first, without its slow parts.
    load_drawing()
    chosen = study_of(study, overrides, draws, seed)
    # A text stays a text: in a Path, a URL is no longer recognised as one.
    folder = out or Path("out") / chosen.name
    try:
        swept = sweep(chosen, threads=threads, out=folder, agreed=agreed, progress=progress)
        write_sweep_report(swept.found)
    except KeyboardInterrupt:
        names = study_folder(folder).names()
        has_finished_chunk = any(note_file(number) in names for number in range(chunk_count(chosen)))
        raise KeyboardInterrupt(INTERRUPTED if has_finished_chunk else INTERRUPTED_AT_ONCE) from None
    return swept
