"""What an import has to know and recorded files do not say."""

import math
import re
from dataclasses import dataclass

from ppafo.documents.models import NAME
from ppafo.errors import DataError
from ppafo.gait.recorded.mapping import GaitMap, Side
from ppafo.gait.recorded.repairs import LONGEST_FILLED

_NAME = "imported-gait"


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What the files do not say: body mass [kg], side, speed [m/s], map, low pass [Hz], least number of strides.

    The least number of strides is 2 unless given, and 1 overground and of one cycle that wraps around.
    ``body_mass`` may be None where a C3D file states it. ``stature`` [m] gives the length of the thigh where no map
    does. ``start`` and ``end`` [s] cut the files, ``longest_gap`` [s] is up to where gaps are filled, and
    ``ankle_neutral`` [rad] the reading of the file with the foot perpendicular to the shank, where it is not that of
    map or convention.
    """

    body_mass: float | None = None
    side: Side = "right"
    columns: GaitMap | None = None
    walking_speed: float | None = None
    low_pass: float | None = None
    least_strides: int | None = None
    name: str = _NAME
    title: str = ""
    stature: float | None = None
    start: float | None = None
    end: float | None = None
    longest_gap: float = 0.0
    ankle_neutral: float | None = None


def check_settings(settings: ImportSettings) -> None:
    """Raise DataError for settings that are not plausible."""
    if settings.body_mass is not None and not 1.0 <= settings.body_mass <= 500.0:
        raise DataError(f"a body mass of {settings.body_mass:g} kg is not plausible; give it in kg, such as '62 kg'")
    if settings.walking_speed is not None and not 0.05 <= settings.walking_speed <= 4.0:
        raise DataError(f"a walking speed of {settings.walking_speed:g} m/s is not plausible; walking is 0.05 to 4 m/s")
    if settings.stature is not None and not 0.5 <= settings.stature <= 2.5:
        raise DataError(f"a stature of {settings.stature:g} m is not plausible; give it in m, such as '1.75 m'")
    if settings.low_pass is not None and not (math.isfinite(settings.low_pass) and settings.low_pass >= 1.0):
        raise DataError(f"a low pass at {settings.low_pass:g} Hz would remove the gait itself; 6 Hz is usual")
    if not 0.0 <= settings.longest_gap <= LONGEST_FILLED:
        raise DataError(f"gaps of {settings.longest_gap:g} s cannot be filled; allowed is 0 to {LONGEST_FILLED:g} s")
    if settings.start is not None and settings.end is not None and not settings.start < settings.end:
        raise DataError(f"the start, {settings.start:g} s, must be before the end, {settings.end:g} s")
    if re.fullmatch(NAME, settings.name) is None:
        raise DataError(f"name {settings.name!r} must consist of lower-case letters, digits, '-' and '_'")
    if settings.least_strides is not None and settings.least_strides < 1:
        raise DataError(f"the minimum number of strides must be 1 or more, not {settings.least_strides}")
