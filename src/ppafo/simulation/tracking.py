"""Does what is controlled follow its reference? One verdict on a run, with what hinders it and what would help.

It is judged on the settled part: the second half of the hold, or of the run where the reference never rests. A run does
not follow where the RMS error there is more than ``LARGEST_SHARE`` of the way that is wanted, where the value swings
about its reference, where the command turns too often from one way to the other, or where the value goes far beyond the
highest one that is wanted. Of a walk the samples count in which its controller asks for a torque.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from ppafo.control import angle_loop, torque_loop
from ppafo.control.kind import ControllerKind
from ppafo.metrics.command import asked_samples
from ppafo.metrics.metric import Floats, extent, followed, has_reference, hold_start
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, SHUT, reversals
from ppafo.metrics.tracking import SUSTAINED
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE, Controlled
from ppafo.model.declaration import Quantity
from ppafo.model.plant import gravity_torque
from ppafo.parameters.reach import supply_for, torque_reach
from ppafo.report.display_units import metric_change, metric_level
from ppafo.signals import Recording
from ppafo.simulation.gains import settings_of, terms_of
from ppafo.simulation.numbers import declared_numbers, number_at, with_numbers
from ppafo.simulation.place import quicker_at
from ppafo.simulation.profiles import limits_of
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.torque_loop import DEAD_TIME, RATE
from ppafo.units.shown import in_units, units_in_force

if TYPE_CHECKING:
    from ppafo.simulation.at_hand import Recorded

LARGEST_SHARE = 0.05
"""RMS error of the settled part over the way that is wanted, above which a law that opens gradually does not follow."""
LARGEST_SHARE_SWITCHED = 0.25
"""The same of a law that only switches, which swings about its reference by design."""
LARGEST_SHARE_ALONG = 0.2
"""The same where the reference never rests, or the joint is moved: every loop follows late."""
LARGEST_SHARE_WALK = 0.5
"""RMS error over the RMS of the torque that the controller of a walk requests."""
LARGEST_PEAK = 1.5
"""Way of the value over the largest way that is wanted."""
LARGEST_PEAK_WALK = 1.5
"""Largest torque of a walk over the limit of its controller."""
MOST_PER_STRIDE, MOST_PER_SECOND = 12.0, 10.0
"""Reversals of the command above which a loop oscillates."""
LEAST_SHARE = 0.01
"""Share of the way that is wanted below which a loop does not move."""
LEAST_HOLD = 0.1
"""Share of a run that a hold must last to be judged as one."""
SMALLEST_WAY = 0.05
"""Way that is wanted at least, over the whole reach of what is controlled: smaller ones have no better resolution."""
LEAST_WAY = 0.01
"""The same where nobody knows the reach, in sizes of what is controlled (``CONTROLLED``)."""
MOST_TRIED = 12
"""Remedies that are tried side by side, which takes the time of about as many runs."""
MARGIN = 1.5
"""Torque that a law should be able to ask for, over the friction that holds the joint."""

REVERSALS = "command_reversals"
"""The metric that counts them."""

_FIRST = (
    torque_loop.PROPORTIONAL_GAIN,
    torque_loop.BOUNDARY,
    torque_loop.CONVERGENCE,
    angle_loop.INNER_GAIN,
    angle_loop.ANGLE_STIFFNESS,
)
"""What sets how fast a loop is; of a cascade the inner one first, on which the outer one relies."""
_SLOWER_ABOVE = frozenset((torque_loop.BOUNDARY,))
"""Those of which a larger one makes the loop slower."""
_SLOPES = ("derivative_gain", "damping")
_NEAR = 0.02
"""Fraction by which a gain may differ from another one that is called the same."""
_ON_STOP = 1.0e-3
"""How near to a stop a joint lies on it [rad]."""
_MOVING = 0.01
"""Way of a joint [rad] in the settled part from which on it disturbs a loop of a torque or a pressure."""
_OFTEN, _LOOKED_AT = 0.1, 400
"""Share of a walk that is often, and samples of it that are looked at."""
_OF_FREQUENCY = (0.1, 0.3)
"""Rate of an integral of the angle, over the frequency of its loop."""
_MOSTLY = 0.5
_OF_REACH = ("reference.", "supply.", "actuator.", "motion.", "device.")
"""Beginnings of the paths of what a reach depends on, and of what is to be reached."""
_FULLY_OPEN = 0.98
_QUICKER = 1.3
"""How many times quicker a place must be than where the gains were taken, to be the cause of swings."""
_SWING_SHARE = 0.2
"""R theta of a pair over the level, that its remedy aims at."""

_OTHER = {"sonic_conductance": "critical_ratio", "area": "discharge_coefficient"}
"""The second number of each form of an orifice, which stays."""

Kind = Literal["does not move", "oscillates", "overshoots", "does not follow"]


@dataclass(frozen=True, slots=True)
class Remedy:
    """Numbers of a scenario [SI], by path, with which the run might follow, and as they are written."""

    numbers: Mapping[str, float]
    text: str


@dataclass(frozen=True, slots=True)
class Tracking:
    """A run whose controlled quantity does not follow its reference.

    ``error`` and ``wanted`` are the RMS error of the settled part and the way that is wanted, ``missing`` the mean
    error, ``moved`` how far the value went, all in SI of what is ``controlled``. ``reversals`` are the command's ``per``
    stride or second. ``cause`` says what hinders it, ``remedies`` what might help, the likeliest first; ``accepted`` is
    what the scenario says of a reference beyond the reach, "" where it says nothing.
    """

    kind: Kind
    controlled: str
    error: float
    wanted: float
    missing: float
    moved: float
    reversals: float
    per: str
    cause: str
    advice: str
    remedies: tuple[Remedy, ...] = ()
    accepted: str = ""
    tried: str = ""
    at_rest: bool = True
    units: Mapping[str, str] = field(default_factory=units_in_force, compare=False, repr=False)

    @property
    def rests(self) -> bool:
        """Whether what is missing is the same for all of the settled part, nearly."""
        return abs(self.missing) > 0.9 * self.error

    @property
    def is_useless(self) -> bool:
        """False where the scenario says itself that its reference lies beyond the reach."""
        return not self.accepted

    @property
    @in_units(lambda tracking: tracking.units)
    def sentence(self) -> str:
        """The verdict in one line."""
        return f"{self._found}; {self.cause}{self._help}"

    @property
    def _found(self) -> str:
        kind = CONTROLLED[self.controlled]
        error, wanted, moved = (_amount(kind, number) for number in (self.error, self.wanted, self.moved))
        plain = error.partition(" ")[0]
        if self.kind == "does not move":
            return f"the {kind.words} loop does not move: {moved.partition(' ')[0]} of {wanted} wanted"
        if self.kind == "oscillates":
            return f"the {kind.words} loop oscillates: {self.reversals:.3g} reversals a {self.per}, RMS {plain} of {wanted} wanted"
        if self.kind == "overshoots":
            return f"the {kind.words} overshoots: {moved.partition(' ')[0]} of {wanted} wanted at most"
        if self.rests and self.at_rest:
            side = "below" if self.missing < 0.0 else "above"
            return f"the {kind.words} stays {_amount(kind, abs(self.missing))} {side} its reference, of {wanted} wanted"
        return f"the {kind.words} does not follow its reference: RMS {plain} of {wanted} wanted"

    @property
    def _help(self) -> str:
        if self.accepted:
            return f"; the scenario says of its level: {self.accepted}"
        if self.tried:
            return f"; {self.tried}"
        if self.remedies:
            return f": {' or '.join(remedy.text for remedy in self.remedies[:2])}"
        return f"; {self.advice}" if self.advice else ""


class Settled(NamedTuple):
    """Numbers of a run that is judged: its settled samples, what is wanted and how far off it is [SI of the value]."""

    part: Any
    wanted: float
    error: float
    missing: float
    swing: float
    turns: int
    moved: float
    peak: float
    duration: float
    rests: bool
    ends_on_ramp: bool = False


def tracking_in(result: "Recorded") -> Tracking | None:
    """Return the verdict on a result; None where it follows its reference, or has none."""
    scenario, metrics = result.scenario, {name: metric.value for name, metric in result.metrics.items()}
    strides, time = metrics.get("strides", 0.0), result.recording.time
    stride_time = float(time[-1] - time[0]) / strides if strides > 0.0 else 0.0
    return tracking_of(scenario, scenario.law, result.recording, metrics, stride_time)


def most_reversals(scenario: Scenario, law: ControllerKind | None, duration: float, stride_time: float = 0.0) -> float:
    """Return the reversals of the command in a time [s] above which a loop oscillates; infinite for one that may.

    ``stride_time`` [s] is how long a stride of a walk lasts.
    """
    # A law that asks for openings between shut and open should not turn.
    if law is None or not scenario.motion.motion_kind.asks_gradually(law):
        return math.inf
    return duration * (MOST_PER_STRIDE / stride_time if stride_time > 0.0 else MOST_PER_SECOND)


@in_units(lambda scenario, *_, **__: scenario.device.shown)
def tracking_of(
    scenario: Scenario,
    law: ControllerKind | None,
    recording: Recording,
    metrics: Mapping[str, float],
    stride_time: float = 0.0,
) -> Tracking | None:
    """Return the verdict on a run with these metrics [SI]; None where it follows, or has no reference."""
    if not has_reference(recording) or len(recording) < 8 or scenario.controller.is_open_loop:
        return None
    is_walk = not scenario.follows_reference
    settled = _of_walk(recording) if is_walk else _settled(scenario, recording)
    if settled is None:
        return None
    turns, duration = metrics.get(REVERSALS, 0.0), float(np.ptp(recording.time[[0, -1]]))
    turning = turns > most_reversals(scenario, law, duration, stride_time)
    switches = law is not None and law.only_switches
    kind = _kind(settled, turning, switches, is_walk, _limit(scenario, is_walk))
    # A pair swings so far by design that the mean tells more of it than the RMS.
    if kind is None and abs(settled.missing) > LARGEST_SHARE * settled.wanted and not is_walk:
        kind = "does not follow" if _beyond_reach(scenario, recording, settled) else None
    if kind is None:
        return None
    scale, per = (stride_time, "stride") if stride_time > 0.0 else (1.0, "second")
    swings = settled.turns / settled.duration if settled.turns and not turning else turns / duration
    found = Tracking(
        kind=kind,
        controlled=scenario.controlled,
        error=settled.error,
        wanted=_limit(scenario, is_walk) if kind == "overshoots" and is_walk else settled.wanted,
        missing=settled.missing,
        moved=settled.peak if kind == "overshoots" else settled.moved,
        reversals=swings * scale,
        per=per,
        cause="",
        advice="",
        at_rest=settled.rests,
    )
    return _explained(found, scenario, law, recording, settled)


def _limit(scenario: Scenario, is_walk: bool) -> float:
    """Return the torque [N m] that a walk's controller asks for at most; 0 where nobody says."""
    return float(scenario.controller.settings.get("largest_torque", 0.0)) if is_walk else 0.0


