"""``ppafo reproduce``: runs the paper's experiments and reports against its claims."""

import argparse
import sys
from typing import TYPE_CHECKING

from ppafo.cli.output import add_output_arguments, add_override_argument, print_result, write_files

if TYPE_CHECKING:
    from ppafo.studies.reproduction import Reproduction

EXIT_GOOD = 0
EXIT_CHECK_FAILED = 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    add_override_argument(parser)
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print the claims; 1 where a number misses the window that it has to meet, unless values were changed."""
    from ppafo.reporting.claims_table import claims_table
    from ppafo.reporting.reproduction_files import REPORT, claims_document, reproduction_files
    from ppafo.studies.reproduction import reproduce

    reproduction = reproduce(parsed.overrides, _tell)
    lines = [*claims_table(reproduction.claims), *_missed(reproduction)]
    if parsed.out is not None:
        _tell("drawing the figures and writing the report")
        write_files(parsed.out, reproduction_files(reproduction))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), claims_document(reproduction), parsed.json)
    return EXIT_CHECK_FAILED if reproduction.missed and not parsed.overrides else EXIT_GOOD


def _tell(text: str) -> None:
    print(f"ppafo: {text} ...", file=sys.stderr, flush=True)


def _missed(reproduction: "Reproduction") -> list[str]:
    return [
        f"missed: {claim.id} is outside {claim.window[0]:g} to {claim.window[1]:g} {claim.unit}"
        for claim in reproduction.missed
        if claim.window is not None
    ]
