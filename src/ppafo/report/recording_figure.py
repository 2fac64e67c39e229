"""The figure of a recording: one panel a quantity over a common time, each in the unit that the field uses."""

import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.errors import DataError, one_line
from ppafo.report.style import (
    ACTUAL,
    CHAMBER_1,
    CHAMBER_2,
    GREY,
    ORANGE,
    REFERENCE,
    VERMILION,
    Look,
    Margins,
    figure_of_panels,
    house_style,
    label_lines,
    look_of_valve,
    mark_kind,
    render_figure,
)
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.storage import StoredResult
from ppafo.storage.result_folder import RUN_FILE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_FORMATS = ("png", "svg", "pdf")
_WIDTH, _LEFT, _RIGHT = 7.2, 0.62, 0.2
_PANEL, _GAP, _TOP, _BOTTOM, _REMARK_LINE = 1.15, 0.42, 0.75, 0.55, 0.17
"""Inches."""
_REMARK_WIDTH = 100
_HEADROOM = 0.06
_MAXIMUM_TICKS = 5
_LARGEST = 1e9
"""No atmosphere [Pa absolute] and no time [s] is as large."""
_LONGEST_SHOWN, _LONGEST_REMARK = 60, 500
_END_OF_WALK = 5.0
"""Of a walk the last seconds are drawn, some strides: a minute of them is a black bar."""


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a panel: channel, name in the legend, look, and whether it keeps its value between samples."""

    channel: str
    name: str
    look: Look
    is_held: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel: title with unit, how an SI value becomes a value in that unit, and its lines.

    ``smallest_span`` of the axis keeps what hardly changes from looking wild; ``always_shown`` are values that the axis
    reaches in any case. Both are in the unit of the axis.
    """

    title: str
    smallest_span: float
    convert: Callable[[Floats, float], Floats]
    lines: tuple[Line, ...]
    always_shown: tuple[float, ...] = ()


def _as_it_is(values: Floats, atmosphere: float) -> Floats:  # noqa: ARG001  # all conversions share one signature
    return values


def _degrees(values: Floats, atmosphere: float) -> Floats:  # noqa: ARG001
    return np.degrees(values)


def _gauge(values: Floats, atmosphere: float) -> Floats:
    return (values - atmosphere) / PASCALS_PER_PSI


def _grams(values: Floats, atmosphere: float) -> Floats:  # noqa: ARG001
    return values * GRAMS_PER_KILOGRAM


PANELS = (
    Panel("Ankle angle (deg)", 10.0, _degrees, (Line("angle", "", ACTUAL),)),
    Panel(
        "Pressure (psig)",
        5.0,
        _gauge,
        (Line("pressure_1", "chamber 1", CHAMBER_1), Line("pressure_2", "chamber 2", CHAMBER_2)),
        (0.0,),
    ),
    Panel(
        "Actuator torque (N m)",
        0.5,
        _as_it_is,
        (Line("torque", "actuator", ACTUAL), Line("reference", "reference", REFERENCE)),
    ),
    Panel(
        "Valve command (-1 to 1; 2 vents both chambers)",
        2.0,
        _as_it_is,
        (Line("command", "", ACTUAL, is_held=True),),
        (-1.0, 1.0),
    ),
    Panel(
        "Gas since the start (g)",
        0.01,
        _grams,
        (
            Line("supplied_mass", "supplied", ACTUAL),
            Line("vented_mass", "vented", Look(ORANGE)),
            Line("leaked_mass", "leaked between the chambers", Look(GREY, "--")),
        ),
    ),
)


def recording_figure(
    recording: Recording,
    title: str = "",
    remark: str = "",
    atmosphere: float = STANDARD_ATMOSPHERE,
    valve: str = "",
) -> "Figure":
    """Return the figure of a recording, with a panel for every quantity that it has.

    ``remark`` stands below the title, for example why a run stopped early. Gauge pressure counts from ``atmosphere``
    [Pa absolute]. ``valve`` is the kind of valve, in whose colour the device is drawn.
    """
    panels = [panel for panel in PANELS if any(line.channel in recording for line in panel.lines)]
    if not panels:
        drawn = ", ".join(line.channel for panel in PANELS for line in panel.lines)
        raise DataError(f"{recording.label}: has nothing to draw; a figure shows {drawn}")
    with house_style():
        figure, grid = _grid(len(panels), title or recording.label, remark)
        for panel, axes in zip(panels, grid, strict=True):
            _draw(axes, panel, recording, atmosphere, look_of_valve(valve))
        grid[-1].set_xlabel("Time (s)")
        mark_kind(figure, recording.kind)
        if recording.duration > 0.0:
            grid[-1].set_xlim(recording.time[0], recording.time[-1])
        return figure