def _of_walk(recording: Recording) -> Settled | None:
    asked = asked_samples(recording)
    if not asked.any():
        return None
    reference, value = (series[asked] for series in followed(recording))
    wanted, error = float(np.sqrt(np.mean(reference**2))), value - reference
    if wanted == 0.0:
        return None
    rms, missing = float(np.sqrt(np.mean(error**2))), float(np.mean(error))
    duration, peak = float(np.ptp(recording.time[[0, -1]])), float(np.max(np.abs(recording["torque"])))
    return Settled(asked, wanted, rms, missing, rms, 0, float(np.ptp(value)), peak, duration, False)


def _settled(scenario: Scenario, recording: Recording) -> Settled:
    reference, value = followed(recording)
    time, count = recording.time, len(recording)
    first = hold_start(recording)
    rests = first is not None and time[-1] - time[first] >= LEAST_HOLD * (time[-1] - time[0])
    part = slice((first + count) // 2 if rests and first is not None else count // 2, None)
    error = value[part] - reference[part]
    way = max(extent(recording), _smallest_way(scenario))
    wanted = way
    # A joint that is moved disturbs the loop of a torque or a pressure all the time, as a reference does that moves.
    rests = rests and (scenario.controlled == ANGLE or float(np.ptp(recording["angle"][part])) <= _MOVING)
    origin = 0.0 if scenario.controlled == TORQUE else float(value[0])
    ahead = reference - origin
    way_of = math.copysign(1.0, float(ahead[int(np.argmax(np.abs(ahead)))]))
    # What a joint has at the start, such as the torque of its material, is not the loop's.
    began = int(np.argmax((value - reference) * way_of <= 0.0))
    peak = float(np.max((value[began:] - origin) * way_of))
    turns = reversals(np.asarray(error, dtype=np.float64), OSCILLATION_THRESHOLD * way)
    return Settled(
        part=part,
        wanted=wanted,
        error=float(np.sqrt(np.mean(error**2))),
        missing=float(np.mean(error)),
        swing=float(np.std(error)),
        turns=turns if turns >= SUSTAINED else 0,
        moved=float(np.ptp(value)),
        peak=peak if extent(recording) >= way else 0.0,
        duration=float(time[-1] - time[part][0]),
        rests=rests,
        ends_on_ramp=not rests and first is None and _only_one_way(reference),
    )


def _only_one_way(reference: Floats) -> bool:
    """Tell whether a reference only rises, only falls or rests."""
    steps = np.diff(reference)
    return bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))


