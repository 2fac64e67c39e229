"""Causes outside the loop: torque or load beyond reach, and initial pressures that do not carry the load."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.catalog import PROFILES
from ppafo.metrics.metric import Floats, followed
from ppafo.metrics.settled import FEWEST_PERIODS, LARGEST_SHARE
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.plant import gravity_torque
from ppafo.parameters.device import Device
from ppafo.parameters.graph import PRESSURE_PATH
from ppafo.parameters.reach import static_torque, supply_for, supply_that_moves, torque_reach
from ppafo.simulation.numbers import declared_numbers, number_at, of_its_chambers
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.tracking.remedies import (
    Case,
    Change,
    Remedy,
    TrackingCause,
    change_text,
    level_text,
    stated_number,
    stiffened,
    stiffer_laws,
    torque_asked,
)

_MARGINS = (1.05, 1.5)
"""Static torque at an increased supply pressure divided by the wanted torque; the second for a fast wave [-]."""
_NEARLY_ALL, _OFTEN = 0.97, 0.03
"""Torque divided by the reach at which the actuator counts as at its limit, and fraction of the time that is often."""
_MORE_TORQUE = (1.1, 1.3, 1.6, 2.5)
"""Torques of trials, divided by the largest present torque [-]."""
_NEGATIVE = " in the negative direction"
"""Direction of a torque whose sign a text omits."""
ACTS_ONE_WAY = ": it acts in one direction only"
"""Reason for a torque that an actuator does not give."""
_SAMPLES = 400
"""Largest number of samples at which the reach is compared with the torque."""
_WITHIN = 0.95
"""Reduced reference divided by the actuator's reach [-]."""
LOCKED = Remedy({}, ("motion.kind=locked",))
"""Remedy for a free joint that nothing resists."""
ON_STOP = 1.0e-3
"""Distance from a stop up to which a joint rests on it [rad]."""
_MOSTLY = 0.5
"""Fraction of the settled part that counts as most of it [-]."""
ONE_WAY = 0.05
"""Reach in one direction divided by the reach in the other, below which an actuator pushes one way only [-]."""
_PULLED_BACK = 0.1
"""Load that may pull back the joint of a one-way actuator, as a fraction of the actuator's reach [-]."""
_FLUNG = 0.5
"""Initial deviation from the reference, divided by the wanted change, from which a joint counts as thrown off [-]."""


class TorqueReach(NamedTuple):
    """Wanted torque at an angle, and the reach of the actuator in its direction there.

    ``wanted`` and ``reach`` [N m], ``angle`` [rad]; ``upwards`` is true for a torque above the reach, false for one
    below.
    """

    wanted: float
    reach: float
    angle: float
    upwards: bool

    @property
    def lacking(self) -> float:
        """Torque beyond reach [N m], 0 or less within reach."""
        return self.wanted - self.reach if self.upwards else self.reach - self.wanted


def reach_text(reach: float, upwards: bool) -> str:
    """Torque limit [N m] of the actuator in the positive or negative direction, as text with the size and direction."""
    if upwards:
        return f"at most {level_text('N m', reach)}"
    # Of an actuator that always pushes, the smallest torque is positive.
    return f"{'at least' if reach > 0.0 else 'at most'} {level_text('N m', abs(reach))}{_NEGATIVE * (reach <= 0.0)}"


def reach_at_samples(case: Case) -> tuple[NDArray[np.intp], Floats]:
    """Up to 400 settled samples of a recording, and the lowest and highest static torque at their angles [N m].

    Returns the indices, counted from the first settled sample, and torques of shape (samples, 2).
    """
    angle, torque = case.channel("angle"), static_torque(case.device)
    chosen = np.unique(np.linspace(0, angle.size - 1, _SAMPLES).astype(np.intp))
    return chosen, np.array([torque_reach(case.device, float(angle[index]), torque) for index in chosen])


def _supplies_for(
    device: Device, torques: Sequence[tuple[str, float, float]], factors: Sequence[float]
) -> list[dict[str, float]]:
    """Return supply pressures [Pa absolute] by path for each factor [-] with which the supplies can give all torques.

    A torque is the path of its supply (of a chamber that there is), an angle [rad] and the torque there [N m].
    """
    trials = [{path: supply_for(device, at, factor * torque) for path, at, torque in torques} for factor in factors]
    found = [{path: pressure for path, pressure in each.items() if pressure is not None} for each in trials]
    return [each for each, trial in zip(found, trials, strict=True) if len(of_its_chambers(each, device)) == len(trial)]


def torque_peaks(case: Case) -> tuple[TorqueReach, TorqueReach]:
    """Highest and lowest wanted torque with the reach there; a reference with a period counts with its own peaks."""
    reference, angle, device = case.reference, case.channel("angle"), case.device
    has_period = math.isfinite(case.settled.reference_periods)
    lowest, highest = profile_bounds(case.scenario.reference) if has_period else (reference.min(), reference.max())
    top, bottom = float(angle[int(np.argmax(reference))]), float(angle[int(np.argmin(reference))])
    return (
        TorqueReach(float(highest), torque_reach(device, top)[1], top, upwards=True),
        TorqueReach(float(lowest), torque_reach(device, bottom)[0], bottom, upwards=False),
    )


