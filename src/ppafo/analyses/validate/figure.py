"""Panels of a validation: each channel of a recording with the model, and its residual below."""

import numpy as np

from ppafo.report.display_units import gauge_shift
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import Course, course_panels
from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2
from ppafo.validation import ChannelAgreement
from ppafo.validation.agreement import RecordingAgreement, measured_values
from ppafo.validation.compared import COMPARED, PRESSURE_1, PRESSURE_2

KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""What the recording is called beside the model: nobody may take a model's output for a measurement."""
MILLISECONDS = 1.0e3
"""Milliseconds of a second."""
_LOOKS = {PRESSURE_1: CHAMBER_1, PRESSURE_2: CHAMBER_2}
_NEAR_LIMIT = 0.25
"""Largest residual over the limit of its RMS value from which the panel shows that limit: else it would be flat."""
_SHORT = 3.0
"""Recordings shorter than this [s] have an axis in milliseconds."""


def panels_across(agreement: RecordingAgreement) -> int:
    """Return how many channels of a recording stand side by side: 2, or 1 where there is no other."""
    return 1 if len(agreement.channels) == 1 else 2


def agreement_panels(agreement: RecordingAgreement, atmosphere: float) -> list[Panel]:
    """Return two panels for each channel of a recording; gauge pressures count from ``atmosphere`` [Pa absolute]."""
    pairs = [_channel_panels(agreement, channel, atmosphere) for channel in agreement.channels]
    across = panels_across(agreement)
    rows = [pairs[first : first + across] for first in range(0, len(pairs), across)]
    empty = (Panel(TIME, TIME, ()), Panel(TIME, TIME, (), tall=0.5))
    filled = [[*row, *[empty] * (across - len(row))] for row in rows]
    return [panel for row in filled for line in zip(*row, strict=True) for panel in line]


def _channel_panels(agreement: RecordingAgreement, channel: ChannelAgreement, atmosphere: float) -> list[Panel]:
    """Return samples and model over time, and below them their residual."""
    name, measured, model = channel.channel, agreement.measured, agreement.model
    measurement = measured_values(measured, name)
    assert measurement is not None, "a channel that is compared was measured"
    is_short, is_chamber = measured.duration < _SHORT, name in (PRESSURE_1, PRESSURE_2)
    time, scale = (Kind("Time", "ms"), MILLISECONDS) if is_short else (TIME, 1.0)
    shown, limit = COMPARED[name], channel.limit * channel.full_range
    is_first = channel is agreement.channels[0]
    course = Course(
        time=time,
        level=Kind(shown.title, "", "pressure" if is_chamber else shown.quantity),
        change=Kind(f"Measured - model, RMS {100 * channel.fraction:.2g} %", "", shown.quantity),
        times=scale * measured.time,
        samples=measurement,
        # The measurement is late by the delay, so the model is read that much earlier.
        model=np.interp(measured.time - agreement.delay.correction, model.time, model[name]),
        names=(KIND_WORDS[measured.kind], "model on the recorded inputs") if is_first else ("", ""),
        colour=_LOOKS.get(name, ACTUAL).colour,
        above=gauge_shift(atmosphere) if is_chamber else 0.0,
    )
    is_near = float(np.abs(course.model - measurement).max()) >= _NEAR_LIMIT * limit
    return course_panels(course, "dots", "figure" if is_first else "", (-limit, limit) if is_near else ())
