"""Commands on gaits: list, display, import and recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from ppafo.arguments import (
    Angle,
    BodyMass,
    Count,
    File,
    Frequency,
    Gait,
    Length,
    Name,
    Speed,
    Time,
    Word,
)

if TYPE_CHECKING:
    from ppafo.cli.output import CommandOutput
    from ppafo.gait.finding import GaitFound
    from ppafo.report.finding import Finding


def gait_list() -> CommandOutput:
    """List the gaits that come with the package.

    >>> print(gait_list().text)
    falisse2019-subject1  Healthy adult, 62 kg, overground at 1.33 m/s
    """
    from ppafo.cli.output import listing
    from ppafo.gait import list_gaits, load_gait

    return listing("gait", [{"name": name, "title": load_gait(name).title} for name in list_gaits()])


def gait_show(gait: Gait, *, speed: Speed | None = None) -> Finding[GaitFound]:
    """Show and draw a gait.

    speed: walking speed to scale to, such as '1.2 m/s'

    >>> print(gait_show("falisse2019-subject1").said[0])
    falisse2019-subject1: Healthy adult, 62 kg, overground at 1.33 m/s (measured)
    """
    from ppafo.gait import at_speed, load_gait
    from ppafo.gait.finding import gait_finding

    return gait_finding(load_gait(gait) if speed is None else at_speed(load_gait(gait), speed))


def gait_import(
    files: Sequence[File],
    *,
    body_mass: BodyMass | None = None,
    side: Literal["right", "left"] = "right",
    map_: File | None = None,
    speed: Speed | None = None,
    stature: Length | None = None,
    low_pass: Frequency | None = None,
    minimum_strides: Count | None = None,
    stride_time: Time | None = None,
    form: Annotated[str, Word("FORM")] = "",
    start: Time | None = None,
    end: Time | None = None,
    fill_gaps: Time = 0.0,
    ankle_neutral: Angle | None = None,
    name: Name = "imported-gait",
    title: str = "",
) -> Finding[GaitFound]:
    """Make a gait from recorded files (.mot, .sto, .csv, .txt, .tsv, .emt, .c3d, .trc, .mat).

    files: files of one walk, on one clock
    body_mass: mass of the wearer, such as '62 kg'; default: what a C3D file states
    side: which foot; default right
    map_: gait map (.toml): which columns, units and signs
    speed: walking speed, such as '1.2 m/s'; needed to scale the gait later
    stature: stature of the wearer, such as '1.75 m'; gives the thigh length that OpenSim files lack
    low_pass: cutoff of a low-pass filter, such as '6 Hz'; default: none
    minimum_strides: minimum number of whole strides; default 2, overground 1
    stride_time: duration of a mean stride over percent, such as '1.1 s'
    form: form of the files, such as opensim; default: what they look like
    start: leave out what is before, such as '1.2 s'
    end: leave out what is after, such as '3.4 s'
    fill_gaps: fill gaps up to this length, such as '0.1 s'; default: none
    ankle_neutral: reading of the ankle with the foot square to the shank, such as '3 deg'
    name: name of the gait and of its file
    title: one line: who walks, and how

    >>> from pathlib import Path
    >>> written = gait_record("falisse2019-subject1", out=Path("strides.csv"))
    >>> print(gait_import([Path("strides.csv")], body_mass=62.0).said[0])
    imported-gait: Mean of 9 strides, right foot (synthetic)
    """
    from ppafo.gait.finding import gait_finding
    from ppafo.gait.recorded import ImportSettings, import_gait
    from ppafo.gait.recorded.mapping import load_map

    settings = ImportSettings(
        body_mass=body_mass,
        side=side,
        columns=None if map_ is None else load_map(map_),
        walking_speed=speed,
        low_pass=low_pass,
        least_strides=minimum_strides,
        stride_time=stride_time,
        name=name,
        title=title,
        stature=stature,
        start=start,
        end=end,
        form=form,
        longest_gap=fill_gaps,
        ankle_neutral=ankle_neutral,
    )
    imported = import_gait(files, settings)
    return gait_finding(imported.gait, imported)


def gait_record(gait: Gait, *, strides: Count = 10, out: File) -> CommandOutput:
    """Write some strides of a gait as a synthetic recording.

    strides: number of strides; default 10
    out: the .csv file to write

    >>> from pathlib import Path
    >>> print(gait_record("falisse2019-subject1", strides=2, out=Path("strides.csv")).text)
    written: strides.csv (417 samples, synthetic)
    """
    from ppafo.cli.output import CommandOutput, check_new_file
    from ppafo.errors import DataError
    from ppafo.gait import load_gait, walk_recording
    from ppafo.storage import write_csv

    if out.suffix.lower() != ".csv":
        raise DataError(f"--out {out}: the name must end in .csv")
    check_new_file(out)
    recording = walk_recording(load_gait(gait), strides)
    write_csv(out, recording)
    document = {"file": str(out), "samples": len(recording), "channels": list(recording.names)}
    return CommandOutput(f"written: {out} ({len(recording)} samples, synthetic)", document)