def cuts_wave(case: Case) -> bool:
    """True if a moving reference of a torque goes far beyond what the actuator reaches at the angle of its peak."""
    settled = case.settled
    if case.scenario.controlled != TORQUE or settled.rests or settled.ends_on_ramp:
        return False
    return max(peak.lacking for peak in torque_peaks(case)) > LARGEST_SHARE * settled.wanted_change


def torque_beyond_reach(case: Case) -> TrackingCause | None:
    """Cause: the wanted torque exceeds the actuator's torque from its supplies at that angle."""
    scenario, device, settled = case.scenario, case.device, case.settled
    peaks = torque_peaks(case) if scenario.controlled == TORQUE and not case.oscillates else ()
    lacking = [peak for peak in peaks if peak.lacking > 0.0]
    if not lacking:
        return None
    worst = max(lacking, key=lambda peak: peak.lacking)
    # An actuator that only pushes gives least where its chamber is vented.
    pushes = worst.reach > 0.0 and not worst.upwards
    of_second = supply_that_moves(device, worst.upwards) != PRESSURE_PATH
    filled = float(device.lowest_pressure if pushes else device.highest_pressures[of_second])
    text = (
        f"at {level_text('rad', worst.angle)} and {level_text('Pa', filled)} the "
        f"actuator gives {reach_text(worst.reach, worst.upwards)}"
    )
    if isinstance(scenario.motion, FreeMotion) and (stop := stop_of(scenario, case.channel("angle"))):
        text = f"only the {stop} stop, on which the joint lies, resists the torque: {text}"
        return case.cause(text, (), f"lock the joint ({LOCKED.text}) or add a load")
    torques = [(supply_that_moves(device, peak.upwards), peak.angle, peak.wanted) for peak in lacking]
    changes = _supplies_for(device, torques, _MARGINS)
    if pushes and "lowest_pressure" in device.valve.settings:
        changes.append({"valve.lowest_pressure": float(device.supply.atmospheric_pressure)})
    if "amplitude" in scenario.reference.settings:
        level = float(scenario.reference.settings["level"])
        changes.append({"reference.amplitude": min(abs(_WITHIN * peak.reach - level) for peak in peaks)})
    elif PROFILES[scenario.reference.kind].is_monotone:
        changes.append({"reference.level": _WITHIN * worst.reach})
    # The judged half of a trial shows a period of the reference.
    is_long = settled.rests or settled.reference_periods >= FEWEST_PERIODS
    longer = {} if is_long else {"run.duration": scenario.run.duration / settled.reference_periods}
    return case.cause(text, ({**each, **longer} for each in changes))


def below_lowest_set_pressure(case: Case) -> TrackingCause | None:
    """Cause: the reference of a chamber's pressure is below the lowest pressure that its regulator can be set to."""
    scenario, path, lowest = case.scenario, "valve.lowest_pressure", case.device.lowest_pressure
    # A difference, a torque and an angle have their reach from both chambers.
    is_level = scenario.controlled in ("pressure_1", "pressure_2") and path in declared_numbers(scenario)
    asked = float(np.min(case.reference))
    if not is_level or asked >= lowest or case.settled.mean_error <= 0.0:
        return None
    is_monotone = PROFILES[scenario.reference.kind].is_monotone
    changes = [{path: asked}, *([{"reference.level": float(lowest)}] if is_monotone else [])]
    stated, asked_text = stated_number(scenario, path), level_text("Pa", asked)
    return case.cause(f"the regulator sets no less than {stated}, and {asked_text} is asked for", changes)


def _load_at(case: Case, angle: float) -> float | None:
    """Torque of load and weight at a controlled angle [rad] of a free joint; None for other joints, and for legs."""
    motion = case.scenario.motion
    if case.scenario.controlled != ANGLE or not isinstance(motion, FreeMotion) or motion.leg is not None:
        return None
    return float(motion.outside_torque) + float(gravity_torque(angle, case.device.foot_plate.gravity_torque))


