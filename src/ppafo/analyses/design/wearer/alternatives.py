"""Alternative devices with relaxed requirements if no device meets all, each confirmed by a walk on a bottle."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from ppafo.analyses.design.wearer.available_parts import AvailableParts
from ppafo.analyses.design.wearer.bottle import keeps, lasting_flow, walk_on_bottle, walking_time
from ppafo.analyses.design.wearer.requirements import (
    SHORTEST,
    Alternative,
    DesignRequirements,
    WalkedDevice,
    shown_clearance,
)
from ppafo.analyses.design.wearer.strides import few_strides
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.parameters.parts import Part
from ppafo.parameters.parts.catalogue import rated_pressure
from ppafo.progress import Progress, Report

_MORE_PRESSURE = (1.1, 1.25, 1.5, 1.8, 2.2, 2.7, 3.3, 4.0, 5.0)
"""Factors on the gauge pressure that are tried if no torque suffices."""
_HIGHEST_PRESSURE = STANDARD_ATMOSPHERE + 1.0e6
"""Highest pressure [Pa absolute] that is tried with parts whose rated pressure is unknown: ten bar gauge."""
_LESS_PRESSURE = tuple(0.95 - 0.05 * step for step in range(12))
"""Factors on the gauge pressure that are tried if no bottle lasts."""
_MOST_PAIRS = 5
"""Number of pairs of parts tried at lower pressure: the pairs with the most torque per gas flow."""
_MOST_WALKED = 4
"""Number of candidates walked on a bottle in the search for an alternative, starting with the least gas."""
_USABLE = 0.8
"""Largest fraction of a bottle's gas for the required time with which a candidate is walked on the bottle [-]."""
_SHOWN_TIME = 0.6
"""Resolution [s] to which the time of an alternative is rounded down: a hundredth of a minute."""
_SHOWN_TORQUE = 100.0
"""Inverse of the resolution to which the torque of an alternative is rounded down [1/(N m)]."""


class _Candidate(NamedTuple):
    """Pair of valve and actuator after a few strides, with the requirements at the supply pressure of these strides."""

    requirements: DesignRequirements
    pair: WalkedDevice


def alternatives_to(
    requirements: DesignRequirements, tried: Sequence[WalkedDevice], shelf: AvailableParts, report: Report
) -> Iterator[Alternative]:
    """Yield alternatives to requirements that no device meets, each confirmed by a walk on the largest bottle.

    A design for the relaxed requirements of an alternative finds the same device again.
    """
    bottle = max(shelf.bottles, key=lambda bottle: bottle.values["content"])
    candidates = [_Candidate(requirements, pair) for pair in tried]
    candidates += _at_less_pressure(requirements, tried, report)
    able = [candidate for candidate in candidates if candidate.pair.has(requirements)]
    able.sort(key=lambda candidate: candidate.pair.flow)
    weak, low = [], []
    for candidate in candidates:
        is_strong = requirements.is_reached_by(candidate.pair.torque)
        if not is_strong and candidate.pair.toes >= requirements.clearance:
            weak.append(candidate)
        # A device whose toes drag is no alternative.
        elif is_strong and 0.0 <= candidate.pair.toes < requirements.clearance:
            low.append(candidate)
    weak.sort(key=lambda candidate: -candidate.pair.torque)
    low.sort(key=lambda candidate: -candidate.pair.toes)
    nearest = [] if able else [_as_walked(group[0], bottle, shelf, report) for group in (weak, low) if group]
    thriftiest = _thriftiest(able, bottle, shelf, report)
    # Where less pressure does not last either, the time at the required pressure is offered beside it.
    if thriftiest is not None and thriftiest.requirements.seconds < requirements.seconds:
        at_pressure = [candidate for candidate in able if candidate.requirements.pressure == requirements.pressure]
        if thriftiest.requirements.pressure < requirements.pressure and at_pressure:
            nearest.append(_thriftiest(at_pressure, bottle, shelf, report))
    alternatives = list(filter(None, (thriftiest, *nearest)))
    yield from alternatives
    if not able:
        stronger = (
            _as_walked(candidate, bottle, shelf, report) for candidate in _at_more_pressure(requirements, tried, shelf)
        )
        yield from itertools.islice(filter(None, stronger), 1)
    # A walk that ends early is no full answer: less torque for the whole time is offered beside it.
    if all(alternative.requirements.seconds < requirements.seconds for alternative in alternatives):
        # The one with the most torque that walks for all of the time.
        largest_flow = _USABLE * bottle.values["content"] / requirements.seconds
        for candidate in weak:
            if candidate.pair.flow > largest_flow:
                continue
            alternative = _as_walked(candidate, bottle, shelf, report)
            if alternative is not None and alternative.requirements.seconds == requirements.seconds:
                yield alternative
                break
            lasted = 0.0 if alternative is None else alternative.requirements.seconds
            largest_flow = lasting_flow(candidate.pair, lasted, requirements.seconds)


