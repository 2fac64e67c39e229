"""Causes of a task or walk that does not follow its reference, most certain first, with numbers and remedies."""

from collections.abc import Iterable, Iterator
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
from ppafo.simulation.gains import loop_of
from ppafo.simulation.numbers import declared_numbers, number_at, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import LoopParts, quicker_at
from ppafo.simulation.tracking.load_causes import (
    ACTS_ONE_WAY,
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
    Case,
    Change,
    Remedy,
    TrackingCause,
    change_text,
    dead_band,
    default_gains,
    default_integral,
    level_text,
    own_settings,
    rescaled_gains,
    sized_valves,
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
_STEPS_OF_PAIR = (0.2, 0.3, 0.4, 0.5, 0.6, 0.1)
"""Steps of a pair during its dead time divided by the wanted change, aimed at with smaller orifices [-]."""
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
    moves = case.reference.size > 1 and not case.settled.rests and not case.only_switches
    return np.gradient(case.reference, case.recording.time[case.samples]) if moves else np.zeros(case.reference.size)


def _late_device(case: Case, least: float = LARGEST_SHARE) -> TrackingCause | None:
    """Cause: the number of valve or controller that gives most of a dead time, if the task does not leave that.

    In the dead time a reference moves by more than a share ``least`` of the wanted change, or one at rest is judged for
    few dead times only.
    """
    scenario, settled, period = case.scenario, case.settled, case.scenario.controller.period
    saved, valve = {"controller.rate": SAMPLES_LATE * period}, case.device.valve.settings
    # The valves of an on/off law, and the gains of a Python object, have causes of their own.
    law = None if case.only_switches else case.law
    dead_time = saved["controller.rate"] if law is None else loop_of(scenario, law).dead_time
    moves = float(np.sqrt(np.mean(_slope(case) ** 2))) * dead_time
    if moves <= least * settled.wanted_change and not (settled.rests and dead_time > least * settled.duration):
        return None
    quicker = {
        f"valve.{name}": [float(valve[name]) * factor**power for factor in _QUICKER_DEVICE]
        for name, power in _DELAYS_OF_VALVE.items()
        if law is not None and valve.get(name, 0.0) > 0.0
    }
    for path, numbers in quicker.items():
        assert law is not None, "only these laws have a loop"
        saved[path] = dead_time - loop_of(with_numbers(scenario, {path: numbers[-1]}), law).dead_time
    path = max(saved, key=saved.__getitem__)
    remedies: list[Change | Remedy] = [{path: number} for number in quicker.get(path, ())]
    stated = stated_number(scenario, path) if path in quicker else f"`{path} = {1.0 / period:.4g} Hz`"
    if path not in quicker:
        rates = [rate for rate in dict.fromkeys((10.0 / period, 100.0 / period, _USUAL_RATE)) if rate <= _USUAL_RATE]
        remedies += [Remedy({}, (f"controller.rate={rate:g} Hz",)) for rate in rates if rate * period > 1.0]
    moved = f", in which the reference moves by {change_text(scenario.controlled, moves)}" * (moves > 0.0)
    text = f"{stated} gives most of the loop's dead time of {level_text('s', dead_time)}{moved}"
    return case.cause(text, remedies, "use a faster valve or controller, or a slower reference")


def _shut_valve(case: Case) -> TrackingCause | None:
    """Cause: the command is 0, or stays within the dead band of the valve."""
    scenario, settled = case.scenario, case.settled
    reverses = settled.error_reversals > MOST_REVERSALS
    command, band = np.abs(case.channel("command")), dead_band(scenario)
    # A loop that rests at the edge of the band is a little beyond it now and then.
    typical = float(np.max(command)) if np.mean(command <= _EDGE * band) < _MOSTLY else float(np.median(command))
    if case.overshoots:
        return None
    if (np.max(command) if reverses else typical) <= SHUT:
        return TrackingCause("the command stays 0: the gains are 0, or the dead zone is wider than the error")
    known_band = float(scenario.controller.settings.get("dead_band", 0.0))
    if typical > _EDGE * band or reverses or (known_band >= band and case.is_settling):
        return None
    is_unknown = known_band < band
    # A law that knows the band asks for more openings than it gets, and errs by what its gain lacks.
    factor = band / typical if is_unknown else settled.rms_error / (LARGEST_SHARE * settled.wanted_change)
    changes: list[Change] = [{"controller.dead_band": band}] if is_unknown else []
    changes += rescaled_gains(scenario, 1.5 * factor, 3.0 * factor) + default_integral(scenario)
    if torque_asked(scenario, settled.rms_error) is not None:
        changes += stiffer_laws(scenario, float(case.device.friction.static_torque), settled)
    relation = "stays within" if is_unknown else "hardly opens the valve beyond"
    text = f"the command of {typical:.2g} {relation} `valve.dead_band = {band:.2g}`"
    return case.cause(text, changes, "give a larger gain")


def _oscillation(case: Case) -> TrackingCause | None:
    """Cause: valves, gains or small chambers make the loop oscillate."""
    law, scenario, settled = case.law, case.scenario, case.settled
    gain = next((quantity.name for quantity in speed_settings(scenario).values()), "")
    may_be_late = scenario.follows_reference and case.opens_fully_alone and not gain
    late, delay = "", float(scenario.sensors.delay)
    if may_be_late:
        crossings = int(np.count_nonzero(np.diff(case.error > 0.0)))
        late = _late_measurement(case) * (delay * max(crossings, 1) > _LONG_DELAY * settled.duration)
    if not (case.oscillates or case.only_switches or late):
        return None
    if law is not None and case.only_switches:
        return _step_of_valves(case, law)
    # Valves that a Python object opens fully alone act as under the shipped on/off law.
    shipped = CONTROLLERS["on_off"] if law is None and may_be_late and not late else None
    if shipped is not None and _pair_step(case, shipped)[0] > _FINE * settled.wanted_change:
        return _step_of_valves(case, shipped)
    if gain:
        return _gains_of_another_device(case) or _fast_loop(case, gain)
    name = "the user-defined controller" if law is None else f"`{law.name}`"
    if not case.opens_fully_alone:
        return TrackingCause(f"{name} is too fast for the delays of the loop", (), "reduce its gains, or slow it down")
    quicker = f"reduce `{_DELAY}`, " * bool(late)
    quicker += "increase `controller.rate`, " * (scenario.controller.period >= _SLOW)
    zone = change_text(scenario.controlled, LARGEST_SHARE * settled.wanted_change)
    declaration = ", or give it hysteresis and only_switches=True in its ControllerKind" * (law is not None)
    advice = f"{quicker}let it command 0 within a dead zone below {zone} about its reference{declaration}"
    reason = late or "reverses them without pause"
    return TrackingCause(f"{name} commands only full openings, and {reason}", (), advice)


def _late_measurement(case: Case) -> str:
    """Clause on the delay of the sensors."""
    stated = stated_number(case.scenario, _DELAY)
    return f"the measured {CONTROLLED[case.scenario.controlled].words} comes late ({stated})"


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
        is_late = sampled > float(case.device.valve.settings["switching_interval"])
        quicker = "faster valves" + " together with a higher `controller.rate`" * is_late
    smaller = sized_valves(scenario, *(share / ratio for share in _STEPS_OF_PAIR if share < ratio))
    # Where a valve has gradual openings, a law that uses them for an angle is the better remedy.
    gradual = (CASCADE,) if scenario.controlled == ANGLE else ()
    return case.cause(text, (*gradual, *smaller), f"take smaller valves, or {quicker}")


def _pair_step(case: Case, law: ControllerKind) -> tuple[float, float]:
    """Step R theta of on/off valves [SI] at the mean angle of the settled part, in their dead time theta [s]."""
    loop, angle = loop_of(case.scenario, law), float(np.mean(case.channel("angle")))
    return loop.rate * loop.dead_time * _loop_rate(case.scenario, angle), loop.dead_time


def _wide_zone(case: Case, begin: str, end: str = "") -> TrackingCause:
    """Cause: dead zone or hysteresis of an on/off law is too wide; the text names the settings, between two parts."""
    scenario, unit = case.scenario, CONTROLLED[case.scenario.controlled].difference
    settings = scenario.controller.settings
    found = {item.name: float(settings[item.name]) for item in own_settings(scenario) if item.unit == unit}
    widths = {name: width for name, width in found.items() if width > 0.0}
    own = ", ".join(f"`{name} = {change_text(scenario.controlled, width)}`" for name, width in widths.items())
    narrower = [{f"controller.{name}": width / by for name, width in widths.items()} for by in _NARROWER if widths]
    return case.cause(
        f"{begin}{own and f' ({own})'}{end}", narrower, "change the settings or the rule of the controller"
    )


def _fast_loop(case: Case, gain: str) -> TrackingCause:
    """Cause: a default gain is too large for delays, noise, motion of the joint, or chambers that are small there."""
    scenario, sensors, angle = case.scenario, case.scenario.sensors, case.channel("angle")
    # A joint that moves far oscillates where its loop is fastest, near a stop.
    rates = [(_loop_rate(scenario, float(each)), float(each)) for each in (angle.mean(), angle.min(), angle.max())]
    (rate, fastest), softer = max(rates), stiffened(scenario, 0.5, 0.25)
    if rate > _QUICKER:
        text = (
            f"at {level_text('rad', fastest)} the chambers are so small that the loop is {rate:.2g} times "
            f"faster than at the angle for which `{gain}` is computed"
        )
        # Near a stop for a part of the time, a loop needs no gain for that angle throughout.
        factors = (rate, 2.0 * rate) if rate == rates[0][0] else (2.0, 4.0, rate)
        return case.cause(text, (*rescaled_gains(scenario, *(1.0 / factor for factor in factors)), *softer))
    noise = f"{change_text(ANGLE, sensors.angle_noise)} and {change_text('pressure_1', sensors.pressure_noise)}"
    flaws = [case.device.valve.settings.get(name, 0.0) for name in _FLAWS_OF_VALVE[2]]
    reasons = {
        f"sensor noise ({noise}) reverses the command": sensors.angle_noise or sensors.pressure_noise,
        "it includes neither hysteresis nor resolution of the valve": max(flaws) > 0.0,
        "the delay of sensors or supply lines causes it": sensors.delay or scenario.supply_lines is not None,
        "it is computed at constant volume and without load, but the joint moves": np.ptp(angle) > _MOVING,
        "the loop has delays that this gain does not include": True,
    }
    reason = next(text for text, is_so in reasons.items() if is_so)
    text = f"`{gain}` is about the gain computed for this device: {reason}"
    return case.cause(text, (*rescaled_gains(scenario, 0.5, 0.25), *softer))


def _loop_rate(scenario: Scenario, angle: float) -> float:
    """Loop rate at an angle [rad], divided by the rate for which gains are computed [-]."""
    parts = LoopParts(scenario.device, scenario.motion.motion_kind.sees(scenario), scenario.controlled)
    return quicker_at(parts, Asked(partial(number_at, scenario)), angle)


def _static_friction(case: Case) -> TrackingCause | None:
    """Cause: static friction, with the valve's dead band, holds the joint at rest off its reference."""
    scenario, settled, settings = case.scenario, case.settled, case.scenario.controller.settings
    requested, gain = torque_asked(scenario, settled.rms_error), float(settings.get("torque_gain", 0.0))
    # Friction holds a joint still: it neither overshoots nor swings.
    swings = case.overshoots or (settled.rests and settled.error_deviation > abs(settled.mean_error))
    if requested is None or gain == 0.0 or swings:
        return None
    # A torque that creeps up while the joint rests is asked for beside the stiffness.
    known_friction, holding = float(settings.get("static_torque", 0.0)), float(case.device.friction.static_torque)
    requested += known_friction
    # The law believes in a dead band, and jumps over that.
    lost = max(dead_band(scenario) - float(settings.get("dead_band", 0.0)), 0.0) / gain
    if requested > holding + lost:
        return None
    band_text = f" and `valve.dead_band` costs {level_text('N m', lost)}" if requested > holding else ""
    text = (
        f"static friction holds the joint with {level_text('N m', holding)}{band_text}, but the controller requests "
        f"only {level_text('N m', requested)} at this error"
    )
    is_too_low = "static_torque" in settings and known_friction < holding
    changes: list[Change] = [{"controller.static_torque": holding}] if is_too_low else []
    changes += stiffer_laws(scenario, holding, settled)
    return case.cause(text, changes, "increase `controller.angle_stiffness`")


def _small_valve(case: Case) -> TrackingCause | None:
    """Cause: the valve is fully open for much of the settled part, and too small for this task."""
    scenario, settled, share = case.scenario, case.settled, case.open_share
    if share <= (_MOSTLY if settled.rests or case.oscillates else _PARTLY) or case.is_for_reach:
        return None
    # A valve larger by wanted over reached change gives the wanted change in the same time.
    missing = max(min(settled.wanted_change / max(settled.value_range, _TINY), _LARGEST_FACTOR), 1.0)
    larger = sized_valves(scenario, *sorted({3.0, 10.0, *(times * missing for times in _LARGER_VALVES)} - {1.0}))
    # A reference beyond reach needs both, unless it lies there on purpose.
    beyond = None if scenario.beyond_reach else torque_beyond_reach(case)
    within = () if beyond is None else beyond.remedies[:2]
    both = [{**valve, **each.numbers} for each in within for valve in larger[-3:]]
    also = "" if beyond is None else f"; {beyond.text}"
    return case.cause(
        f"{_fully_open(case)} this task{also}", both or larger, "use a larger valve or a slower reference"
    )


def _fully_open(case: Case) -> str:
    """Clause on a valve that is too small."""
    return f"the valve is fully open for {100.0 * case.open_share:.0f} % of the time: it is too small for"


def _opened_away(case: Case) -> TrackingCause | None:
    """Cause: the valve is fully open for most of the settled part, away from the reference."""
    scenario, samples, is_open = case.scenario, case.samples, case.is_fully_open
    if case.open_share <= _MOSTLY:
        return None
    reference, value = followed(case.recording)
    # Sign of the command that reduces a positive error.
    upwards = error_functions(scenario.controlled, case.device.supply.is_vacuum).steered(1.0)
    command = upwards * case.recording["command"]
    is_away = np.asarray(command * (reference - value) < 0.0)
    away = np.mean(is_away[samples][is_open[samples]])
    # With the right sign a valve is opened fully towards the reference as it is measured, however late the loop is.
    ways, time = np.where(is_open, np.sign(command), 0.0), case.recording.time
    begins = is_open & (np.diff(ways, prepend=0.0) != 0.0)
    measured = np.interp(time - float(scenario.sensors.delay), time, value)
    if away > _MOSTLY and np.mean((command * (reference - measured))[begins] < 0.0) > _ALWAYS:
        text = (
            f"the valve is fully open for {100.0 * case.open_share:.0f} % of the time, and drives away from the "
            f"reference for {100.0 * away:.0f} % of this time"
        )
        return TrackingCause(text, (), "reverse the sign of the command or of the measurement")
    is_gradual = case.law is not None and not case.only_switches
    if is_gradual or away <= _ALWAYS or begins[samples].any() or not case.opens_fully_alone:
        return None
    worst = change_text(scenario.controlled, case.settled.largest_error)
    opened = f"the valve stays open {worst} beyond the reference: the hysteresis of the controller"
    return _wide_zone(case, opened, " is wider than the allowed error")


def _lag(case: Case) -> TrackingCause | None:
    """Cause: the reference moves faster than the loop follows; states the lag if it explains the error."""
    scenario, slope = case.scenario, _slope(case)
    squares, late = float(np.mean(slope**2)), _late_device(case)
    if squares == 0.0:
        return None
    delay = float(np.mean(slope * -case.error)) / squares
    text = "the reference changes faster than the loop can follow" if late is None else late.text
    if delay > 0.0 and delay**2 * squares >= _EXPLAINED * case.settled.rms_error**2:
        text = f"it lags its reference by {1.0e3 * delay:.3g} ms"
    remedies: list[Change | Remedy] = [*stiffened(scenario, 2.0, 4.0), *rescaled_gains(scenario, 2.0, 4.0)]
    remedies += () if late is None else late.remedies
    frequency = float(scenario.reference.settings.get("frequency", 0.0))
    for share in _SLOWER if frequency else ():
        # The judged half of a run shows a period of the slower reference.
        is_short = share * case.settled.reference_periods < 1.0
        longer = {"run.duration": 2.0 / (share * frequency)} if is_short else {}
        remedies.append({"reference.frequency": share * frequency, **longer})
    return case.cause(text, remedies, "use larger gains, less delay or a slower reference")


def _gains_of_another_device(case: Case) -> TrackingCause | None:
    """Cause: a gain differs from the default gain of the device."""
    defaults = default_gains(case.scenario)
    if not defaults:
        return None
    # Without its integral a loop rests beside its reference with any gain.
    others = default_integral(case.scenario)
    if case.oscillates:
        # Where the default gains oscillate as well, or lag, gains of half or twice their speed may follow.
        others = [
            {**defaults[-1], **each} for each in rescaled_gains(with_numbers(case.scenario, defaults[-1]), 2.0, 0.5)
        ]
    return case.cause("the gains do not suit this device", (*defaults, *others))


def _numbers_above_0(scenario: Scenario, paths: Iterable[str]) -> dict[str, float]:
    """Return the numbers at some paths that the scenario has and that are not 0 [SI]."""
    declared = declared_numbers(scenario)
    numbers = {path: number_at(scenario, path) for path in paths if path in declared}
    return {path: number for path, number in numbers.items() if number > 0.0}


def _not_settled(case: Case) -> TrackingCause:
    """Cause: the run ends before the loop settles, the integral gain is 0, or no other cause applies."""
    scenario, settings = case.scenario, case.scenario.controller.settings
    stop = stop_of(scenario, case.channel("angle"))
    if stop and scenario.controlled == ANGLE:
        return TrackingCause(f"the joint lies on its {stop} stop", (), "check the load that moves it there")
    if case.is_settling:
        longer = [{"run.duration": times * scenario.run.duration} for times in (2.0, 4.0)]
        text = f"it has not settled by {case.settled.start:.3g} s"
        return case.cause(text, (*longer, *rescaled_gains(scenario, 2.0, 4.0)), "increase `run.duration`")
    if integral := next((name for name in settings if "integral" in name and settings[name] == 0.0), ""):
        text = "the remaining error needs integral action, whose gain is 0"
        return case.cause(text, default_integral(scenario), f"set `{integral}` above 0")
    return TrackingCause("torque limit, dead band, friction and opening do not explain the error", (), "see the figure")


def _of_sensors(case: Case) -> Iterator[TrackingCause]:
    """Yield the cause of delay, noise or resolution of the sensors, if any."""
    found = _numbers_above_0(case.scenario, _SENSOR_FLAWS)
    # Gains are changed with less effort than sensors.
    less = [{path: number / factor} for path, number in found.items() for factor in _LESS]
    stated = ", ".join(stated_number(case.scenario, path) for path in found if path != _DELAY)
    others = f"the sensors are not accurate enough for the controlled quantity ({stated})" if stated else ""
    if text := ", and ".join(filter(None, (_late_measurement(case) if _DELAY in found else "", others))):
        yield case.cause(text, (*rescaled_gains(case.scenario, 0.5), *less))


def _of_regulator(case: Case) -> Iterator[TrackingCause]:
    """Yield the causes of numbers of a regulator that keep its set pressure off the command."""
    for names in _FLAWS_OF_VALVE:
        numbers = _numbers_above_0(case.scenario, [f"valve.{name}" for name in names])
        if len(numbers) == len(names):
            stated = " and ".join(stated_number(case.scenario, path) for path in numbers)
            smaller = [{path: number / by for path, number in numbers.items()} for by in _QUICKER_DEVICE[:2]]
            yield case.cause(f"the set pressure is kept off the command by {stated}", smaller)


def causes_of_task(case: Case) -> Iterator[TrackingCause]:
    """Yield the causes of a task that does not follow its reference, most certain first, and at least one."""
    scenario, settled, law, settings = case.scenario, case.settled, case.law, case.scenario.controller.settings
    beyond = torque_beyond_reach(case)
    outside = (
        _opened_away(case),
        # A larger lack than the reach explains has another cause before it.
        beyond if case.is_for_reach else None,
        load_beyond_reach(case),
        below_lowest_set_pressure(case),
        flung_at_start(case),
        # No gains follow what moves on in the dead time by more than any lag that is allowed.
        _late_device(case, LARGEST_LAG),
        torque_at_its_limit(case),
    )
    yield from filter(None, outside)
    # An angle controller may accept a larger error at rest than the verdict does.
    accepted, allowed = settings.get("tolerance", 0.0), LARGEST_SHARE * settled.wanted_change
    if settled.rests and not case.oscillates and allowed < abs(settled.mean_error) <= accepted:
        text = f"the controller accepts an error of `controller.tolerance = {level_text('rad', accepted)}`"
        stricter: list[Change] = [{"controller.tolerance": share * allowed} for share in (0.9, 0.5, 0.2)]
        yield case.cause(text, (*stricter, *stiffened(scenario, 2.0, 4.0)))
    gains = _gains_of_another_device(case)
    of_loop = (_static_friction(case), _shut_valve(case), _oscillation(case), _small_valve(case))
    yield from filter(None, (*of_loop, beyond, gains, _lag(case)))
    # A loop that neither swings nor rests needs longer than its reference rests, or larger gains.
    if case.failure == "does not follow" and case.is_approaching:
        limit = float(settings.get("error_limit", 0.0))
        further: list[Change] = [{"controller.error_limit": by * limit} for by in (2.0, 4.0) if limit > 0.0]
        further += [{"run.duration": by * scenario.run.duration} for by in (2.0, 4.0)]
        text = f"it is still on its way at the end, {settled.duration:.3g} s later"
        advice = "let the reference rest longer, or use larger gains"
        yield case.cause(text, further + rescaled_gains(scenario, 2.0, 4.0), advice)
    # The gas spring swings the joint of an angle controller without inner torque loop.
    is_stiff = scenario.controlled != ANGLE or torque_asked(scenario, 0.0) is not None
    if law is not None and not (is_stiff or law.only_switches):
        text = f"`{law.name}` controls the angle without an inner torque loop and is slow against load and friction"
        yield TrackingCause(text, (CASCADE,))
    yield from filter(None, (_late_device(case),))
    # Of a loop that does not oscillate, the flaws of a regulator are less certain than any other cause.
    if case.oscillates:
        yield from _of_regulator(case)
    yield from _of_sensors(case)
    yield _not_settled(case)
    if not case.oscillates:
        yield from _of_regulator(case)


def _request_beyond_reach(case: Case) -> TrackingCause | None:
    """Cause: the controller of a walk often requests more torque than the actuator gives at the current angle."""
    if case.overshoots or controlled_in(case.recording) is None:
        return None
    settings, settled = case.scenario.controller.settings, case.settled
    places, reaches = reach_at_samples(case)
    reference, angle = case.reference[places], case.channel("angle")[places]
    above, below = reference - reaches[:, 1], reaches[:, 0] - reference
    share = float(np.mean((above > 0.0) | (below > 0.0)))
    if share <= (0.0 if settled.given_peak < LEAST_PEAK_WALK * settled.requested_peak else _OFTEN):
        return None
    if np.mean(below > 0.0) > _OFTEN and -reaches[:, 0].min() <= ONE_WAY * reaches[:, 1].max():
        # Dorsiflexion torque requested from an actuator that pushes in plantarflexion only.
        asked, given_text = float(reference.min()), reach_text(float(reaches[:, 0].min()), False)
        text = f"the controller requests {level_text('N m', asked)}, but the actuator gives {given_text}{ACTS_ONE_WAY}"
        unasked = {f"controller.{name}": 0.0 for name in _DORSIFLEXION if settings.get(name, 0.0) > 0.0}
        advice = "request no dorsiflexion torque, or add a spring that lifts the foot"
        return case.cause(text, [unasked] if unasked else [], advice)
    at = int(np.argmax(np.maximum(above, below)))
    asked, given = float(reference[at]), float(reaches[at, 1 if above[at] > 0.0 else 0])
    text = (
        f"for {100.0 * share:.0f} % of the time the controller requests more torque than the actuator gives, such as "
        f"{level_text('N m', asked)} where the actuator gives {level_text('N m', given)}"
    )
    supplies: dict[str, float] = {}
    for path, lacking in (("supply.pressure", above), ("supply.dorsiflexion_pressure", below)):
        place = int(np.argmax(lacking))
        needed = supply_for(case.device, float(angle[place]), 1.05 * float(reference[place]))
        if needed is not None and lacking.max() > 0.0:
            supplies[path] = needed
    changes = [supplies] if supplies else []
    least = float(np.quantile(np.where(reference > 0.0, reaches[:, 1], -reaches[:, 0]), _OFTEN))
    if min(least, settings.get("largest_torque", 0.0)) > 0.0:
        changes.append({"controller.largest_torque": least})
    return case.cause(text, changes, "increase `supply.pressure` or request less torque")


def causes_of_walk(case: Case) -> Iterator[TrackingCause]:
    """Yield the causes of a walk that does not give the requested torque, most certain first, and at least one."""
    scenario, settled, overshoots = case.scenario, case.settled, case.overshoots
    # Gains that make a walk oscillate, or a pair of valves whose step exceeds the torque limit.
    may_swing = case.oscillates or (overshoots and case.only_switches)
    yield from filter(None, (_request_beyond_reach(case), _oscillation(case) if may_swing else None))
    # The controller does not compensate the dead band.
    band = dead_band(scenario) - float(scenario.controller.settings.get("dead_band", 0.0))
    command = np.abs(case.channel("command"))
    share = float(np.mean((command > SHUT) & (command <= band)))
    if share > _OFTEN and not overshoots:
        text = f"the command stays within `valve.dead_band = {band:.2g}` for {100.0 * share:.0f} % of the time"
        advice = "use a valve without dead band, or a controller that compensates the dead band"
        yield case.cause(text, rescaled_gains(scenario, 2.0, 4.0, 8.0), advice)
    # An oscillating loop, and on/off valves, are fully open for other reasons, unless they give too little.
    lacks = settled.given_peak < LEAST_PEAK_WALK * settled.requested_peak
    if case.open_share > _OFTEN and (lacks or not (case.oscillates or case.only_switches)):
        text = f"{_fully_open(case)} the speed of this gait"
        yield case.cause(text, sized_valves(scenario, *_VALVES_OF_WALK), "use a larger valve")
    yield from filter(None, (_gains_of_another_device(case),))
    volumes = {path: number_at(scenario, path) for path in ("actuator.dead_volume_1", "actuator.dead_volume_2")}
    changes = [] if case.law is None else sized_valves(scenario, 0.5, 2.0)
    if min(volumes.values()) > 0.0:
        changes += [{path: factor * number for path, number in volumes.items()} for factor in (2.0, 4.0)]
    text = "the gait moves the joint faster than the torque loop can follow"
    yield case.cause(text, changes, "use larger dead volumes or a faster valve")
