"""``ppafo identify PROBLEM.toml --out DIR``: recordings in, parameter set with uncertainty out."""

import argparse
from pathlib import Path

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    check_output,
    print_result,
    tell,
    write_files,
)
from ppafo.cli.quick_imports import load_drawing


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("problem", metavar="PROBLEM", type=Path, help="a .toml file; 'ppafo schema identification'")
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print estimates and checks, and write them with the new set and the figures; 1 where a check does not hold."""
    from ppafo.identification.identify import identify
    from ppafo.reporting.identification_files import identification_document, identification_files
    from ppafo.reporting.identification_table import identification_table

    check_output(parsed)
    identification = identify(parsed.problem, tell)
    lines = identification_table(identification)
    if parsed.out is not None:
        load_drawing()
        files = identification_files(identification)
        write_files(parsed, files)
        lines += ["", f"written: {parsed.out} ({', '.join(files)})"]
    print_result("\n".join(lines), identification_document(identification), parsed.json)
    return EXIT_GOOD if identification.is_good else EXIT_CHECK_FAILED
