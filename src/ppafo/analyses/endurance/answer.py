"""The answer about a bottle: how long it lasts and why it ends, its values with their sources; several side by side."""

import textwrap
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.endurance.discharge import Discharge
from ppafo.analyses.endurance.draw import Draw
from ppafo.model.cold_gas import heat_to_warm
from ppafo.model.source import bottle_content
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.report import Answer, Column, Figure, Section, Table
from ppafo.report.display_units import axis_unit, display_value, display_values, quantity_text
from ppafo.report.solved import Solved
from ppafo.report.style import (
    BLUE,
    GREY,
    ORANGE,
    VERMILION,
    Margins,
    figure_of_panels,
    house_style,
    label_lines,
    mark_kind,
)
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units import format_quantity
from ppafo.version import __version__
from ppafo.walking.bottle import Schedule, minutes_text, strides_text
from ppafo.walking.figures.over_time import draw_bottle_pressure, draw_gas_left

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes


@dataclass(frozen=True, slots=True, repr=False)
class Endurance(Solved):
    """The request and its result.

    ``discharge`` is the requested course. ``strides_when_warm`` is the number of strides that a bottle which stays at
    room temperature gives: what cooling costs. ``is_of_course`` is true where a stride is a course.
    """

    bottle: Bottle
    draw: Draw
    schedule: Schedule
    discharge: Discharge
    strides_when_warm: float
    is_of_course: bool = False


@dataclass(frozen=True, slots=True, repr=False)
class Endurances(Solved):
    """Several gas uses on the same bottle, by name."""

    uses: Mapping[str, Endurance]


_WIDTH, _LEFT, _RIGHT = 7.2, 0.62, 0.2
_PANEL, _GAP, _TOP, _BOTTOM, _REMARK_LINE = 1.5, 0.45, 0.75, 0.62, 0.17
"""Inches."""
_REMARK_WIDTH = 105
_PANELS = 3


def endurance_figure(found: Endurance) -> "matplotlib.figure.Figure":
    """Return the figure of the requested course; below it stands how it ended."""
    recording = found.discharge.recording
    minutes = display_values(recording.time, "duration")
    remarks = textwrap.wrap(f"End: {found.discharge.ending.message}.", _REMARK_WIDTH)
    bottom = _BOTTOM + _REMARK_LINE * len(remarks)
    height = _TOP + _PANELS * _PANEL + (_PANELS - 1) * _GAP + bottom
    with house_style():
        figure, rows = figure_of_panels((_WIDTH, height), Margins(_LEFT, _RIGHT, _TOP, bottom, _GAP), _PANELS)
        grid = [axes for (axes,) in rows]
        _draw_temperature(grid[0], found, minutes)
        draw_bottle_pressure(grid[1], minutes, recording["bottle_pressure"], found.bottle.regulator)
        draw_gas_left(grid[2], minutes, recording, found.bottle.mass)
        for axes in grid:
            axes.locator_params(axis="y", nbins=5)
        grid[-1].set_xlabel(f"Time ({axis_unit('duration')})")
        grid[-1].set_xlim(0.0, float(minutes[-1]))
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, _title(found), va="top", fontsize=13, fontweight="bold")
        figure.text(0.12 / _WIDTH, 0.1 / height, "\n".join(remarks), va="bottom", fontsize=9, color=VERMILION)
        mark_kind(figure, recording.kind)
        return figure


def _title(found: Endurance) -> str:
    gas, time = quantity_text(found.draw.mass_per_stride, "gas mass"), quantity_text(found.draw.stride_time, "time")
    return f"{found.bottle.name}: {gas} per stride of {time}"


def _draw_temperature(axes: "Axes", found: Endurance, minutes: Floats) -> None:
    recording = found.discharge.recording
    axes.axhline(
        display_value(found.bottle.room_temperature, "temperature"),
        color=GREY,
        linestyle=":",
        linewidth=1.2,
        label="room",
    )
    axes.plot(minutes, display_values(recording["wall_temperature"], "temperature"), color=ORANGE, label="wall")
    axes.plot(minutes, display_values(recording["bottle_temperature"], "temperature"), color=BLUE, label="fluid")
    axes.set_title(f"Temperature of the bottle ({axis_unit('temperature')})")
    label_lines(axes)


FORMAT = "ppafo bottle"
_LEFT_OUT = (
    "Not in the model: a regulator that its gas cools or ices, unless a walk is on the bottle; liquid carried out "
    "with the vapour, a bottle upside down, leaking connections, and ice on the outside of the bottle."
)
_CAPTION = "Temperature, pressure and gas in the bottle from full to the end."
_USE = (Column("gas use"), Column("gas per stride", "gas mass", ".3g"))
_COURSE = (Column("walking", "duration"), Column("strides"))


def answer_of(found: Endurance | Endurances) -> Answer:
    """Return the answer for one gas use, or for several side by side."""
    return _answer_of_one(found) if isinstance(found, Endurance) else _answer_of_several(found)


