"""``ppafo league [SCENARIO]``: every controller on one task, on drawn devices, against the best that is possible."""

import argparse

from ppafo.cli.output import (
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_own_folder,
    print_result,
    tell,
    write_files,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing

_TASK = "torque-task-proportional"
_DRAWS = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "scenario",
        metavar="SCENARIO",
        nargs="?",
        default=_TASK,
        help=f"name of a scenario, or a .toml file; {_TASK} unless given",
    )
    add_override_argument(parser)
    parser.add_argument(
        "--draws",
        metavar="N",
        type=int,
        default=_DRAWS,
        help=f"devices drawn around the scenario's own, 0 for none; default {_DRAWS}",
    )
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Play the league, print its table and write the report."""
    load_compiler()
    from ppafo.reporting.league_files import NAMES, REPORT, league_files
    from ppafo.reporting.league_table import league_document, league_table
    from ppafo.studies.league import league

    check_own_folder(parsed.out, NAMES)
    played = league(parsed.scenario, parsed.overrides, parsed.draws, say=tell)
    lines = league_table(played)
    if parsed.out is not None:
        load_drawing()
        write_files(parsed.out, league_files(played))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), league_document(played), parsed.json)
    return EXIT_GOOD
