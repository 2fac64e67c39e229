"""``ppafo size SIZING``: a torque profile and hours of use in, the smallest valve, pressure and bottle out."""

import argparse

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    check_output,
    print_result,
    tell,
    write_files,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.errors import StudyError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("sizing", metavar="SIZING", nargs="?", help="name of a sizing file, or a .toml file")
    parser.add_argument("--list", action="store_true", help="list the sizing files that come with the package")
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Size every valve, print the table and write the report; 1 where nothing can be suggested."""
    from ppafo.studies.sizing.document import FILE, read_sizing_file

    if parsed.list:
        return _list(parsed)
    if parsed.sizing is None:
        raise StudyError(f"no sizing was given: name one ({', '.join(FILE.names())}) or give a .toml file")
    from ppafo.reporting.sizing_files import sizing_files
    from ppafo.reporting.sizing_table import sizing_document, sizing_table

    check_output(parsed)
    read_sizing_file(parsed.sizing)
    load_compiler()
    from ppafo.studies.sizing import run_sizing

    sizing = run_sizing(parsed.sizing, watch=tell)
    lines = sizing_table(sizing)
    if parsed.out is not None:
        load_drawing()
        files = sizing_files(sizing)
        write_files(parsed, files)
        lines += ["", f"written: {parsed.out} ({', '.join(files)})"]
    print_result("\n".join(lines), sizing_document(sizing), parsed.json)
    return EXIT_CHECK_FAILED if sizing.choice is None else EXIT_GOOD


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.studies.sizing.document import FILE, read_sizing_file

    found = [read_sizing_file(name)[0] for name in FILE.names()]
    width = max(len(item.name) for item in found)
    text = "\n".join(f"{item.name:<{width}}  {item.description}" for item in found)
    document = {"sizings": [{"name": item.name, "description": item.description} for item in found]}
    print_result(text, document, parsed.json)
    return EXIT_GOOD
