"""Causes of a walk whose torque does not follow its controller's request, most certain first."""

from collections.abc import Callable

import numpy as np

from ppafo.metrics.metric import controlled_in, followed
from ppafo.metrics.switching import SHUT
from ppafo.parameters.reach import supply_for
from ppafo.simulation.numbers import number_at
from ppafo.simulation.tracking.case import Case, TrackingCause
from ppafo.simulation.tracking.causes import gains_of_another_device, open_share, oscillation
from ppafo.simulation.tracking.load_causes import ONE_WAY, reach_at_samples, reach_text
from ppafo.simulation.tracking.remedies import dead_band, level_text, remedy, rescaled_gains, sized_valves
from ppafo.simulation.tracking.rule import LEAST_PEAK_WALK

_OFTEN = 0.1
"""Fraction of the samples with a request that counts as often [-]."""
_LARGER_VALVES = (2.0, 4.0, 8.0, 32.0, 128.0, 1000.0)
"""Factors by which a valve is enlarged in a trial; the last one for a unit mistaken by 1000 [-]."""
_DORSIFLEXION = ("landing_peak_torque", "swing_peak_torque", "hold_stiffness", "hold_damping")
"""Settings of a walking controller that request a torque in dorsiflexion."""


def _request_beyond_reach(case: Case) -> TrackingCause | None:
    """Cause: the controller of a walk often requests more torque than the actuator gives at the current angle."""
    scenario, samples = case.scenario, case.samples
    if case.failure == "overshoots" or controlled_in(case.recording) is None:
        return None
    reference, angle = followed(case.recording)[0][samples], case.recording["angle"][samples]
    places, reaches = reach_at_samples(case)
    above, below = reference[places] - reaches[:, 1], reaches[:, 0] - reference[places]
    share = float(np.mean((above > 0.0) | (below > 0.0)))
    lacks_peak = case.settled.given_peak < LEAST_PEAK_WALK * case.settled.requested_peak
    if share <= (0.0 if lacks_peak else _OFTEN):
        return None
    if np.mean(below > 0.0) > _OFTEN and -reaches[:, 0].min() <= ONE_WAY * reaches[:, 1].max():
        # Dorsiflexion torque requested from an actuator that pushes in plantarflexion only.
        asked, lowest = float(reference[places].min()), float(reaches[:, 0].min())
        text = (
            f"the controller requests {level_text('N m', asked)}, but the actuator gives {reach_text(lowest, False)}: "
            "it acts in one direction only"
        )
        settings = scenario.controller.settings
        unasked = {f"controller.{name}": 0.0 for name in _DORSIFLEXION if settings.get(name, 0.0) > 0.0}
        omission = (remedy(scenario, unasked),) if unasked else ()
        advice = "request no dorsiflexion torque, or add a spring that lifts the foot"
        return TrackingCause(text, omission, advice)
    at = int(np.argmax(np.maximum(above, below)))
    asked, given = float(reference[places][at]), float(reaches[at, 1 if above[at] > 0.0 else 0])
    text = (
        f"for {100.0 * share:.0f} % of the time the controller requests more torque than the actuator gives, such as "
        f"{level_text('N m', asked)} where the actuator gives {level_text('N m', given)}"
    )
    numbers: dict[str, float] = {}
    for path, lacking in (("supply.pressure", above), ("supply.dorsiflexion_pressure", below)):
        place = places[int(np.argmax(lacking))]
        needed = supply_for(scenario.device, float(angle[place]), 1.05 * float(reference[place]))
        if needed is not None and lacking.max() > 0.0:
            numbers[path] = needed
    remedies = [remedy(scenario, numbers)] if numbers else []
    least = float(np.quantile(np.where(reference[places] > 0.0, reaches[:, 1], -reaches[:, 0]), _OFTEN))
    if min(least, scenario.controller.settings.get("largest_torque", 0.0)) > 0.0:
        remedies.append(remedy(scenario, {"controller.largest_torque": least}))
    advice = "increase `supply.pressure` or request less torque"
    return TrackingCause(text, tuple(remedies), advice)


def _speed_of_gait(case: Case) -> TrackingCause:
    """Cause: the gait moves the joint faster than the torque loop follows."""
    scenario = case.scenario
    volumes = {path: number_at(scenario, path) for path in ("actuator.dead_volume_1", "actuator.dead_volume_2")}
    remedies = [] if case.law is None else [*sized_valves(scenario, (0.5, 2.0))]
    if min(volumes.values()) > 0.0:
        larger = [{path: factor * number for path, number in volumes.items()} for factor in (2.0, 4.0)]
        remedies += [remedy(scenario, numbers) for numbers in larger]
    text = "the gait moves the joint faster than the torque loop can follow"
    return TrackingCause(text, tuple(remedies), "use larger dead volumes or a faster valve")


def _dead_band_of_walk(case: Case) -> TrackingCause | None:
    """Cause: the command of a walk often stays within the valve's dead band, without compensation by its controller."""
    scenario = case.scenario
    band = dead_band(scenario) - float(scenario.controller.settings.get("dead_band", 0.0))
    command = np.abs(case.recording["command"][case.samples])
    share = float(np.mean((command > SHUT) & (command <= band)))
    if share <= _OFTEN or case.failure == "overshoots":
        return None
    text = f"the command stays within `valve.dead_band = {band:.2g}` for {100.0 * share:.0f} % of the time"
    advice = "use a valve without dead band, or a controller that compensates the dead band"
    return TrackingCause(text, rescaled_gains(scenario, case.law, (2.0, 4.0, 8.0)), advice)


def _small_valve_of_walk(case: Case) -> TrackingCause | None:
    """Cause: the valve of a walk is often fully open, and too small for the speed of the joint."""
    share, settled = open_share(case), case.settled
    # An oscillating loop, and on/off valves, are fully open for other reasons, unless they give too little.
    lacks = settled.given_peak < LEAST_PEAK_WALK * settled.requested_peak
    if share <= _OFTEN or ((case.oscillates or case.only_switches) and not lacks):
        return None
    text = f"the valve is fully open for {100.0 * share:.0f} % of the time: it is too small for the speed of this gait"
    return TrackingCause(text, sized_valves(case.scenario, _LARGER_VALVES), "use a larger valve")


CAUSES_OF_WALK: tuple[Callable[[Case], TrackingCause | None], ...] = (
    _request_beyond_reach,
    # Gains that make a walk oscillate, or a pair of valves whose step exceeds the torque limit.
    lambda case: (
        oscillation(case) if case.oscillates or (case.failure == "overshoots" and case.only_switches) else None
    ),
    _dead_band_of_walk,
    _small_valve_of_walk,
    gains_of_another_device,
    _speed_of_gait,
)
"""Causes of a walk, most certain first; the last one always applies."""
