"""``ppafo validate PARAMETERS RECORDINGS``: replays recordings on the model and says how far apart they are."""

import argparse
from typing import TYPE_CHECKING

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_output_arguments,
    add_override_argument,
    check_output,
    print_result,
    tell,
    write_files,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing

if TYPE_CHECKING:
    from ppafo.storage.column_map import ColumnMap

_LONGEST_DELAY = "20 ms"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("parameters", metavar="PARAMETERS", help="name of a parameter set, or a .toml file")
    parser.add_argument(
        "recordings",
        metavar="RECORDING",
        nargs="+",
        help="a .csv or .nc file, or a result folder; several may be given",
    )
    parser.add_argument("--valve", metavar="NAME", help="a valve of the set; its default valve unless given")
    add_override_argument(parser)
    parser.add_argument(
        "--motion",
        metavar="free|measured|held",
        default="free",
        help="free: the model moves the vane; measured: it follows the recorded angle; held: it stays where it starts",
    )
    parser.add_argument(
        "--volume",
        metavar="VOLUME",
        help="no vane: chamber 1 is a fixed volume, '60 cm^3', filled and vented by the valve; pressure_1 is compared",
    )
    parser.add_argument(
        "--initial",
        metavar="CHANNEL=VALUE",
        action="append",
        default=[],
        help="where the replay starts, for a channel that was not recorded, for example 'pressure_2=0 psi_g'",
    )
    parser.add_argument(
        "--threshold",
        dest="thresholds",
        metavar="[CHANNEL=]LIMIT",
        action="append",
        default=[],
        help="largest RMS error, of full range or with a unit: 5%%, angle=10%%, 'pressure_1=3.7 psi_d'; default 10%%",
    )
    parser.add_argument(
        "--longest-delay",
        metavar="TIME",
        default=_LONGEST_DELAY,
        help=f"largest delay of the measurement that is looked for; default '{_LONGEST_DELAY}', '0 s' for none",
    )
    parser.add_argument(
        "--columns",
        metavar="FILE.toml[:NAME]",
        help="a column map, [columns.NAME], for recordings with columns of their own; a problem file may hold it",
    )
    add_output_arguments(parser)


def _column_map(text: str | None) -> "ColumnMap | None":
    """Return the map that is named as a file, and by name where the file has several."""
    from ppafo.storage.column_map import load_column_map

    if text is None:
        return None
    path, separator, name = text.rpartition(".toml:")
    return load_column_map(f"{path}.toml", name) if separator and name else load_column_map(text)


def run(parsed: argparse.Namespace) -> int:
    """Compare, print and write; 1 where an error is above its limit."""
    load_compiler()
    from ppafo.parameters import load_device
    from ppafo.reporting.agreement_files import REPORT, agreement_files
    from ppafo.reporting.agreement_table import agreement_document, agreement_table
    from ppafo.validation import ReplaySettings, parse_thresholds, validate
    from ppafo.validation.alignment import parse_limit
    from ppafo.validation.start import parse_initial
    from ppafo.validation.validate import check_motion, parse_volume

    atmosphere = load_device(parsed.parameters, parsed.valve, parsed.overrides).supply.atmospheric_pressure
    settings = ReplaySettings(
        motion=check_motion(parsed.motion),
        initial=parse_initial(parsed.initial, atmosphere),
        longest_delay=parse_limit(parsed.longest_delay),
        thresholds=parse_thresholds(parsed.thresholds),
        volume=parse_volume(parsed.volume),
    )
    columns = _column_map(parsed.columns)
    check_output(parsed)
    validation = validate(parsed.parameters, parsed.recordings, parsed.valve, parsed.overrides, settings, tell, columns)
    lines = agreement_table(validation)
    if parsed.out is not None:
        load_drawing()
        write_files(parsed, agreement_files(validation))
        lines += ["", f"report: {parsed.out / REPORT}"]
    print_result("\n".join(lines), agreement_document(validation), parsed.json)
    return EXIT_GOOD if validation.passes else EXIT_CHECK_FAILED
