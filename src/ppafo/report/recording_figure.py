"""Figure of a recording: a panel for each quantity over a common time axis, in display units."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import DataError
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import (
    ACTUAL,
    BLACK,
    CHAMBER_1,
    CHAMBER_2,
    GREY,
    REFERENCE,
    REFERENCE_2,
    DrawingStyle,
    look_of_valve,
)
from ppafo.signals import Recording
from ppafo.units.shown import gauge_zero

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_FORMATS = ("png", "svg", "pdf")
_SIZE = (5.4, 1.5)
"""Size of a panel with its title [inches]: width, height."""
_HEADROOM = 0.06
"""Margin above and below the data, relative to the range of the data [-]."""
_MAXIMUM_TICKS = 5
"""Largest number of intervals between ticks of a value axis."""

_SMALL_COMMAND = 0.2
"""Command [-] below which the axis does not reach full opening, where a small command would be a flat line."""

_ANGLE, _COMMAND = Kind("Ankle angle", "rad", "angle"), Kind("Valve command (-1 to 1)")
_COMMAND_THAT_VENTS = Kind("Valve command (-1 to 1; 2 vents both chambers)")


class _Quantity(NamedTuple):
    """Panel of the figure: kind of the numbers, and label and style of each channel that may be drawn.

    The axis spans at least ``smallest_span`` [SI], so that small changes are not magnified, and always includes
    ``always_shown`` [SI].
    """

    kind: Kind
    lines: Mapping[str, tuple[str, DrawingStyle]]
    smallest_span: float
    always_shown: tuple[float, ...] = ()


_QUANTITIES = (
    _Quantity(_ANGLE, {"angle": ("ankle", ACTUAL), "reference_angle": ("reference", REFERENCE)}, math.radians(10.0)),
    _Quantity(
        kind=Kind("Pressure", "Pa_a", "pressure"),
        lines={
            "pressure_1": ("chamber 1", CHAMBER_1),
            "pressure_2": ("chamber 2", CHAMBER_2),
            "reference_pressure_1": ("reference, chamber 1", REFERENCE),
            "reference_pressure_2": ("reference, chamber 2", REFERENCE_2),
        },
        smallest_span=5.0 * PASCALS_PER_PSI,
    ),
    _Quantity(
        kind=Kind("Pressure in chamber 1 less chamber 2", "Pa_d", "pressure change"),
        lines={"reference_pressure_difference": ("reference", REFERENCE), "pressure_difference": ("actual", ACTUAL)},
        smallest_span=5.0 * PASCALS_PER_PSI,
    ),
    _Quantity(
        kind=Kind("Actuator torque", "N m", "torque"),
        lines={"torque": ("actuator", ACTUAL), "reference": ("reference", REFERENCE)},
        smallest_span=0.5,
    ),
    _Quantity(kind=_COMMAND, lines={"command": ("", ACTUAL)}, smallest_span=2.0, always_shown=(-1.0, 1.0)),
    _Quantity(
        kind=Kind("Gas since the start", "kg", "gas mass"),
        lines={
            "supplied_mass": ("supplied", ACTUAL),
            "vented_mass": ("vented", DrawingStyle(BLACK, "-.")),
            "leaked_mass": ("leaked between the chambers", DrawingStyle(GREY, "--")),
        },
        smallest_span=1.0e-5,
    ),
)


def recording_figure(
    recording: Recording, title: str = "", remark: str = "", valve: str = "", joint: JointNames = ANKLE
) -> "Figure":
    """Return the figure of a recording, with a panel for every quantity in it.

    A constant ankle angle of a simulation is written in the title instead, unless nothing else can be drawn. ``remark``
    is printed below the panels, for example the reason for an early stop. ``valve`` is the kind of valve, which is in
    the title and determines the colour of the device, and ``joint`` holds the names of the joint. Gauge pressure is
    relative to the active atmosphere (``units/shown.py``).
    """
    title = title or recording.label
    if valve and valve not in title:
        title = f"{title}, {valve.replace('_', ' ')} valve"
    drawn = [quantity for quantity in _QUANTITIES if not quantity.lines.keys().isdisjoint(recording.names)]
    others = [quantity for quantity in drawn if quantity.kind is not _ANGLE]
    may_be_locked = recording.kind == "simulated" and "angle" in recording and "reference_angle" not in recording
    if others and may_be_locked and len(recording) > 1 and np.ptp(recording["angle"]) == 0.0:
        drawn = others
        title = f"{title}, {joint.name} at {_ANGLE.text(float(recording['angle'][0]))}"
    if not drawn:
        channels = ", ".join(channel for quantity in _QUANTITIES for channel in quantity.lines)
        raise DataError(f"{recording.label}: has nothing to draw; a figure shows {channels}")
    panels = [_panel(recording, quantity, valve, joint) for quantity in drawn]
    return draw_panels(panels, 1, _SIZE, title, remark, recording.kind)


def _panel(recording: Recording, quantity: _Quantity, valve: str, joint: JointNames) -> Panel:
    """Return the panel of one quantity of the recording."""
    kind = quantity.kind
    lines = {channel: line for channel, line in quantity.lines.items() if channel in recording}
    marks = []
    for channel, (name, line) in lines.items():
        look = look_of_valve(valve) if line is ACTUAL else line
        # A command holds between two samples; all else goes on in between.
        style = {"linestyle": look.line, "drawstyle": "steps-post" if channel == "command" else "default"}
        label = joint.said(name) if len(lines) > 1 else ""
        marks.append(Mark("line", recording.time, recording[channel], (), label, look.colour, style))
    ends = (float(recording.time[0]), float(recording.time[-1])) if recording.duration > 0.0 else None
    always_shown = (gauge_zero(),) if kind.quantity == "pressure" else quantity.always_shown
    smallest_span = kind.shown_change(quantity.smallest_span)
    if kind is _COMMAND and float(np.abs(recording["command"]).max()) < _SMALL_COMMAND:
        always_shown, smallest_span = (0.0,), _SMALL_COMMAND
    then = partial(_set_limits, ends, smallest_span, tuple(kind.values(always_shown)))
    vents = kind is _COMMAND and float(recording["command"].max()) > 1.0
    shown_kind = _COMMAND_THAT_VENTS if vents else kind
    return Panel(TIME, replace(shown_kind, words=joint.said(shown_kind.words)), marks, then=then, shares_x=True)


def _set_limits(
    ends: tuple[float, float] | None, smallest_span: float, always_shown: Sequence[float], axes: "Axes"
) -> None:
    """Set the limits of the value axis to include the data and ``always_shown``, with a margin and few ticks."""
    shown = (*axes.dataLim.intervaly, *always_shown)
    span = max(shown) - min(shown)
    missing = max(0.0, smallest_span - span)
    air = _HEADROOM * (span + missing) + 0.5 * missing
    # None, for a single sample, leaves the limits to Matplotlib, which warns of two equal ones.
    axes.set_xlim(ends)
    axes.set_ylim(min(shown) - air, max(shown) + air)
    axes.locator_params(axis="y", nbins=_MAXIMUM_TICKS)
