"""``ppafo sensitivity STUDY``: which uncertain value matters, by Sobol, Shapley or Morris."""

import argparse

from ppafo.cli.output import EXIT_GOOD, check_output, print_result, write_files
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.cli.study_options import add_study_options, confidence, most_failed, progress, seed, threads
from ppafo.cli.whole_numbers import whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("study", metavar="STUDY", help="a study with distributions: a name, or a .toml file")
    parser.add_argument(
        "--method",
        metavar="sobol|shapley|morris",
        help="sobol, or shapley where values are correlated; morris to screen; by the study unless given",
    )
    parser.add_argument(
        "--metric", dest="metrics", metavar="NAME", action="append", default=[], help="those of the study unless given"
    )
    parser.add_argument(
        "--samples", metavar="N", help="base points (8192 unless given), orders (2048) or trajectories (128)"
    )
    parser.add_argument("--configuration", metavar="NAME", help="of the study, where it has several")
    parser.add_argument("--independent", action="store_true", help="leave the correlations of the study out")
    add_study_options(parser)


def run(parsed: argparse.Namespace) -> int:
    """Run the design, print and write the indices."""
    load_compiler()
    from ppafo.reporting.sensitivity_report import (
        REPORT,
        sensitivity_document,
        sensitivity_files,
        sensitivity_text,
    )
    from ppafo.studies.sensitivity import sensitivity

    check_output(parsed)
    with progress() as line:
        found = sensitivity(
            parsed.study,
            parsed.method,
            parsed.metrics,
            whole_number(parsed.samples, "--samples"),
            parsed.configuration,
            parsed.overrides,
            parsed.independent,
            seed(parsed),
            confidence(parsed),
            most_failed(parsed, 0.02),
            threads(parsed),
            line,
        )
    lines = sensitivity_text(found)
    if parsed.out is not None:
        load_drawing()
        write_files(parsed, sensitivity_files(found))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), sensitivity_document(found), parsed.json)
    return EXIT_GOOD
