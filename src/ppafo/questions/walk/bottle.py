"""What the answer of a walk says of the bottle that the device hangs on: what ended it, how cold, what is left."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ppafo.answers import Figure, Section, Table
from ppafo.answers.display_units import quantity_text
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.walking.figures.bottle import bottle_figure, peak_torques
from ppafo.walking.on_bottle import WALKED, SupplyCourse
from ppafo.walking.result import WalkResult

_CAPTION = (
    "The supply over the walk. A regulator holds at most its set pressure, and less once the bottle has too little. "
    "Gas at the device is what comes out of the hose."
)
_EXPLAINED = (
    "The vapour of liquid CO2 lacks heat: from 20 degC it wants 95 kJ/kg to be gas of 25 degC behind the regulator. It "
    "takes it from the regulator's body and from the hose, which take it from the room. Below the triple point dry ice "
    "stays in the seat and narrows it. The gas in lines and chambers keeps the temperature with which it leaves the "
    "hose; in truth their walls warm it, so its effect here is the largest that it can have.",
    "A walk ends where the line behind the regulator no longer comes within the given share of the set pressure in two "
    "strides, or where the content of the bottle freezes.",
)


def bottle_sections(worn: WalkResult) -> tuple[Section, ...]:
    """Return the facts of the bottle of a walk, its figure and how to read them; nothing without a bottle."""
    supply = worn.supply
    if supply is None:
        return ()
    figure = Figure("bottle", _CAPTION, lambda: bottle_figure(worn))
    return (
        Section("On the bottle", table=Table((), tuple(_facts(worn, supply)))),
        Section("The bottle over the walk", figure=figure, is_detail=True),
        Section("How to read the bottle", _EXPLAINED, is_detail=True),
    )


def bottle_remark(worn: WalkResult) -> str:
    """Return what ended a walk on its bottle, and when; empty without a bottle."""
    supply = worn.supply
    if supply is None:
        return ""
    ended = "" if supply.ending.kind == WALKED else f"ended after {quantity_text(supply.ending.time, 'duration')}: "
    return f"bottle {supply.supply.bottle.name}: {ended}{supply.ending.message}"


def _facts(worn: WalkResult, supply: SupplyCourse) -> list[tuple[str, str]]:
    values, peaks = supply.values, peak_torques(worn)
    bottle = supply.supply.bottle
    liquid = f", {_gas(float(values['liquid_mass'][-1]))} of it liquid" if "liquid_mass" in values else ""
    rows = [
        ("bottle", f"{bottle.title}, with {_gas(supply.supply.mass)} at {_warmth(supply.supply.temperature)}"),
        ("what ended it", supply.ending.message),
        ("when", f"{quantity_text(supply.ending.time, 'duration')}, after {worn.helped.size} strides"),
        ("gas used", f"{_gas(supply.balance.left_bottle)}, left {_gas(float(values['bottle_mass'][-1]))}{liquid}"),
        ("bottle at the end", f"{_warmth(float(values['bottle_temperature'][-1]))}, {_pressure(supply)}"),
        ("coldest gas behind the regulator", _warmth(float(values["outlet_temperature"].min()))),
        ("coldest gas at the device", _warmth(float(values["gas_temperature"].min()))),
        ("seat free of ice, at least", quantity_text(float(values["seat_open"].min()), "fraction", ".0f")),
    ]
    if peaks.size > 3:
        third, last = (quantity_text(float(peak), "torque") for peak in (peaks[2], peaks[-1]))
        rows.append(("peak torque of a stride", f"{third} in the third, {last} in the last"))
    return rows


def bottle_data(worn: WalkResult) -> dict[str, Any]:
    """Return the supply as data in SI units: what ended it, what closes, all at the end; nothing without a bottle."""
    supply = worn.supply
    if supply is None:
        return {}
    return {
        "supply": {
            **supply.supply.to_dict(),
            "ending": supply.ending._asdict(),
            "balance": supply.balance._asdict(),
            "at_end": {name: float(values[-1]) for name, values in supply.values.items()},
            "lowest": {name: float(np.min(values)) for name, values in supply.values.items()},
        }
    }


def bottle_files(worn: WalkResult) -> dict[str, Callable[[], bytes]]:
    """Return the file with the course of the bottle; nothing without one."""
    supply = worn.supply
    return {} if supply is None else {"bottle.csv": lambda: marked_csv_bytes(supply.recording)}


def _gas(mass: float) -> str:
    return quantity_text(mass, "gas mass")


def _warmth(temperature: float) -> str:
    return quantity_text(temperature, "temperature", ".0f")


def _pressure(supply: SupplyCourse) -> str:
    return quantity_text(float(supply.values["bottle_pressure"][-1]), "pressure", ".0f")
