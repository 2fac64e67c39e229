"""Walks on a bottle, and the lightest pair of parts with a bottle that lasts."""

import math
from collections.abc import Sequence
from dataclasses import replace

from ppafo.analyses.design.wearer.available_parts import AvailableParts
from ppafo.analyses.design.wearer.requirements import WALKS, DesignRequirements, WalkedDevice
from ppafo.errors import ScenarioError
from ppafo.parameters.parts import Part
from ppafo.progress import Progress, Report
from ppafo.walking.bottle.course import WALKED
from ppafo.walking.loading import load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk

_ALLOWANCE = 1.15
"""Allowance factor on the gas flow of a pair, relative to the gas that another pair drew from the same bottle."""


def lightest_on_bottle(
    requirements: DesignRequirements, tried: Sequence[WalkedDevice], shelf: AvailableParts, report: Report
) -> tuple[WalkedDevice, Part, WalkResult] | None:
    """Return the lightest pair and bottle whose walk meets the requirements, with this walk; None if no pair does.

    Every pair that might last on a bottle is tried, so that a later design for an alternative finds its device again.
    """
    # Heaviest first: of pairs with the same overrides the lightest replaces the others.
    able = {pair.overrides: pair for pair in sorted(tried, key=lambda pair: -pair.mass) if pair.has(requirements)}
    choices = [(pair, bottle) for pair in able.values() for bottle in shelf.bottles]
    too_thirsty: dict[str, float] = {}
    for pair, bottle in sorted(choices, key=lambda choice: choice[0].mass + choice[1].full_mass):
        largest_flow = min(bottle.values["content"] / requirements.seconds, too_thirsty.get(bottle.name, math.inf))
        if pair.flow > largest_flow:
            continue
        walked = walk_on_bottle(pair, shelf.bottle_name(bottle), requirements.seconds, report)
        if walked is None or walking_time(walked) < requirements.seconds:
            too_thirsty[bottle.name] = lasting_flow(pair, walking_time(walked), requirements.seconds)
        elif keeps(walked, requirements):
            return pair, bottle, walked
    return None


def walk_on_bottle(pair: WalkedDevice, bottle: str, seconds: float, report: Report) -> WalkResult | None:
    """Walk for a time [s] or until the bottle is exhausted; None if the bottle cannot supply the device."""
    counted = Progress(
        f"walking with {pair.valve.name} and {pair.actuator.name} on {bottle}", 0, round(seconds), noun="s of walking"
    )
    report(counted)
    try:
        walking = load_walk(WALKS[pair.valve.kind], pair.overrides, bottle=bottle)
        return walk(
            walking, minutes=seconds / 60.0, progress=lambda done, _: report(replace(counted, done=round(60.0 * done)))
        )
    except ScenarioError:
        return None


def walking_time(walked: WalkResult | None) -> float:
    """Return the time that a device walks on a bottle [s], infinite if it lasts until the end; 0 without a walk."""
    if walked is None or walked.supply is None or not walked.status.is_completed:
        return 0.0
    return math.inf if walked.supply.ending.kind == WALKED else float(walked.recording.time[-1])


def lasting_flow(pair: WalkedDevice, lasted: float, seconds: float) -> float:
    """Return the gas flow [kg/s] above which no pair lasts on a bottle, with some allowance.

    The estimate rests on a pair that ``lasted`` less than ``seconds`` [s] on the same bottle.
    """
    return pair.flow * min(0.99, max(0.5, _ALLOWANCE * lasted / seconds))


def keeps(walked: WalkResult, requirements: DesignRequirements) -> bool:
    """Return whether the mean stride of a walk on a bottle meets the required torque and toe clearance."""
    if not walked.averages or walked.tracking:
        return False
    is_reached = requirements.is_reached_by(float(walked.averages["torque"].mean.max()))
    return bool(is_reached and walked.metrics["lowest_toes"].value >= requirements.clearance)
