"""``ppafo firmware``: the controller of a scenario as firmware for a small processor."""

import argparse
import shlex
from pathlib import Path

from ppafo.cli import output
from ppafo.control.fixed.torque_laws import TARGETS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario, or a .toml file")
    parser.add_argument("--target", choices=TARGETS, default=TARGETS[0], help=f"the processor (default: {TARGETS[0]})")
    output.add_override_argument(parser)
    output.add_json_argument(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")


def run(parsed: argparse.Namespace) -> int:
    """Write the firmware of the controller of a scenario, and say what to do next."""
    output.check_output(parsed)
    from ppafo.exports.firmware import firmware
    from ppafo.simulation.loading import load_scenario

    contents = firmware(load_scenario(parsed.scenario, parsed.overrides), parsed.target)
    output.write_files(parsed, contents)
    following = f"make -C {shlex.quote(str(parsed.out))}"
    document = {"folder": str(parsed.out), "target": parsed.target, "files": list(contents), "next": following}
    output.print_result(f"written: {parsed.out} ({', '.join(contents)}); next: {following}", document, parsed.json)
    return output.EXIT_GOOD