def _smallest_way(scenario: Scenario) -> float:
    kind = CONTROLLED[scenario.controlled]
    if kind.name == TORQUE:
        device = scenario.device
        lowest, highest = torque_reach(device, 0.5 * (device.actuator.angle_min + device.actuator.angle_max))
    else:
        limits = limits_of(scenario.device, kind)
        lowest, highest = float(limits.lowest), float(limits.highest)
    # Of a torque or a difference of pressures half of the reach is one way.
    one_way = 0.5 if kind.name in (TORQUE, "pressure_difference") else 1.0
    return max(SMALLEST_WAY * one_way * abs(highest - lowest), LEAST_WAY * kind.size * SMALLEST_WAY)


def _kind(settled: Settled, turning: bool, switches: bool, is_walk: bool, limit: float) -> Kind | None:
    share = settled.error / settled.wanted
    if is_walk:
        if turning:
            return "oscillates"
        if limit > 0.0 and settled.peak > LARGEST_PEAK_WALK * limit:
            return "overshoots"
        return "does not follow" if share > LARGEST_SHARE_WALK else None
    most = LARGEST_SHARE_SWITCHED if switches else LARGEST_SHARE if settled.rests else LARGEST_SHARE_ALONG
    if share > LARGEST_SHARE and settled.moved <= LEAST_SHARE * settled.wanted:
        return "does not move"
    # A run that ends on its ramp has no settled part: every loop is behind there.
    most = math.inf if settled.ends_on_ramp else most
    swings = settled.turns > 0 and not switches and (settled.rests or share > most)
    if turning or swings or (switches and share > most and settled.swing > abs(settled.missing)):
        return "oscillates"
    if share > most:
        return "does not follow"
    return "overshoots" if settled.peak > LARGEST_PEAK * settled.wanted and settled.rests and not switches else None


