"""``ppafo reproduce``: runs the paper's experiments and reports against its claims."""

import argparse
from typing import TYPE_CHECKING

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    named_option,
    print_result,
    tell,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing

if TYPE_CHECKING:
    from ppafo.studies.reproduction import Reproduction


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    add_override_argument(parser)
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print the claims; 1 where a number misses the window that it has to meet, unless values were changed."""
    load_compiler()
    from ppafo.reporting.claims_table import claims_table
    from ppafo.reporting.reproduction_files import (
        REPORT,
        check_reproduction_folder,
        claims_document,
        reproduction_files,
        write_reproduction,
    )
    from ppafo.studies.reproduction import reproduce

    if parsed.out is not None:
        with named_option():
            check_reproduction_folder(parsed.out)
    reproduction = reproduce(parsed.overrides, tell)
    lines = [*_changed(parsed.overrides), *claims_table(reproduction.claims), *_missed(reproduction)]
    if parsed.out is not None:
        tell("drawing the figures and writing the report")
        load_drawing()
        write_reproduction(parsed.out, reproduction_files(reproduction))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), claims_document(reproduction), parsed.json)
    return EXIT_CHECK_FAILED if reproduction.missed and not parsed.overrides else EXIT_GOOD


def _changed(overrides: list[str]) -> list[str]:
    """A line that says whose device the verdicts are about, where something was changed."""
    if not overrides:
        return []
    return [
        f"not the paper's device: changed with --set {', '.join(overrides)}; the verdicts compare it all the same",
        "",
    ]


def _missed(reproduction: "Reproduction") -> list[str]:
    return [
        f"missed: {claim.id} is outside {claim.window[0]:g} to {claim.window[1]:g} {claim.unit}"
        for claim in reproduction.missed
        if claim.window is not None
    ]