def _at_less_pressure(
    requirements: DesignRequirements, tried: Sequence[WalkedDevice], report: Report
) -> list[_Candidate]:
    """Return the pairs with the most torque per gas flow, walked at pressures below the required one."""
    thrifty = sorted((pair for pair in tried if pair.flow > 0.0), key=lambda pair: -pair.torque / pair.flow)
    # Actuators of the same numbers walk alike: one of them is enough.
    unlike = {(pair.valve.name, pair.torque, pair.flow): pair for pair in thrifty}
    candidates = []
    for number, factor in enumerate(_LESS_PRESSURE):
        report(Progress("walking at less pressure", number, len(_LESS_PRESSURE), noun="pressures"))
        lower = requirements.at_gauge(factor)
        if STANDARD_ATMOSPHERE < lower.pressure < requirements.pressure:
            for pair in list(unlike.values())[:_MOST_PAIRS]:
                candidates += [_Candidate(lower, again) for again in few_strides(lower, pair.valve, pair.actuator)]
    return candidates


def _at_more_pressure(
    requirements: DesignRequirements, tried: Sequence[WalkedDevice], shelf: AvailableParts
) -> Iterator[_Candidate]:
    """Yield pairs that meet the requirements at a higher pressure, the lowest pressure first.

    For each kind of valve, the pair with the largest torque and the pair with the largest toe clearance are tried; of a
    kind without assistance at the required pressure, every valve with the actuator of the largest torque constant.
    """
    valves, actuators = shelf.groups["valves"].values(), shelf.groups["actuators"].values()
    largest = max(actuators, key=lambda part: part.values["torque_constant"])
    best: list[tuple[Part, Part]] = []
    for kind in dict.fromkeys(valve.kind for valve in valves):
        pairs = [pair for pair in tried if pair.valve.kind == kind]
        chosen = [max(pairs, key=lambda pair: pair.torque), max(pairs, key=lambda pair: pair.toes)] if pairs else []
        best += {(pair.valve.name, pair.actuator.name): (pair.valve, pair.actuator) for pair in chosen}.values()
        best += [(valve, largest) for valve in valves if valve.kind == kind and not pairs]
    for factor in _MORE_PRESSURE:
        higher = requirements.at_gauge(factor)
        for valve, actuator in best:
            if min(rated_pressure(valve, actuator), _HIGHEST_PRESSURE) >= higher.pressure:
                again = few_strides(higher, valve, actuator)
                yield from (_Candidate(higher, strides) for strides in again if strides.has(requirements))


def _thriftiest(able: Sequence[_Candidate], bottle: Part, shelf: AvailableParts, report: Report) -> Alternative | None:
    """Return the alternative with the least gas flow on a bottle; None if no candidate can walk on the bottle.

    Among the first few candidates, one that keeps the required toe clearance on the bottle is preferred.
    """
    fallback: Alternative | None = None
    for candidate in able[:_MOST_WALKED]:
        alternative = _as_walked(candidate, bottle, shelf, report)
        if alternative is not None and alternative.requirements.clearance >= candidate.requirements.clearance:
            return alternative
        fallback = alternative if fallback is None else fallback
    return fallback


def _as_walked(candidate: _Candidate, bottle: Part, shelf: AvailableParts, report: Report) -> Alternative | None:
    """Return a candidate as an alternative, confirmed by a walk on a bottle; None if the walk does not provide help.

    The requirements are relaxed to the results of the candidate, rounded down to the digits of a command line. The pair
    then walks a few strides for the relaxed requirements, and after that on the bottle. Results of this walk that are
    lower relax the requirements further. An alternative that would lead to different strides is dropped.
    """
    lesser, pair = candidate
    if not lesser.is_reached_by(pair.torque):
        lesser = replace(lesser, torque=math.floor(_SHOWN_TORQUE * pair.torque) / _SHOWN_TORQUE)
    if pair.toes < lesser.clearance:
        lesser = replace(lesser, toes=shown_clearance(pair.toes))
    again = next((strides for strides in few_strides(lesser, pair.valve, pair.actuator) if strides.has(lesser)), None)
    walked = None if again is None else walk_on_bottle(again, shelf.bottle_name(bottle), lesser.seconds, report)
    if again is None or walked is None or not walked.averages:
        return None
    # The toes come down a little as the pressure falls.
    toes = walked.metrics["lowest_toes"].value
    if toes < lesser.clearance:
        lesser = replace(lesser, toes=shown_clearance(toes))
        if [strides.overrides for strides in few_strides(lesser, pair.valve, pair.actuator)] != [again.overrides]:
            return None
    lasted = walking_time(walked)
    if lasted < lesser.seconds:
        lesser = replace(lesser, seconds=_SHOWN_TIME * math.floor(lasted / _SHOWN_TIME))
    helps = lesser.torque > 0.0 and lesser.clearance >= 0.0 and keeps(walked, lesser)
    return Alternative(lesser, again, bottle) if helps and lesser.seconds >= SHORTEST else None