class _Why(NamedTuple):
    cause: str
    remedies: tuple[Remedy, ...] = ()
    advice: str = ""
    accepted: str = ""


def _explained(
    found: Tracking, scenario: Scenario, law: ControllerKind | None, recording: Recording, settled: Settled
) -> Tracking:
    """Return the verdict with what hinders the run, the surest reason first."""
    swings, switches = found.kind == "oscillates", law is not None and law.only_switches
    if not scenario.follows_reference:
        why = _of_gait(scenario, law, recording, settled, swings)
        return replace(found, cause=why.cause, remedies=why.remedies, advice=why.advice)
    why = (
        (None if swings else _beyond_reach(scenario, recording, settled))
        or _load(scenario, recording, settled)
        or _shut(scenario, law, recording, settled)
        or (_swinging(scenario, law, recording, settled) if swings or switches else None)
        or _friction(scenario, law, settled)
        or _saturated(scenario, recording, settled)
        or _unlike_gains(scenario, law)
        or _open_end(scenario, recording, settled)
    )
    return replace(found, cause=why.cause, remedies=why.remedies, advice=why.advice, accepted=why.accepted)


def _beyond_reach(scenario: Scenario, recording: Recording, settled: Settled) -> _Why | None:
    """Tell that a torque is wanted that no pressure of the device's supplies gives."""
    if scenario.controlled != TORQUE:
        return None
    reference, value = (series[settled.part] for series in followed(recording))
    angle = recording["angle"][settled.part]
    place = int(np.argmax(np.abs(reference)))
    wanted, there = float(reference[place]), float(angle[place])
    lowest, highest = torque_reach(scenario.device, there)
    reach = highest if wanted > 0.0 else lowest
    if lowest <= wanted <= highest:
        return None
    supply = "supply.pressure" if wanted > highest else "supply.dorsiflexion_pressure"
    text = (
        f"at {_level('rad', there, scenario)} and {_level('Pa', number_at(scenario, supply), scenario)} the actuator "
        f"gives {_level('N m', reach, scenario)} at most"
    )
    # What a file says of its level it says of one that lies beyond the reach, unless either was changed for this run.
    changed = any(text.startswith(_OF_REACH) for text in scenario.origin.overrides)
    notes = () if changed else scenario.assumptions
    note = next((item.note for item in notes if item.path == "reference.level"), "")
    remedies = []
    needed = supply_for(scenario.device, there, 1.05 * wanted)
    if needed is not None:
        remedies.append(_remedy(scenario, {supply: needed}))
    if "level" in scenario.reference.settings and not scenario.reference.kind.startswith("sine"):
        remedies.append(_remedy(scenario, {"reference.level": 0.95 * reach}))
    return _Why(text, tuple(remedies), accepted=note.partition("; ")[2] or note)


