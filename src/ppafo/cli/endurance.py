"""``ppafo endurance``: how long a bottle lasts for a gas use, how cold it gets, and why it ends."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.cli.output import EXIT_GOOD, add_json_argument, add_override_argument, named_option, print_result
from ppafo.cli.quick_imports import load_drawing
from ppafo.errors import DataError, ParameterError, UnitError

if TYPE_CHECKING:
    from ppafo.storage.owned_folder import FolderKind
    from ppafo.studies.endurance import Bottle, Endurance, Schedule

_STEP_TIME = "1.1 s"
_WALK, _REST, _LONGEST = "10 min", "0 s", "1440 min"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "recordings",
        metavar="RECORDING",
        nargs="*",
        type=Path,
        help="a .csv or .nc file with supplied_mass, a result folder or that of a walk; repeated for ever; several "
        "are shown side by side",
    )
    parser.add_argument("--gas-per-step", metavar="MASS", help="gas of one step, for example '0.3 g'")
    parser.add_argument(
        "--step-time",
        metavar="TIME",
        help=f"time of one step; default '{_STEP_TIME}', or all of the recording, or a stride of a walk",
    )
    parser.add_argument("--peak-flow", metavar="FLOW", help="largest flow, for example '4.5 g/s'; default the mean one")
    parser.add_argument("--bottle", metavar="BOTTLE", help="name of a bottle or a .toml file; default the paper's")
    parser.add_argument("--list", action="store_true", help="list the bottles that come with the package")
    parser.add_argument("--walk", metavar="TIME", default=_WALK, help=f"walking between two rests; default '{_WALK}'")
    parser.add_argument("--rest", metavar="TIME", default=_REST, help="rest after it; default '0 s', no rest at all")
    parser.add_argument(
        "--longest", metavar="TIME", default=_LONGEST, help=f"where to stop in any case; default '{_LONGEST}'"
    )
    parser.add_argument(
        "--reuse",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="reuse the exhaust for dorsiflexion, for example 'reservoir_volume=50 cm^3'; what is not given of the "
        "chambers is taken from a walk; may be given again",
    )
    add_override_argument(parser)
    add_json_argument(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, help="also write report, figure, course and JSON here")


def run(parsed: argparse.Namespace) -> int:
    """Follow the bottle, print and write."""
    if parsed.list:
        return _list(parsed)
    from ppafo.studies.endurance import Schedule, load_bottle
    from ppafo.studies.endurance.bottle import PAPER_BOTTLE

    if bool(parsed.recordings) == (parsed.gas_per_step is not None):
        raise ParameterError("give either a recording or --gas-per-step, for example --gas-per-step '0.3 g'")
    bottle = load_bottle(parsed.bottle or PAPER_BOTTLE, parsed.overrides)
    schedule = Schedule(
        _quantity("--walk", parsed.walk, "s"),
        _quantity("--rest", parsed.rest, "s"),
        _quantity("--longest", parsed.longest, "s"),
    )
    return (_several if len(parsed.recordings) > 1 else _one)(parsed, bottle, schedule)


def _one(parsed: argparse.Namespace, bottle: "Bottle", schedule: "Schedule") -> int:
    from ppafo.reporting.endurance_report import endurance_document, endurance_files, endurance_text
    from ppafo.storage.owned_folder import check_owned_folder, write_owned_folder

    kind = _folder_kind()
    if parsed.out is not None:
        with named_option():
            check_owned_folder(parsed.out, kind)
    if parsed.recordings:
        made = _of_recording(parsed.recordings[0], parsed, bottle, schedule)
    else:
        made = _of_numbers(parsed, bottle, schedule)
    lines = endurance_text(made)
    if parsed.out is not None:
        load_drawing()
        write_owned_folder(parsed.out, endurance_files(made), kind)
        lines += ["", f"written: {parsed.out}"]
    print_result("\n".join(lines), endurance_document(made), parsed.json)
    return EXIT_GOOD


def _several(parsed: argparse.Namespace, bottle: "Bottle", schedule: "Schedule") -> int:
    from ppafo.reporting.endurance_report import endurance_document
    from ppafo.reporting.endurance_table import endurance_table

    if parsed.out is not None:
        raise ParameterError("--out writes the course of one recording; give one, or leave --out away")
    names = [str(path) for path in parsed.recordings]
    if len(set(names)) < len(names):
        raise ParameterError("the same recording is given twice")
    made = {str(path): _of_recording(path, parsed, bottle, schedule) for path in parsed.recordings}
    document = {"recordings": {name: endurance_document(one) for name, one in made.items()}}
    print_result("\n".join(endurance_table(made)), document, parsed.json)
    return EXIT_GOOD


def _of_numbers(parsed: argparse.Namespace, bottle: "Bottle", schedule: "Schedule") -> "Endurance":
    from ppafo.studies.endurance import draw_of_numbers, endurance, parse_reuse

    mass = _quantity("--gas-per-step", parsed.gas_per_step, "kg")
    step_time = _quantity("--step-time", parsed.step_time or _STEP_TIME, "s")
    peak = None if parsed.peak_flow is None else _quantity("--peak-flow", parsed.peak_flow, "kg/s")
    plan = parse_reuse(parsed.reuse, bottle) if parsed.reuse else None
    return endurance(bottle, draw_of_numbers(mass, step_time, peak), schedule, plan)


def _of_recording(path: Path, parsed: argparse.Namespace, bottle: "Bottle", schedule: "Schedule") -> "Endurance":
    from ppafo.storage.recordings import read_recording
    from ppafo.studies.endurance import draw_of_recording, endurance, parse_reuse
    from ppafo.studies.endurance.of_walk import endurance_of_walked
    from ppafo.studies.endurance.walked import is_walk_folder, read_walked

    if parsed.peak_flow is not None:
        raise ParameterError("--peak-flow belongs to --gas-per-step; a recording says its largest flow itself")
    if is_walk_folder(path):
        if parsed.step_time is not None:
            raise ParameterError(f"--step-time: a step of {path} is a stride of its walk; leave it away")
        return endurance_of_walked(read_walked(path), bottle, schedule, parsed.reuse)
    step_time = None if parsed.step_time is None else _quantity("--step-time", parsed.step_time, "s")
    plan = parse_reuse(parsed.reuse, bottle) if parsed.reuse else None
    return endurance(bottle, draw_of_recording(read_recording(path), step_time), schedule, plan)


def _quantity(option: str, text: str, unit: str) -> float:
    from ppafo.units import parse_quantity

    try:
        return parse_quantity(text, unit)
    except UnitError as error:
        raise ParameterError(f"{option} {text}: {error}") from error


def _folder_kind() -> "FolderKind":
    from ppafo.reporting.endurance_report import DOCUMENT, FILES, FORMAT
    from ppafo.storage.owned_folder import FolderKind, read_json

    def files_of(folder: Path) -> tuple[str, ...]:
        document = read_json(folder / DOCUMENT)
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            raise DataError(f"{folder / DOCUMENT}: is not of 'ppafo endurance' (its 'format' is not '{FORMAT}')")
        return FILES

    return FolderKind("result of 'ppafo endurance'", DOCUMENT, files_of)


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.studies.endurance import list_bottles, load_bottle

    titles = {name: load_bottle(name).title for name in list_bottles()}
    width = max(map(len, titles))
    text = "\n".join(f"{name:<{width}}  {title}" for name, title in titles.items())
    bottles = [{"name": name, "title": title} for name, title in titles.items()]
    print_result(text, {"bottles": bottles}, parsed.json)
    return EXIT_GOOD
