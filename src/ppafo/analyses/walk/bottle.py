"""Gas bottle in the report of a walk: facts, data and figure."""

from functools import partial
from typing import Any

import numpy as np

from ppafo.report.finding import Section, facts
from ppafo.report.kind import Kind
from ppafo.walking.bottle.course import SupplyCourse, duration_text, strides_text
from ppafo.walking.figures.bottle import bottle_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult

_CAPTION = (
    "Gas supply over the walk. A regulator delivers its set pressure at most, and less as the bottle empties. "
    "Gas at the device leaves the hose."
)
_EXPLAINED = (
    "The vapour of liquid CO2 at 20 degC needs 95 kJ/kg to become gas of 25 degC behind the regulator. It draws "
    "this heat from the regulator's body and the hose, and these from the room. Below the triple point dry ice "
    "stays in the seat and narrows it. The gas in lines and chambers keeps the temperature with which it leaves the "
    "hose; in reality their walls warm it, so its effect is overestimated here.",
    "A walk ends when the line behind the regulator does not reach the given fraction of the set pressure within two "
    "strides, or when the fluid in the bottle freezes.",
)
_TORQUE, _GAS = (Kind(quantity=name, form=".3g") for name in ("torque", "gas mass"))
_SHARE, _WARMTH, _PRESSURE = (Kind(quantity=name, form=".0f") for name in ("fraction", "temperature", "pressure"))


def bottle_parts(worn: WalkResult) -> tuple[Section, ...]:
    """Return the facts of the bottle of a walk, its figure and an explanation; () for a walk without a bottle."""
    supply = worn.supply
    if supply is None:
        return ()
    draw, caption = partial(bottle_figure, worn), _CAPTION
    return (
        Section("On the bottle", facts(_facts(worn, supply))),
        Section("The bottle over the walk", name="bottle", caption=caption, draw=draw, is_detail=True),
        Section("How to read the bottle", said=_EXPLAINED, is_detail=True),
    )


def _facts(worn: WalkResult, supply: SupplyCourse) -> list[tuple[str, str]]:
    """Return end of the walk and its time, gas used, and lowest temperatures, as pairs of name and value."""
    values, motion, peaks = supply.values, walk_of(worn.scenario), worn.peak_torques
    end = {name: float(series[-1]) for name, series in values.items()}
    filled = f"{_GAS.text(supply.supply.mass)} at {_WARMTH.text(supply.supply.temperature)}"
    remaining = _GAS.text(end["bottle_mass"])
    if "liquid_mass" in values:
        remaining += f", {_GAS.text(end['liquid_mass'])} of it liquid"
    # Strides are counted by time, as ``ppafo bottle`` counts them.
    strides = strides_text(supply.ending.time / motion.gait.stride_time)
    walked = f"{strides} strides, {worn.metrics['strides'].value:.0f} of them whole between strikes"
    rows = [
        ("bottle", f"{supply.supply.bottle.title}, with {filled}"),
        ("reason for the end", supply.ending.message),
        ("when", f"{duration_text(supply.ending.time)}, {walked}"),
        ("gas used", f"{_GAS.text(supply.balance.left_bottle)}, left {remaining}"),
        ("bottle at the end", f"{_WARMTH.text(end['bottle_temperature'])}, {_PRESSURE.text(end['bottle_pressure'])}"),
        ("coldest gas behind the regulator", _WARMTH.text(float(values["outlet_temperature"].min()))),
        ("coldest gas at the device", _WARMTH.text(float(values["gas_temperature"].min()))),
        ("seat free of ice, at least", _SHARE.text(float(values["seat_open"].min()))),
    ]
    # The third stride is the first in which the controller knows the stride time.
    if peaks.size > 3:
        third, last = _TORQUE.text(float(peaks[2])), _TORQUE.text(float(peaks[-1]))
        rows.append(("push-off peak by stride", f"{third} in the third, {last} in the last"))
    return rows


def bottle_data(worn: WalkResult) -> dict[str, Any]:
    """Return the supply as data in SI units: end, balances, final and lowest values; {} without a bottle."""
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
