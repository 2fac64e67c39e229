"""Causes of a task or walk that does not follow its reference, most certain first, with numbers and remedies."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ppafo.control.catalog import CONTROLLERS, switching_remedy
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import SAMPLES_LATE
from ppafo.metrics.metric import Floats, controlled_in, followed
from ppafo.metrics.settled import LARGEST_LAG, LARGEST_SHARE, MOST_REVERSALS
from ppafo.metrics.switching import SHUT
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE, error_functions
from ppafo.parameters.graph import Asked
from ppafo.parameters.reach import supply_for
from ppafo.simulation.declaration import law_settings
from ppafo.simulation.gains import loop_of
from ppafo.simulation.numbers import declared_numbers, number_at, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import LoopParts, quicker_at
from ppafo.simulation.tracking.case import Case, TrackingCause, only_opens_fully
from ppafo.simulation.tracking.load_causes import (
    ONE_WAY,
    below_lowest_set_pressure,
    flung_at_start,
    load_beyond_reach,
    reach_at_samples,
    reach_text,
    stop_of,
    torque_at_its_limit,
    torque_beyond_reach,
)
from ppafo.simulation.tracking.remedies import (
    CASCADE,
    Remedy,
    change_text,
    dead_band,
    default_gain_remedies,
    default_integral_remedy,
    level_text,
    remedy,
    rescaled_gains,
    sized_valves,
    smaller_pair,
    speed_settings,
    stated_number,
    stiffened,
    stiffer_laws,
    torque_asked,
)
from ppafo.simulation.tracking.rule import LEAST_PEAK_WALK, is_pair

_MOSTLY, _PARTLY = 0.5, 0.2
"""Fractions of the settled part that count as most of it, and as much of a move [-]."""
_ALWAYS = 0.9
"""Fraction of the samples that counts as nearly all [-]."""
_FINE = 0.1
"""Step of an on/off valve during its dead time divided by the wanted change, up to which it makes no loop fail [-]."""
_SMALL_STEP = 0.25
"""Step of an on/off valve during its dead time divided by the swing, below which the swing is not the valve's [-]."""
_NARROWER = (2.0, 5.0, 20.0)
"""Factors by which the dead zone of an on/off law is reduced in a trial [-]."""
_EDGE = 1.05
"""Command divided by the dead band, up to which the command counts as within the band [-]."""
_TINY = 1.0e-300
"""Divisor in place of 0."""
_EXPLAINED = 0.6
"""Smallest fraction of the squared error explained by a lag for which the lag is reported [-]."""
_SLOWER = (0.7, 0.4, 0.2, 0.1, 0.05)
"""Frequencies of a reference in trials, divided by its own frequency [-]."""
_DELAYS_OF_VALVE = {"delay": -1.0, "spool_frequency": 1.0}
"""Numbers of a valve that delay its opening, and the sign of the change that reduces the delay."""
_QUICKER_DEVICE = (3.0, 10.0, 100.0)
"""Factors by which valve or controller become quicker in trials [-]."""
_FLAWS_OF_VALVE = (("hysteresis",), ("resolution",), ("hysteresis", "resolution"), ("response_time",))
"""Numbers of a valve that keep a set pressure off its command, which are reduced together in trials."""
_SLOW = 0.01
"""Period of a controller from which its rate is named [s]."""
_DELAY, _LONG_DELAY = "sensors.delay", 0.1
"""Path of the delay of all sensors, and delay divided by the time between two crossings of the reference, from which
the delay is named [-]."""
_SENSOR_FLAWS = (_DELAY, *(f"sensors.{of}_{flaw}" for flaw in ("noise", "resolution") for of in ("angle", "pressure")))
"""Paths of the imperfections of sensors that a remedy reduces."""
_LESS = (10.0, 1000.0)
"""Factors by which an imperfection of a sensor is reduced in a trial; the second one for a unit mistaken [-]."""
_LARGER_VALVES, _LARGEST_FACTOR = (1.0, 3.0, 10.0), 1.0e6
"""Sizes of a valve in trials, divided by the one that makes up for the missing change, and largest such factor [-]."""
_USUAL_RATE = 1000.0
"""Rate assumed for the paper's controller of a proportional valve [Hz]."""
_MOVING = 0.02
"""Range of the angle [rad] above which the volumes of the chambers are not constant."""
_QUICKER = 1.3
"""Loop rate at an angle, divided by the rate used for the gains, above which it causes oscillation [-]."""
_OFTEN = 0.1
"""Fraction of the samples of a walk with a request that counts as often [-]."""
_VALVES_OF_WALK = (2.0, 4.0, 8.0, 32.0, 128.0, 1000.0)
"""Factors by which the valve of a walk is enlarged in a trial; the last one for a unit mistaken by 1000 [-]."""
_DORSIFLEXION = ("landing_peak_torque", "swing_peak_torque", "hold_stiffness", "hold_damping")
"""Settings of a walking controller that request a torque in dorsiflexion."""


