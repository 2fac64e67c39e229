"""What ``ppafo endurance`` says: lines of text, a JSON document, a short report, and all files of its folder."""

from dataclasses import asdict
from typing import Any

import numpy as np

import ppafo
from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.documents.json_text import json_text
from ppafo.reporting.endurance_figure import ICE_POINT, endurance_figure, minutes_text
from ppafo.reporting.endurance_table import chambers_sentence
from ppafo.reporting.style import rendered
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.studies.endurance import Discharge, Endurance, Reuse
from ppafo.units import format_quantity, from_si

DOCUMENT = "endurance.json"
FORMAT = "ppafo endurance"
FILES = (DOCUMENT, "endurance.md", "bottle.csv", "endurance.png", "endurance.svg")

LEFT_OUT = (
    "Not in the model: the regulator's own cooling, wet vapour carried along, a bottle held upside down, leaks of the "
    "connections, and ice on the outside of the bottle."
)


REUSE_ASSUMES = (
    "Accounting for ideal gas at constant temperature: pressures become equal, check valves lose nothing, "
    "nothing leaks, and the reservoir has settled over many steps."
)


def endurance_text(made: Endurance) -> list[str]:
    """Return what came out as lines for a terminal."""
    width = max(len(name) for name, _ in _rows(made))
    return [f"{made.bottle.title}", f"gas use: {made.draw.origin}", ""] + [
        f"{name:<{width}}  {value}" for name, value in _rows(made)
    ]


