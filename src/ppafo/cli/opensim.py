"""``ppafo export opensim``: a walk or a recording in the names and signs of OpenSim."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from ppafo.cli import output
from ppafo.cli.output import Said
from ppafo.errors import DataError

COMMAND = "export opensim"
_FEW_STRIDES = 0.2
"""Minutes of a walk without a course for OpenSim, unless given."""
_RECORDINGS = (".csv", ".nc")


def opensim_tables(
    name: str,
    gait: str | Path | None,
    minutes: float | None,
    side: Literal["right", "left"],
    strikes: tuple[float, ...] | None,
    body_mass: float | None,
    overrides: Sequence[str],
    out: Path,
) -> Said:
    """Write the tables of a recording, where a file or folder of that name is there, else of a walk."""
    path = Path(name)
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
        lambda: _walked(name, overrides, gait, minutes, side, strikes),
        lambda _: _next(out, "device_torque.sto"),
    )


def _next(out: Path, file: str) -> str:
    return f"load {shlex.quote(str(out / file))} in OpenSim; its header says units and signs"


def _recorded(path: Path, side: Literal["right", "left"], mass: float | None, out: Path) -> Said:
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
    side: Literal["right", "left"],
    strikes: tuple[float, ...] | None,
) -> Mapping[str, bytes]:
    from ppafo.exports.opensim import check_strikes, opensim_files
    from ppafo.walking.loading import load_walk
    from ppafo.walking.motion import check_led, walk_of
    from ppafo.walking.walk import walk

    if strikes is not None:
        check_strikes(strikes)
    chosen = load_walk(name, overrides, gait)
    check_led(chosen, "a torque file for OpenSim")
    few_strides = _FEW_STRIDES if walk_of(chosen).course is None else None
    result = walk(chosen, few_strides if minutes is None else minutes)
    return opensim_files(result, side, strikes or ())
