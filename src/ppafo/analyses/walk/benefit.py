"""Verdict on a walk: benefit of the device against the same walk without it, and a remedy if it does not help."""

import contextlib

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import PpafoError
from ppafo.loading import reloaded
from ppafo.parameters.reach import torque_reach
from ppafo.report.kind import Kind
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import remedy
from ppafo.walking.gait_series import gait_timing
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.safety_events import event_lines
from ppafo.walking.strides import PHASES
from ppafo.walking.walk import WalkComparison, walk

_WORK, _SHARE = Kind("", "J", "energy", ".3g"), Kind("", "1", "fraction", ".2g")
_ANGLE, _HEIGHT = Kind("", "rad", "angle", ".3g"), Kind("", "m", "length", ".2g")
_TORQUE = Kind("", "N m", "torque", ".3g")
_LAWS = (
    ("controller.kind=event_proportional",),
    ("controller.kind=event_proportional", "device.valve=proportional"),
)
"""Overrides that are tried for a walk without a controller: the controller alone, and with the valve it needs."""
_PRESSURES = (1.2, 1.4, 1.7, 2.0, 3.0, 5.0)
"""Factors on the gauge pressures of the supplies that are tried if the toes would drag."""
_HIGHEST_PRESSURE = 1.0e6
"""Highest gauge pressure [Pa] that is tried: ten bar, the rating of most small pneumatic parts."""
_STIFFER = (2.0, 4.0)
"""Factors on the stiffness with which a controller lifts the foot, tried if the requested torque is too small."""
_NEARLY = 0.95
"""Ratio of a torque to its limit from which the limit counts as reached [-]."""
_MINUTES = 0.15
"""Duration of a walk with a remedy [min]: a few strides after the transient."""


def benefit_sentence(comparison: WalkComparison) -> str:
    """Return a sentence on whether the device helps, with the numbers of both walks; "" for a walk that diverged.

    The device helps by net work in push-off, toes above the ground, and an ankle closer to the healthy angle.
    """
    worn, bare = comparison.with_device, comparison.without_device
    if not comparison.is_completed or "net_push_off_work" not in worn.metrics:
        faults = event_lines(worn.events)[:1]
        return "" if worn.is_helped else f"the device does not help: {'; '.join((worn.help_text, *faults))}"
    numbers = {name: metric.value for name, metric in worn.metrics.items()}
    without = {name: metric.value for name, metric in bare.metrics.items()}
    work, toes, bare_toes = numbers["net_push_off_work"], numbers.get("lowest_toes"), without.get("lowest_toes")
    has_work, drags, dragged = work > 0.0, toes is not None and toes < 0.0, bare_toes is not None and bare_toes < 0.0
    said = [f"{_WORK.text(work)} of net work in push-off"]
    if "push_off_share" in numbers:
        said[0] += f" (positive work {_SHARE.text(numbers['push_off_share'])} of the healthy ankle's)"
    closer = 0.0
    if "angle_difference" in numbers and "angle_difference" in without:
        closer = without["angle_difference"] - numbers["angle_difference"]
        angles = _ANGLE.text(numbers["angle_difference"]), _ANGLE.text(without["angle_difference"])
        said.append(f"ankle {angles[0]} from the healthy one ({angles[1]} without)")
    if toes is not None:
        height = "toes would drag" if drags else f"toes {_HEIGHT.text(toes)} over the ground"
        said.append(f"{height} ({'also' if drags == dragged else 'would drag' if dragged else 'clear'} without)")
    lifts = not drags and (dragged or closer > 0.0)
    where = {(True, True): "", (True, False): " in push-off but not in swing", (False, True): " in swing alone"}
    if not worn.is_helped or not (has_work or lifts):
        verdict = "the device does not help"
        said += [] if worn.is_helped else [worn.help_text, *event_lines(worn.events)[:1]]
    else:
        verdict = f"the device helps{where[has_work, lifts or not drags]}"
    needs = drags or not has_work
    return f"{verdict}, against the same walk without it: {', '.join(said)}{_remedied(worn, drags) if needs else ''}"


