"""``ppafo record --port PORT --out FILE.csv``: a recording from a bench that speaks the protocol."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.cli import output
from ppafo.cli.hil import EXIT_INTERRUPTED, LONGEST_PATIENCE, PORT_HELP, add_baud_argument, seconds_of
from ppafo.errors import DataError

if TYPE_CHECKING:
    from ppafo.exports.hil.recording import Recorded

_DEFAULT_PATIENCE = "5 s"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "--port", metavar="PORT", required=True, help=f"where the bench sends: {PORT_HELP}; UDP listens at the address"
    )
    add_baud_argument(parser)
    parser.add_argument("--duration", metavar="TIME", help="end after this time of the bench, for example '10 s'")
    parser.add_argument(
        "--patience",
        metavar="TIME",
        default=_DEFAULT_PATIENCE,
        help=f"end, or give up, after this time without a sample (default: '{_DEFAULT_PATIENCE}')",
    )
    output.add_json_argument(parser)
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the .csv file to write")


def run(parsed: argparse.Namespace) -> int:
    """Record until the bench or a person ends it; 1 where the port broke, 130 where Ctrl-C stopped it."""
    patience = seconds_of("--patience", parsed.patience, LONGEST_PATIENCE)
    duration = None if parsed.duration is None else seconds_of("--duration", parsed.duration)
    output.check_new_file(parsed.out)
    if parsed.out.suffix != ".csv":
        raise DataError(f"--out {parsed.out}: must end in .csv")
    from ppafo.storage.files import check_files_can_be_added

    with output.blame_out_option():
        check_files_can_be_added(parsed.out.parent, [parsed.out.name])
    from ppafo.exports.hil.loop import stop_by_interrupt
    from ppafo.exports.hil.recording import kept_aside, record
    from ppafo.exports.hil.wire import open_port
    from ppafo.storage.comma_separated import write_csv

    port = open_port(parsed.port, parsed.baud, listens=True)
    try:
        output.tell(f"listening at {parsed.port}")
        with stop_by_interrupt() as is_stopped, kept_aside(parsed.out) as keep:
            found = record(port, parsed.out.stem, duration, patience, is_stopped, keep=keep)
            write_csv(parsed.out, found.recording)
        is_broken = bool(port.failure)
    finally:
        port.close()
    from ppafo.exports.hil.wire import described_refusals

    recording = found.recording
    others = [*found.ignored.items(), ("of somebody else", found.strangers)]
    text = "\n".join(
        [
            f"{len(recording)} samples over {recording.duration:.6g} s, {recording.kind}: {', '.join(recording.names)}",
            f"lost     {found.lost} samples between the first and the last",
            f"dropped  {described_refusals(found.refused, others)}",
            f"ended    by {found.ended}",
            f"written: {parsed.out}",
        ]
    )
    output.print_result(text, _document(found, parsed.out), parsed.json)
    if found.is_stopped:
        print(f"ppafo: stopped; {parsed.out} is whole", file=sys.stderr)
        return EXIT_INTERRUPTED
    return output.EXIT_CHECK_FAILED if is_broken else output.EXIT_GOOD


def _document(found: "Recorded", path: Path) -> dict[str, Any]:
    recording = found.recording
    return {
        "file": str(path),
        "samples": len(recording),
        "duration": recording.duration,
        "kind": recording.kind,
        "channels": {name: recording.unit(name) for name in recording.names},
        "lost": found.lost,
        "refused": dict(found.refused),
        "ignored": dict(found.ignored),
        "strangers": found.strangers,
        "ended": found.ended,
    }