def _slope(case: Case) -> Floats:
    """Rate of the reference in the settled part [SI/s]; none at rest, of a pair, or for a move of one sample."""
    reference, time = followed(case.recording)[0][case.samples], case.recording.time[case.samples]
    moves = reference.size > 1 and not case.settled.rests and not case.only_switches
    return np.gradient(reference, time) if moves else np.zeros(reference.size)


def _late_device(case: Case, least: float = LARGEST_SHARE) -> TrackingCause | None:
    """Cause: the number of valve or controller that gives most of a dead time, if the task does not leave that.

    In the dead time a reference moves by more than a share ``least`` of the wanted change, or one at rest is judged for
    few dead times only.
    """
    scenario, law, settled = case.scenario, case.law, case.settled
    period, valve = scenario.controller.period, scenario.device.valve.settings
    saved = {"controller.rate": SAMPLES_LATE * period}
    # The valves of an on/off law, and the gains of a Python object, have causes of their own.
    has_loop = law is not None and not case.only_switches
    dead_time = loop_of(scenario, law).dead_time if law is not None and has_loop else saved["controller.rate"]
    moves = float(np.sqrt(np.mean(_slope(case) ** 2))) * dead_time
    if moves <= least * settled.wanted_change and not (settled.rests and dead_time > least * settled.duration):
        return None
    quicker = {
        f"valve.{name}": [float(valve[name]) * factor**power for factor in _QUICKER_DEVICE]
        for name, power in _DELAYS_OF_VALVE.items()
        if has_loop and valve.get(name, 0.0) > 0.0
    }
    if law is not None:
        trials = {path: loop_of(with_numbers(scenario, {path: numbers[-1]}), law) for path, numbers in quicker.items()}
        saved |= {path: dead_time - loop.dead_time for path, loop in trials.items()}
    path = max(saved, key=saved.__getitem__)
    if path in quicker:
        stated = stated_number(scenario, path)
        remedies = tuple(remedy(scenario, {path: each}) for each in quicker[path])
    else:
        rates = [rate for rate in dict.fromkeys((10.0 / period, 100.0 / period, _USUAL_RATE)) if rate <= _USUAL_RATE]
        stated = f"`{path} = {1.0 / period:.4g} Hz`"
        remedies = tuple(Remedy({}, (f"controller.rate={rate:g} Hz",)) for rate in rates if rate * period > 1.0)
    moved = f", in which the reference moves by {change_text(scenario.controlled, moves)}" * (moves > 0.0)
    text = f"{stated} gives most of the loop's dead time of {level_text('s', dead_time)}{moved}"
    return TrackingCause(text, remedies, "use a faster valve or controller, or a slower reference")


