"""What an import has to know and recorded files do not say."""

import math
import re
from dataclasses import dataclass

from ppafo.documents.models import NAME
from ppafo.errors import DataError
from ppafo.gait.recorded.mapping import GaitMap, Side

_NAME = "imported-gait"


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What the files do not say: body mass [kg], side, speed [m/s], map, low pass [Hz], least number of strides.

    ``stature`` [m] gives the length of the thigh where no map does.
    """

    body_mass: float
    side: Side = "right"
    columns: GaitMap | None = None
    walking_speed: float | None = None
    low_pass: float | None = None
    least_strides: int = 2
    name: str = _NAME
    title: str = ""
    stature: float | None = None


def check_settings(settings: ImportSettings) -> None:
    """Raise DataError for settings that are not plausible."""
    if not 1.0 <= settings.body_mass <= 500.0:
        raise DataError(f"a body mass of {settings.body_mass:g} kg is not plausible; give it in kg, such as '62 kg'")
    if settings.walking_speed is not None and not 0.05 <= settings.walking_speed <= 4.0:
        raise DataError(f"a walking speed of {settings.walking_speed:g} m/s is not plausible; walking is 0.05 to 4 m/s")
    if settings.stature is not None and not 0.5 <= settings.stature <= 2.5:
        raise DataError(f"a stature of {settings.stature:g} m is not plausible; give it in m, such as '1.75 m'")
    if settings.low_pass is not None and not (math.isfinite(settings.low_pass) and settings.low_pass >= 1.0):
        raise DataError(f"a low pass at {settings.low_pass:g} Hz would remove the gait itself; 6 Hz is usual")
    if re.fullmatch(NAME, settings.name) is None:
        raise DataError(f"name {settings.name!r} must consist of lower-case letters, digits, '-' and '_'")
    if settings.least_strides < 1:
        raise DataError(f"the minimum number of strides must be 1 or more, not {settings.least_strides}")