def _answer_of_one(found: Endurance) -> Answer:
    figure = Figure("endurance", _CAPTION, lambda: endurance_figure(found))
    head = tuple(map(Column, ("value", "", "origin", "source")))
    rows = tuple(
        (path, format_quantity(entry.value, entry.unit), entry.origin, entry.source)
        for path, entry in found.bottle.entries.items()
    )
    properties = f"Gas properties: {found.bottle.fluid.source}."
    return Answer(
        name="endurance",
        kicker="Endurance",
        title="How long the bottle lasts",
        lead=(found.bottle.title, f"gas use: {found.draw.origin}"),
        sections=(
            Section(table=Table((), tuple(_facts(found)))),
            Section("The bottle over time", figure=figure, remarks=(_LEFT_OUT,), is_detail=True),
            Section("Values", table=Table(head, rows, left=4), remarks=(properties,), is_detail=True),
        ),
        data=_data(found),
        files={"bottle.csv": lambda: marked_csv_bytes(found.discharge.recording)},
    )


def _answer_of_several(several: Endurances) -> Answer:
    uses = several.uses
    first = next(iter(uses.values()))
    head = (*_USE, *_COURSE, Column("ended"))
    return Answer(
        name="endurance",
        kicker="Endurance",
        title="How long the bottle lasts",
        lead=(first.bottle.title,),
        sections=(
            Section(table=Table(head, tuple((name, *_cells(one)) for name, one in uses.items()))),
            Section("What is not in the model", (_LEFT_OUT,), is_detail=True),
        ),
        data={"recordings": {name: _data(one) for name, one in uses.items()}},
    )


def _cells(one: Endurance) -> tuple[str | float, ...]:
    course = one.discharge
    return one.draw.mass_per_stride, course.walking_time, strides_text(course.strides), course.ending.kind


def _facts(found: Endurance) -> list[tuple[str, str]]:
    """Return name and value of everything that a reader wants first."""
    course, draw = found.discharge, found.draw
    recording = course.recording
    flows = [quantity_text(flow, "mass flow") for flow in (draw.mean_flow, draw.peak_flow)]
    rows = [
        ("run time", f"{minutes_text(course.walking_time)} of walking, {minutes_text(course.total_time)} in total"),
        ("strides", strides_text(course.strides)),
        (
            "strides without cooling",
            f"{strides_text(found.strides_when_warm)} (a bottle that stays at room temperature)",
        ),
        ("ended", course.ending.message),
        ("gas", f"{_gas(draw.mass_per_stride)} a stride, {flows[0]}, largest {flows[1]}"),
        ("heat that it lacks", _lacking_heat(found)),
        (
            "lowest temperature of the fluid",
            quantity_text(float(np.min(recording["bottle_temperature"])), "temperature", ".1f"),
        ),
        ("pressure at the end", quantity_text(float(recording["bottle_pressure"][-1]), "pressure", ".0f")),
    ]
    if "liquid_mass" in recording:
        rows.append(("liquid used up", _dry_since(course)))
    return rows


def _lacking_heat(found: Endurance) -> str:
    """Return what warms the gas of the full bottle to the room's temperature behind the regulator."""
    bottle, room = found.bottle, found.bottle.room_temperature
    content = bottle_content(bottle.fluid.table, bottle.mass, bottle.volume, room)
    heat = heat_to_warm(bottle.fluid.table, content, room, bottle.regulator.set_pressure)
    return f"{quantity_text(heat * found.draw.mean_flow, 'power')}, {heat / 1000.0:.3g} kJ/kg, at the start"


def _dry_since(course: Discharge) -> str:
    liquid = course.recording["liquid_mass"]
    dry = np.flatnonzero(liquid <= 0.0)
    if not dry.size:
        return f"no, {_gas(float(liquid[-1]))} left"
    return f"after {minutes_text(float(course.recording.time[dry[0]]))}"


def _data(found: Endurance) -> dict[str, Any]:
    data: dict[str, Any] = {
        "format": FORMAT,
        "schema_version": 1,
        "kind": "simulated",
        "ppafo": __version__,
        "result": _course_data(found.discharge) | {"strides_when_warm": found.strides_when_warm},
        "draw": asdict(found.draw) | {"mean_flow": found.draw.mean_flow},
        "schedule": found.schedule._asdict(),
        "bottle": _bottle_data(found),
    }
    return data


def _course_data(course: Discharge) -> dict[str, Any]:
    recording = course.recording
    return {
        "walking_time": course.walking_time,
        "total_time": course.total_time,
        "strides": course.strides,
        "ending": asdict(course.ending),
        "coldest_temperature": float(np.min(recording["bottle_temperature"])),
        "at_end": {name: float(recording[name][-1]) for name in recording.names},
        "balance": course.balance._asdict(),
    }


def _bottle_data(found: Endurance) -> dict[str, Any]:
    bottle = found.bottle
    return {
        "name": bottle.name,
        "title": bottle.title,
        "fluid": bottle.fluid.name,
        "properties": bottle.fluid.source,
        "gas_mass": bottle.mass,
        "volume": bottle.volume,
        "values": {path: entry.model_dump() for path, entry in bottle.entries.items()},
    }


def _gas(mass: float) -> str:
    return quantity_text(mass, "gas mass")