def _shut_valve(case: Case) -> TrackingCause | None:
    """Cause: the command is 0, or stays within the dead band of the valve."""
    scenario, settled = case.scenario, case.settled
    reverses = settled.error_reversals > MOST_REVERSALS
    command, band = np.abs(case.recording["command"][case.samples]), dead_band(scenario)
    # A loop that rests at the edge of the band is a little beyond it now and then.
    typical = float(np.max(command)) if np.mean(command <= _EDGE * band) < _MOSTLY else float(np.median(command))
    if case.failure != "overshoots" and (np.max(command) if reverses else typical) <= SHUT:
        return TrackingCause("the command stays 0: the gains are 0, or the dead zone is wider than the error")
    if typical > _EDGE * band or reverses or case.failure == "overshoots":
        return None
    known_band = float(scenario.controller.settings.get("dead_band", 0.0))
    if known_band >= band and case.is_settling:
        return None
    remedies = [remedy(scenario, {"controller.dead_band": band})] if known_band < band else []
    # A law that knows the band asks for more openings than it gets, and errs by what its gain lacks.
    gain_factor = band / typical if known_band < band else settled.rms_error / (LARGEST_SHARE * settled.wanted_change)
    remedies += rescaled_gains(scenario, case.law, (1.5 * gain_factor, 3.0 * gain_factor))
    remedies += default_integral_remedy(scenario, case.law)
    if torque_asked(scenario, case.law, settled.rms_error) is not None:
        remedies += stiffer_laws(scenario, float(scenario.device.friction.static_torque), settled)
    relation = "stays within" if known_band < band else "hardly opens the valve beyond"
    text = f"the command of {typical:.2g} {relation} `valve.dead_band = {band:.2g}`"
    return TrackingCause(text, tuple(remedies), "give a larger gain")


def _oscillation(case: Case) -> TrackingCause | None:
    """Cause: valves, gains or small chambers make the loop oscillate."""
    law, scenario = case.law, case.scenario
    names = [quantity.name for quantity in speed_settings(scenario, law).values()]
    may_be_late = scenario.follows_reference and only_opens_fully(case.recording) and not names
    late, delay = "", float(scenario.sensors.delay)
    if may_be_late:
        reference, value = followed(case.recording)
        crossings = int(np.count_nonzero(np.diff((value > reference)[case.samples])))
        if delay * max(crossings, 1) > _LONG_DELAY * case.settled.duration:
            late = (
                f"the measured {CONTROLLED[scenario.controlled].words} comes late ({stated_number(scenario, _DELAY)})"
            )
    if not (case.oscillates or case.only_switches or late):
        return None
    if law is not None and case.only_switches:
        return _step_of_valves(case, law)
    # Valves that a Python object opens fully alone act as under the shipped on/off law.
    shipped = CONTROLLERS["on_off"] if law is None and may_be_late and not late else None
    if shipped is not None and _pair_step(case, shipped)[0] > _FINE * case.settled.wanted_change:
        return _step_of_valves(case, shipped)
    if law is not None and names:
        return _gains_of_another_device(case) or _fast_loop(case, law, names[0])
    name = "the user-defined controller" if law is None else f"`{law.name}`"
    if not only_opens_fully(case.recording):
        return TrackingCause(f"{name} is too fast for the delays of the loop", (), "reduce its gains, or slow it down")
    quicker = f"reduce `{_DELAY}`, " * bool(late) + "increase `controller.rate`, " * (
        scenario.controller.period >= _SLOW
    )
    zone = change_text(scenario.controlled, LARGEST_SHARE * case.settled.wanted_change)
    declaration = ", or give it hysteresis and only_switches=True in its ControllerKind" * (law is not None)
    advice = f"{quicker}let it command 0 within a dead zone below {zone} about its reference{declaration}"
    reason = late or "reverses them without pause"
    return TrackingCause(f"{name} commands only full openings, and {reason}", (), advice)


