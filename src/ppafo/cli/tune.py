"""``ppafo tune TUNING``: searches gains for a goal under constraints, robust where asked."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_output,
    print_result,
    write_files,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.cli.study_options import progress, seed, threads
from ppafo.errors import StudyError

if TYPE_CHECKING:
    from ppafo.studies.tuning import Problem


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("tuning", metavar="TUNING", nargs="?", help="name of a tuning, or a .toml file")
    parser.add_argument("--list", action="store_true", help="list the tunings that come with the package")
    add_override_argument(parser)
    parser.add_argument("--seed", metavar="N", help="of the search; that of the file unless given")
    parser.add_argument("--threads", metavar="N", help="threads; all cores unless given")
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Search, print and write; 1 where the gains found do not keep all constraints, over fresh draws too."""
    if parsed.list:
        return _list(parsed)
    if parsed.tuning is None:
        raise StudyError("no tuning was given: name one or give a .toml file; 'ppafo tune --list' shows them")
    load_compiler()
    from ppafo.reporting.tuning_report import REPORT, tuning_document, tuning_files, tuning_text
    from ppafo.studies.tuning import tune

    problem = _problem(parsed)
    check_output(parsed)
    with progress() as line:
        tuning = tune(problem, (), threads(parsed), line)
    lines = tuning_text(tuning)
    if parsed.out is not None:
        load_drawing()
        write_files(parsed, tuning_files(tuning))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), tuning_document(tuning), parsed.json)
    return EXIT_GOOD if tuning.after.is_feasible else EXIT_CHECK_FAILED


def _problem(parsed: argparse.Namespace) -> "Problem":
    from ppafo.studies.tuning import load_tuning

    problem, number = load_tuning(parsed.tuning, parsed.overrides), seed(parsed)
    return problem if number is None else replace(problem, effort=replace(problem.effort, seed=number))


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.studies.tuning import list_tunings, load_tuning

    problems = [load_tuning(name) for name in list_tunings()]
    width = max(len(problem.name) for problem in problems)
    listed: list[dict[str, Any]] = [{"name": item.name, "description": item.description} for item in problems]
    print_result(
        "\n".join(f"{item.name:<{width}}  {item.description}" for item in problems), {"tunings": listed}, parsed.json
    )
    return EXIT_GOOD