def _remedied(worn: WalkResult, drags: bool) -> str:
    """Return a clause on the cause of missing help and the first remedy with push-off work and clear toes."""
    scenario = worn.scenario
    if walk_of(scenario).bottle is not None or not worn.is_helped:
        return ""
    raised = _raised_pressures(scenario)
    asked, given = _lifting_torques(worn) if drags else (0.0, 0.0)
    if scenario.controller.kind == "off":
        cause, candidates = "its controller is off", list(_LAWS)
        advice = "another controller alone does not help"
    elif asked < _NEARLY * given and "hold_stiffness" in scenario.controller.settings:
        cause = (
            f"the ankle is not lifted enough, as the controller requests {_TORQUE.text(asked)} at the lowest toes, "
            f"where the actuator gives {_TORQUE.text(given)}"
        )
        stiffer = _stiffer_holds(worn, asked, given)
        # A stiffer hold alone, before the one with more pressure: the valve may fill the chamber too slowly.
        numbers = [*stiffer, *({**hold, **levels} for hold in stiffer[-2:] for levels in raised[:3])]
        candidates = [remedy(scenario, each).overrides for each in numbers]
        largest = remedy(scenario, stiffer[-1]).overrides[-1].replace("=", " = ", 1)
        advice = (
            f"larger settings up to `{largest}`, alone and with more supply pressure, were simulated and do not suffice"
        )
    else:
        cause = "the ankle is not lifted enough" if drags else "the torque opposes the motion"
        other = "an actuator with more torque" if drags else "another timing of push-off"
        advice = f"more supply pressure alone does not suffice; {other} was not tried"
        candidates = [remedy(scenario, levels).overrides for levels in raised]
    for overrides in candidates:
        with contextlib.suppress(PpafoError):
            again = walk(reloaded(scenario, overrides), minutes=_MINUTES)
            lowest, work = (again.metrics[name].value for name in ("lowest_toes", "net_push_off_work"))
            if again.status.is_completed and again.is_helped and work > 0.0 and (lowest >= 0.0 or not drags):
                changed = " and ".join(f"`{text.replace('=', ' = ', 1)}`" for text in overrides)
                return (
                    f"; {cause}: with {changed}, toes {_HEIGHT.text(lowest)} over the ground and {_WORK.text(work)}, "
                    "simulated in another walk"
                )
    return f"; {cause}, and {advice}"


def _raised_pressures(scenario: Scenario) -> list[dict[str, float]]:
    """Return the supply pressures [Pa] by path that are tried, least first, up to what small parts withstand."""
    supply = scenario.device.supply
    paths = {"supply.pressure": supply.pressure}
    if supply.dorsiflexion_pressure != supply.pressure:
        paths["supply.dorsiflexion_pressure"] = supply.dorsiflexion_pressure
    return [
        {path: STANDARD_ATMOSPHERE + factor * (level - STANDARD_ATMOSPHERE) for path, level in paths.items()}
        for factor in _PRESSURES
        if factor * (supply.pressure - STANDARD_ATMOSPHERE) <= _HIGHEST_PRESSURE
    ]


def _lifting_torques(worn: WalkResult) -> tuple[float, float]:
    """Return the dorsiflexion torques [N m] at the lowest toes in mid-swing: requested, and largest of the actuator.

    Both are 0 without a request. The smaller torque limits the height of the toes.
    """
    if "reference" not in worn.averages:
        return 0.0, 0.0
    timing = gait_timing(walk_of(worn.scenario).gait)
    first, last = PHASES.searchsorted([timing.clearance_from, timing.clearance_to])
    lowest = first + int(worn.averages["toe_height"].mean[first:last].argmin())
    request, angle = (float(worn.averages[name].mean[lowest]) for name in ("reference", "angle"))
    return -request, -torque_reach(worn.scenario.device, angle)[0]


def _stiffer_holds(worn: WalkResult, asked: float, given: float) -> list[dict[str, float]]:
    """Return settings of the controller by path that request more torque where the toes are lowest, least first.

    A limit that cuts the request is raised to the torque that the actuator gives.
    """
    settings, path = worn.scenario.controller.settings, "controller.hold_stiffness"
    is_cut = asked >= _NEARLY * float(settings["largest_torque"])
    raised = {"controller.largest_torque": given} if is_cut else {}
    stiffness = max(float(settings["hold_stiffness"]), declared_numbers(worn.scenario)[path].default or 0.0)
    return [*([raised] if raised else []), *({**raised, path: factor * stiffness} for factor in _STIFFER)]
