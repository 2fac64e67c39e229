"""Recordings written as tables of OpenSim (``.sto``); ``gait/recorded/forms/opensim.py`` reads them."""

import re
from pathlib import Path

from ppafo.signals import Recording
from ppafo.signals.recording import TIME
from ppafo.storage.files import write_file
from ppafo.wording import one_line

END = "endheader"
"""Last line of the header."""
KIND = "kind="
"""Header key for the kind of a recording that was not measured, in files of this package."""
_SIGNS = {
    r"(healthy_)?ankle_angle_[rl]": "is 0 with the foot square to the shank and above 0 in dorsiflexion",
    r"ankle_angle_[rl]_speed": "is above 0 towards dorsiflexion",
    r"ankle_angle_[rl]_moment": "is what the wearer gives, above 0 in dorsiflexion",
    r"ankle_angle_[rl]_device(_moment)?": "is what the device gives the wearer, above 0 in dorsiflexion",
    r"ground_force_[rl]_vy": "is above 0 upward",
}
"""Sign conventions for the header, by column name of OpenSim."""


def opensim_bytes(recording: Recording) -> bytes:
    """Return the ``.sto`` file of a recording: SI units, angles in radians, labels ``time`` and channel names.

    The header states units and signs as text, which OpenSim preserves, and the kind of a recording that was not
    measured.
    """
    units = ", ".join(f"{name} [{recording.unit(name)}]" for name in recording.names)
    signs = [f"{name} {sign}" for name in recording.names for form, sign in _SIGNS.items() if re.fullmatch(form, name)]
    signs.append(f"{'other columns' if signs else 'columns'} have the signs of ppafo")
    head = [
        one_line(recording.label),
        "version=1",
        f"nRows={len(recording)}",
        f"nColumns={1 + len(recording.names)}",
        "inDegrees=no",
        f"{KIND}{recording.kind}",
        f"units={units}",
        f"signs={'; '.join(signs)}",
        END,
        "\t".join((TIME, *recording.names)),
    ]
    columns = [recording.time, *(recording[name] for name in recording.names)]
    rows = ["\t".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    return ("\n".join([*head, *rows]) + "\n").encode()


def write_opensim(path: str | Path, recording: Recording) -> Path:
    """Write a recording as a ``.sto`` file for OpenSim. Returns the path."""
    return write_file(path, opensim_bytes(recording))
