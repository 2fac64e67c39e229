"""Verdict on a walk: benefit of the device against the same walk without it, and a remedy if it does not help."""

from collections.abc import Mapping, Sequence

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import PpafoError
from ppafo.loading import reloaded
from ppafo.parameters.reach import torque_reach
from ppafo.report.kind import Kind
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import remedy
from ppafo.walking.gait_series import gait_timing
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES
from ppafo.walking.walk import WalkComparison, walk

_WORK, _SHARE = Kind("", "J", "energy", ".3g"), Kind("", "1", "fraction", ".2g")
_ANGLE, _HEIGHT = Kind("", "rad", "angle", ".3g"), Kind("", "m", "length", ".2g")
_TORQUE = Kind("", "N m", "torque", ".3g")
_LAWS = (("controller.kind=event_proportional",), ("controller.kind=event_proportional", "device.valve=proportional"))
"""Overrides that are tried for a walk without a controller: the controller alone, and with the valve it needs."""
_PRESSURES = (1.2, 1.4, 1.7, 2.0, 3.0, 5.0)
"""Factors on the gauge pressures of the supplies that are tried if the toes would drag."""
_HIGHEST_PRESSURE = 1.0e6
"""Highest gauge pressure [Pa] that is tried: ten bar, the rating of most small pneumatic parts."""
_STIFFER = (2.0, 4.0)
"""Factors on the stiffness with which a controller lifts the foot, tried if the requested torque is too small."""
_NEARLY = 0.95
"""Ratio of a torque to its limit from which the limit counts as reached [-]."""
_FIRST_TRIAL = 9.0
"""Duration of the first walk with a remedy [s]; one that does not suffice in it is not tried for the whole duration."""


RemedyTrials = tuple[str, Sequence[tuple[str, ...]], str]
"""Cause of missing help, the overrides of each remedy to try in turn, and advice if no remedy suffices."""


def benefit_sentence(comparison: WalkComparison) -> str:
    """Return a sentence on whether the device helps until the end of the walk; "" for a walk that diverged.

    The device helps by net work in push-off, toes above the ground, and an ankle closer to the healthy angle.
    """
    worn, bare = comparison.with_device, comparison.without_device
    numbers, without = ({name: metric.value for name, metric in walked.metrics.items()} for walked in (worn, bare))
    if "diverged" in (worn.status.kind, bare.status.kind) or "net_push_off_work" not in numbers:
        return ""
    has_work = numbers["net_push_off_work"] > 0.0
    drags, drags_without = (metrics.get("lowest_toes", 0.0) < 0.0 for metrics in (numbers, without))
    both = numbers.keys() & without.keys()
    is_closer = "angle_difference" in both and without["angle_difference"] > numbers["angle_difference"]
    lifts = not drags and (drags_without or is_closer)
    if not (has_work or lifts):
        verdict = "the device does not help"
    elif drags:
        verdict = "the device helps in push-off but not in swing"
    else:
        verdict = "the device helps" if has_work else "the device helps in swing alone"
    if not worn.status.is_completed:
        verdict = f"until then {verdict}"
    clauses = ", ".join(_compared(numbers, without))
    remedied = _remedied(worn, drags) if drags or not has_work else []
    return "; ".join([f"{verdict}, against the same walk without it: {clauses}", *remedied])


def _compared(numbers: Mapping[str, float], without: Mapping[str, float]) -> list[str]:
    """Return clauses on work, ankle and toes, from the metrics [SI] of the walks with the device and without it."""
    clauses = [f"{_WORK.text(numbers['net_push_off_work'])} of net work in push-off"]
    if "push_off_share" in numbers:
        clauses[0] += f" (positive work {_SHARE.text(numbers['push_off_share'])} of the healthy ankle's)"
    if "angle_difference" in numbers and "angle_difference" in without:
        angle, angle_without = (_ANGLE.text(metrics["angle_difference"]) for metrics in (numbers, without))
        clauses.append(f"ankle {angle} from the healthy one ({angle_without} without)")
    if "lowest_toes" in numbers:
        drags, drags_without = numbers["lowest_toes"] < 0.0, without.get("lowest_toes", 0.0) < 0.0
        height = "toes would drag" if drags else f"toes {_HEIGHT.text(numbers['lowest_toes'])} over the ground"
        height_without = "also" if drags == drags_without else "would drag" if drags_without else "clear"
        clauses.append(f"{height} ({height_without} without)")
    return clauses