def _step_of_valves(case: Case, law: ControllerKind) -> TrackingCause | None:
    """Cause: on/off valves change the controlled quantity during their dead time, however little is requested."""
    scenario, (step, dead_time) = case.scenario, _pair_step(case, law)
    ratio = step / case.settled.wanted_change
    if ratio <= _FINE and not case.oscillates:
        return None
    controlled = scenario.controlled if TORQUE in law.controls else TORQUE
    if law.only_switches and step < _SMALL_STEP * case.settled.error_range and controlled == scenario.controlled:
        step_text = f"the valves cause a step of only {change_text(scenario.controlled, step)} in their dead time"
        return _wide_zone(case, f"`{law.name}` itself lets it swing", f": {step_text}")
    declare = switching_remedy(scenario.controller.kind)
    asks = f"`{law.name}` requests partial openings, which on/off valves do not have{declare}: "
    text = (
        f"{'' if law.only_switches else asks}the valves cause a step of {change_text(controlled, step)} in their dead "
        f"time of {1.0e3 * dead_time:.3g} ms, {ratio:.2g} times the requested change"
    )
    # The longer of the valves' switching interval and the delay of sampling decides.
    sampled = SAMPLES_LATE * scenario.controller.period
    quicker = "a faster valve" if sampled <= 0.5 * dead_time else "a higher `controller.rate`"
    if is_pair(scenario):
        is_late = sampled > float(scenario.device.valve.settings["switching_interval"])
        quicker = "faster valves" + " together with a higher `controller.rate`" * is_late
    # Where a valve has gradual openings, a law that uses them for an angle is the better remedy.
    gradual = (CASCADE,) if scenario.controlled == ANGLE else ()
    return TrackingCause(text, (*gradual, *smaller_pair(scenario, ratio)), f"take smaller valves, or {quicker}")


def _pair_step(case: Case, law: ControllerKind) -> tuple[float, float]:
    """Step R theta of on/off valves [SI] at the mean angle of the settled part, in their dead time theta [s]."""
    loop, angle = loop_of(case.scenario, law), float(np.mean(case.recording["angle"][case.samples]))
    return loop.rate * loop.dead_time * _loop_rate(case.scenario, angle), loop.dead_time


def _wide_zone(case: Case, begin: str, end: str = "") -> TrackingCause:
    """Cause: dead zone or hysteresis of an on/off law is too wide; the text names the settings, between two parts."""
    scenario, unit = case.scenario, CONTROLLED[case.scenario.controlled].difference
    widths = {
        item.name: float(scenario.controller.settings[item.name])
        for item in (law_settings(case.law, scenario.controlled) if case.law is not None else ())
        if item.unit == unit and scenario.controller.settings[item.name] > 0.0
    }
    own = ", ".join(f"`{name} = {change_text(scenario.controlled, width)}`" for name, width in widths.items())
    text = f"{begin}{own and f' ({own})'}{end}"
    narrower = [{f"controller.{name}": width / factor for name, width in widths.items()} for factor in _NARROWER]
    smaller = [remedy(scenario, numbers) for numbers in narrower if numbers]
    return TrackingCause(text, tuple(smaller), "change the settings or the rule of the controller")


def _fast_loop(case: Case, law: ControllerKind, gain: str) -> TrackingCause:
    """Cause: a default gain is too large for delays, noise, motion of the joint, or chambers that are small there."""
    scenario, sensors, angle = case.scenario, case.scenario.sensors, case.recording["angle"][case.samples]
    # A joint that moves far oscillates where its loop is fastest, near a stop.
    rates = [(_loop_rate(scenario, float(each)), float(each)) for each in (angle.mean(), angle.min(), angle.max())]
    (rate, fastest), softer = max(rates), stiffened(scenario, (0.5, 0.25))
    if rate > _QUICKER:
        text = (
            f"at {level_text('rad', fastest)} the chambers are so small that the loop is {rate:.2g} times "
            f"faster than at the angle for which `{gain}` is computed"
        )
        # Near a stop for a part of the time, a loop needs no gain for that angle throughout.
        factors = (rate, 2.0 * rate) if rate == rates[0][0] else (2.0, 4.0, rate)
        return TrackingCause(text, (*rescaled_gains(scenario, law, (1.0 / factor for factor in factors)), *softer))
    if sensors.angle_noise or sensors.pressure_noise:
        noise = f"{change_text(ANGLE, sensors.angle_noise)} and {change_text('pressure_1', sensors.pressure_noise)}"
        reason = f"sensor noise ({noise}) reverses the command"
    elif any(scenario.device.valve.settings.get(name, 0.0) > 0.0 for name in _FLAWS_OF_VALVE[2]):
        reason = "it includes neither hysteresis nor resolution of the valve"
    elif sensors.delay or scenario.supply_lines is not None:
        reason = "the delay of sensors or supply lines causes it"
    elif np.ptp(angle) > _MOVING:
        reason = "it is computed at constant volume and without load, but the joint moves"
    else:
        reason = "the loop has delays that this gain does not include"
    text = f"`{gain}` is about the gain computed for this device: {reason}"
    return TrackingCause(text, (*rescaled_gains(scenario, law, (0.5, 0.25)), *softer))


