"""Figure of a recording, a panel for each quantity over a common time axis, in display units; and of saved results.

The document of a saved result may come from any source; each error names the key with an invalid value.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ppafo.arguments import checked
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.errors import DataError, UnitError
from ppafo.metrics.metric import Metric, Metrics
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.report.kind import TIME, Kind, metrics_lines
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
    drawn_at,
    look_of_valve,
    shown,
)
from ppafo.signals import Recording
from ppafo.storage import StoredResult, read_stored
from ppafo.storage.result_folder import RUN_FILE
from ppafo.units import conversion
from ppafo.units.shown import GAUGE_ZERO, counted_from, gauge_zero, shown_in
from ppafo.wording import one_line

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

_ANGLE = Kind("Ankle angle", "rad", "angle")
_COMMAND = Kind("Valve command (-1 to 1)")
_COMMAND_THAT_VENTS = Kind("Valve command (-1 to 1; 2 vents both chambers)")
_LARGEST = 1e9
"""Upper limit of the atmosphere [Pa absolute] and of times [s] in a document."""
_LONGEST_SHOWN = 60
"""Largest number of characters of a key, value or word in a message or figure."""
_LONGEST_REMARK = 500
"""Largest number of characters of a document's message about the end of a run."""
_END_OF_WALK = 5.0
"""Duration drawn from the end of a walk [s]: a few strides, since a longer one would be unreadable."""


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
        always_shown = (0.0,)
        smallest_span = _SMALL_COMMAND
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


@checked
def read_result(folder: str | Path) -> StoredResult:
    """Return the content of a result folder, with its figure; raises DataError for a folder without a result.

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("step")
    >>> stored = ppafo.read_result(folder)
    >>> stored.document["status"]["kind"], len(stored.plot().axes), round(max(stored["pressure_1", "psi_g"]))
    ('completed', 5, 55)
    """
    stored = read_stored(folder)
    file = stored.folder / RUN_FILE
    metrics = Metrics()
    for name, stated in table_at(file, stored.document, "metrics").items():
        try:
            # JSON has no nan, which a metric without a value has.
            value = math.nan if stated["value"] is None else float(stated["value"])
            metrics[name] = Metric(value, str(stated["unit"]), str(stated["summary"]))
        except (KeyError, TypeError, ValueError) as error:
            raise _other_form(file, f"metrics.{name}", stated, "a value with unit and summary") from error
    atmosphere = _stated_atmosphere(file, stored.document, "scenario", "device")
    # Folders of earlier versions hold no verdict.
    said = stored.document.get("verdict", [_ending(file, stored.document)])
    if not (isinstance(said, list) and all(isinstance(each, str) for each in said)):
        raise _other_form(file, "verdict", said, "a list of texts")
    kind = one_line(table_at(file, stored.document, "status").get("kind", ""))[:_LONGEST_SHOWN]
    with shown_in(stated_units(file, stored.document, device=("scenario", "device"))):
        text = "\n".join([kind, *filter(None, map(one_line, said)), "", *metrics_lines(metrics), ""])
    return replace(stored, metrics=metrics, atmosphere=atmosphere, drawn_by=draw_stored_result, text=text)


def draw_stored_result(stored: StoredResult, width: float | str | None = None) -> "Figure":
    """Return the figure of a saved result, identical to the figure of ``Result.plot``.

    Raises DataError that names the invalid key of ``run.json``.
    """
    file = stored.folder / RUN_FILE
    document = stored.document
    title = table_at(file, document, "scenario").get("name", "")
    if not isinstance(title, str):
        raise _other_form(file, "scenario.name", title, "a text")
    valve = str(table_at(file, document, "scenario", "device", "valve").get("kind", ""))
    words = table_at(file, document, "scenario", "device", "joint")
    joint = {name: words.get(name, getattr(ANKLE, name)) for name in ("name", "positive", "negative")}
    for name, word in joint.items():
        if not isinstance(word, str):
            raise _other_form(file, f"scenario.device.joint.{name}", word, "a text")
    names = JointNames(**{name: one_line(word)[:_LONGEST_SHOWN] for name, word in joint.items()})
    with shown_in(stated_units(file, document, device=("scenario", "device"))), drawn_at(width):
        return shown(recording_figure(stored.recording, one_line(title), _ending(file, document), valve, names))


