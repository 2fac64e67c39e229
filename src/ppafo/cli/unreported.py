"""``ppafo unreported``: what the paper's results imply about the settings that it does not print."""

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
from ppafo.cli.whole_numbers import whole_number

_FIGURE, _DOCUMENT = "unreported-settings", "unreported.json"
_FORMATS = ("png", "svg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "--draws", default="262144", metavar="N", help="completions of the torque task to run; default 262144"
    )
    parser.add_argument("--seed", default="2011", metavar="N", help="seed of the draws; default 2011")
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print what is implied; 1 where no completion agrees with the paper."""
    load_compiler()
    from ppafo.documents.json_text import json_text
    from ppafo.reporting.unreported_table import unreported_document, unreported_table
    from ppafo.studies.unreported_settings import infer_settings

    draws = whole_number(parsed.draws, "--draws") or 0
    seed = whole_number(parsed.seed, "--seed") or 0
    check_output(parsed)
    family = infer_settings(draws, seed, tell)
    document = unreported_document(family)
    lines = unreported_table(family)
    if parsed.out is not None:
        load_drawing()
        from ppafo.reporting.style import rendered
        from ppafo.reporting.unreported_figure import unreported_figure

        figures = rendered(unreported_figure(family), _FORMATS)
        contents = {f"{_FIGURE}.{ending}": content for ending, content in figures.items()}
        write_files(parsed, {**contents, _DOCUMENT: f"{json_text(document)}\n".encode()})
        lines += ["", f"figure: {parsed.out / f'{_FIGURE}.png'}"]
    print_result("\n".join(lines), document, parsed.json)
    return EXIT_GOOD if family.effective > 0.0 else EXIT_CHECK_FAILED
