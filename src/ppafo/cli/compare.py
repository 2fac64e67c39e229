"""``ppafo compare``: configurations side by side, and over an uncertain device with common random numbers."""

import argparse

from ppafo.cli.arguments import UsageError
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, check_output, print_result, write_files
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.cli.study_options import add_study_options, confidence, most_failed, progress, seed, threads
from ppafo.cli.whole_numbers import whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "scenarios", metavar="SCENARIO", nargs="*", help="names or .toml files; those of --study if none"
    )
    parser.add_argument("--study", metavar="STUDY", help="a study file: its distributions, and its configurations")
    parser.add_argument(
        "--task",
        dest="tasks",
        metavar="NAME:PATH=VALUE[,PATH=VALUE]",
        action="append",
        default=[],
        help="a task that all do, for example 'slow:reference.ramp_time=2 s'; as written unless given",
    )
    parser.add_argument("--baseline", metavar="NAME", help="what all others are held against; the first unless given")
    parser.add_argument("--draws", metavar="N", help="draws of the uncertain values; 4096 unless given")
    add_study_options(parser)


def run(parsed: argparse.Namespace) -> int:
    """Compare, print and write; 1 where a run diverged."""
    load_compiler()
    from ppafo.reporting.comparison_report import REPORT, comparison_document, comparison_files, comparison_text
    from ppafo.studies.comparison import compare
    from ppafo.studies.comparison.study import DEFAULT_DRAWS

    check_output(parsed)
    draws = whole_number(parsed.draws, "--draws")
    with progress() as line:
        comparison = compare(
            parsed.scenarios or None,
            parsed.study,
            _tasks(parsed.tasks),
            parsed.overrides,
            parsed.baseline,
            DEFAULT_DRAWS if draws is None else draws,
            seed(parsed),
            confidence(parsed),
            most_failed(parsed, 0.01),
            threads(parsed),
            line,
        )
    lines = comparison_text(comparison)
    if parsed.out is not None:
        load_drawing()
        write_files(parsed, comparison_files(comparison))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), comparison_document(comparison), parsed.json)
    return EXIT_GOOD if all(case.status.is_completed for case in comparison.cases) else EXIT_CHECK_FAILED


def _tasks(texts: list[str]) -> dict[str, list[str]] | None:
    tasks: dict[str, list[str]] = {}
    for text in texts:
        name, colon, overrides = (part.strip() for part in text.partition(":"))
        if not name or not colon or not overrides:
            raise UsageError(f"--task {text}: is not of the form NAME:PATH=VALUE, as 'slow:reference.ramp_time=2 s' is")
        if name in tasks:
            raise UsageError(f"--task {text}: there are two tasks '{name}'")
        tasks[name] = [item.strip() for item in overrides.split(",")]
    return tasks or None