def _loop_rate(scenario: Scenario, angle: float) -> float:
    """Loop rate at an angle [rad], divided by the rate for which gains are computed [-]."""
    parts = LoopParts(scenario.device, scenario.motion.motion_kind.sees(scenario), scenario.controlled)
    return quicker_at(parts, Asked(partial(number_at, scenario)), angle)


def _static_friction(case: Case) -> TrackingCause | None:
    """Cause: static friction, with the valve's dead band, holds the joint at rest off its reference."""
    scenario, settled = case.scenario, case.settled
    settings, holding = scenario.controller.settings, float(scenario.device.friction.static_torque)
    requested = torque_asked(scenario, case.law, settled.rms_error)
    gain = float(settings.get("torque_gain", 0.0))
    if requested is None or gain == 0.0:
        return None
    # Friction holds a joint still: it neither overshoots nor swings.
    if case.failure == "overshoots" or (settled.rests and settled.error_deviation > abs(settled.mean_error)):
        return None
    # A torque that creeps up while the joint rests is asked for beside the stiffness.
    known_friction = float(settings.get("static_torque", 0.0))
    requested += known_friction
    # The law believes in a dead band, and jumps over that.
    band = max(dead_band(scenario) - float(settings.get("dead_band", 0.0)), 0.0)
    lost = band / gain
    if requested > holding + lost:
        return None
    holding_text, requested_text = level_text("N m", holding), level_text("N m", requested)
    band_text = f" and `valve.dead_band` costs {level_text('N m', lost)}" if requested > holding else ""
    text = (
        f"static friction holds the joint with {holding_text}{band_text}, but the controller requests only "
        f"{requested_text} at this error"
    )
    is_too_low = "static_torque" in settings and known_friction < holding
    remedies = [remedy(scenario, {"controller.static_torque": holding})] if is_too_low else []
    remedies += stiffer_laws(scenario, holding, settled)
    return TrackingCause(text, tuple(remedies), "increase `controller.angle_stiffness`")


def _open_share(case: Case) -> float:
    """Share of the settled part in which the valve is fully open [-]."""
    return float(np.mean(case.is_fully_open[case.samples]))


def _small_valve(case: Case) -> TrackingCause | None:
    """Cause: the valve is fully open for much of the settled part, and too small for this task."""
    scenario, settled, share = case.scenario, case.settled, _open_share(case)
    if share <= (_MOSTLY if settled.rests or case.oscillates else _PARTLY) or case.is_for_reach:
        return None
    # A valve larger by wanted over reached change gives the wanted change in the same time.
    missing = min(settled.wanted_change / max(settled.value_range, _TINY), _LARGEST_FACTOR)
    factors = sorted({3.0, 10.0, *(times * max(missing, 1.0) for times in _LARGER_VALVES)} - {1.0})
    larger = sized_valves(scenario, factors)
    # A reference beyond reach needs both, unless it lies there on purpose.
    beyond = None if scenario.beyond_reach else torque_beyond_reach(case)
    both = [
        remedy(scenario, {**valve.numbers, **within.numbers})
        for within in (beyond.remedies[:2] if beyond is not None else ())
        for valve in larger[-3:]
    ]
    also = "" if beyond is None else f"; {beyond.text}"
    text = f"the valve is fully open for {100.0 * share:.0f} % of the time: it is too small for this task{also}"
    advice = "use a larger valve or a slower reference"
    return TrackingCause(text, tuple(both) or larger, advice)