def _remedied(worn: WalkResult, drags: bool) -> list[str]:
    """Return a clause on the cause of missing help, with the first remedy that another walk confirms or advice.

    The list is empty for a walk on a bottle, and for a cause without remedy and advice. A remedy needs push-off work
    and, if the toes would drag, clear toes.
    """
    if walk_of(worn.scenario).bottle is not None:
        return []
    (cause, remedies, advice), whole = _trials(worn, drags), worn.scenario.run.duration
    for overrides in remedies:
        gain = ""
        # Toes may sink from stride to stride: the whole walk decides.
        for seconds in (_FIRST_TRIAL, whole) if whole > _FIRST_TRIAL else (whole,):
            gain = _gain(worn, overrides, seconds, drags)
            if not gain:
                break
        if gain:
            changes = " and ".join(f"`{text.replace('=', ' = ', 1)}`" for text in overrides)
            minutes = f"{whole / 60.0:.3g} min"
            return [f"{cause}: for example with {changes}, {gain}, simulated in another walk of {minutes}"]
    return [f"{cause}, and {advice}"] if advice else []


def _gain(worn: WalkResult, overrides: Sequence[str], seconds: float, drags: bool) -> str:
    """Return height of the toes and work of a walk with a remedy as text; "" if not enough."""
    try:
        again = walk(with_duration(reloaded(worn.scenario, overrides), seconds))
    except PpafoError:
        return ""
    if not again.status.is_completed:
        return ""
    toes, work = (again.metrics[name].value for name in ("lowest_toes", "net_push_off_work"))
    is_enough = work > 0.0 and not (drags and toes < 0.0)
    return f"toes {_HEIGHT.text(toes)} over the ground and {_WORK.text(work)}" if is_enough else ""


def _trials(worn: WalkResult, drags: bool) -> RemedyTrials:
    """Return the cause of missing help with its remedies; ``drags`` is True if the toes would drag."""
    scenario = worn.scenario
    if scenario.controller.kind == "off":
        return "its controller is off", _LAWS, "another controller alone does not help"
    requested, available = 0.0, 0.0
    if drags and "reference" in worn.averages:
        # Dorsiflexion torques at the lowest toes: requested, and of the actuator.
        timing = gait_timing(walk_of(scenario).gait)
        first, last = PHASES.searchsorted([timing.clearance_from, timing.clearance_to])
        lowest = first + int(worn.averages["toe_height"].mean[first:last].argmin())
        request, angle = (float(worn.averages[name].mean[lowest]) for name in ("reference", "angle"))
        requested, available = -request, -torque_reach(scenario.device, angle)[0]
    if requested < _NEARLY * available and "hold_stiffness" in scenario.controller.settings:
        return _stiffer_holds(scenario, requested, available)
    other = "an actuator with more torque" if drags else "another timing of push-off"
    return (
        "the ankle is not lifted enough" if drags else "the torque opposes the motion",
        [remedy(scenario, pressures).overrides for pressures in _raised_pressures(scenario)],
        f"more supply pressure alone does not suffice; {other} was not tried",
    )


def _stiffer_holds(scenario: Scenario, requested: float, available: float) -> RemedyTrials:
    """Return settings with which the controller requests more torque at the lowest toes as remedies, least first.

    ``requested`` and ``available`` are the torques [N m] of controller and actuator there. A limit that cuts the
    request is raised to the torque of the actuator.
    """
    settings, path = scenario.controller.settings, "controller.hold_stiffness"
    limit = {"controller.largest_torque": available} if requested >= _NEARLY * settings["largest_torque"] else {}
    stiffness = max(float(settings["hold_stiffness"]), declared_numbers(scenario)[path].default or 0.0)
    holds = [*([limit] if limit else []), *({**limit, path: factor * stiffness} for factor in _STIFFER)]
    # A stiffer hold alone comes before one with more pressure: the valve may fill the chamber too slowly.
    filled = [{**hold, **pressures} for hold in holds[-2:] for pressures in _raised_pressures(scenario)[:3]]
    largest = remedy(scenario, holds[-1]).overrides[-1].replace("=", " = ", 1)
    return (
        f"the ankle is not lifted enough, as the controller requests {_TORQUE.text(requested)} at the lowest toes, "
        f"where the actuator gives {_TORQUE.text(available)}",
        [remedy(scenario, numbers).overrides for numbers in (*holds, *filled)],
        f"larger settings up to `{largest}`, alone and with more supply pressure, were simulated and do not suffice",
    )


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
