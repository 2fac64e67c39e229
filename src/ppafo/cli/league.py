"""``ppafo league``: every controller on one task, on drawn devices, against the best that is possible.

The task is a torque to follow, ``ppafo league [SCENARIO]``, or a leg that walks, ``ppafo league --walk [CONFIG]``.
"""

import argparse
from collections.abc import Callable
from typing import Any

from ppafo.cli.output import (
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_output,
    print_result,
    tell,
    write_files,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.cli.walk import minutes_of
from ppafo.errors import ScenarioError

_TASK = "torque-task-proportional"
_WALK = "proportional"
_MINUTES = "0.2"
_DRAWS = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "scenario",
        metavar="SCENARIO",
        nargs="?",
        help=f"name of a scenario, or a .toml file; {_TASK} unless given",
    )
    parser.add_argument(
        "--walk",
        metavar="CONFIG",
        nargs="?",
        const=_WALK,
        help=f"walk instead: name of a walk configuration, or a .toml file; {_WALK} unless named",
    )
    parser.add_argument("--gait", metavar="GAIT", help="with --walk: name of a gait, or a gait file")
    parser.add_argument("--minutes", metavar="N", help=f"with --walk: how long to walk; default {_MINUTES}")
    add_override_argument(parser)
    parser.add_argument(
        "--draws",
        metavar="N",
        type=int,
        default=_DRAWS,
        help=f"devices, and wearers who walk, drawn around those of the task, 0 for none; default {_DRAWS}",
    )
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Play the league, print its table and write the report."""
    if parsed.walk is not None:
        return _walking(parsed)
    if parsed.gait is not None or parsed.minutes is not None:
        option = "--gait" if parsed.gait is not None else "--minutes"
        raise ScenarioError(f"{option} belongs to a leg that walks: add --walk")
    load_compiler()
    from ppafo.reporting.league_files import league_files
    from ppafo.reporting.league_table import league_document, league_table
    from ppafo.studies.league import league

    check_output(parsed)
    played = league(parsed.scenario or _TASK, parsed.overrides, parsed.draws, say=tell)
    return _shown(parsed, league_table(played), league_document(played), lambda: league_files(played))


def _walking(parsed: argparse.Namespace) -> int:
    if parsed.scenario is not None:
        raise ScenarioError(f"{parsed.scenario}: a league has one task; give a scenario or --walk, not both")
    load_compiler()
    from ppafo.reporting.walking_league_document import walking_league_document
    from ppafo.reporting.walking_league_files import walking_league_files
    from ppafo.reporting.walking_league_table import walking_league_table
    from ppafo.studies.league.walking import walking_league, walking_task

    check_output(parsed)
    task = walking_task(parsed.walk, parsed.overrides, parsed.gait, minutes_of(parsed.minutes or _MINUTES))
    league = walking_league(task, parsed.draws, say=tell)
    document = walking_league_document(league)
    return _shown(parsed, walking_league_table(league), document, lambda: walking_league_files(league))


def _shown(
    parsed: argparse.Namespace,
    lines: list[str],
    document: dict[str, Any],
    files: Callable[[], dict[str, bytes]],
) -> int:
    """Write the files where they are wanted, and print the table."""
    from ppafo.reporting.league_files import REPORT

    if parsed.out is not None:
        load_drawing()
        write_files(parsed, files())
        lines = [*lines, "", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), document, parsed.json)
    return EXIT_GOOD
