"""``ppafo export``: a scenario or a walk for other tools."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from ppafo.cli import output
from ppafo.cli.output import Said
from ppafo.errors import DataError

_FEW_STRIDES = 0.2
"""Minutes of a walk without a course for OpenSim, unless given."""
_RECORDINGS = (".csv", ".nc")


def c_files(name: str, interface: Literal["loop", "plant"], overrides: Sequence[str], out: Path) -> Said:
    """Write a scenario or a walk as a library in C, and return what to do next."""
    output.check_output(out, "export c")
    from ppafo.exports.c_library import c_library
    from ppafo.exports.c_library.plant import plant_library
    from ppafo.loading import load_scenario

    files_of = {"loop": c_library, "plant": plant_library}[interface]
    contents = files_of(load_scenario(name, overrides))
    output.write_files(out, contents, "export c")
    return output.write_for(out, contents, f"make -C {shlex.quote(str(out))} check")


def controller_files(name: str, overrides: Sequence[str], out: Path) -> Said:
    """Write the integer controller of a scenario in C behind the protocol of ``ppafo hil``."""
    output.check_output(out, "export controller")
    from ppafo.exports.hil.run import example_controller
    from ppafo.simulation.loading import load_scenario

    contents = example_controller(load_scenario(name, overrides))
    output.write_files(out, contents, "export controller")
    return output.write_for(out, contents, f"make -C {shlex.quote(str(out))}")


def unit_files(
    name: str,
    interface: Literal["loop", "plant"],
    fmi: Literal["2", "3"],
    platforms: str | None,
    overrides: Sequence[str],
    out: Path,
) -> Said:
    """Write a scenario or a walk as a functional mock-up unit, and return what to do next."""
    output.check_output(out, "export fmu")
    from ppafo.exports.fmu import closed_loop, functional_unit, host_platform, plant_alone
    from ppafo.loading import load_scenario

    chosen = [host_platform()] if platforms is None else platforms.split(",")
    wanted = list(dict.fromkeys(one.strip() for one in chosen if one is not None))
    made = {"loop": closed_loop, "plant": plant_alone}[interface]
    contents = functional_unit(made(load_scenario(name, overrides)), int(fmi), wanted)
    output.write_files(out, contents, "export fmu")
    following = f"fmpy simulate {shlex.quote(str(out / next(iter(contents))))} --show-plot"
    return output.write_for(out, contents, following)


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
    output.check_output(out, "export opensim")
    path = Path(name)
    is_recording = path.suffix != ".toml" and (path.is_dir() or path.suffix.lower() in _RECORDINGS)
    of_walk = {"--gait": gait, "--minutes": minutes, "--strikes": strikes, "--set": overrides or None}
    for option, value in (of_walk if is_recording else {"--body-mass": body_mass}).items():
        if value is not None:
            other = "a walk, not a recording" if is_recording else "a recording; a walk knows its wearer"
            raise DataError(f"{option}: is for {other}")
    if is_recording:
        contents, following = _recorded(path, side, body_mass, out)
    else:
        contents, following = _walked(name, overrides, gait, minutes, side, strikes, out)
    output.write_files(out, contents, "export opensim")
    return output.write_for(out, contents, following)


def _recorded(
    path: Path, side: Literal["right", "left"], mass: float | None, out: Path
) -> tuple[Mapping[str, bytes], str]:
    from ppafo.storage import read_recording
    from ppafo.storage.opensim import opensim_bytes, opensim_recording

    recording, missing = opensim_recording(read_recording(path), side, mass)
    following = f"load {shlex.quote(str(out / 'recording.sto'))} in OpenSim; its header says units and signs"
    left_out = f"\nleft out: {', '.join(missing)}, which are per body mass: give --body-mass" if missing else ""
    return {"recording.sto": opensim_bytes(recording)}, f"{following}{left_out}"


def _walked(
    name: str,
    overrides: Sequence[str],
    gait: str | Path | None,
    minutes: float | None,
    side: Literal["right", "left"],
    strikes: tuple[float, ...] | None,
    out: Path,
) -> tuple[Mapping[str, bytes], str]:
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
    following = f"load {shlex.quote(str(out / 'device_torque.sto'))} in OpenSim; its header says units and signs"
    return opensim_files(result, side, strikes or ()), following