def _within_tolerance(case: Case) -> TrackingCause | None:
    """Cause: an angle controller accepts a larger error at rest than the verdict does."""
    scenario, settled = case.scenario, case.settled
    accepted, allowed = scenario.controller.settings.get("tolerance", 0.0), LARGEST_SHARE * settled.wanted_change
    if not settled.rests or case.oscillates or not allowed < abs(settled.mean_error) <= accepted:
        return None
    text = f"the controller accepts an error of `controller.tolerance = {level_text('rad', accepted)}`"
    numbers = [{"controller.tolerance": share * allowed} for share in (0.9, 0.5, 0.2)]
    return TrackingCause(text, (*(remedy(scenario, each) for each in numbers), *stiffened(scenario, (2.0, 4.0))))


def _opened_away(case: Case) -> TrackingCause | None:
    """Cause: the valve is fully open for most of the settled part, away from the reference."""
    scenario, samples, is_open = case.scenario, case.samples, case.is_fully_open
    share = np.mean(is_open[samples])
    if share <= _MOSTLY:
        return None
    reference, value = followed(case.recording)
    # Sign of the command that reduces a positive error.
    upwards = error_functions(scenario.controlled, scenario.device.supply.is_vacuum).steered(1.0)
    command = upwards * case.recording["command"]
    is_away = np.asarray(command * (reference - value) < 0.0)
    away = np.mean(is_away[samples][is_open[samples]])
    # With the right sign a valve is opened fully towards the reference as it is measured, however late the loop is.
    ways, time = np.where(is_open, np.sign(command), 0.0), case.recording.time
    begins = is_open & (np.diff(ways, prepend=0.0) != 0.0)
    measured = np.interp(time - float(scenario.sensors.delay), time, value)
    if away > _MOSTLY and np.mean((command * (reference - measured))[begins] < 0.0) > _ALWAYS:
        text = (
            f"the valve is fully open for {100.0 * share:.0f} % of the time, and drives away from the reference for "
            f"{100.0 * away:.0f} % of this time"
        )
        return TrackingCause(text, (), "reverse the sign of the command or of the measurement")
    is_gradual = case.law is not None and not case.only_switches
    if is_gradual or away <= _ALWAYS or begins[samples].any() or not only_opens_fully(case.recording):
        return None
    worst = change_text(scenario.controlled, case.settled.largest_error)
    opened = f"the valve stays open {worst} beyond the reference: the hysteresis of the controller"
    return _wide_zone(case, opened, " is wider than the allowed error")


def _lag(case: Case) -> TrackingCause | None:
    """Cause: the reference moves faster than the loop follows; states the lag if it explains the error."""
    scenario, samples = case.scenario, case.samples
    reference, value = (series[samples] for series in followed(case.recording))
    slope, error = _slope(case), reference - value
    squares = float(np.mean(slope**2))
    if squares == 0.0:
        return None
    delay = float(np.mean(slope * error)) / squares
    text = "the reference changes faster than the loop can follow"
    late = _late_device(case)
    if delay > 0.0 and delay**2 * squares >= _EXPLAINED * case.settled.rms_error**2:
        text = f"it lags its reference by {1.0e3 * delay:.3g} ms"
    elif late is not None:
        text = late.text
    remedies = [*stiffened(scenario, (2.0, 4.0)), *rescaled_gains(scenario, case.law, (2.0, 4.0))]
    remedies += () if late is None else late.remedies
    frequency = float(scenario.reference.settings.get("frequency", 0.0))
    for share in _SLOWER if frequency else ():
        slower = {"reference.frequency": share * frequency}
        # The judged half of a run shows a period of the slower reference.
        if share * case.settled.reference_periods < 1.0:
            slower["run.duration"] = 2.0 / (share * frequency)
        remedies.append(remedy(scenario, slower))
    return TrackingCause(text, tuple(remedies), "use larger gains, less delay or a slower reference")


