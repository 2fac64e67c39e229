"""``ppafo export opensim``: a walk or a recording with the names and signs of OpenSim."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from ppafo.arguments import BodyMass, Folder, Gait, Minutes, Overrides, Word
from ppafo.arguments.reading import times
from ppafo.cli import output
from ppafo.cli.output import CommandOutput
from ppafo.errors import DataError

COMMAND = "export opensim"
_RECORDINGS = (".csv", ".nc")


Side = Literal["right", "left"]
# One text has all times, so that for the command line this is no option that is repeated.
Strikes = Annotated[Any, Word("T1,T2,...", times)]


def export_opensim(
    walk: Annotated[str, Word("WALK")],
    *,
    gait: Gait | None = None,
    minutes: Minutes | None = None,
    side: Side = "right",
    strikes: Strikes | None = None,
    body_mass: BodyMass | None = None,
    overrides: Overrides = (),
    out: Folder,
) -> CommandOutput:
    """Write a walk, a recording or a result in the names and signs of OpenSim (.sto).

    walk: name of a walk, or a .toml file; or a recording (.csv, .nc) or result folder
    gait: of a walk: name of a gait, or a gait file
    minutes: of a walk: time to walk; default 0.2
    side: which foot; default right
    strikes: of a walk: heel strikes of your motion [s], to put the mean stride of the torque on
        (--strikes=-0.4,0.8 where time begins below 0); default: the walk as it is, from 0 s on
    body_mass: of a recording: for moments and forces per mass, such as '62 kg'
    out: the folder to write

    >>> print(export_opensim("solenoid", minutes=0.1, out=Path("motion")).text)
    written: motion (device_torque.sto, walk.sto); next: load motion/device_torque.sto in OpenSim; its header says
    units and signs
    """
    path = Path(walk)
    is_recording = path.suffix != ".toml" and (path.is_dir() or path.suffix.lower() in _RECORDINGS)
    of_walk = {"--gait": gait, "--minutes": minutes, "--strikes": strikes, "--set": overrides or None}
    for option, value in (of_walk if is_recording else {"--body-mass": body_mass}).items():
        if value is not None:
            other = "a walk, not for a recording" if is_recording else "a recording; a walk states the body mass"
            raise DataError(f"{option} is allowed only for {other}")
    from ppafo.exports.opensim import FEW_STRIDES, check_strikes, opensim_files
    from ppafo.storage.opensim import opensim_bytes, opensim_recording
    from ppafo.storage.reading import read_recording
    from ppafo.walking.loading import check_duration_once, load_walk
    from ppafo.walking.walk import walk as walked

    # Known once the files are made, and said after that.
    missing: list[str] = []

    def make() -> dict[str, bytes]:
        if not is_recording:
            if strikes is not None:
                check_strikes(strikes)
            check_duration_once(overrides, minutes)
            chosen = load_walk(walk, overrides, gait=gait)
            result = walked(chosen, minutes=FEW_STRIDES if minutes is None else minutes)
            return opensim_files(result, side, strikes or ())
        recording, found = opensim_recording(read_recording(path), side, body_mass)
        missing.extend(found)
        return {"recording.sto": opensim_bytes(recording)}

    def following(_: Sequence[str]) -> str:
        file = shlex.quote(str(out / ("recording.sto" if is_recording else "device_torque.sto")))
        left_out = (
            f"\nleft out: {', '.join(missing)}, which are per body mass; to export them, give --body-mass"
            if missing
            else ""
        )
        return f"load {file} in OpenSim; its header says units and signs{left_out}"

    return output.export(out, COMMAND, make, following)
