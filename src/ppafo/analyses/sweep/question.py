"""Command ``sweep``: run a study into a folder, or estimate a statistic of it, as its arguments ask."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Count, Fraction, Name, Overrides, Seed, Threads, Word, checked
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.sweep.results import StudyResults
    from ppafo.analyses.sweep.stopping import StatisticEstimate
    from ppafo.report.finding import Finding
    from ppafo.studies.study import Study

StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY")]
Folder = Annotated[str | Path, Word("DIR")]
Agreed = Annotated[bool, Word(option="--yes")]
StatisticWords = Annotated[str, Word("WORDS", option="--statistic")]
MetricName = Annotated[str, Word("NAME", option="--metric")]
Width = Annotated[str, Word("WIDTH")]


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
    statistic: StatisticWords | None = None,
    metric: MetricName | None = None,
    width: Width | None = None,
    also: Sequence[Name] = (),
    configuration: Name | None = None,
    first_draws: Count | None = None,
    confidence: Fraction | None = None,
    maximum_failed: Fraction | None = None,
    progress: Report | None = None,
) -> Finding[StudyResults] | Finding[StatisticEstimate]:
    """Run a study: many runs, one row each, resumable; or a statistic to a wanted precision.

    study: name of a study, or a .toml file
    out: folder for the results; default out/NAME with the name of the study
    draws: number of draws, instead of the number in the file; of a statistic the maximum, default 1,048,576
    agreed: start even if the results will fill much of the disk
    statistic: draw until the interval of a statistic is narrow enough, and keep no rows: mean, 'quantile 0.95',
        'probability above 1.2 N m', 'probability below 0.5 g'
    metric: with --statistic: name of a metric, such as rms_error
    width: target width of the interval: '1 %' of the value (default), or '0.01 N m'; of a probability, 0.02
    also: a further metric, whose mean over the same draws is given; may be repeated
    configuration: configuration of the study, needed if it has several
    first_draws: draws before the first estimate; default 256
    confidence: confidence of the interval; default 95%
    maximum_failed: fraction of the runs that may fail before the statistic is refused; default 1%

    >>> from pathlib import Path
    >>> print(sweep_into_folder("torque-task-uncertainty", draws=4, out=Path("four")).said[0])
    torque-task-uncertainty: 8 runs: 8 completed
    """
    from ppafo.errors import StudyError
    from ppafo.report.drawing import load_drawing
    from ppafo.studies.draws import study_of
    from ppafo.wording import argument_text

    # A module imported below may import Matplotlib, slowly: load_drawing imports it first, without its slow parts.
    load_drawing()
    for_statistic_only: dict[str, Any] = {
        "metric": metric,
        "width": width,
        "also": tuple(also) or None,
        "configuration": configuration,
        "first_draws": first_draws,
        "confidence": confidence,
        "maximum_failed": maximum_failed,
    }
    given = {name: value for name, value in for_statistic_only.items() if value is not None}
    if statistic is None:
        if given:
            example = f"{argument_text('statistic', 'mean')} {argument_text('metric', 'rms_error')}"
            raise StudyError(f"{next(iter(given))}: needs a statistic, for example {example}")
        return _study_into_folder(study_of(study, overrides, draws, seed), out, threads, agreed, progress)
    if metric is None:
        raise StudyError(f"statistic '{statistic}': needs a metric, for example {argument_text('metric', 'rms_error')}")
    if draws is not None:
        given["draws"] = draws
    given |= {"statistic": statistic, "seed": seed, "threads": threads, "progress": progress}
    return _statistic_into_folder(study_of(study, overrides), out, given)


def _study_into_folder(
    study: Study, out: str | Path | None, threads: int | None, agreed: bool, progress: Report | None
) -> Finding[StudyResults]:
    """Run a study into the folder ``out``, default out/NAME, and write its figure, page and summary there.

    An interrupt is raised again with a message that tells whether the same command resumes the study.
    """
    from ppafo.analyses.sweep.answer import write_sweep_report
    from ppafo.analyses.sweep.solve import INTERRUPTED, INTERRUPTED_AT_ONCE, sweep
    from ppafo.study.blocks import chunk_count
    from ppafo.study.folder import study_folder
    from ppafo.study.store import note_file

    # A text stays a text: in a Path, a URL is no longer recognised as one.
    folder = out or Path("out") / study.name
    try:
        swept = sweep(study, threads=threads, out=folder, agreed=agreed, progress=progress)
        write_sweep_report(swept.found)
    except KeyboardInterrupt:
        names = study_folder(folder).names()
        has_finished_chunk = any(note_file(number) in names for number in range(chunk_count(study)))
        raise KeyboardInterrupt(INTERRUPTED if has_finished_chunk else INTERRUPTED_AT_ONCE) from None
    return swept


def _statistic_into_folder(
    study: Study, out: str | Path | None, arguments: Mapping[str, Any]
) -> Finding[StatisticEstimate]:
    """Estimate a statistic of a study and write its report into the folder ``out``, default out/NAME-METRIC.

    ``arguments`` are the arguments of ``estimate`` that the user gave; ``estimate`` has the defaults of the others.
    """
    from dataclasses import replace

    from ppafo.analyses.sweep.statistic import estimate
    from ppafo.storage.owned_folder import check_owned_folder, marked_folder

    folder = Path(out or Path("out") / f"{study.name}-{arguments['metric']}")
    # The folder is checked before the draws, which may take minutes.
    check_owned_folder(folder, marked_folder("sweep"))
    estimated = estimate(study, **arguments)
    estimated.save(folder)
    return replace(estimated, found=replace(estimated.found, folder=str(folder)))
