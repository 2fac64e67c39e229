"""``ppafo sweep STUDY``: runs a study file into a folder of columns, figure and report; goes on where it stopped."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, add_json_argument, add_override_argument, print_result
from ppafo.cli.quick_imports import load_drawing
from ppafo.errors import StudyError

if TYPE_CHECKING:
    from ppafo.studies.sweep.results import StudyResults

EXIT_INTERRUPTED = 130


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("study", metavar="STUDY", nargs="?", help="name of a study, or a .toml file")
    parser.add_argument("--list", action="store_true", help="list the studies that come with the package")
    parser.add_argument("--out", metavar="DIR", help="folder or address of the results; default out/NAME of the study")
    add_override_argument(parser)
    parser.add_argument("--runs", metavar="N", help="number of draws, in place of the file's")
    parser.add_argument("--threads", metavar="N", help="threads of each process; all cores unless given")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that works out the chunks")
    parser.add_argument("--yes", action="store_true", help="start even where the results take much of the disk")
    add_json_argument(parser)


def run(parsed: argparse.Namespace) -> int:
    """Run a study, write and print what came of it; 1 where no run completed."""
    if parsed.list:
        return _list(parsed)
    if parsed.study is None:
        raise StudyError("no study was given: name one or give a .toml file; 'ppafo sweep --list' shows them")
    try:
        return _run_and_report(parsed)
    except KeyboardInterrupt:
        print("\nppafo: interrupted; finished chunks are kept, and the same command goes on from them", file=sys.stderr)
        return EXIT_INTERRUPTED


def _run_and_report(parsed: argparse.Namespace) -> int:
    results = _results(parsed)
    load_drawing()
    from ppafo.reporting.study_report import study_document, study_text, write_report

    write_report(results)
    print_result(study_text(results), study_document(results), parsed.json)
    return _told_failures(results)


def _results(parsed: argparse.Namespace) -> "StudyResults":
    from ppafo.studies.sweep.loading import load_study
    from ppafo.studies.sweep.progress import ProgressLine
    from ppafo.studies.sweep.run import run_study

    runs, threads = _count(parsed.runs, "--runs"), _count(parsed.threads, "--threads")
    study = load_study(parsed.study, parsed.overrides, runs)
    line = ProgressLine(sys.stderr)
    try:
        out = parsed.out or Path("out") / study.name
        return run_study(study, out, threads=threads, scheduler=parsed.scheduler, agreed=parsed.yes, watch=line)
    finally:
        line.close()


def _count(text: str | None, option: str) -> int | None:
    if text is None:
        return None
    if not text.replace("_", "").isdecimal() or int(text) < 1:
        raise StudyError(f"{option} {text}: must be a whole number, 1 or more")
    return int(text)


def _told_failures(results: "StudyResults") -> int:
    completed, runs = results.summary["completed"], results.document["runs"]
    if completed == runs:
        return EXIT_GOOD
    first = results.summary["failures"][0]
    print(
        f"ppafo: {runs - completed:,} of {runs:,} runs failed and have no metrics; the first is run {first['run']}: "
        f"{first['reason']}",
        file=sys.stderr,
    )
    return EXIT_GOOD if completed else EXIT_CHECK_FAILED


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.studies.sweep.loading import list_studies, load_study

    studies = [load_study(name) for name in list_studies()]
    width = max(len(study.name) for study in studies)
    text = "\n".join(f"{study.name:<{width}}  {study.runs:>9,} runs  {study.description}" for study in studies)
    listed: list[dict[str, Any]] = [
        {"name": study.name, "runs": study.runs, "description": study.description} for study in studies
    ]
    print_result(text, {"studies": listed}, parsed.json)
    return EXIT_GOOD