def _gains_of_another_device(case: Case) -> TrackingCause | None:
    """Cause: a gain differs from the default gain of the device."""
    default_gains = default_gain_remedies(case.scenario, case.law)
    if not default_gains:
        return None
    if case.oscillates:
        # Where the default gains oscillate as well, or lag, gains of half or twice their speed may follow.
        numbers = default_gains[-1].numbers
        rescaled = rescaled_gains(with_numbers(case.scenario, numbers), case.law, (2.0, 0.5))
        others = [remedy(case.scenario, {**numbers, **each.numbers}) for each in rescaled]
    else:
        # Without its integral a loop rests beside its reference with any gain.
        others = default_integral_remedy(case.scenario, case.law)
    return TrackingCause("the gains do not suit this device", (*default_gains, *others))


def _poor_sensors(case: Case) -> TrackingCause | None:
    """Cause: delay, noise or resolution of the sensors; less certain than a cause within the loop."""
    scenario, declared = case.scenario, declared_numbers(case.scenario)
    flaws = {path: number_at(scenario, path) for path in _SENSOR_FLAWS if path in declared}
    found = {path: number for path, number in flaws.items() if number > 0.0}
    if not found:
        return None
    # Gains are changed with less effort than sensors.
    remedies = [*rescaled_gains(scenario, case.law, (0.5,))]
    remedies += [remedy(scenario, {path: number / factor}) for path, number in found.items() for factor in _LESS]
    stated = [stated_number(scenario, path) for path in found]
    late = (
        f"the measured {CONTROLLED[scenario.controlled].words} comes late ({stated.pop(0)})" if _DELAY in found else ""
    )
    others = f"the sensors are not accurate enough for the controlled quantity ({', '.join(stated)})" if stated else ""
    return TrackingCause(", and ".join(filter(None, (late, others))), tuple(remedies))


def _flaw_of_valve(names: tuple[str, ...], oscillates: bool, case: Case) -> TrackingCause | None:
    """Cause: numbers of a regulator that keep its set pressure off the command, for a loop that oscillates or not."""
    scenario, declared = case.scenario, declared_numbers(case.scenario)
    numbers = {path: number_at(scenario, path) for path in (f"valve.{name}" for name in names) if path in declared}
    if case.oscillates != oscillates or len(numbers) < len(names) or not min(numbers.values()) > 0.0:
        return None
    stated = " and ".join(stated_number(scenario, path) for path in numbers)
    smaller = [{path: number / factor for path, number in numbers.items()} for factor in _QUICKER_DEVICE[:2]]
    remedies = tuple(remedy(scenario, each) for each in smaller)
    return TrackingCause(f"the set pressure is kept off the command by {stated}", remedies)


def _law_without_torque_loop(case: Case) -> TrackingCause | None:
    """Cause: an angle controller without inner torque loop, slow because the gas spring swings the joint."""
    scenario, law, error = case.scenario, case.law, case.settled.rms_error
    is_other = scenario.controlled != ANGLE or torque_asked(scenario, law, error) is not None
    if is_other or law is None or law.only_switches:
        return None
    text = f"`{law.name}` controls the angle without an inner torque loop and is slow against load and friction"
    return TrackingCause(text, (CASCADE,))


