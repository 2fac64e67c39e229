"""``ppafo firmware``: the controller of a scenario or a walk as firmware for a small processor."""

import argparse
import shlex
from pathlib import Path

from ppafo.cli import output
from ppafo.control.fixed.torque_laws import TARGETS, WALK_TARGETS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario or a walk, or a .toml file")
    parser.add_argument(
        "--target",
        choices=(*TARGETS, *WALK_TARGETS),
        help=f"the processor (default: {TARGETS[0]}, of a walk {WALK_TARGETS[0]})",
    )
    output.add_override_argument(parser)
    output.add_json_argument(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")


def run(parsed: argparse.Namespace) -> int:
    """Write the firmware of the controller of a scenario or a walk, and say what to do next."""
    output.check_output(parsed)
    from ppafo.exports.firmware import firmware
    from ppafo.exports.firmware.walking import walk_firmware
    from ppafo.loading import load_scenario
    from ppafo.simulation.scenario import worn_kind

    chosen = load_scenario(parsed.scenario, parsed.overrides)
    if worn_kind(chosen) is None:
        target = parsed.target or TARGETS[0]
        contents = firmware(chosen, target)
    else:
        target = parsed.target or WALK_TARGETS[0]
        contents = walk_firmware(chosen, target)
    output.write_files(parsed, contents)
    following = f"make -C {shlex.quote(str(parsed.out))}"
    document = {"folder": str(parsed.out), "target": target, "files": list(contents), "next": following}
    output.print_result(f"written: {parsed.out} ({', '.join(contents)}); next: {following}", document, parsed.json)
    return output.EXIT_GOOD
