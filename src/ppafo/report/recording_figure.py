"""The figure of a recording: one panel a quantity over a common time, each in the unit that the field uses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.errors import DataError, UnitError, one_line
from ppafo.parameters.joint import ANKLE, Joint
from ppafo.report.display_units import display_difference, gauge_shift
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import (
    ACTUAL,
    CHAMBER_1,
    CHAMBER_2,
    GREY,
    ORANGE,
    REFERENCE,
    Look,
    look_of_valve,
    render_figure,
)
from ppafo.signals import Recording
from ppafo.storage import StoredResult
from ppafo.storage.result_folder import RUN_FILE
from ppafo.units import conversion
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_FORMATS = ("png", "svg", "pdf")
_SIZE = (6.9, 1.6)
"""Inches of a panel with its title."""
_HEADROOM = 0.06
_MAXIMUM_TICKS = 5
_LARGEST = 1e9
"""No atmosphere [Pa absolute] and no time [s] is as large."""
_LONGEST_SHOWN, _LONGEST_REMARK = 60, 500
_END_OF_WALK = 5.0
"""Of a walk the last seconds are drawn, some strides: a minute of them is a black bar."""

_ANGLE, _COMMAND = Kind("Ankle angle", "rad", "angle"), Kind("Valve command (-1 to 1)")
_COMMAND_THAT_VENTS = Kind("Valve command (-1 to 1; 2 vents both chambers)")
PANELS: tuple[tuple[Kind, float, tuple[float, ...], dict[str, tuple[str, Look]]], ...] = (
    (_ANGLE, math.radians(10.0), (), {"angle": ("ankle", ACTUAL), "reference_angle": ("reference", REFERENCE)}),
    (
        Kind("Pressure", "Pa_a", "pressure"),
        5.0 * PASCALS_PER_PSI,
        (STANDARD_ATMOSPHERE,),
        {
            "pressure_1": ("chamber 1", CHAMBER_1),
            "pressure_2": ("chamber 2", CHAMBER_2),
            "reference_pressure_1": ("reference, chamber 1", REFERENCE),
            "reference_pressure_2": ("reference, chamber 2", REFERENCE),
        },
    ),
    (
        Kind("Pressure in chamber 1 less chamber 2", "Pa_d", "pressure change"),
        5.0 * PASCALS_PER_PSI,
        (),
        {"reference_pressure_difference": ("reference", REFERENCE), "pressure_difference": ("actual", ACTUAL)},
    ),
    (
        Kind("Actuator torque", "N m", "torque"),
        0.5,
        (),
        {"torque": ("actuator", ACTUAL), "reference": ("reference", REFERENCE)},
    ),
    (_COMMAND, 2.0, (-1.0, 1.0), {"command": ("", ACTUAL)}),
    (
        Kind("Gas since the start", "kg", "gas mass"),
        1.0e-5,
        (),
        {
            "supplied_mass": ("supplied", ACTUAL),
            "vented_mass": ("vented", Look(ORANGE)),
            "leaked_mass": ("leaked between the chambers", Look(GREY, "--")),
        },
    ),
)
"""Panels: kind of the numbers, smallest span of the axis, values that it always shows, names and looks by channel.

