"""Report of a bottle's duration and end, of its values with their sources, and of several gas demands compared."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ppafo.analyses.endurance.discharge import Discharge
from ppafo.analyses.endurance.gas_demand import GasDemand
from ppafo.documents.json_text import fields_of
from ppafo.model.cold_gas import heat_to_warm
from ppafo.model.source import bottle_content
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import TIME, Kind, duration_kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLUE, GREEN, GREY, ORANGE, VERMILION
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units import format_quantity
from ppafo.units.shown import in_units, units_beside
from ppafo.version import __version__
from ppafo.walking.bottle.coupling import Schedule
from ppafo.walking.bottle.course import duration_text, strides_text
from ppafo.walking.bottle.supply import SET_PRESSURE

FORMAT = "ppafo bottle"
_TITLE = "How long the bottle lasts"
_MASS, _FLOW = Kind("Left in the bottle", "kg", "gas mass", ".3g"), Kind("", "kg/s", "mass flow", ".3g")
_PRESSURE = Kind("Pressure in the bottle", "Pa_a", "pressure", ".3g")
_WARMTH = Kind("Temperature of the bottle", "K", "temperature", ".1f")


@dataclass(frozen=True, slots=True)
class Endurance:
    """Duration of a bottle for one gas demand: inputs and result.

    - ``bottle``: the bottle
    - ``draw``: gas demand
    - ``schedule``: times of walking and rest
    - ``discharge``: state of the bottle over time, and its end
    - ``strides_when_warm``: number of strides from a bottle at constant room temperature, to show the effect of cooling
    - ``is_of_recording``: True if a repetition is a whole recording
    - ``device_units``: display units of the device by SI unit, if it is known
    """

    bottle: Bottle
    draw: GasDemand
    schedule: Schedule
    discharge: Discharge
    strides_when_warm: float
    is_of_recording: bool = False
    device_units: Mapping[str, str] = field(default_factory=dict)

    @property
    def shown(self) -> dict[str, str]:
        """Display units by SI unit: of the device if it is known, otherwise of the bottle file."""
        return units_beside("Pa_a", self.bottle.entries["regulator.set_pressure"].unit) | dict(self.device_units)

    def json_document(self) -> dict[str, Any]:
        """Return time series, ending and bottle as plain data in SI units."""
        result, bottle = self.discharge, self.bottle
        recording = result.recording
        return {
            "format": FORMAT,
            "schema_version": 1,
            "kind": "simulated",
            "ppafo": __version__,
            "result": {
                **fields_of(result, "walking_time", "total_time", "strides"),
                "ending": asdict(result.ending),
                "coldest_temperature": float(np.min(recording["bottle_temperature"])),
                "at_end": {name: float(recording[name][-1]) for name in recording.names},
                "balance": result.balance._asdict(),
                "strides_when_warm": self.strides_when_warm,
            },
            "draw": asdict(self.draw) | {"mean_flow": self.draw.mean_flow},
            "schedule": self.schedule._asdict(),
            "bottle": {
                **fields_of(bottle, "name", "title", "volume"),
                "fluid": bottle.fluid.name,
                "properties": bottle.fluid.source,
                "gas_mass": bottle.mass,
                "values": {path: asdict(entry) for path, entry in bottle.entries.items()},
            },
        }


@dataclass(frozen=True, slots=True)
class Endurances:
    """Durations of the same bottle for several gas demands, by name."""

    uses: Mapping[str, Endurance]

    def json_document(self) -> dict[str, Any]:
        """Return the results of all gas demands as plain data in SI units."""
        return {"recordings": {name: use.json_document() for name, use in self.uses.items()}}


_LEFT_OUT = (
    "Not in the model: a regulator that its gas cools or ices, unless a walk is on the bottle; liquid carried out "
    "with the vapour, a bottle upside down, leaking connections, and ice on the outside of the bottle."
)
_CAPTION = "Temperature, pressure and gas in the bottle from full to the end."


@in_units(lambda endurance: endurance.shown)
def finding_of(endurance: Endurance) -> Finding[Endurance]:
    """Return the report of a bottle's duration for one gas demand: text, tables and panels."""
    values = [
        (path, format_quantity(entry.value, entry.unit), entry.origin, entry.source)
        for path, entry in endurance.bottle.entries.items()
    ]
    return Finding(
        name="endurance",
        kicker="Endurance",
        title=_TITLE,
        said=(endurance.bottle.title, f"gas use: {endurance.draw.origin}"),
        parts=(
            Section(columns=facts(_facts(endurance))),
            Section(
                "The bottle over time",
                panels=partial(endurance_panels, endurance),
                name="endurance",
                caption=_CAPTION,
                size=(5.4, 1.8),
                title=f"{endurance.bottle.label}: {_MASS.text(endurance.draw.mass_per_stride)} per "
                f"{_counted(endurance)} of {TIME.text(endurance.draw.stride_time, '.3g')}",
                note=f"End: {endurance.discharge.ending.message}.",
                remarks=(_LEFT_OUT,),
                is_detail=True,
            ),
            Section(
                "Values",
                columns_of(("value", "", "origin", "source"), values),
                remarks=(f"Gas properties: {endurance.bottle.fluid.source}.",),
                left=4,
                is_detail=True,
            ),
        ),
        found=endurance,
        files={"bottle.csv": partial(marked_csv_bytes, endurance.discharge.recording)},
    )