def draw_stored_walk(file: Path, document: Mapping[str, Any], recording: Recording) -> "Figure":
    """Return the figure of the last seconds of a saved walk, with the failure that ended it, if any.

    ``document`` is the content of ``file``, empty without a file. Raises DataError that names the invalid key.
    """
    end = float(recording.time[-1])
    # A short walk is drawn whole, and then nothing is left out that had to be said.
    part = f"the last {_END_OF_WALK:g} s of {end:.4g} s" if recording.duration > _END_OF_WALK else ""
    remark = "; ".join(text for text in (_ending(file, document), part) if text)
    shown = recording.between(end - _END_OF_WALK, end)
    valve = str(table_at(file, document, "configuration", "device", "valve").get("kind", ""))
    with shown_in(stated_units(file, document, device=("configuration", "device"))):
        return recording_figure(shown, recording.label, remark, valve)


def stated_units(
    file: Path, document: Mapping[str, Any], *keys: str, device: tuple[str, ...] = ("device",)
) -> dict[str, str]:
    """Return the display units stated in a document at some keys, by SI unit.

    They include the atmosphere of the device, the reference of gauge pressures. Raises DataError for a unit of a wrong
    kind, and for an invalid value, with its key.
    """
    # The device itself says from which pressure gauge ones count.
    stated = {key: unit for key, unit in table_at(file, document, *keys, "shown").items() if key != GAUGE_ZERO}
    for si_unit, unit in stated.items():
        try:
            conversion(str(unit), si_unit)
        except UnitError as error:
            raise _other_form(file, f"shown.{one_line(si_unit)[:_LONGEST_SHOWN]}", unit, "a unit for it") from error
    return counted_from(stated, _stated_atmosphere(file, document, *keys, *device))


def _stated_atmosphere(file: Path, document: Mapping[str, Any], *device: str) -> float:
    """Return the atmosphere of the device at some keys of a document [Pa absolute], standard if it is missing."""
    path = (*device, "supply", "atmospheric_pressure")
    atmosphere = table_at(file, document, *path[:-1]).get(path[-1], STANDARD_ATMOSPHERE)
    # JSON has true and false, which Python takes for 1 and 0.
    is_number = isinstance(atmosphere, int | float) and not isinstance(atmosphere, bool)
    if not is_number or not 0.0 < atmosphere < _LARGEST:
        raise _other_form(file, ".".join(path), atmosphere, "a pressure in Pa")
    return float(atmosphere)


def _ending(file: Path, document: Mapping[str, Any]) -> str:
    """Return the reason for an early stop of a run; empty for a completed run."""
    status = table_at(file, document, "status")
    message = one_line(status.get("message", ""))[:_LONGEST_REMARK]
    return "" if status.get("kind", "completed") == "completed" else message


def table_at(file: Path, document: Mapping[str, Any], *keys: str) -> Mapping[str, Any]:
    """Return the table at some keys of a document, empty if it is missing."""
    for depth, key in enumerate(keys, start=1):
        below = document.get(key, {})
        if not isinstance(below, Mapping):
            raise _other_form(file, ".".join(keys[:depth]), below, "a table")
        document = below
    return document


def _other_form(file: Path, path: str, given: object, wanted: str) -> DataError:
    """Build the error for an invalid value at a dotted path of a file; ``wanted`` describes the valid values."""
    return DataError(f"{file}: {path} = {one_line(repr(given))[:_LONGEST_SHOWN]} must be {wanted}")