def _of_gait(
    scenario: Scenario, law: ControllerKind | None, recording: Recording, settled: Settled, swings: bool
) -> _Why:
    """Tell why a walk's torque does not follow: the reach at the angles of the gait, the valve, or the gains."""
    reference, angle = followed(recording)[0][settled.part], recording["angle"][settled.part]
    places = np.linspace(0, angle.size - 1, _LOOKED_AT).astype(np.intp)
    reaches = np.array([torque_reach(scenario.device, float(angle[place])) for place in places])
    beyond = (reference[places] < reaches[:, 0]) | (reference[places] > reaches[:, 1])
    if np.mean(beyond) > _OFTEN:
        texts = [_level("N m", float(np.max(np.abs(numbers))), scenario) for numbers in (reaches, reference)]
        text = (
            f"in {100.0 * np.mean(beyond):.0f} % of the time its controller asks for more than the actuator gives there"
        )
        return _Why(
            f"{text}, {texts[0]} at most of {texts[1]} asked for", (), "take a higher `supply.pressure` or ask for less"
        )
    if swings:
        return _swinging(scenario, law, recording, settled) or _Why("its law is too fast")
    command = np.abs(recording["command"][settled.part])
    fully = float(np.mean((command >= _FULLY_OPEN) & (command <= 1.0 + SHUT)))
    if fully > _OFTEN and not (law is not None and law.only_switches):
        text = f"its valve is fully open for {100.0 * fully:.0f} % of the time"
        return _Why(f"{text}: it is too small for how quickly the gait turns the joint", (), "take a larger valve")
    return _unlike_gains(scenario, law) or _Why(
        "the gait turns the joint more quickly than its loop follows", (), "take larger dead volumes or a quicker valve"
    )


def _load(scenario: Scenario, recording: Recording, settled: Settled) -> _Why | None:
    """Tell that what works on a free joint is more than the actuator gives where the joint is to be."""
    motion = scenario.motion
    if scenario.controlled != ANGLE or not isinstance(motion, FreeMotion) or motion.leg is not None:
        return None
    reference, angle = (series[settled.part] for series in followed(recording))
    wanted, device = float(np.mean(reference)), scenario.device
    lowest, highest = torque_reach(device, wanted)
    load = float(motion.outside_torque) + float(gravity_torque(wanted, device.foot_plate.gravity_torque))
    stop = _stop(scenario, angle)
    if lowest <= load <= highest:
        return None
    reach, supply = (highest, "supply.pressure") if load > highest else (lowest, "supply.dorsiflexion_pressure")
    rests = f"the joint lies on its {stop} stop: " if stop else ""
    text = (
        f"{rests}{_level('N m', abs(load), scenario)} work against it at {_level('rad', wanted, scenario)}, where the "
        f"actuator gives {_level('N m', abs(reach), scenario)} at most"
    )
    needed = supply_for(device, wanted, load + math.copysign(0.3 * abs(load), load))
    changes: list[dict[str, float]] = [] if needed is None else [{supply: needed}]
    if motion.outside_torque:
        changes.append({"motion.external_torque": 0.7 * reach - (load - float(motion.outside_torque))})
    remedies = [_remedy(scenario, numbers) for numbers in changes]
    # A law without an integral asks for no torque where there is no error, and knows nothing of what works on the joint.
    if _asked_torque(scenario, scenario.law, settled) is not None:
        for numbers in changes:
            left = abs(numbers.get("motion.external_torque", float(motion.outside_torque)))
            holding = float(device.friction.static_torque)
            remedies += [_remedy(scenario, {**numbers, **integral}) for integral in _integrals(scenario)]
            for integral in ({}, *_integrals(scenario)[:1]):
                remedies += _stiffer(scenario, left + holding, settled, {**numbers, **integral})
    return _Why(text, tuple(remedies))


def _stop(scenario: Scenario, angle: Floats) -> str:
    """Return on which stop a joint lies for most of a time, "" on none."""
    ends = (("lower", scenario.device.actuator.angle_min), ("upper", scenario.device.actuator.angle_max))
    return next((word for word, stop in ends if np.mean(np.abs(angle - stop) <= _ON_STOP) > _MOSTLY), "")


