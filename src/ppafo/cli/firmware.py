"""``ppafo firmware``: a scenario's controller, or its plant, as firmware for a small processor."""

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
from ppafo.control.fixed.kind import PLANT_TARGETS, TARGETS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario, or a .toml file")
    parser.add_argument("--target", choices=TARGETS, default=TARGETS[0], help=f"the processor (default: {TARGETS[0]})")
    parser.add_argument(
        "--plant", action="store_true", help=f"write the plant instead of the controller ({', '.join(PLANT_TARGETS)})"
    )
    add_override_argument(parser)
    add_json_argument(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")


def run(parsed: argparse.Namespace) -> int:
    """Write the firmware of a scenario's controller or plant, and say what to do next."""
    check_output(parsed)
    from ppafo.exports.firmware import firmware
    from ppafo.exports.firmware.plant import plant_firmware
    from ppafo.simulation.loading import load_scenario

    write = plant_firmware if parsed.plant else firmware
    contents = write(load_scenario(parsed.scenario, parsed.overrides), parsed.target)
    write_files(parsed, contents)
    following = f"make -C {shlex.quote(str(parsed.out))}"
    document = {"folder": str(parsed.out), "target": parsed.target, "files": list(contents), "next": following}
    print_result(f"written: {parsed.out} ({', '.join(contents)}); next: {following}", document, parsed.json)
    return EXIT_GOOD
