"""``ppafo export``: what leaves the package for other tools."""

import argparse
import math
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppafo.cli import output
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.questions.question import minutes
from ppafo.units import number_text

_C = "write a scenario or a walk as a library in C: header, source, example, make files"
_UNIT = "write a scenario or a walk as a functional mock-up unit (FMU)"
_TABLES = "write a walk, a recording or a result in the names and signs of OpenSim (.sto)"
_CONTROLLER = "write a scenario's integer controller in C behind the protocol of 'ppafo hil'"
_FEW_STRIDES = 0.2
"""Minutes of a walk without a course for OpenSim, unless given."""
_RECORDINGS = (".csv", ".nc")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    library = actions.add_parser("c", help=_C, description=f"{_C[:1].upper()}{_C[1:]}.")
    controller = actions.add_parser(
        "controller", help=_CONTROLLER, description=f"{_CONTROLLER[:1].upper()}{_CONTROLLER[1:]}."
    )
    unit = actions.add_parser("fmu", help=_UNIT, description=f"{_UNIT[:1].upper()}{_UNIT[1:]}.")
    unit.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="version of FMI (default: 2)")
    for shown in (library, unit):
        shown.add_argument(
            "--interface",
            choices=("loop", "plant"),
            default="loop",
            help="the closed loop, or the plant alone under a command and the motion of its ankle (default: loop)",
        )
    unit.add_argument(
        "--platforms",
        metavar="LIST",
        help="what it is to run on, separated by commas: linux64, win64, ... (default: this computer)",
    )
    tables = _add_tables(actions)
    either = "name of a scenario or a walk, or a .toml file"
    moved = "name of a walk, or a .toml file; or a recording (.csv, .nc) or result folder"
    for parser_of_one, noun, said in (
        (library, "SCENARIO", either),
        (controller, "SCENARIO", "name of a scenario, or a .toml file"),
        (unit, "SCENARIO", either),
        (tables, "WALK", moved),
    ):
        parser_of_one.add_argument("scenario", metavar=noun, help=said)
        output.add_override_argument(parser_of_one)
        output.add_json_argument(parser_of_one)
        parser_of_one.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")


def _add_tables(actions: Any) -> argparse.ArgumentParser:
    tables: argparse.ArgumentParser = actions.add_parser(
        "opensim", help=_TABLES, description=f"{_TABLES[:1].upper()}{_TABLES[1:]}."
    )
    tables.add_argument("--gait", metavar="GAIT", help="of a walk: name of a gait, or a gait file")
    said = f"of a walk: time to walk; default: all of a course, else {_FEW_STRIDES:g}"
    tables.add_argument("--minutes", metavar="N", type=minutes, help=said)
    tables.add_argument("--side", choices=("right", "left"), default="right", help="which foot; default right")
    tables.add_argument(
        "--strikes",
        metavar="T1,T2,...",
        help="of a walk: heel strikes of your motion [s], to put the mean stride of the torque on "
        "(--strikes=-0.4,0.8 where time begins below 0); default: the walk as it is, from 0 s on",
    )
    tables.add_argument(
        "--body-mass", metavar="MASS", help="of a recording: for moments and forces per mass, such as '62 kg'"
    )
    return tables


def run(parsed: argparse.Namespace) -> int:
    """Write the files of a scenario for another tool, and say what to do next."""
    output.check_output(parsed)
    ways = {"c": _library, "controller": _controller, "fmu": _unit, "opensim": _tables}
    contents, following = ways[parsed.action](parsed)
    output.write_files(parsed, contents)
    document = {"folder": str(parsed.out), "files": list(contents), "next": following}
    output.print_result(f"written: {parsed.out} ({', '.join(contents)}); next: {following}", document, parsed.json)
    return output.EXIT_GOOD


def _library(parsed: argparse.Namespace) -> tuple[Mapping[str, bytes], str]:
    from ppafo.exports.c_library import c_library
    from ppafo.exports.c_library.plant import plant_library
    from ppafo.loading import load_scenario

    files_of = {"loop": c_library, "plant": plant_library}[parsed.interface]
    contents = files_of(load_scenario(parsed.scenario, parsed.overrides))
    return contents, f"make -C {shlex.quote(str(parsed.out))} check"