def endurance_document(made: Endurance) -> dict[str, Any]:
    """Return everything as plain data in SI units."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "schema_version": 1,
        "kind": "simulated",
        "ppafo": ppafo.__version__,
        "result": _course(made.discharge) | {"steps_when_warm": made.steps_when_warm},
        "draw": asdict(made.draw) | {"mean_flow": made.draw.mean_flow},
        "schedule": asdict(made.schedule),
        "bottle": _bottle(made),
    }
    if made.reuse is not None and made.without_reuse is not None:
        cycle, balance = made.reuse.cycle._asdict(), made.reuse.balance._asdict()
        document["reuse"] = {"cycle": cycle, "balance": balance, "without_reuse": _course(made.without_reuse)}
        document["reuse"]["origins"] = dict(made.reuse.origins)
    return document


def endurance_markdown(made: Endurance) -> str:
    """Return the short report."""
    rows = "\n".join(f"| {name} | {value} |" for name, value in _rows(made))
    values = "\n".join(
        f"| `{path}` | {format_quantity(entry.value, entry.unit)} | {entry.origin} | {entry.source} |"
        for path, entry in made.bottle.entries.items()
    )
    return (
        f"# How long the bottle lasts\n\n{made.bottle.title}. Gas use: {made.draw.origin}. Everything here is "
        f"simulated.\n\n![Course of the bottle](endurance.svg)\n\n| | |\n|---|---|\n{rows}\n\n{LEFT_OUT}\n\n"
        f"## Values\n\nGas properties: {made.bottle.fluid.source}.\n\n"
        f"| Value | | Origin | Source |\n|---|---|---|---|\n{values}\n"
        + ("" if made.reuse is None else _reuse_section(made.reuse))
    )


def _reuse_section(reused: Reuse) -> str:
    """Return what the reuse of the exhaust was reckoned with, in the units of the field."""
    cycle = reused.cycle
    pressures = {name: getattr(cycle, name) for name in ("exhaust_pressure", "fill_pressure", "atmospheric_pressure")}
    volumes = {name: getattr(cycle, name) for name in ("exhaust_volume", "fill_volume", "reservoir_volume")}
    shown = {name: f"{value / PASCALS_PER_PSI:.3g} psi absolute" for name, value in pressures.items()}
    shown |= {name: f"{from_si(value, 'cm^3', 'm^3'):.3g} cm^3" for name, value in volumes.items()}
    origins = reused.origins
    table = "\n".join(f"| `{name}` | {text} | {origins.get(name, 'standard')} |" for name, text in shown.items())
    return f"\n## Reuse of the exhaust\n\n{REUSE_ASSUMES}\n\n| Value | | Origin |\n|---|---|---|\n{table}\n"


def endurance_files(made: Endurance) -> dict[str, bytes]:
    """Return every file by name."""
    drawn = rendered(endurance_figure(made), ("png", "svg"))
    return {
        DOCUMENT: f"{json_text(endurance_document(made))}\n".encode(),
        "endurance.md": endurance_markdown(made).encode(),
        "bottle.csv": marked_csv_bytes(made.discharge.recording),
        **{f"endurance.{file_format}": content for file_format, content in drawn.items()},
    }


def _rows(made: Endurance) -> list[tuple[str, str]]:
    """Return name and value of everything that a reader wants first."""
    course, draw = made.discharge, made.draw
    recording = course.recording
    rows = [
        ("run time", f"{_minutes(course.walking_time)} of walking, {_minutes(course.total_time)} in all"),
        ("steps", f"{course.steps:.0f}"),
        ("steps without cooling", f"{made.steps_when_warm:.0f} (a bottle that stays at room temperature)"),
        ("ended", course.ending.message),
        ("gas", f"{_grams(draw.mass_per_step)} a step, {_grams(draw.mean_flow)}/s, largest {_grams(draw.peak_flow)}/s"),
        ("coldest content", _celsius(float(np.min(recording["bottle_temperature"])))),
        ("pressure at the end", f"{recording['bottle_pressure'][-1] / PASCALS_PER_PSI:.0f} psi absolute"),
    ]
    if "liquid_mass" in recording:
        rows.append(("liquid used up", _dry_since(course)))
    return rows + (_reuse_rows(made, made.reuse, made.without_reuse) if made.reuse and made.without_reuse else [])


def _reuse_rows(made: Endurance, reused: Reuse, without: Discharge) -> list[tuple[str, str]]:
    balance = reused.balance
    before = made.draw.mass_per_step + balance.returned_mass
    return [
        (
            "exhaust reused",
            f"{_grams(balance.returned_mass)} a step, {balance.returned_mass / before:.1%} of "
            f"{_grams(before)}; the exhaust holds {_grams(balance.exhausted_mass)}",
        ),
        ("chambers", chambers_sentence(reused)),
        ("without reuse", f"{_minutes(without.walking_time)} of walking, {without.steps:.0f} steps"),
    ]


def _dry_since(course: Discharge) -> str:
    liquid = course.recording["liquid_mass"]
    dry = np.flatnonzero(liquid <= 0.0)
    if not dry.size:
        return f"no, {_grams(float(liquid[-1]))} of it left"
    return f"after {_minutes(float(course.recording.time[dry[0]]))}"


def _course(course: Discharge) -> dict[str, Any]:
    recording = course.recording
    at_end = {name: float(recording[name][-1]) for name in recording.names}
    return {
        "walking_time": course.walking_time,
        "total_time": course.total_time,
        "steps": course.steps,
        "ending": asdict(course.ending),
        "coldest_temperature": float(np.min(recording["bottle_temperature"])),
        "at_end": at_end,
        "balance": asdict(course.balance),
    }


def _bottle(made: Endurance) -> dict[str, Any]:
    bottle = made.bottle
    return {
        "name": bottle.name,
        "title": bottle.title,
        "fluid": bottle.fluid.name,
        "properties": bottle.fluid.source,
        "gas_mass": bottle.mass,
        "volume": bottle.volume,
        "values": {path: entry.model_dump() for path, entry in bottle.entries.items()},
    }


def _minutes(seconds: float) -> str:
    return f"{minutes_text(seconds)} min"


def _grams(kilograms: float) -> str:
    return f"{kilograms * GRAMS_PER_KILOGRAM:.3g} g"


def _celsius(kelvin: float) -> str:
    return f"{kelvin - ICE_POINT:.1f} degC"