def draw_stored_result(stored: StoredResult) -> "Figure":
    """Return the figure of a saved result: the same that ``Result.plot`` gave.

    DataError names the key of ``run.json`` that is of another form.
    """
    file, document = stored.folder / RUN_FILE, stored.document
    name = _under(file, document, "scenario").get("name", "")
    if not isinstance(name, str):
        raise _other_form(file, "scenario.name", name, "a text")
    atmosphere, valve = stated_atmosphere(file, document, "scenario", "device"), _valve(file, document, "scenario")
    return recording_figure(stored.recording, one_line(name), _ending(file, document), atmosphere, valve)


def draw_stored_walk(file: Path, document: Mapping[str, Any], recording: Recording) -> "Figure":
    """Return the figure of the last seconds of a saved walk, with the fall or failure that ended it.

    ``document`` is what ``file`` holds, empty where there is none; DataError names the key that is of another form.
    """
    end = float(recording.time[-1])
    part = f"the last {_END_OF_WALK:g} s of {end:.4g} s" if recording.duration > _END_OF_WALK else ""
    fall = _positive(file, document, "a time in s", "metrics", "fall_time", "value")
    fallen = "" if fall is None else f"the wearer falls at {fall:.1f} s"
    remark = "; ".join(text for text in (_ending(file, document), fallen, part) if text)
    atmosphere = stated_atmosphere(file, document, "configuration", "device")
    shown = recording.between(end - _END_OF_WALK, end)
    return recording_figure(shown, recording.label, remark, atmosphere, _valve(file, document, "configuration"))


def stated_atmosphere(file: Path, document: Mapping[str, Any], *device: str) -> float:
    """Return the atmosphere [Pa absolute] of the device at some keys of a file's document, else the standard one.

    DataError names the key that is of another form.
    """
    given = _positive(file, document, "a pressure in Pa", *device, "supply", "atmospheric_pressure")
    return STANDARD_ATMOSPHERE if given is None else given


def _valve(file: Path, document: Mapping[str, Any], scenario: str) -> str:
    """Return the kind of the valve at a key of a file's document, empty where it says none."""
    return str(_under(file, document, scenario, "device", "valve").get("kind", ""))


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
    given = table[keys[-1]]
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 < given < _LARGEST:
        raise _other_form(file, ".".join(keys), given, wanted)
    return float(given)


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


def _grid(count: int, title: str, remark: str) -> "tuple[Figure, list[Axes]]":
    """Return a figure with a title, an optional remark below the time axis and ``count`` panels over one time axis."""
    remarks = textwrap.wrap(remark, _REMARK_WIDTH)
    bottom = _BOTTOM + _REMARK_LINE * len(remarks)
    height = _TOP + count * _PANEL + (count - 1) * _GAP + bottom
    figure, rows = figure_of_panels((_WIDTH, height), Margins(_LEFT, _RIGHT, _TOP, bottom, _GAP), count)
    # Names and messages come from files: a dollar sign in them begins no formula.
    shown: dict[str, Any] = {"ha": "left", "parse_math": False}
    figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, title, va="top", fontsize=13, fontweight="bold", **shown)
    figure.text(0.12 / _WIDTH, 0.1 / height, "\n".join(remarks), va="bottom", fontsize=9, color=VERMILION, **shown)
    return figure, [axes for (axes,) in rows]


def _draw(axes: "Axes", panel: Panel, recording: Recording, atmosphere: float, device: Look) -> None:
    shown = [line for line in panel.lines if line.channel in recording]
    for line in shown:
        values = panel.convert(recording[line.channel], atmosphere)
        steps = "steps-post" if line.is_held else "default"
        look = device if line.look is ACTUAL else line.look
        axes.plot(recording.time, values, look.line, color=look.colour, label=line.name, drawstyle=steps)
    axes.set_title(panel.title)
    _set_limits(axes, panel)
    if len(shown) > 1:
        label_lines(axes)


def _set_limits(axes: "Axes", panel: Panel) -> None:
    """Set the limits of the value axis to what is drawn and what is always shown, with some air, and few ticks."""
    shown = (*axes.dataLim.intervaly, *panel.always_shown)
    span = max(shown) - min(shown)
    missing = max(0.0, panel.smallest_span - span)
    air = _HEADROOM * (span + missing) + 0.5 * missing
    axes.set_ylim(min(shown) - air, max(shown) + air)
    axes.locator_params(axis="y", nbins=_MAXIMUM_TICKS)
