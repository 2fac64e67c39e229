"""What is said of a walk's safety: what is fitted, pressures far above the supply, less help over time."""

import math
from functools import partial

from ppafo.control.walking.assistance import PEAKS
from ppafo.report.display_units import quantity_text
from ppafo.report.finding import Part
from ppafo.report.kind import Kind
from ppafo.walking.events import event_lines, failure_times
from ppafo.walking.figures.whole_walk import whole_walk_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult

_OVER_TIME = (
    "Gas, toes and phases over the whole walk. The strip at the bottom shows where the controller helps, only lifts "
    "the foot, pauses or has stopped. A red line is where there is less help, a dashed one where something fails."
)
_TORQUE = Kind("", "N m", "torque", ".3g")
_FAR_ABOVE = 2.0
"""Largest pressure in a chamber over its supply, both absolute, above which it is said; healthy wearers stay below."""


def safety_remarks(worn: WalkResult) -> list[str]:
    """Return what is fitted, torques above the limit, pressures far above the supply, pauses, stop, strides helped."""
    scenario, supply = worn.scenario, worn.scenario.device.supply
    remarks = []
    fitted = walk_of(scenario).shut_off
    if fitted:
        mass, power = 1.0e3 * float(fitted["mass"]), float(fitted["power"])
        remarks.append(
            f"shut-off valve: {mass:.0f} g, {power:.2g} W as long as the device helps ({60.0 * power:.0f} J a minute)"
        )
    # Peaks of the desired torque above the limit of the controller, which requests no more.
    settings = scenario.controller.settings
    limit = settings.get("largest_torque", math.inf)
    cut = [f"controller.{name} = {_TORQUE.text(settings[name])}" for name in PEAKS if settings.get(name, 0.0) > limit]
    if cut:
        shown = _TORQUE.text(limit)
        remarks.append(
            f"{', '.join(cut)}: no more than controller.largest_torque = {shown} is requested; set that higher too"
        )
    # Where the foot drives the vane to its end, it compresses a chamber far above its supply.
    for channel, words, given in (
        ("pressure_1", "chamber 1", supply.pressure),
        ("pressure_2", "chamber 2", supply.dorsiflexion_pressure),
    ):
        largest = float(worn.recording[channel].max()) if channel in worn.recording else 0.0
        if largest > _FAR_ABOVE * given:
            reached, fed = (
                quantity_text(value, "pressure", ".3g", supply.atmospheric_pressure) for value in (largest, given)
            )
            remarks.append(
                f"the pressure in {words} reaches {reached}, and its supply is set to {fed}: "
                "actuator, valves and tubing must withstand that"
            )
    if not worn.events:
        return remarks
    helped, strides = int(worn.helped.sum()), worn.helped.size
    remarks += event_lines(worn.events)
    if strides:
        enough = "" if worn.is_helped else ": fewer than half"
        remarks.append(f"help in {helped} of {strides} strides{enough}")
    return remarks


def over_time_parts(worn: WalkResult) -> tuple[Part, ...]:
    """Return the walk over time, where something happened in it."""
    # A figure of an even walk shows nothing that the mean stride does not.
    if not worn.events and not failure_times(worn.scenario):
        return ()
    draw = partial(whole_walk_figure, worn)
    return (Part("The walk over time", name="over-time", caption=_OVER_TIME, draw=draw, is_detail=True),)