def _shut(scenario: Scenario, law: ControllerKind | None, recording: Recording, settled: Settled) -> _Why | None:
    """Tell that the command asks for nothing, or for no more than the valve's dead band."""
    command = np.abs(recording["command"][settled.part])
    asked, dead_band = float(np.max(command)), float(scenario.device.valve.settings.get("dead_band", 0.0))
    if asked <= SHUT:
        return _Why("its law asks for nothing: its gains are 0, or its dead zone is wider than the error")
    if asked > dead_band or settled.turns:
        return None
    text = f"its command of {asked:.2g} at most stays within `valve.dead_band = {dead_band:.2g}`"
    remedies = []
    for quantity in list(_first(scenario, law).values())[:1]:
        own = float(scenario.controller.settings[quantity.name])
        for times in (1.5, 3.0):
            remedies.append(_remedy(scenario, {f"controller.{quantity.name}": own * times * dead_band / asked}))
    if _asked_torque(scenario, law, settled) is not None:
        remedies += _stiffer(scenario, float(scenario.device.friction.static_torque), settled)
    return _Why(text, tuple(remedies), "give a larger gain")


def _swinging(scenario: Scenario, law: ControllerKind | None, recording: Recording, settled: Settled) -> _Why | None:
    """Tell why a loop swings: its valves, its gains, or a place where the chambers are smaller than the gains know."""
    if law is None:
        return _Why("its controller is of yours", (), "give it smaller gains")
    terms = terms_of(scenario, law)
    rate, late = (float(terms[name].number(lambda path: number_at(scenario, path))) for name in (RATE, DEAD_TIME))
    angle = float(np.mean(recording["angle"][settled.part]))
    # The gains of a locked joint are those of its place.
    is_locked = scenario.motion.motion_kind.name == "locked"
    quicker = 1.0 if is_locked else quicker_at(scenario.device, angle, scenario.controlled)
    kind = CONTROLLED[scenario.controlled if TORQUE in law.controls else TORQUE]
    if law.only_switches:
        jump = rate * quicker * late
        text = (
            f"its valves change it by {_amount(kind, jump)} in the {1.0e3 * late:.3g} ms that they are late, "
            f"{jump / settled.wanted:.2g} times what is wanted"
        )
        return _Why(text, _smaller(scenario, jump / settled.wanted), "take faster or smaller valves")
    unlike, first = _unlike_gains(scenario, law), _first(scenario, law)
    if not first:
        return _Why("its law is too fast for what is late", (), "give its law smaller gains, or a slower one")
    if unlike is not None:
        return unlike
    quantity = next(iter(first.values()))
    own, path = float(scenario.controller.settings[quantity.name]), f"controller.{quantity.name}"
    slower = next(iter(first)) in _SLOWER_ABOVE
    if quicker > _QUICKER:
        text = (
            f"at {_level('rad', angle, scenario)} the chambers are so small that it changes {quicker:.2g} times "
            f"quicker than where `{quantity.name}` is taken"
        )
        steps = (quicker, 2.0 * quicker)
    else:
        text = f"`{quantity.name}` is this device's: look for what delays it (sensors, lines)"
        steps = (2.0, 4.0)
    remedies = tuple(_remedy(scenario, {path: own * step if slower else own / step}) for step in steps)
    return _Why(text, remedies)


def _smaller(scenario: Scenario, jump: float) -> tuple[Remedy, ...]:
    """Return smaller orifices of a valve that changes what is controlled by so many times what is wanted."""
    orifice = scenario.device.valve.orifice
    name = "sonic_conductance" if hasattr(orifice, "sonic_conductance") else "area"
    own, other = float(getattr(orifice, name)), _OTHER[name]
    return tuple(
        _remedy(scenario, {f"valve.{name}": own * share / jump, f"valve.{other}": float(getattr(orifice, other))})
        for share in (_SWING_SHARE, 0.5 * _SWING_SHARE)
        if share < jump
    )


def _friction(scenario: Scenario, law: ControllerKind | None, settled: Settled) -> _Why | None:
    """Tell that static friction holds a joint that rests beside its reference."""
    holding = float(scenario.device.friction.static_torque)
    asked = _asked_torque(scenario, law, settled)
    if asked is None or asked > 2.0 * holding or (settled.rests and settled.swing > abs(settled.missing)):
        return None
    text = (
        f"static friction holds the joint with {_level('N m', holding, scenario)}, and the law asks for "
        f"{metric_change(asked, 'N m')[0]:.3g} at this error, `angle_stiffness` times it"
    )
    return _Why(text, tuple(_stiffer(scenario, holding, settled)), "some `angle_integral` moves it")


