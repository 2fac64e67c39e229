"""Smallest change of the controlled quantity by a pair of on/off valves: the change during their dead time."""

import logging
import math
from collections.abc import Callable, Collection, Iterable
from typing import TYPE_CHECKING

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import SAMPLES_LATE
from ppafo.model.controlled import ANGLE, CONTROLLED
from ppafo.simulation.gains import loop_of
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import change_text, smaller_pair
from ppafo.simulation.tracking.rule import REVERSALS, is_pair, most_reversals
from ppafo.simulation.tracking.settled import smallest_change
from ppafo.units.shown import in_units
from ppafo.wording import subject_text, without_exponent

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import RecordedResult

logger = logging.getLogger("ppafo")

_TRAVEL_TIMES: dict[str, Callable[[float], float]] = {
    "opening_delay": lambda delay: delay,
    "closing_delay": lambda delay: delay,
    "switching_interval": lambda interval: interval,
    "spool_frequency": lambda frequency: 0.5 / frequency,
    "slew_limit": lambda slew: 2.0 / slew,
}
"""Time [s] in which a valve goes from one end to the other, from each number that limits it; 0 limits nothing.

A second-order spool takes half of its natural period, a limited slew rate two full openings.
"""
_REPORTED_SWITCHING = 20.0
"""Switching frequency of the solenoid valves of the paper [Hz], the only one that it reports."""
_SIZES = frozenset(("valve.area", "valve.sonic_conductance"))
"""Paths that set the size of the valve's orifice."""
_LARGEST_STEP = 0.25
"""Step of a pair divided by the wanted change, above which a warning is logged [-]."""


def pair_step(scenario: Scenario, law: ControllerKind) -> tuple[float, float]:
    """Step R theta of a pair [SI unit of the controlled quantity], and its dead time theta [s]."""
    loop = loop_of(scenario, law)
    return loop.rate * loop.dead_time, loop.dead_time


def quicker_text(scenario: Scenario, dead_time: float) -> str:
    """Words for what reduces the dead time [s] of an on/off loop: its valves, the rate of its controller, or both."""
    sampled = SAMPLES_LATE * scenario.controller.period
    if not is_pair(scenario):
        return "a higher `controller.rate`" if sampled > 0.5 * dead_time else "a faster valve"
    # The longer of the valves' switching interval and the delay of sampling decides.
    interval = float(scenario.device.valve.settings["switching_interval"])
    return "faster valves together with a higher `controller.rate`" if sampled > interval else "faster valves"


def unlimited_switching(result: "RecordedResult") -> str:
    """Remark on valves that reverse more often than their data permit, or than known valves do; "" for others."""
    scenario = result.scenario
    # A law that asks for gradual openings and reverses them is said to oscillate.
    if math.isfinite(most_reversals(scenario)) or REVERSALS not in result.metrics:
        return ""
    often = result.metrics[REVERSALS].value / max(result.recording.duration, 1.0)
    valve = scenario.device.valve.settings
    names = [name for name in _TRAVEL_TIMES if name in valve]
    times = {name: _TRAVEL_TIMES[name](float(valve[name])) for name in names if valve[name] > 0.0}
    slowest = max(times, key=lambda name: times[name], default="")
    allowed = 1.0 / times[slowest] if slowest else 0.0
    if often <= max(_REPORTED_SWITCHING, allowed):
        return ""
    reversals = f"the valves are reversed {without_exponent(often, '.3g')} times a second"
    if slowest:
        return (
            f"{reversals}, but `valve.{slowest}` lets them open and shut fully at most "
            f"{without_exponent(allowed, '.3g')} times a second: they remain partly open, which on/off control does "
            "not expect; use a wider dead zone or a faster valve"
        )
    missing = ", ".join(f"`valve.{name}`" for name in names)
    return f"{reversals}, and no value of the parameter set limits this rate ({missing} are 0): give these values"


def warn_of_coarse_pairs(scenarios: Iterable[Scenario], varied: Collection[str] = ()) -> None:
    """Log a warning for each scenario with a too coarse pair of valves, before the runs; equal warnings once.

    ``varied`` are the paths that the runs vary: none is logged if these include the size of the valve.
    """
    for text in dict.fromkeys(coarse_pair(scenario, varied) for scenario in scenarios):
        if text:
            logger.warning("ppafo: %s", text)


@in_units(lambda scenario, *_: scenario.device.shown)
def coarse_pair(scenario: Scenario, varied: Collection[str] = ()) -> str:
    """Warning for a pair whose step exceeds a quarter of the wanted change of torque or pressure; "" without one.

    In a walk the wanted change is the largest torque of a torque controller. Angle loops are not checked, because their
    step depends on the joint as much as on the pair; nor are runs whose ``varied`` paths replace the valve's size.
    """
    law, controlled = scenario.law, CONTROLLED[scenario.controlled]
    if law is None or not is_pair(scenario) or controlled.name == ANGLE or not _SIZES.isdisjoint(varied):
        return ""
    if scenario.follows_reference:
        initial = scenario.initial
        start = float(controlled.value(0.0, initial.pressure_1, initial.pressure_2, 0.0))
        extent = max(abs(float(bound) - start) for bound in profile_bounds(scenario.reference))
        wanted = max(extent, smallest_change(scenario))
    else:
        # A walking controller such as event_on_off holds one state of the pair for each phase, and tracks no torque.
        wanted = scenario.controller.settings.get("largest_torque", 0.0) if law.name in CONTROLLERS else 0.0
    if wanted == 0.0:
        return ""
    step, dead_time = pair_step(scenario, law)
    ratio = step / wanted
    if ratio <= _LARGEST_STEP:
        return ""
    step_text, wanted_text = change_text(controlled.name, step), change_text(controlled.name, wanted)
    # The valves of a joint that moves also fill the chambers as these grow.
    smaller = "smaller valves" if scenario.motion.locked_angle is None else smaller_pair(scenario, ratio)[0].text
    return (
        f"{subject_text(scenario.name)}: the pair of valves changes the {controlled.words} by {step_text} in its dead "
        f"time of {1.0e3 * dead_time:.3g} ms, {ratio:.2g} times the requested {wanted_text}: {smaller}, "
        f"{quicker_text(scenario, dead_time)} or larger chambers reduce this step"
    )