The smallest span keeps what hardly changes from looking wild. It and the values are in SI.
"""


def recording_figure(
    recording: Recording,
    title: str = "",
    remark: str = "",
    atmosphere: float = STANDARD_ATMOSPHERE,
    valve: str = "",
    joint: Joint = ANKLE,
) -> "Figure":
    """Return the figure of a recording, with a panel for every quantity that it has.

    An ankle that a simulation holds at one angle is in the title instead, unless there is nothing else to draw.
    ``remark`` stands below the panels, for example why a run stopped early. Gauge pressure counts from ``atmosphere``
    [Pa absolute]. ``valve`` is the kind of valve, in whose colour the device is drawn, ``joint`` what it turns.
    """
    panels = []
    title = title or recording.label
    held = _held_angle(recording)
    if held is not None:
        title = f"{title}, {joint.name} at {_ANGLE.text(held)}"
    for kind, span, always_shown, lines in PANELS:
        shown = {name: line for name, line in lines.items() if name in recording}
        if kind is _ANGLE and held is not None:
            continue
        vents = kind is _COMMAND and bool(shown) and float(recording["command"].max()) > 1.0
        shift = -gauge_shift(atmosphere) if kind.quantity == "pressure" else 0.0
        marks = []
        for channel, (name, line) in shown.items():
            look = look_of_valve(valve) if line is ACTUAL else line
            # A command holds between two samples; all else goes on in between.
            style = {"linestyle": look.line, "drawstyle": "steps-post" if channel == "command" else "default"}
            label = joint.said(name) if len(shown) > 1 else ""
            marks.append(Mark("line", recording.time, recording[channel] + shift, (), label, look.colour, style))
        if marks:
            ends = (float(recording.time[0]), float(recording.time[-1])) if recording.duration > 0.0 else None
            smallest = display_difference(span, kind.quantity)
            then = partial(_set_limits, ends, smallest, tuple(kind.values(always_shown)))
            own = _COMMAND_THAT_VENTS if vents else kind
            named = replace(own, words=joint.said(own.words))
            panels.append(Panel(TIME, named, marks, then=then, shares_x=True))
    if not panels:
        drawn = ", ".join(channel for *_, lines in PANELS for channel in lines)
        raise DataError(f"{recording.label}: has nothing to draw; a figure shows {drawn}")
    return draw_panels(panels, 1, _SIZE, title, remark, recording.kind)


def _held_angle(recording: Recording) -> float | None:
    """Return the angle [rad] of a simulated ankle that never moves beside what else is drawn, None of any other."""
    others = [name for _, _, _, lines in PANELS for name in lines if name != "angle" and name in recording]
    follows = "reference_angle" in recording
    if recording.kind != "simulated" or "angle" not in recording or not others or follows:
        return None
    angle = recording["angle"]
    return float(angle[0]) if angle.size > 1 and bool((angle == angle[0]).all()) else None


def _set_limits(
    ends: tuple[float, float] | None, smallest_span: float, always_shown: Sequence[float], axes: "Axes"
) -> None:
    """Set the limits of the value axis to what is drawn and what is always shown, with some air, and few ticks."""
    shown = (*axes.dataLim.intervaly, *always_shown)
    span = max(shown) - min(shown)
    missing = max(0.0, smallest_span - span)
    air = _HEADROOM * (span + missing) + 0.5 * missing
    # None, for a single sample, leaves the limits to Matplotlib, which warns of two equal ones.
    axes.set_xlim(ends)
    axes.set_ylim(min(shown) - air, max(shown) + air)
    axes.locator_params(axis="y", nbins=_MAXIMUM_TICKS)


def draw_stored_result(stored: StoredResult) -> "Figure":
    """Return the figure of a saved result: the same that ``Result.plot`` gave.

    DataError names the key of ``run.json`` that is of another form.
    """
    file, document = stored.folder / RUN_FILE, stored.document
    name = _under(file, document, "scenario").get("name", "")
    if not isinstance(name, str):
        raise _other_form(file, "scenario.name", name, "a text")
    atmosphere = stated_atmosphere(file, document, "scenario", "device")
    valve = str(_under(file, document, "scenario", "device", "valve").get("kind", ""))
    joint = stated_joint(file, document, "scenario", "device")
    with shown_in(stated_units(file, document)):
        return recording_figure(stored.recording, one_line(name), _ending(file, document), atmosphere, valve, joint)


def draw_stored_walk(file: Path, document: Mapping[str, Any], recording: Recording) -> "Figure":
    """Return the figure of the last seconds of a saved walk, with the failure that ended it, if any.

    ``document`` is what ``file`` holds, empty where there is none; DataError names the key that is of another form.
    """
    end = float(recording.time[-1])
    # A short walk is drawn whole, and then nothing is left out that had to be said.
    part = f"the last {_END_OF_WALK:g} s of {end:.4g} s" if recording.duration > _END_OF_WALK else ""
    remark = "; ".join(text for text in (_ending(file, document), part) if text)
    atmosphere = stated_atmosphere(file, document, "configuration", "device")
    shown = recording.between(end - _END_OF_WALK, end)
    valve = str(_under(file, document, "configuration", "device", "valve").get("kind", ""))
    with shown_in(stated_units(file, document)):
        return recording_figure(shown, recording.label, remark, atmosphere, valve)


def stated_units(file: Path, document: Mapping[str, Any], *keys: str) -> dict[str, str]:
    """Return the units in which a file's document says, at some keys, that numbers are shown, by unit in SI; else none.

    DataError names one that is no unit of that kind.
    """
    stated = _under(file, document, *keys, "shown")
    for si_unit, unit in stated.items():
        try:
            conversion(str(unit), si_unit)
        except UnitError as error:
            raise _other_form(file, f"shown.{one_line(si_unit)[:_LONGEST_SHOWN]}", unit, "a unit for it") from error
    return {si_unit: str(unit) for si_unit, unit in stated.items()}


def stated_atmosphere(file: Path, document: Mapping[str, Any], *device: str) -> float:
    """Return the atmosphere [Pa absolute] of the device at some keys of a file's document, else the standard one.

    DataError names the key that is of another form.
    """
    atmosphere = _positive(file, document, "a pressure in Pa", *device, "supply", "atmospheric_pressure")
    return STANDARD_ATMOSPHERE if atmosphere is None else atmosphere


def stated_joint(file: Path, document: Mapping[str, Any], *device: str) -> Joint:
    """Return what the device at some keys of a file's document turns, in words; the ankle where it does not say.

    DataError names the key that is of another form.
    """
    words = _under(file, document, *device, "joint")
    joint = {name: words.get(name, getattr(ANKLE, name)) for name in ("name", "positive", "negative")}
    for name, word in joint.items():
        if not isinstance(word, str):
            raise _other_form(file, ".".join((*device, "joint", name)), word, "a text")
    return Joint(**{name: one_line(word)[:_LONGEST_SHOWN] for name, word in joint.items()})


def _ending(file: Path, document: Mapping[str, Any]) -> str:
    """Return why a run stopped before its end, empty where it did not."""
    status = _under(file, document, "status")
    message = one_line(status.get("message", ""))[:_LONGEST_REMARK]
    return "" if status.get("kind", "completed") == "completed" else message


def _positive(file: Path, document: Mapping[str, Any], wanted: str, *keys: str) -> float | None:
    """Return the number above 0 at some keys of a file's document, None where it has none; ``wanted`` is what it is."""
    table = _under(file, document, *keys[:-1])
    if keys[-1] not in table:
        return None
    value = table[keys[-1]]
    # JSON has true and false, which Python takes for 1 and 0.
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < _LARGEST:
        raise _other_form(file, ".".join(keys), value, wanted)
    return float(value)


def _under(file: Path, document: Mapping[str, Any], *keys: str) -> Mapping[str, Any]:
    """Return a table of a document, an empty one where there is none."""
    for depth, key in enumerate(keys, start=1):
        below = document.get(key, {})
        if not isinstance(below, Mapping):
            raise _other_form(file, ".".join(keys[:depth]), below, "a table")
        document = below
    return document


def _other_form(file: Path, path: str, given: object, wanted: str) -> DataError:
    return DataError(f"{file}: {path} = {one_line(repr(given))[:_LONGEST_SHOWN]} must be {wanted}")


def figure_files(figure: "Figure") -> dict[str, bytes]:
    """Return the files that a result folder keeps of its figure, by name."""
    return {f"figure.{file_format}": content for file_format, content in render_figure(figure, ("png", "svg")).items()}
