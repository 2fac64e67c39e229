"""``ppafo workbench SCENARIO...``: scenarios and walks as one page that simulates in the browser."""

import argparse
from pathlib import Path

from ppafo.cli import output

DEFAULT_FILE = Path("out") / "workbench.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "scenarios",
        metavar="SCENARIO",
        nargs="*",
        help="names of scenarios and walks, or .toml files; default: the torque task, step response and a walk",
    )
    output.add_override_argument(parser)
    output.add_json_argument(parser)
    parser.add_argument(
        "--out", metavar="FILE", type=Path, default=DEFAULT_FILE, help=f"the page to write; default {DEFAULT_FILE}"
    )


def run(parsed: argparse.Namespace) -> int:
    """Write a page, in the place of an earlier one of this command but of no other file."""
    from ppafo.live.page import is_page
    from ppafo.live.workbench import DEFAULT, workbench
    from ppafo.storage.files import write_file

    if not is_page(parsed.out):
        output.check_new_file(parsed.out)
    scenarios = parsed.scenarios or list(DEFAULT)
    page = workbench(scenarios, parsed.overrides)
    write_file(parsed.out, page)
    document = {"file": str(parsed.out), "bytes": len(page), "scenarios": scenarios}
    output.print_result(
        f"written: {parsed.out} ({len(page) / 1e3:.0f} kB, {', '.join(scenarios)})", document, parsed.json
    )
    return output.EXIT_GOOD
