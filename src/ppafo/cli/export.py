"""``ppafo export``: what leaves the package for other tools."""

import argparse
import shlex
from pathlib import Path

from ppafo.cli.output import (
    EXIT_GOOD,
    add_json_argument,
    add_override_argument,
    check_output,
    print_result,
    write_files,
)

_C = "write a scenario as a library in C: header, source, example, make files"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    library = actions.add_parser("c", help=_C, description=f"{_C[:1].upper()}{_C[1:]}.")
    library.add_argument("scenario", metavar="SCENARIO", help="name of a scenario, or a .toml file")
    add_override_argument(library)
    add_json_argument(library)
    library.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")


def run(parsed: argparse.Namespace) -> int:
    """Write the files of a library, and say what to run next."""
    from ppafo.exports.c_library import c_library
    from ppafo.simulation.loading import load_scenario

    check_output(parsed)
    contents = c_library(load_scenario(parsed.scenario, parsed.overrides))
    write_files(parsed, contents)
    command = f"make -C {shlex.quote(str(parsed.out))} check"
    document = {"folder": str(parsed.out), "files": list(contents), "next": command}
    print_result(f"written: {parsed.out} ({', '.join(contents)}); next: {command}", document, parsed.json)
    return EXIT_GOOD