def _asked_torque(scenario: Scenario, law: ControllerKind | None, settled: Settled) -> float | None:
    """Return the torque [N m] that a law with a stiffness asks for at the error that is left; None of another law."""
    if scenario.controlled != ANGLE or law is None:
        return None
    if not any(angle_loop.ANGLE_STIFFNESS in quantity.follows for quantity in settings_of(scenario, law)):
        return None
    settings = scenario.controller.settings
    return float(settings["angle_stiffness"]) * min(float(settings["error_limit"]), settled.error)


def _stiffer(
    scenario: Scenario, holding: float, settled: Settled, more: Mapping[str, float] | None = None
) -> list[Remedy]:
    """Return larger stiffnesses [N m/rad] for a torque [N m] that works against the law, with the damping of each."""
    settings, found = scenario.controller.settings, []
    own, limit = float(settings["angle_stiffness"]), float(settings["error_limit"])
    damping, band = float(settings.get("angle_damping", 0.0)), _band(scenario)
    enough = (MARGIN * holding / limit, 3.0 * holding / limit, holding / (0.8 * LARGEST_SHARE * settled.wanted))
    for stiffness in sorted(value for value in enough if value > own > 0.0):
        given = {"controller.angle_stiffness": stiffness}
        damped = {**given, "controller.angle_damping": damping * math.sqrt(stiffness / own)}
        for numbers in (given, damped):
            found.append(_remedy(scenario, {**(more or {}), **numbers}))
    if band > 0.0 and found and float(settings.get("torque_gain", 0.0)) > 0.0:
        # What is asked for must open the valve beyond its dead band, too.
        gain = float(settings["torque_gain"])
        wider = [dict(remedy.numbers) for remedy in found[-2:]]
        for numbers in wider:
            reached = numbers["controller.angle_stiffness"] * LARGEST_SHARE * settled.wanted
            for times in (1.0, 2.0):
                larger = times * band / max(reached, 1.0e-9)
                if larger > gain:
                    found.append(_remedy(scenario, {**numbers, "controller.torque_gain": larger}))
    return found


def _integrals(scenario: Scenario) -> list[dict[str, float]]:
    """Return integral gains [N m/(rad s)] that bring a constant load in within some periods of the angle loop."""
    settings = scenario.controller.settings
    if settings.get("angle_integral", math.nan) != 0.0 or settings.get("angle_damping", 0.0) <= 0.0:
        return []
    stiffness = float(settings["angle_stiffness"])
    frequency = 2.0 * stiffness / float(settings["angle_damping"])
    return [{"controller.angle_integral": share * stiffness * frequency} for share in _OF_FREQUENCY]


def _band(scenario: Scenario) -> float:
    return float(scenario.device.valve.settings.get("dead_band", 0.0))


def _unlike_gains(scenario: Scenario, law: ControllerKind | None) -> _Why | None:
    """Tell that the gains are not the ones that the device asks for."""
    unlike = [] if law is None else _unlike(scenario, law)
    if not unlike:
        return None
    quantity, right = unlike[0]
    # The rules leave the slope of the error alone.
    slopes = {f"controller.{name}": 0.0 for name in _SLOPES if scenario.controller.settings.get(name, 0.0) > 0.0}
    numbers = {f"controller.{quantity.name}": right, **slopes}
    rest = "".join(f" and `{name.rpartition('.')[2]} = 0`" for name in slopes)
    text = f"for this device `{quantity.name} = {right:.3g} {quantity.unit}`{rest}"
    return _Why("its gains are not this device's", (Remedy(numbers, text),))


def _saturated(scenario: Scenario, recording: Recording, settled: Settled) -> _Why | None:
    """Tell that the valve is fully open for most of the settled part."""
    command = np.abs(recording["command"][settled.part])
    fully = float(np.mean((command >= _FULLY_OPEN) & (command <= 1.0 + SHUT)))
    if fully <= _MOSTLY:
        return None
    text = f"its valve is fully open for {100.0 * fully:.0f} % of the time: it is too small for this task"
    orifice = scenario.device.valve.orifice
    name = "sonic_conductance" if hasattr(orifice, "sonic_conductance") else "area"
    own, more = float(getattr(orifice, name)), {f"valve.{_OTHER[name]}": float(getattr(orifice, _OTHER[name]))}
    remedies = tuple(_remedy(scenario, {f"valve.{name}": own * times, **more}) for times in (3.0, 10.0))
    return _Why(text, remedies, "take a larger valve or a slower reference")