def _still_approaching(case: Case) -> TrackingCause | None:
    """Cause: a loop that neither swings nor rests needs longer than its reference rests, or larger gains."""
    if case.failure != "does not follow" or not case.is_approaching:
        return None
    scenario, limit = case.scenario, float(case.scenario.controller.settings.get("error_limit", 0.0))
    remedies = [remedy(scenario, {"controller.error_limit": factor * limit}) for factor in (2.0, 4.0) if limit > 0.0]
    remedies += [remedy(scenario, {"run.duration": factor * scenario.run.duration}) for factor in (2.0, 4.0)]
    remedies += rescaled_gains(scenario, case.law, (2.0, 4.0))
    text = f"it is still on its way at the end, {case.settled.duration:.3g} s later"
    return TrackingCause(text, tuple(remedies), "let the reference rest longer, or use larger gains")


def _not_settled(case: Case) -> TrackingCause:
    """Cause: the run ends before the loop settles, the integral gain is 0, or no other cause applies."""
    settings = case.scenario.controller.settings
    stop = stop_of(case.scenario, case.recording["angle"][case.samples])
    if stop and case.scenario.controlled == ANGLE:
        return TrackingCause(f"the joint lies on its {stop} stop", (), "check the load that moves it there")
    if case.is_settling:
        longer = [remedy(case.scenario, {"run.duration": times * case.scenario.run.duration}) for times in (2.0, 4.0)]
        text = f"it has not settled by {case.settled.start:.3g} s"
        return TrackingCause(
            text, (*longer, *rescaled_gains(case.scenario, case.law, (2.0, 4.0))), "increase `run.duration`"
        )
    integral = next((name for name in settings if "integral" in name and settings[name] == 0.0), "")
    if integral:
        remedies = tuple(default_integral_remedy(case.scenario, case.law))
        text = "the remaining error needs integral action, whose gain is 0"
        return TrackingCause(text, remedies, f"set `{integral}` above 0")
    return TrackingCause("torque limit, dead band, friction and opening do not explain the error", (), "see the figure")


CAUSES_OF_TASK: tuple[Callable[[Case], TrackingCause | None], ...] = (
    _opened_away,
    # A larger lack than the reach explains has another cause before it.
    lambda case: torque_beyond_reach(case) if case.is_for_reach else None,
    load_beyond_reach,
    below_lowest_set_pressure,
    flung_at_start,
    # No gains follow what moves on in the dead time by more than any lag that is allowed.
    lambda case: _late_device(case, LARGEST_LAG),
    torque_at_its_limit,
    _within_tolerance,
    _static_friction,
    _shut_valve,
    _oscillation,
    _small_valve,
    torque_beyond_reach,
    _gains_of_another_device,
    _lag,
    _still_approaching,
    _law_without_torque_loop,
    _late_device,
    # Of a loop that does not oscillate, these are less certain than any other cause.
    *(partial(_flaw_of_valve, names, True) for names in _FLAWS_OF_VALVE),
    _poor_sensors,
    _not_settled,
    *(partial(_flaw_of_valve, names, False) for names in _FLAWS_OF_VALVE),
)
"""Causes of a task, most certain first; ``_not_settled`` always applies."""


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
    share, settled = _open_share(case), case.settled
    # An oscillating loop, and on/off valves, are fully open for other reasons, unless they give too little.
    lacks = settled.given_peak < LEAST_PEAK_WALK * settled.requested_peak
    if share <= _OFTEN or ((case.oscillates or case.only_switches) and not lacks):
        return None
    text = f"the valve is fully open for {100.0 * share:.0f} % of the time: it is too small for the speed of this gait"
    return TrackingCause(text, sized_valves(case.scenario, _VALVES_OF_WALK), "use a larger valve")


CAUSES_OF_WALK: tuple[Callable[[Case], TrackingCause | None], ...] = (
    _request_beyond_reach,
    # Gains that make a walk oscillate, or a pair of valves whose step exceeds the torque limit.
    lambda case: (
        _oscillation(case) if case.oscillates or (case.failure == "overshoots" and case.only_switches) else None
    ),
    _dead_band_of_walk,
    _small_valve_of_walk,
    _gains_of_another_device,
    _speed_of_gait,
)
"""Causes of a walk, most certain first; the last one always applies."""