def _controller(parsed: argparse.Namespace) -> tuple[Mapping[str, bytes], str]:
    from ppafo.exports.hil.run import example_controller
    from ppafo.simulation.loading import load_scenario

    contents = example_controller(load_scenario(parsed.scenario, parsed.overrides))
    return contents, f"make -C {shlex.quote(str(parsed.out))}"


def _unit(parsed: argparse.Namespace) -> tuple[Mapping[str, bytes], str]:
    from ppafo.exports.fmu import closed_loop, functional_unit, plant_alone
    from ppafo.loading import load_scenario

    platforms = _platforms(parsed)
    interface = {"loop": closed_loop, "plant": plant_alone}[parsed.interface]
    contents = functional_unit(interface(load_scenario(parsed.scenario, parsed.overrides)), parsed.fmi, platforms)
    return contents, f"fmpy simulate {shlex.quote(str(parsed.out / next(iter(contents))))} --show-plot"


def _platforms(parsed: argparse.Namespace) -> list[str]:
    """The requested platforms without duplicates; by default that of this computer."""
    from ppafo.exports.fmu import host_platform

    chosen = [host_platform()] if parsed.platforms is None else parsed.platforms.split(",")
    return list(dict.fromkeys(name.strip() for name in chosen if name is not None))


def _tables(parsed: argparse.Namespace) -> tuple[Mapping[str, bytes], str]:
    """The tables of a recording, where a file or folder of that name is there, else of a walk."""
    path = Path(parsed.scenario)
    is_recording = path.suffix != ".toml" and (path.is_dir() or path.suffix.lower() in _RECORDINGS)
    of_walk, of_recording = ("--gait", "--minutes", "--strikes", "--set"), ("--body-mass",)
    given = {
        "--gait": parsed.gait,
        "--minutes": parsed.minutes,
        "--strikes": parsed.strikes,
        "--set": parsed.overrides or None,
        "--body-mass": parsed.body_mass,
    }
    for option in of_walk if is_recording else of_recording:
        if given[option] is not None:
            other = "a walk, not a recording" if is_recording else "a recording; a walk knows its wearer"
            raise DataError(f"{option}: is for {other}")
    return _recorded(parsed, path) if is_recording else _walked(parsed)


def _recorded(parsed: argparse.Namespace, path: Path) -> tuple[Mapping[str, bytes], str]:
    from ppafo.storage import read_recording
    from ppafo.storage.opensim import opensim_bytes, opensim_recording
    from ppafo.units import parse_quantity

    mass = None
    if parsed.body_mass is not None:
        with refused_as(DataError, f"--body-mass {parsed.body_mass!r}", UnitError):
            mass = parse_quantity(parsed.body_mass, "kg")
    recording, missing = opensim_recording(read_recording(path), parsed.side, mass)
    following = f"load {shlex.quote(str(parsed.out / 'recording.sto'))} in OpenSim; its header says units and signs"
    left_out = f"\nleft out: {', '.join(missing)}, which are per body mass: give --body-mass" if missing else ""
    return {"recording.sto": opensim_bytes(recording)}, f"{following}{left_out}"


def _walked(parsed: argparse.Namespace) -> tuple[Mapping[str, bytes], str]:
    from ppafo.exports.opensim import check_strikes, opensim_files
    from ppafo.walking.loading import load_walk
    from ppafo.walking.motion import check_led, walk_of
    from ppafo.walking.walk import walk

    strikes = () if parsed.strikes is None else _times(parsed.strikes)
    if parsed.strikes is not None:
        check_strikes(strikes)
    chosen = load_walk(parsed.scenario, parsed.overrides, parsed.gait)
    check_led(chosen, "a torque file for OpenSim")
    few_strides = _FEW_STRIDES if walk_of(chosen).course is None else None
    result = walk(chosen, few_strides if parsed.minutes is None else parsed.minutes)
    following = f"load {shlex.quote(str(parsed.out / 'device_torque.sto'))} in OpenSim; its header says units and signs"
    return opensim_files(result, parsed.side, strikes), following


def _times(text: str) -> tuple[float, ...]:
    """Return times [s] that are separated by commas; DataError for anything else."""
    try:
        times = tuple(float(number_text(part)) for part in text.split(","))
    except ValueError:
        times = (math.nan,)
    if not all(map(math.isfinite, times)):
        raise DataError(f"--strikes {text!r}: must be times in seconds, separated by commas, such as 0.63,1.86")
    return times
