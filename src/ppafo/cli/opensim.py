"""``ppafo export opensim``: a walk or a recording in the names and signs of OpenSim."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

from ppafo.cli import output
from ppafo.cli.arguments import Folder, Gait, Mass, Minutes, Overrides, Word, times
from ppafo.cli.output import Said
from ppafo.errors import DataError

COMMAND = "export opensim"
_FEW_STRIDES = 0.2
"""Minutes of a walk without a course for OpenSim, unless given."""
_RECORDINGS = (".csv", ".nc")


Side = Literal["right", "left"]
Strikes = Annotated["tuple[float, ...]", Word("T1,T2,...", times)]


def export_opensim(
    walk: Annotated[str, Word("WALK")],
    *,
    gait: Gait | None = None,
    minutes: Minutes | None = None,
    side: Side = "right",
    strikes: Strikes | None = None,
    body_mass: Mass | None = None,
    overrides: Overrides = (),
    out: Folder,
) -> Said:
    """Write a walk, a recording or a result in the names and signs of OpenSim (.sto).

    walk: name of a walk, or a .toml file; or a recording (.csv, .nc) or result folder
    gait: of a walk: name of a gait, or a gait file
    minutes: of a walk: time to walk; default: all of a course, else 0.2
    side: which foot; default right
    strikes: of a walk: heel strikes of your motion [s], to put the mean stride of the torque on
        (--strikes=-0.4,0.8 where time begins below 0); default: the walk as it is, from 0 s on
    body_mass: of a recording: for moments and forces per mass, such as '62 kg'
    out: the folder to write
    """
    path = Path(walk)
    is_recording = path.suffix != ".toml" and (path.is_dir() or path.suffix.lower() in _RECORDINGS)
    of_walk = {"--gait": gait, "--minutes": minutes, "--strikes": strikes, "--set": overrides or None}
    for option, value in (of_walk if is_recording else {"--body-mass": body_mass}).items():
        if value is not None:
            other = "a walk, not a recording" if is_recording else "a recording; a walk knows its wearer"
            raise DataError(f"{option}: is for {other}")
    if is_recording:
        return _recorded(path, side, body_mass, out)
    return output.export(
        out,
        COMMAND,
        lambda: _walked(walk, overrides, gait, minutes, side, strikes),
        lambda _: _next(out, "device_torque.sto"),
    )


def _next(out: Path, file: str) -> str:
    return f"load {shlex.quote(str(out / file))} in OpenSim; its header says units and signs"


def _recorded(path: Path, side: Side, mass: float | None, out: Path) -> Said:
    from ppafo.storage import read_recording
    from ppafo.storage.opensim import opensim_bytes, opensim_recording

    missing: list[str] = []

    def make() -> dict[str, bytes]:
        recording, found = opensim_recording(read_recording(path), side, mass)
        missing.extend(found)
        return {"recording.sto": opensim_bytes(recording)}

    def following(_: Sequence[str]) -> str:
        left_out = f"\nleft out: {', '.join(missing)}, which are per body mass: give --body-mass" if missing else ""
        return f"{_next(out, 'recording.sto')}{left_out}"

    return output.export(out, COMMAND, make, following)


def _walked(
    name: str,
    overrides: Sequence[str],
    gait: str | Path | None,
    minutes: float | None,
    side: Side,
    strikes: tuple[float, ...] | None,
) -> Mapping[str, bytes]:
    from ppafo.exports.opensim import check_strikes, opensim_files
    from ppafo.walking.loading import check_duration_once, load_walk
    from ppafo.walking.motion import check_led, walk_of
    from ppafo.walking.walk import walk

    if strikes is not None:
        check_strikes(strikes)
    check_duration_once(overrides, minutes)
    chosen = load_walk(name, overrides, gait)
    check_led(chosen, "a torque file for OpenSim")
    few_strides = _FEW_STRIDES if walk_of(chosen).course is None else None
    result = walk(chosen, few_strides if minutes is None else minutes)
    return opensim_files(result, side, strikes or ())
