"""Command ``sweep``: arguments of a study with results in a folder, or of a statistic over draws."""

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
    from dataclasses import replace

    from ppafo.errors import StudyError
    from ppafo.report.drawing import load_drawing
    from ppafo.studies.draws import study_of
    from ppafo.wording import argument_text

    # Before anything else imports Matplotlib, so that it comes without what it does for others.
    load_drawing()
    optional: dict[str, Any] = {
        "width": width,
        "also": tuple(also) or None,
        "configuration": configuration,
        "first_draws": first_draws,
        "confidence": confidence,
        "maximum_failed": maximum_failed,
    }
    # What is not given has the default of ``estimate``.
    options = {name: value for name, value in optional.items() if value is not None}
    if statistic is None:
        unused = [*(["metric"] if metric is not None else []), *options]
        if unused:
            example = f"{argument_text('statistic', 'mean')} {argument_text('metric', 'rms_error')}"
            raise StudyError(f"{unused[0]}: needs a statistic, for example {example}")
        from ppafo.analyses.sweep.answer import write_sweep_report
        from ppafo.analyses.sweep.solve import INTERRUPTED, INTERRUPTED_AT_ONCE, sweep

        chosen = study_of(study, overrides, draws, seed)
        target = out or Path("out") / chosen.name
        try:
            swept = sweep(chosen, threads=threads, out=target, agreed=agreed, progress=progress)
            write_sweep_report(swept.found)
        except KeyboardInterrupt:
            is_begun = any(Path(target).glob("finished/chunk-*.json"))
            raise KeyboardInterrupt(INTERRUPTED if is_begun else INTERRUPTED_AT_ONCE) from None
        return swept
    if metric is None:
        raise StudyError(f"statistic '{statistic}': needs a metric, for example {argument_text('metric', 'rms_error')}")
    from ppafo.analyses.sweep.statistic import estimate
    from ppafo.storage.owned_folder import check_owned_folder, marked_folder

    chosen = study_of(study, overrides)
    folder = Path(out or Path("out") / f"{chosen.name}-{metric}")
    # Before anything is drawn: a folder of something else must cost no time.
    check_owned_folder(folder, marked_folder("sweep"))
    if draws is not None:
        options["draws"] = draws
    options |= {"seed": seed, "threads": threads, "progress": progress}
    estimated = estimate(chosen, metric=metric, statistic=statistic, **options)
    estimated.save(folder)
    return replace(estimated, found=replace(estimated.found, folder=str(folder)))
