"""The prescribed torque of a sizing file: from a recording or a list to the table that the lanes follow."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from ppafo.control.profiles import KNOTS
from ppafo.documents.models import STRICT, Text, Texts
from ppafo.errors import DataError, StudyError, UnitError
from ppafo.storage.recordings import read_recording
from ppafo.units import parse_quantity

Floats = NDArray[np.float64]

_TORQUE = "N m"
_ROUNDING = 1.0e-9
"""Fraction of the range of a profile below which a difference is none."""
_MOMENT = 1.0e-5
"""Time [s] in which a table goes from the end of a repetition to the beginning of the next where these differ."""


class ProfileTable(BaseModel):
    """The prescribed torque over one repetition: a recording, or times and torques."""

    model_config = STRICT

    recording: Annotated[
        str | None, Field(description="a .csv or .nc file or a result folder, relative to this file")
    ] = None
    channel: Annotated[Text, Field(description="channel of the recording, in N m")] = "torque"
    time: Annotated[Texts, Field(description="times with unit, from 0 on; the profile repeats after the last")] = ()
    torque: Annotated[Texts, Field(description="torques with unit, one for each time")] = ()
    scale: Annotated[float, Field(description="factor on every torque: the fraction that the orthosis provides")] = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class TorqueProfile:
    """One repetition: times [s] from 0 and torques [N m] as given, and the knots of the table that stands for them.

    ``kind`` says where it comes from: ``measured``, ``simulated``, ``synthetic`` or ``typed``.
    """

    time: Floats
    torque: Floats
    kind: str
    knot_times: Floats
    knot_values: Floats

    @property
    def period(self) -> float:
        """Length of a repetition [s]."""
        return float(self.time[-1])

    @property
    def table_error(self) -> float:
        """Largest difference of the table from what was given [N m]."""
        return float(np.max(np.abs(self.at(self.time[:-1]) - self.torque[:-1])))

    @property
    def largest(self) -> float:
        """Largest torque of the table, either sign [N m]."""
        return float(np.max(np.abs(self.knot_values)))

    def at(self, time: Floats) -> Floats:
        """Return the table's torque [N m] at times [s] from 0 on."""
        times, values = np.append(self.knot_times, self.period), np.append(self.knot_values, self.knot_values[0])
        return np.asarray(np.interp(np.mod(time, self.period), times, values))

    def overrides(self) -> tuple[str, ...]:
        """Return the overrides that make a scenario follow the table."""
        kind = ("reference.kind=tabulated", f"reference.level=0 {_TORQUE}", f"reference.period={self.period!r} s")
        times = enumerate(self.knot_times[1:].tolist(), 2)
        values = enumerate(self.knot_values.tolist(), 1)
        return (
            *kind,
            *(f"reference.time_{number:02d}={time!r} s" for number, time in times),
            *(f"reference.value_{number:02d}={value!r} {_TORQUE}" for number, value in values),
        )


def read_profile(table: ProfileTable, folder: Path, file: str) -> TorqueProfile:
    """Return the profile of a sizing file; a recording's path begins in ``folder``."""
    place = f"{file}: profile"
    is_typed = bool(table.time or table.torque)
    if is_typed == (table.recording is not None):
        raise StudyError(f"{place}: give either recording, or time and torque")
    time, torque, kind = _profile_of_table(table, place) if is_typed else _profile_of_recording(table, folder, place)
    if not np.any(torque):
        raise StudyError(f"{place}: is 0 {_TORQUE} throughout; there is nothing to size for")
    knot_times, knot_values = choose_knots(*_open_end(time, torque))
    return TorqueProfile(time=time, torque=torque, kind=kind, knot_times=knot_times, knot_values=knot_values)


def choose_knots(time: Floats, torque: Floats) -> tuple[Floats, Floats]:
    """Return at most 32 of the samples, from the first one on, that stand for all: always the worst one is added next.

    Between the last sample and the next repetition there is nothing to choose.
    """
    chosen = [0, time.size - 1]
    while len(chosen) < min(KNOTS, time.size):
        between = np.interp(time, time[chosen], torque[chosen])
        worst = int(np.argmax(np.abs(between - torque)))
        if abs(between[worst] - torque[worst]) <= _ROUNDING * np.ptp(torque):
            break
        chosen = sorted([*chosen, worst])
    return time[chosen], torque[chosen]


def _open_end(time: Floats, torque: Floats) -> tuple[Floats, Floats]:
    """Return the samples without the last one, which is the first of the next repetition.

    Where the two differ, the last one stays, a moment earlier: the table then jumps as the profile does.
    """
    if torque[-1] == torque[0]:
        return time[:-1], torque[:-1]
    moment = min(_MOMENT, 0.5 * (time[-1] - time[-2]))
    return np.append(time[:-1], time[-1] - moment), torque


def _profile_of_table(table: ProfileTable, place: str) -> tuple[Floats, Floats, str]:
    if len(table.time) != len(table.torque) or len(table.time) < 2:
        raise StudyError(
            f"{place}: time has {len(table.time)} and torque {len(table.torque)} entries; give as many of each, "
            f"two or more"
        )
    time = np.array([_number(text, "s", f"{place}.time") for text in table.time])
    torque = table.scale * np.array([_number(text, _TORQUE, f"{place}.torque") for text in table.torque])
    if time[0] != 0.0 or np.any(np.diff(time) <= 0.0):
        raise StudyError(f"{place}.time: must begin with '0 s' and grow from entry to entry")
    return time, torque, "typed"


def _profile_of_recording(table: ProfileTable, folder: Path, place: str) -> tuple[Floats, Floats, str]:
    try:
        recording = read_recording(folder / str(table.recording))
        torque: Any = recording[table.channel]
        unit = recording.unit(table.channel)
    except DataError as error:
        raise StudyError(f"{place}.recording: {error}") from error
    if unit != _TORQUE:
        raise StudyError(f"{place}.channel = '{table.channel}' is in '{unit}'; a torque in {_TORQUE} is needed")
    if len(recording) < 2:
        raise StudyError(f"{place}.recording: has one sample only; a profile needs two or more")
    return recording.time - recording.time[0], table.scale * torque, recording.kind


def _number(text: str, unit: str, place: str) -> float:
    try:
        return parse_quantity(text, unit)
    except UnitError as error:
        raise StudyError(f"{place}: '{text}': {error}") from error
