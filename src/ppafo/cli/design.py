"""``ppafo design DESIGN``: which parts and settings no others beat in error, gas and mass."""

import argparse
import sys

from ppafo.cli.output import EXIT_GOOD, add_output_arguments, check_output, print_result, write_files
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.errors import StudyError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("design", metavar="DESIGN", nargs="?", help="name of a design file, or a .toml file")
    parser.add_argument("--list", action="store_true", help="list the design files that come with the package")
    parser.add_argument("--seed", metavar="N", help="of the search, in place of the file's")
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Search, print the table and write the report."""
    from ppafo.studies.design.document import FILE, read_design_file

    if parsed.list:
        return _list(parsed)
    if parsed.design is None:
        raise StudyError(f"no design was given: name one ({', '.join(FILE.names())}) or give a .toml file")
    from ppafo.reporting.design_files import design_files
    from ppafo.reporting.design_table import design_document, design_table
    from ppafo.studies.design import load_design, run_design

    check_output(parsed)
    read_design_file(parsed.design)
    load_compiler()
    problem = load_design(parsed.design, _seed(parsed.seed))
    design = run_design(problem, watch=_told)
    print(file=sys.stderr)
    lines = design_table(design)
    if parsed.out is not None:
        load_drawing()
        files = design_files(design)
        write_files(parsed, files)
        lines += ["", f"written: {parsed.out} ({', '.join(files)})"]
    print_result("\n".join(lines), design_document(design), parsed.json)
    return EXIT_GOOD


def _told(designs: int, share: float) -> None:
    print(f"\rppafo: {designs} designs tried, hypervolume {share:.4f}", end="", file=sys.stderr, flush=True)


def _seed(text: str | None) -> int | None:
    if text is None:
        return None
    if not text.isdecimal() or int(text) >= 2**32:
        raise StudyError(f"--seed {text}: must be a whole number from 0 to {2**32 - 1}")
    return int(text)


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.studies.design.document import FILE, read_design_file

    found = [read_design_file(name)[0] for name in FILE.names()]
    width = max(len(item.name) for item in found)
    text = "\n".join(f"{item.name:<{width}}  {item.description}" for item in found)
    document = {"designs": [{"name": item.name, "description": item.description} for item in found]}
    print_result(text, document, parsed.json)
    return EXIT_GOOD