def _open_end(scenario: Scenario, recording: Recording, settled: Settled) -> _Why:
    """Tell what else may be: a run that ends before the loop has settled, or a law without an integral."""
    reference, value = followed(recording)
    error = np.abs((value - reference)[settled.part])
    half = error.size // 2
    stop = _stop(scenario, recording["angle"][settled.part]) if scenario.controlled == ANGLE else ""
    if stop:
        return _Why(f"the joint lies on its {stop} stop", (), "look at what presses it")
    if half and np.mean(error[half:]) < 0.7 * np.mean(error[:half]):
        return _Why("it has not settled at the end", (), "give it a longer `run.duration`")
    integrals = [name for name in scenario.controller.settings if "integral" in name]
    if any(scenario.controller.settings[name] == 0.0 for name in integrals):
        return _Why("what stays is left to an integral, which is 0", (), f"give some `{integrals[0]}`")
    return _Why("reach, dead band, friction and opening do not tell why", (), "look at the figure")


def _first(scenario: Scenario, law: ControllerKind | None) -> dict[str, Quantity]:
    """Return the settings of a law that say how fast its loops are, by what they follow, the innermost first."""
    if law is None:
        return {}
    items = {name: quantity for quantity in settings_of(scenario, law) for name in _FIRST if name in quantity.follows}
    return {name: items[name] for name in _FIRST if name in items}


def _unlike(scenario: Scenario, law: ControllerKind) -> list[tuple[Quantity, float]]:
    """Return those of them that are not the device's, each with the number [SI] that would be."""
    terms, settings = terms_of(scenario, law), scenario.controller.settings
    rights = {
        name: (quantity, float(terms[name].number(lambda path: number_at(scenario, path))))
        for name, quantity in _first(scenario, law).items()
    }
    return [
        (quantity, right)
        for quantity, right in rights.values()
        if abs(float(settings[quantity.name]) - right) > _NEAR * right
    ]


def _remedy(scenario: Scenario, numbers: Mapping[str, float]) -> Remedy:
    declared = declared_numbers(scenario)
    texts = [
        f"`{path} = {_level(declared[path].unit, number, scenario)}`"
        for path, number in numbers.items()
        if not path.endswith((".critical_ratio", ".discharge_coefficient"))
    ]
    return Remedy(dict(numbers), " and ".join(texts))


def _level(unit: str, number: float, scenario: Scenario) -> str:
    value, shown = metric_level(float(number), unit, float(scenario.device.supply.atmospheric_pressure))
    return f"{value:.3g} {shown}"


def _amount(kind: Controlled, number: float) -> str:
    # Differences of levels, so that no gauge pressure is meant.
    value, unit = metric_change(number, kind.difference)
    return f"{value:.3g} {unit}"


def tried(scenario: Scenario, verdict: Tracking | None) -> Tracking | None:
    """Return a verdict with the first of its remedies that lets the run follow, found by running it with each."""
    if verdict is None or verdict.accepted or not verdict.remedies or not scenario.follows_reference:
        return verdict
    from ppafo.errors import PpafoError
    from ppafo.simulation.simulate import simulate_many

    changed = []
    for remedy in verdict.remedies[:MOST_TRIED]:
        try:
            changed.append((remedy, with_numbers(scenario, remedy.numbers)))
        except PpafoError:
            continue
    try:
        results = simulate_many([scenario for _, scenario in changed])
    except PpafoError:
        return verdict
    best = None
    for (remedy, _), result in zip(changed, results, strict=True):
        if not result.status.is_completed:
            continue
        left = result.tracking
        if left is None or not left.is_useless:
            return replace(verdict, tried=f"with {remedy.text} it does, as a further run shows")
        if left.error < 0.5 * verdict.error and (best is None or left.error < best[1]):
            best = (remedy, left.error)
    if best is not None:
        error = _amount(CONTROLLED[verdict.controlled], best[1])
        return replace(verdict, tried=f"with {best[0].text} an RMS error of {error} is left, as a further run shows")
    names = ", ".join(dict.fromkeys(path for remedy in verdict.remedies for path in remedy.numbers))
    return replace(
        verdict, tried=f"{verdict.advice + '; ' if verdict.advice else ''}other {names} alone did not mend it"
    )