@in_units(lambda several: next(iter(several.uses.values())).shown)
def finding_of_several(several: Endurances) -> Finding[Endurances]:
    """Return the report of a bottle's durations for several gas demands, compared in one table."""
    are_strides = all(_counted(use) == "stride" for use in several.uses.values())
    counted, time = ("stride", "walking") if are_strides else ("repetition", "run time")
    longest = max(use.discharge.walking_time for use in several.uses.values())
    titles = ("gas use", (f"gas per {counted}", _MASS), (time, duration_kind(longest)), f"{counted}s", "ended")
    rows = [
        (name, draw.mass_per_stride, ended.walking_time, strides_text(ended.strides), ended.ending.kind)
        for name, draw, ended in ((name, use.draw, use.discharge) for name, use in several.uses.items())
    ]
    return Finding(
        name="endurance",
        kicker="Endurance",
        title=_TITLE,
        said=(next(iter(several.uses.values())).bottle.title,),
        parts=(
            Section(columns=columns_of(titles, rows)),
            Section("Not in the model", said=(_LEFT_OUT,), is_detail=True),
        ),
        found=several,
    )


def _counted(endurance: Endurance) -> str:
    return "repetition" if endurance.is_of_recording else "stride"


def endurance_panels(endurance: Endurance) -> list[Panel]:
    """Return the panels of temperature, pressure and gas of the bottle over time."""
    recording, bottle = endurance.discharge.recording, endurance.bottle
    time, needed = recording.time, bottle.regulator.set_pressure + bottle.regulator.pressure_margin
    dotted, dashed = ({"linestyle": style, "linewidth": 1.2} for style in (":", "--"))
    channels = (
        (_WARMTH, "wall_temperature", "wall", ORANGE),
        (_WARMTH, "bottle_temperature", "content", BLUE),
        (_PRESSURE, "bottle_pressure", "bottle", BLUE),
        (_MASS, "bottle_mass", "total gas", BLUE),
        (_MASS, "liquid_mass", "liquid", GREEN),
    )
    marks: dict[Kind, list[Mark]] = {
        _WARMTH: [Mark("level", (), bottle.room_temperature, (), "room", GREY, dotted)],
        _PRESSURE: [Mark("level", (), needed, (), "needed", VERMILION, dashed)],
        _MASS: [],
    }
    for kind, name, label, colour in channels:
        if name in recording:
            marks[kind].append(Mark("line", time, recording[name], (), label, colour))
    axis = duration_kind(float(time[-1]))
    end = float(axis.values(time[-1]))
    return [
        Panel(axis, kind, lines, then=lambda axes: axes.set_xlim(0.0, end), shares_x=True)
        for kind, lines in marks.items()
    ]


def _facts(endurance: Endurance) -> list[tuple[str, str]]:
    """Return the most important results of a discharge as pairs of name and value."""
    result, draw = endurance.discharge, endurance.draw
    recording, bottle, room = result.recording, endurance.bottle, endurance.bottle.room_temperature
    # What warms the gas of the full bottle to the room's temperature behind the regulator.
    content = bottle_content(bottle.fluid.table, bottle.mass, bottle.volume, room)
    heat = heat_to_warm(bottle.fluid.table, content, room, bottle.regulator.set_pressure)
    counted = _counted(endurance)
    of_device = ", the supply pressure of the device" * (bottle.entries[SET_PRESSURE].origin == "derived")
    use = "of use" if endurance.is_of_recording else "of walking"
    rows = [
        ("run time", f"{duration_text(result.walking_time)} {use}, {duration_text(result.total_time)} in total"),
        ("strides" if counted == "stride" else "repetitions of the recording", strides_text(result.strides)),
        (
            f"{counted}s without cooling",
            f"{strides_text(endurance.strides_when_warm)} (a bottle that stays at room temperature)",
        ),
        ("regulator set to", _PRESSURE.text(bottle.regulator.set_pressure) + of_device),
        ("ended", result.ending.message),
        (
            "gas",
            f"{_MASS.text(draw.mass_per_stride)} a {counted}, {_FLOW.text(draw.mean_flow)}, largest "
            f"{_FLOW.text(draw.peak_flow)}",
        ),
        ("heat that it lacks", f"{heat * draw.mean_flow:.3g} W, {heat / 1000.0:.3g} kJ/kg, at the start"),
        ("lowest temperature of the fluid", _WARMTH.text(float(np.min(recording["bottle_temperature"])))),
        ("pressure at the end", _PRESSURE.text(float(recording["bottle_pressure"][-1]))),
    ]
    if "liquid_mass" in recording:
        dry = np.flatnonzero(recording["liquid_mass"] <= 0.0)
        remaining = f"no, {_MASS.text(float(recording['liquid_mass'][-1]))} left"
        used_up = f"after {duration_text(float(recording.time[dry[0]]))}" if dry.size else remaining
        rows.append(("liquid used up", used_up))
    return rows
