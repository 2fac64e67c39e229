"""``ppafo gait``: the gaits that there are, and a gait from recorded files."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.cli import output
from ppafo.errors import DataError, UnitError, refused_as

if TYPE_CHECKING:
    from ppafo.gait import Gait
    from ppafo.gait.recorded import ImportedGait

_SIDES = ("right", "left")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    output.add_json_argument(_action(actions, "list", "list the gaits that come with the package"))
    showing = _action(actions, "show", "show and draw a gait")
    showing.add_argument("gait", metavar="GAIT", help="name of a gait, or a gait file (.toml)")
    showing.add_argument("--speed", metavar="SPEED", help="walking speed to scale to, such as '1.2 m/s'")
    output.add_output_arguments(showing)
    _add_import_arguments(_action(actions, "import", "make a gait from recorded files (.mot, .sto, .csv, .c3d, .trc)"))
    recording = _action(actions, "record", "write some strides of a gait as a synthetic recording")
    recording.add_argument("gait", metavar="GAIT", help="name of a gait, or a gait file (.toml)")
    recording.add_argument("--strides", metavar="N", default="10", help="number of strides; default 10")
    output.add_json_argument(recording)
    recording.add_argument("--out", metavar="FILE", type=Path, required=True, help="the .csv file to write")


def _action(
    actions: "argparse._SubParsersAction[argparse.ArgumentParser]", name: str, summary: str
) -> argparse.ArgumentParser:
    return actions.add_parser(name, help=summary, description=f"{summary[:1].upper()}{summary[1:]}.")


def _add_import_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path, help="files of one walk, on one clock")
    parser.add_argument(
        "--body-mass", metavar="MASS", help="mass of the wearer, such as '62 kg'; default: what a C3D file states"
    )
    parser.add_argument("--side", metavar="right|left", default="right", help="which foot; default right")
    parser.add_argument("--map", metavar="FILE", type=Path, help="gait map (.toml): which columns, units and signs")
    parser.add_argument(
        "--speed", metavar="SPEED", help="walking speed, such as '1.2 m/s'; needed to scale the gait later"
    )
    parser.add_argument(
        "--stature",
        metavar="LENGTH",
        help="stature of the wearer, such as '1.75 m'; gives the thigh length that OpenSim files lack",
    )
    parser.add_argument(
        "--low-pass", metavar="FREQUENCY", help="cutoff of a low-pass filter, such as '6 Hz'; default: none"
    )
    parser.add_argument(
        "--minimum-strides", metavar="N", help="minimum number of whole strides; default 2, overground 1"
    )
    parser.add_argument(
        "--form", metavar="FORM", default="", help="form of the files, such as opensim; default: what they look like"
    )
    parser.add_argument("--start", metavar="TIME", help="leave out what is before, such as '1.2 s'")
    parser.add_argument("--end", metavar="TIME", help="leave out what is after, such as '3.4 s'")
    parser.add_argument(
        "--fill-gaps", metavar="TIME", help="fill gaps up to this length, such as '0.1 s'; default: none"
    )
    parser.add_argument(
        "--ankle-neutral",
        metavar="ANGLE",
        help="reading of the ankle with the foot square to the shank, such as '3 deg'",
    )
    parser.add_argument("--name", metavar="NAME", default="imported-gait", help="name of the gait and of its file")
    parser.add_argument("--title", metavar="TEXT", default="", help="one line: who walks, and how")
    output.add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Run the action that was given."""
    actions = {"list": _list, "show": _show, "import": _import, "record": _record}
    return actions[parsed.action](parsed)


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.gait import list_gaits, load_gait

    titles = {name: load_gait(name).title for name in list_gaits()}
    width = max(map(len, titles))
    lines = [f"{name:<{width}}  {title}" for name, title in titles.items()]
    document = {"gaits": [{"name": name, "title": title} for name, title in titles.items()]}
    output.print_result("\n".join(lines), document, parsed.json)
    return output.EXIT_GOOD


def _show(parsed: argparse.Namespace) -> int:
    from ppafo.gait import at_speed, load_gait

    output.check_output(parsed)
    gait = load_gait(parsed.gait)
    if parsed.speed is not None:
        gait = at_speed(gait, _quantity("--speed", parsed.speed, "m/s"))
    return _deliver(gait, None, parsed)


def _import(parsed: argparse.Namespace) -> int:
    from ppafo.gait.recorded import ImportSettings, import_gait
    from ppafo.gait.recorded.mapping import load_map

    _check_side(parsed.side)
    settings = ImportSettings(
        body_mass=_optional("--body-mass", parsed.body_mass, "kg"),
        side=parsed.side,
        columns=None if parsed.map is None else load_map(parsed.map),
        walking_speed=_optional("--speed", parsed.speed, "m/s"),
        low_pass=_optional("--low-pass", parsed.low_pass, "Hz"),
        least_strides=None if parsed.minimum_strides is None else _whole("--minimum-strides", parsed.minimum_strides),
        name=parsed.name,
        title=parsed.title,
        stature=_optional("--stature", parsed.stature, "m"),
        start=_optional("--start", parsed.start, "s"),
        end=_optional("--end", parsed.end, "s"),
        form=parsed.form,
        longest_gap=_optional("--fill-gaps", parsed.fill_gaps, "s") or 0.0,
        ankle_neutral=_optional("--ankle-neutral", parsed.ankle_neutral, "rad"),
    )
    output.check_output(parsed)
    imported = import_gait(parsed.files, settings)
    return _deliver(imported.gait, imported, parsed)


def _check_side(side: str) -> None:
    if side not in _SIDES:
        raise DataError(f"--side {side!r}: must be right or left")


def _whole(option: str, text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 7):
        raise DataError(f"{option} {text!r}: must be a whole number, such as 2")
    return int(text)


def _quantity(option: str, text: str, si_unit: str) -> float:
    from ppafo.units import parse_quantity

    with refused_as(DataError, f"{option} {text!r}", UnitError):
        return parse_quantity(text, si_unit)


def _optional(option: str, text: str | None, si_unit: str) -> float | None:
    return None if text is None else _quantity(option, text, si_unit)


def _deliver(gait: "Gait", imported: "ImportedGait | None", parsed: argparse.Namespace) -> int:
    from ppafo.gait.answer import gait_answer

    return output.deliver_answer(gait_answer(gait, imported), parsed)


def _record(parsed: argparse.Namespace) -> int:
    from ppafo.gait import load_gait, walk_recording
    from ppafo.storage import write_csv

    if parsed.out.suffix.lower() != ".csv":
        raise DataError(f"--out {parsed.out}: a recording is written as .csv")
    output.check_new_file(parsed.out)
    recording = walk_recording(load_gait(parsed.gait), _whole("--strides", parsed.strides))
    write_csv(parsed.out, recording)
    document = {"file": str(parsed.out), "samples": len(recording), "channels": list(recording.names)}
    output.print_result(f"written: {parsed.out} ({len(recording)} samples, synthetic)", document, parsed.json)
    return output.EXIT_GOOD
