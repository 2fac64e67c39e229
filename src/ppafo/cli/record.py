"""``ppafo rig record --port PORT --out FILE.csv``: a recording from a bench that speaks the protocol."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.cli import output
from ppafo.cli.arguments import Count, File, Patience, Port, Time
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, EXIT_INTERRUPTED, Said
from ppafo.errors import DataError

if TYPE_CHECKING:
    from ppafo.exports.hil.recording import Recorded


def rig_record(
    *, port: Port, baud: Count = 921600, duration: Time | None = None, patience: Patience = 5.0, out: File
) -> Said:
    """Record a bench that speaks the protocol of 'ppafo hil'.

    Exit code 1 where the port broke, 130 where Ctrl-C stopped it.

    port: where the bench sends: udp:HOST:PORT or serial:DEVICE (extra 'hil'); UDP listens at the address
    baud: bits per second of a serial line; default 921600
    duration: end after this time of the bench, for example '10 s'
    patience: end, or give up, after this time without a sample; default '5 s'
    out: the .csv file to write
    """
    if duration is not None and duration <= 0.0:
        raise DataError("--duration: must be above 0 s")
    output.check_new_file(out)
    if out.suffix != ".csv":
        raise DataError(f"--out {out}: must end in .csv")
    from ppafo.storage.files import check_files_can_be_added

    with output.blame_out_option():
        check_files_can_be_added(out.parent, [out.name])
    from ppafo.exports.hil.loop import stop_by_interrupt
    from ppafo.exports.hil.recording import kept_aside, record
    from ppafo.exports.hil.wire import open_port
    from ppafo.storage.comma_separated import write_csv

    wire = open_port(port, baud, listens=True)
    try:
        output.tell(f"listening at {port}")
        with stop_by_interrupt() as is_stopped, kept_aside(out) as keep:
            found = record(wire, out.stem, duration, patience, is_stopped, keep=keep)
            write_csv(out, found.recording)
        is_broken = bool(wire.failure)
    finally:
        wire.close()
    from ppafo.exports.hil.wire import described_refusals

    recording = found.recording
    others = [*found.ignored.items(), ("of somebody else", found.strangers)]
    text = "\n".join(
        [
            f"{len(recording)} samples over {recording.duration:.6g} s, {recording.kind}: {', '.join(recording.names)}",
            f"lost     {found.lost} samples between the first and the last",
            f"dropped  {described_refusals(found.refused, others)}",
            f"ended    by {found.ended}",
            f"written: {out}",
        ]
    )
    code = EXIT_INTERRUPTED if found.is_stopped else EXIT_CHECK_FAILED if is_broken else EXIT_GOOD
    aside = f"stopped; {out} is whole" if found.is_stopped else ""
    return Said(text, _document(found, out), exit_code=code, aside=aside)


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