def load_beyond_reach(case: Case) -> TrackingCause | None:
    """Cause: the load on a free joint exceeds the actuator's torque at the wanted angle."""
    scenario, device, wanted = case.scenario, case.device, float(np.mean(case.reference))
    if (load := _load_at(case, wanted)) is None:
        return None
    lowest, highest = torque_reach(device, wanted)
    outside = float(number_at(scenario, "motion.external_torque"))
    # A joint that rests beside its reference needs what breaks its static friction, too.
    friction = float(device.friction.static_torque)
    holding = friction if case.settled.rests else 0.0
    is_within = lowest <= load <= highest
    is_high = load > highest if not is_within else case.settled.mean_error < 0.0
    needed_torque = load if not is_within else load + holding if is_high else load - holding
    if lowest <= needed_torque <= highest:
        return None
    reach, supply = highest if is_high else lowest, supply_that_moves(device, is_high)
    rests = f"the joint lies on its {stop} stop: " if (stop := stop_of(scenario, case.channel("angle"))) else ""
    works, gives = level_text("N m", needed_torque), reach_text(reach, is_high)
    against = "" if not is_within else f" to break its static friction of {level_text('N m', holding)}"
    text = f"{rests}the load needs {works} at {level_text('rad', wanted)}{against}, the actuator gives {gives}"
    needed, advice = supply_for(device, wanted, 1.3 * needed_torque), ""
    changes: list[dict[str, float]] = [] if needed is None else [{supply: needed}]
    is_one_way = abs(reach) <= ONE_WAY * max(abs(lowest), abs(highest))
    if is_one_way or (needed is None and not outside):
        # The pull of its material is too little, and no pressure gives more.
        text += ACTS_ONE_WAY * is_one_way
        advice = "add a spring or a weight that pulls the joint back"
        back = reach + (1.5 if not is_high else -1.5) * holding + _PULLED_BACK * (highest + lowest)
        changes.append({"motion.external_torque": back - (load - outside)})
    elif outside:
        changes.append({"motion.external_torque": 0.7 * reach - (load - outside)})
    further: list[Change] = []
    # A law without an integral requests no torque where there is no error, and knows nothing of the load.
    for numbers in changes if torque_asked(scenario, case.settled.rms_error) is not None else ():
        held = abs(numbers.get("motion.external_torque", outside)) + friction
        further += stiffer_laws(scenario, held, case.settled, numbers)
    return case.cause(text, (*changes, *further), advice)


def torque_at_its_limit(case: Case) -> TrackingCause | None:
    """Cause: the actuator of a joint whose angle is controlled often gives all the torque that its supplies allow."""
    scenario, device = case.scenario, case.device
    if scenario.controlled != ANGLE or case.oscillates or case.only_switches:
        return None
    angle, torque = case.channel("angle"), case.channel("torque")
    places, reaches = reach_at_samples(case)
    # An actuator that pushes one way only has a reach in one direction only: below 0 downwards, above 0 upwards.
    acts = reaches * np.array([-1.0, 1.0]) > 0.0
    shares = np.divide(torque[places, None], reaches, out=np.zeros_like(reaches), where=acts)
    share = float(np.mean(shares.max(axis=1) > _NEARLY_ALL))
    if share <= _OFTEN:
        return None
    limited = [(up, at) for up, at in enumerate(shares.argmax(axis=0).tolist()) if shares[at, up] > _NEARLY_ALL]
    ends = [
        (supply_that_moves(device, bool(up)), float(angle[places[at]]), float(reaches[at, up])) for up, at in limited
    ]
    (supply, where, given), *_ = ends
    text = (
        f"for {100.0 * share:.0f} % of the time the actuator gives all the torque that it can, such as "
        f"{level_text('N m', given)} at {level_text('rad', where)} and "
        f"{level_text('Pa', number_at(scenario, supply))}"
    )
    pressures = _supplies_for(device, ends, _MORE_TORQUE)
    # A load that is near the limit of the actuator often is too much for the stiffness of the law, too.
    both = [{**pressure, **stiffer} for pressure in pressures[-2:] for stiffer in stiffened(scenario, 2.0, 4.0)]
    return case.cause(text, (*pressures, *both), f"increase `{supply}`")


def stop_of(scenario: Scenario, angle: Floats) -> str:
    """Stop on which a joint rests for most of some samples; "" if on none."""
    ends = (("lower", scenario.device.actuator.angle_min), ("upper", scenario.device.actuator.angle_max))
    return next((word for word, stop in ends if np.mean(np.abs(angle - stop) <= ON_STOP) > _MOSTLY), "")


def flung_at_start(case: Case) -> TrackingCause | None:
    """Cause: the initial pressures do not carry the load, which throws the joint off before the loop catches it."""
    device, initial, (reference, angle) = case.device, case.scenario.initial, followed(case.recording)
    start = float(angle[0])
    if case.oscillates or (load := _load_at(case, start)) is None:
        return None
    torque_at = static_torque(device)
    lacking = load - torque_at(start, float(initial.pressure_1), float(initial.pressure_2))
    # A lack of torque turns the joint to smaller angles.
    deviation = float(np.max((reference - angle) * np.sign(lacking)))
    if abs(lacking) <= float(device.friction.static_torque) or deviation <= _FLUNG * case.settled.wanted_change:
        return None
    text = (
        f"at the start the chambers give {level_text('N m', load - lacking)} for a load of "
        f"{level_text('N m', load)}: the joint moves away by {change_text(ANGLE, deviation)} "
        "before the chambers are filled"
    )
    changes, atmosphere = list[Change](), float(device.supply.atmospheric_pressure)
    if (needed := supply_for(device, start, load)) is not None:
        is_first = supply_that_moves(device, load > torque_at(start, atmosphere, atmosphere)) == PRESSURE_PATH
        pressures = (needed, atmosphere) if is_first else (atmosphere, needed)
        changes.append({"initial.pressure_1": pressures[0], "initial.pressure_2": pressures[1]})
    return case.cause(text, changes, "give pressures in [initial] that carry the load")
