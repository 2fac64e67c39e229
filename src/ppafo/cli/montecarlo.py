"""``ppafo montecarlo STUDY --metric NAME``: draws until the interval of a statistic is narrow enough."""

import argparse

from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, check_output, print_result, write_files
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.cli.study_options import add_study_options, confidence, most_failed, progress, seed, threads
from ppafo.cli.whole_numbers import whole_number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("study", metavar="STUDY", help="a study with distributions: a name, or a .toml file")
    parser.add_argument("--metric", metavar="NAME", required=True, help="such as rms_error")
    parser.add_argument(
        "--statistic",
        metavar="WORDS",
        default="mean",
        help="mean (default), 'quantile 0.95', 'probability above 1.2 N m', 'probability below 0.5 g'",
    )
    parser.add_argument(
        "--width",
        metavar="WIDTH",
        help="of the interval: '1 %%' of the value (default), or '0.01 N m'; of a probability 0.02 unless given",
    )
    parser.add_argument("--configuration", metavar="NAME", help="of the study, where it has several")
    parser.add_argument("--first", metavar="N", default="256", help="draws before the first look; 256 unless given")
    parser.add_argument("--most", metavar="N", default="1048576", help="draws at most; 1,048,576 unless given")
    add_study_options(parser)


def run(parsed: argparse.Namespace) -> int:
    """Draw, print and write; 1 where the interval did not become narrow enough."""
    load_compiler()
    from ppafo.reporting.monte_carlo_report import (
        REPORT,
        monte_carlo_document,
        monte_carlo_files,
        monte_carlo_text,
    )
    from ppafo.studies.monte_carlo import monte_carlo

    check_output(parsed)
    with progress() as line:
        estimate = monte_carlo(
            parsed.study,
            parsed.metric,
            parsed.statistic,
            parsed.width,
            parsed.configuration,
            parsed.overrides,
            seed(parsed),
            whole_number(parsed.first, "--first") or 0,
            whole_number(parsed.most, "--most") or 0,
            confidence(parsed),
            most_failed(parsed, 0.01),
            threads(parsed),
            line,
        )
    lines = monte_carlo_text(estimate)
    if parsed.out is not None:
        load_drawing()
        write_files(parsed, monte_carlo_files(estimate))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), monte_carlo_document(estimate), parsed.json)
    return EXIT_GOOD if estimate.is_met else EXIT_CHECK_FAILED
