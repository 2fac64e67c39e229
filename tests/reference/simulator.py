"""An independent simulator: the equations of docs/equations.md in continuous time, none of the package's stepping.

It reads the numbers of a scenario and knows no engine, no fitted curve and no step of the package. The method is that
of Dormand and Prince, explicit and of order five, with an error control far below what is to be judged. What happens at
once (breakaway, reversal, a stop) is found by bisection; every instant known ahead (a sample, a late command, a coil, a
corner of a profile) is met exactly.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ppafo.simulation.scenario import FreeMotion, Scenario
from tests.reference.joints import Joint

UNIVERSAL_GAS_CONSTANT = 8.314
REFERENCE_DENSITY = 1.185
REFERENCE_TEMPERATURE = 293.15
REFERENCE_PRESSURE = 1.0e5
STANDARD_GRAVITY = 9.80665

MEASURED, DECIDED, ARRIVED = range(3)
ANGLE, VELOCITY, MASS_1, MASS_2, ENERGY_1, ENERGY_2, SPOOL, SPOOL_RATE, ASKED, TAKEN = range(10)
# Ways of the vane, beside 1 and -1 for a vane that moves.
REST = 0.0
LED = 9.0
NEVER = 1.0e300
SAME_INSTANT = 1.0e-12
LONGEST_STEP = 2.0e-4
SLOWEST_REBOUND = 1.0e-7
MOST_STEPS = 20_000_000
TIMES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ERRORS = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
"""Dormand and Prince 1980: times and weights of the stages, the last of which is the result, and of the error."""
CONSTANT = 0.0
RAMP_HOLD = 1.0
SINE = 2.0
CONTROLLERS = {"constant": 0.0, "on_off": 1.0, "pid": 2.0}
PROFILES = {"constant": CONSTANT, "ramp_hold": RAMP_HOLD, "sine": SINE}


class Path(NamedTuple):
    """A function of time: kind and its four settings."""

    kind: float
    a: float
    b: float
    c: float
    d: float


class Restriction(NamedTuple):
    """Choked flow over upstream pressure [kg/(s Pa)], critical ratio, and k, or 0 for the curve of ISO 6358."""

    conductance: float
    critical: float
    k: float


class Valve(NamedTuple):
    """A spool (solenoid = 0) or two coils (solenoid = 1), in SI units."""

    solenoid: float
    dead_band: float
    delay: float
    frequency: float
    damping: float
    slew: float
    opening_delay: float
    closing_delay: float
    interval: float


class Law(NamedTuple):
    """A controller with its sensors; ``bias`` [Pa] is added to what is measured in chamber 1, taken from chamber 2."""

    kind: float
    period: float
    command: float
    p: float
    i: float
    d: float
    filter: float
    anti_windup: float
    dead_band: float
    delay: float
    pressure_resolution: float
    bias: float


class Leg(NamedTuple):
    """A foot on a prescribed shank (is_worn = 1): its m c [kg m], its inertia about the ankle, length of the shank.

    The shank follows a profile, or a gait of that many strides a second (0: none) from a phase in turns: ``curves``
    has the angle and the accelerations of the knee forward and up, each by its mean, its cosines and its sines.
    """

    is_worn: float
    moment: float
    inertia: float
    shank_length: float
    shank: Path
    frequency: float
    start: float
    curves: Any


class Rig(NamedTuple):
    """Everything that the equations need, in SI units; ``joint`` None stands for the vane."""

    torque_constant: float
    displacement_per_radian: float
    lowest: float
    highest: float
    dead_1: float
    dead_2: float
    restitution: float
    static: float
    dynamic: float
    viscous: float
    inertia: float
    gravity: float
    external: float
    source_1: float
    source_2: float
    room: float
    relieving: float
    gas_constant: float
    k: float
    temperature: float
    linear: float
    thermal: float
    heat: float
    walls: float
    led: float
    port: Restriction
    leak: Restriction
    valve: Valve
    law: Law
    path: Path
    wish: Path
    leg: Leg
    joint: Joint | None


class Answer(NamedTuple):
    """Times [s], angle [rad], angular velocity [rad/s], both pressures [Pa], gas drawn [kg]; times of impacts [s]."""

    time: Any
    angle: Any
    velocity: Any
    pressure_1: Any
    pressure_2: Any
    drawn: Any
    impacts: Any
    steps: int


def follow(path: Path, time: float) -> tuple[float, float]:
    """Value and rate of a profile."""
    if path.kind == SINE:
        turn = 2.0 * math.pi
        place = turn * (path.c * time + path.d)
        return path.a + path.b * math.sin(place), path.b * turn * path.c * math.cos(place)
    if path.kind == RAMP_HOLD:
        if time < path.c:
            return path.a, 0.0
        if time < path.c + path.d:
            return path.a + (path.b - path.a) * (time - path.c) / path.d, (path.b - path.a) / path.d
        return path.b, 0.0
    return path.a, 0.0


def bend(path: Path, time: float) -> float:
    """Second derivative of a profile without corners."""
    if path.kind == SINE:
        turn = 2.0 * math.pi
        return -path.b * (turn * path.c) ** 2 * math.sin(turn * (path.c * time + path.d))
    return 0.0


def flow_function(ratio: float, hole: Restriction) -> float:
    """Flow over choked flow, equations (6) and (7) as printed, or ISO 6358."""
    if ratio <= hole.critical:
        return 1.0
    if hole.k == 0.0:
        share = (ratio - hole.critical) / (1.0 - hole.critical)
        return math.sqrt(1.0 - share * share)
    k = hole.k
    subsonic = ratio ** (1.0 / k) * math.sqrt(1.0 - ratio ** ((k - 1.0) / k))
    choked = (2.0 / (k + 1.0)) ** (1.0 / (k - 1.0)) * math.sqrt((k - 1.0) / (k + 1.0))
    return subsonic / choked


def flow(up: float, down: float, warmth: float, hole: Restriction, linear: float) -> float:
    """Mass flow [kg/s], ``up`` not below ``down``; ``warmth`` is the temperature upstream over that of the device."""
    ratio = down / up
    value = flow_function(min(ratio, linear), hole)
    if ratio > linear:
        value *= (1.0 - ratio) / (1.0 - linear)
    return hole.conductance * up * value / math.sqrt(warmth)


def place_of(rig: Rig, time: float, y: Any) -> tuple[float, float]:
    """Angle and angular velocity of the vane."""
    if rig.led > 0.0:
        return follow(rig.path, time)
    return y[ANGLE], y[VELOCITY]


def gas_of(rig: Rig, angle: float, y: Any) -> tuple[float, float, float, float]:
    """Both pressures [Pa] and both temperatures over that of the device."""
    if rig.joint is not None:
        return gas_of_joint(rig, rig.joint, angle, y)
    volume_1 = rig.dead_1 + rig.displacement_per_radian * (angle - rig.lowest)
    volume_2 = rig.dead_2 + rig.displacement_per_radian * (rig.highest - angle)
    product = rig.gas_constant * rig.temperature
    if rig.thermal == 0.0:
        return y[MASS_1] * product / volume_1, y[MASS_2] * product / volume_2, 1.0, 1.0
    pressure_1 = (rig.k - 1.0) * y[ENERGY_1] / volume_1
    pressure_2 = (rig.k - 1.0) * y[ENERGY_2] / volume_2
    return (
        pressure_1,
        pressure_2,
        pressure_1 * volume_1 / (y[MASS_1] * product),
        pressure_2 * volume_2 / (y[MASS_2] * product),
    )


def gas_of_joint(rig: Rig, joint: Joint, angle: float, y: Any) -> tuple[float, float, float, float]:
    """The same in chambers that may follow the pressure."""
    product = rig.gas_constant * rig.temperature
    isothermal = y[MASS_1] * product, y[MASS_2] * product
    if rig.thermal == 0.0:
        return joint.pressure(0, angle, isothermal[0]), joint.pressure(1, angle, isothermal[1]), 1.0, 1.0
    contents = (rig.k - 1.0) * y[ENERGY_1], (rig.k - 1.0) * y[ENERGY_2]
    return (
        joint.pressure(0, angle, contents[0]),
        joint.pressure(1, angle, contents[1]),
        contents[0] / isothermal[0],
        contents[1] / isothermal[1],
    )


def energy_rate(
    rig: Rig, joint: Joint, which: int, angle: float, velocity: float, pressure: float, given: Any
) -> float:
    """Rate of a chamber's energy [W] that is given enthalpy [W], and heat by its walls [W] per volume [m^3]."""
    chamber = joint.chamber(which, angle, pressure)
    entering = given[0] + given[1] * chamber.volume
    # dE = entering - P dV and d(P V) = (k - 1) dE, with dV = V_angle dangle + V_P dP: two equations for dP and dE.
    moved = chamber.by_angle * velocity
    matrix = np.array(
        [[chamber.volume + pressure * chamber.by_pressure, 1.0 - rig.k], [pressure * chamber.by_pressure, 1.0]]
    )
    return float(np.linalg.solve(matrix, np.array([-pressure * moved, entering - pressure * moved]))[1])


def exchange(rig: Rig, inside: float, warmth: float, outside: float, share: float, oneway: bool) -> tuple[float, float]:
    """Flow into a chamber through a share of the valve's area [kg/s]; the same times its warmth."""
    if share <= 0.0:
        return 0.0, 0.0
    if outside >= inside:
        entering = share * flow(outside, inside, 1.0, rig.port, rig.linear)
        return entering, entering
    if oneway:
        return 0.0, 0.0
    leaving = share * flow(inside, outside, warmth, rig.port, rig.linear)
    return -leaving, -leaving * warmth


def shares_of(rig: Rig, y: Any, coils: Any) -> tuple[float, float, float, float]:
    """Shares of the area: source to chamber 1, chamber 1 to the room, source to chamber 2, chamber 2 to the room."""
    if rig.valve.solenoid > 0.0:
        return coils[0, 0], 1.0 - coils[0, 0], coils[1, 0], 1.0 - coils[1, 0]
    opening = y[SPOOL] if rig.valve.frequency > 0.0 else y[ASKED]
    towards_1 = min(max(opening, 0.0), 1.0)
    towards_2 = min(max(-opening, 0.0), 1.0)
    return towards_1, towards_2, towards_2, towards_1


def turning_inertia(rig: Rig) -> float:
    """What turns about the ankle [kg m^2]."""
    return rig.inertia + rig.leg.inertia


def stride(leg: Leg, curve: int, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative of a curve of the gait."""
    turn = 2.0 * math.pi
    terms = leg.curves.shape[1] // 2
    terms_of = leg.curves[curve].tolist()
    value = terms_of[0]
    rate = 0.0
    second = 0.0
    for number in range(1, terms + 1):
        pace = turn * number * leg.frequency
        place = turn * number * (leg.start + leg.frequency * time)
        along = terms_of[number]
        across = terms_of[terms + number]
        value += along * math.cos(place) + across * math.sin(place)
        rate += pace * (across * math.cos(place) - along * math.sin(place))
        second -= pace * pace * (along * math.cos(place) + across * math.sin(place))
    return value, rate, second


def torque_on_foot(rig: Rig, time: float, angle: float) -> float:
    """What shank and weight do to the body that turns about the ankle [N m], plantarflexion positive.

    Newton's law of that body in the frame of the room: its angle over the horizontal is alpha, its weight acts at S
    over the mass, and the ankle carries it along a circle about the knee, which has accelerations of its own.
    """
    knee_forward = 0.0
    knee_up = 0.0
    if rig.leg.frequency > 0.0:
        shank, shank_rate, shank_bend = stride(rig.leg, 0, time)
        knee_forward = stride(rig.leg, 1, time)[0]
        knee_up = stride(rig.leg, 2, time)[0]
    else:
        shank, shank_rate = follow(rig.leg.shank, time)
        shank_bend = bend(rig.leg.shank, time)
    alpha = shank - angle + 0.5 * math.pi
    s = rig.leg.moment + rig.gravity / STANDARD_GRAVITY
    length = rig.leg.shank_length
    forward = knee_forward + length * (math.cos(shank) * shank_bend - math.sin(shank) * shank_rate * shank_rate)
    up = knee_up + length * (math.sin(shank) * shank_bend + math.cos(shank) * shank_rate * shank_rate)
    falls = s * (math.cos(alpha) * (STANDARD_GRAVITY + up) - math.sin(alpha) * forward)
    return turning_inertia(rig) * shank_bend + falls


def net_torque(rig: Rig, time: float, angle: float, pressure_1: float, pressure_2: float) -> float:
    """What drives the vane before friction and damping [N m], equations (1) and (11)."""
    if rig.joint is None:
        actuator = rig.torque_constant * (pressure_1 - pressure_2)
    else:
        actuator = rig.joint.torque(angle, pressure_1, pressure_2)
    if rig.leg.is_worn > 0.0:
        return actuator + torque_on_foot(rig, time, angle) - rig.external
    gravity = -rig.gravity * math.sin(angle)
    return actuator - gravity - rig.external


def rates(rig: Rig, time: float, state: Any, way: float, coils: Any, target: float, slopes: Any) -> None:
    """Time derivatives of all unknowns, equations (1) to (10)."""
    # Python's own numbers are quicker than an array's elements.
    y = state.tolist()
    slope = [0.0] * state.size
    angle, velocity = place_of(rig, time, y)
    pressure_1, pressure_2, warmth_1, warmth_2 = gas_of(rig, angle, y)
    if abs(way) == 1.0:
        torque = net_torque(rig, time, angle, pressure_1, pressure_2) - rig.viscous * velocity - way * rig.dynamic
        slope[ANGLE] = velocity
        slope[VELOCITY] = torque / turning_inertia(rig)
    source_1, vent_1, source_2, vent_2 = shares_of(rig, y, coils)
    oneway = rig.relieving == 0.0
    from_1, warm_1 = exchange(rig, pressure_1, warmth_1, rig.source_1, source_1, oneway)
    from_2, warm_2 = exchange(rig, pressure_2, warmth_2, rig.source_2, source_2, oneway)
    vented_1, cold_1 = exchange(rig, pressure_1, warmth_1, rig.room, vent_1, False)
    vented_2, cold_2 = exchange(rig, pressure_2, warmth_2, rig.room, vent_2, False)
    if pressure_1 >= pressure_2:
        leaked = flow(pressure_1, pressure_2, warmth_1, rig.leak, rig.linear)
        carried = leaked * warmth_1
    else:
        leaked = -flow(pressure_2, pressure_1, warmth_2, rig.leak, rig.linear)
        carried = leaked * warmth_2
    slope[MASS_1] = from_1 + vented_1 - leaked
    slope[MASS_2] = from_2 + vented_2 + leaked
    slope[TAKEN] = from_1 + from_2
    if rig.thermal > 0.0:
        enthalpy = rig.gas_constant * rig.temperature * rig.k / (rig.k - 1.0)
        heat = rig.heat * rig.walls * rig.temperature
        turning = velocity if way != REST else 0.0
    if rig.thermal > 0.0 and rig.joint is not None:
        given_1 = enthalpy * (warm_1 + cold_1 - carried), heat * (1.0 - warmth_1)
        given_2 = enthalpy * (warm_2 + cold_2 + carried), heat * (1.0 - warmth_2)
        slope[ENERGY_1] = energy_rate(rig, rig.joint, 0, angle, turning, pressure_1, given_1)
        slope[ENERGY_2] = energy_rate(rig, rig.joint, 1, angle, turning, pressure_2, given_2)
    elif rig.thermal > 0.0:
        volume_rate = rig.displacement_per_radian * turning
        volume_1 = rig.dead_1 + rig.displacement_per_radian * (angle - rig.lowest)
        volume_2 = rig.dead_2 + rig.displacement_per_radian * (rig.highest - angle)
        slope[ENERGY_1] = enthalpy * (warm_1 + cold_1 - carried) - pressure_1 * volume_rate
        slope[ENERGY_2] = enthalpy * (warm_2 + cold_2 + carried) + pressure_2 * volume_rate
        slope[ENERGY_1] += heat * volume_1 * (1.0 - warmth_1)
        slope[ENERGY_2] += heat * volume_2 * (1.0 - warmth_2)
    if rig.valve.solenoid == 0.0:
        if rig.valve.slew > 0.0 and y[ASKED] != target:
            slope[ASKED] = math.copysign(rig.valve.slew, target - y[ASKED])
        if rig.valve.frequency > 0.0:
            natural = 2.0 * math.pi * rig.valve.frequency
            slope[SPOOL] = y[SPOOL_RATE]
            slope[SPOOL_RATE] = natural * natural * (y[ASKED] - y[SPOOL])
            slope[SPOOL_RATE] -= 2.0 * rig.valve.damping * natural * y[SPOOL_RATE]
    slopes[:] = slope


def trial(
    rig: Rig, time: float, h: float, y: Any, way: float, coils: Any, target: float, work: Any, sizes: Any
) -> float:
    """Error of one step over what is allowed at a tolerance of 1; the result is in the last row of ``work``."""
    for stage in range(7):
        work[7] = y + h * (WEIGHTS[stage, :stage] @ work[:stage])
        rates(rig, time + TIMES[stage] * h, work[7], way, coils, target, work[stage])
    return float(np.max(np.abs(h * (ERRORS @ work[:7])) / sizes))


def leaves(rig: Rig, time: float, y: Any) -> float:
    """1 or -1 where a vane at rest begins to move that way, else 0: friction or a stop holds it, equation (10)."""
    pressure_1, pressure_2, _, _ = gas_of(rig, y[ANGLE], y)
    torque = net_torque(rig, time, y[ANGLE], pressure_1, pressure_2)
    if torque > rig.static and y[ANGLE] < rig.highest:
        return 1.0
    if torque < -rig.static and y[ANGLE] > rig.lowest:
        return -1.0
    return 0.0


def happened(rig: Rig, time: float, y: Any, way: float) -> bool:
    """True where a step has gone past a breakaway, a reversal or a stop."""
    if way == LED:
        return False
    if way == REST:
        return leaves(rig, time, y) != 0.0
    beyond = y[ANGLE] >= rig.highest if way > 0.0 else y[ANGLE] <= rig.lowest
    return beyond or y[VELOCITY] * way <= 0.0


def what_follows(rig: Rig, time: float, y: Any, way: float) -> tuple[float, bool]:
    """The way from here on, with the state changed, and whether this was an impact."""
    impact = False
    if way == REST:
        return leaves(rig, time, y), impact
    stop = rig.highest if way > 0.0 else rig.lowest
    if (y[ANGLE] - stop) * way >= 0.0:
        y[ANGLE] = stop
        impact = y[VELOCITY] * way > 0.0
        y[VELOCITY] = -rig.restitution * y[VELOCITY] if impact else 0.0
    else:
        y[VELOCITY] = 0.0
    if abs(y[VELOCITY]) > SLOWEST_REBOUND:
        return -way, impact
    y[VELOCITY] = 0.0
    return leaves(rig, time, y), impact


def rounded(value: float, resolution: float) -> float:
    """The nearest whole number of quanta, a half away from 0."""
    return math.copysign(math.floor(abs(value) / resolution + 0.5) * resolution, value) if resolution > 0.0 else value


def decide(rig: Rig, time: float, seen: Any, memory: Any) -> float:
    """Command of one sample; ``memory`` has integral, last error, filtered slope and a mark of the first sample."""
    law = rig.law
    if law.kind == 0.0:
        return law.command
    measured_1 = rounded(seen[0] + law.bias, law.pressure_resolution)
    measured_2 = rounded(seen[1] - law.bias, law.pressure_resolution)
    wish, _ = follow(rig.wish, time)
    error = wish - rig.torque_constant * (measured_1 - measured_2)
    if law.kind == 1.0:
        return 1.0 if error >= 0.0 else -1.0
    memory[0] += law.i * error * law.period
    slope = (error - memory[1]) / law.period if memory[3] > 0.0 else 0.0
    memory[2] += (slope - memory[2]) * law.period / (law.filter + law.period)
    memory[1] = error
    memory[3] = 1.0
    wanted = law.p * error + memory[0] + law.d * memory[2]
    command = min(max(wanted, -1.0), 1.0)
    memory[0] += law.anti_windup * (command - wanted) * law.period
    # The dead band that the law believes in is jumped over, in 1/128 of the way.
    return command + law.dead_band * (min(max(128.0 * command, -1.0), 1.0) - command)


def opening_asked(valve: Valve, command: float) -> float:
    """Opening that a command asks of a spool: nothing inside the dead band, all at full command."""
    size = max(abs(command) - valve.dead_band, 0.0) / (1.0 - valve.dead_band)
    return math.copysign(min(size, 1.0), command)


def settle_coils(valve: Valve, coils: Any, command: float, time: float) -> float:
    """Let both coils do what is due; when one acts next. A coil: position, order, when taken, when followed."""
    soonest = NEVER
    for n in range(2):
        coil = coils[n]
        wanted = 1.0 if (command > 0.0 and n == 0) or (command < 0.0 and n == 1) else 0.0
        if coil[0] != coil[1] and time >= coil[3] - SAME_INSTANT:
            coil[0] = coil[1]
        if wanted != coil[1]:
            if time >= coil[2] + valve.interval - SAME_INSTANT:
                coil[1] = wanted
                coil[2] = time
                coil[3] = time + (valve.opening_delay if wanted > 0.0 else valve.closing_delay)
                if coil[3] <= time + SAME_INSTANT:
                    coil[0] = wanted
            else:
                soonest = min(soonest, coil[2] + valve.interval)
        if coil[0] != coil[1]:
            soonest = min(soonest, coil[3])
    return soonest


def corner_after(path: Path, time: float) -> float:
    """The next corner of a profile."""
    if path.kind == RAMP_HOLD:
        for corner in (path.c, path.c + path.d):
            if corner > time + SAME_INSTANT:
                return corner
    return NEVER


def advance(
    rig: Rig,
    time: float,
    end: float,
    y: Any,
    way: float,
    coils: Any,
    target: float,
    work: Any,
    h: float,
    tolerance: float,
    impacts: Any,
    counts: Any,
) -> tuple[float, float]:
    """From one known instant to the next over all that the vane does: its way then, and the length of the next step."""
    sizes = np.empty(y.size)
    while time < end:
        sizes[:] = 1.0
        sizes[VELOCITY] = 1.0 + abs(y[VELOCITY])
        sizes[SPOOL_RATE] = 1.0 + abs(y[SPOOL_RATE]) + 6.3 * rig.valve.frequency
        for n in (MASS_1, MASS_2, ENERGY_1, ENERGY_2):
            sizes[n] = max(y[n], 1.0e-12)
        sizes[TAKEN] = max(y[MASS_1], y[MASS_2])
        last = h >= end - time
        step = end - time if last else h
        error = trial(rig, time, step, y, way, coils, target, work, sizes) / tolerance
        good = error <= 1.0 and work[7, MASS_1] > 0.0 and work[7, MASS_2] > 0.0
        if not good and step > 1.0e-11:
            h = step * (max(0.9 * error**-0.2, 0.2) if 1.0 < error < 1.0e8 else 0.1)
            continue
        counts[0] += 1
        if not happened(rig, time + step, work[7], way):
            y[:] = work[7]
            time = end if last else time + step
            if not last or step > 0.5 * h:
                h = min(step * (min(0.9 * error**-0.2, 4.0) if error > 0.0 else 4.0), LONGEST_STEP)
            continue
        before = 0.0
        after = step
        while after - before > 1.0e-13:
            middle = 0.5 * (before + after)
            if middle <= before or middle >= after:
                break
            trial(rig, time, middle, y, way, coils, target, work, sizes)
            if happened(rig, time + middle, work[7], way):
                after = middle
            else:
                before = middle
        trial(rig, time, after, y, way, coils, target, work, sizes)
        y[:] = work[7]
        time = end if after == end - time else time + after
        way, impact = what_follows(rig, time, y, way)
        counts[2] += 1
        if impact and counts[1] < impacts.size:
            impacts[counts[1]] = time
            counts[1] += 1
    return way, h


def settle_loop(rig: Rig, time: float, y: Any, due: Any, seen: Any, commands: Any, memory: Any) -> float:
    """Measure, decide and pass on what is due; the command that the valve has now, none before the first."""
    law = rig.law
    while due[MEASURED] < commands.size and due[MEASURED] * law.period - law.delay <= time + SAME_INSTANT:
        angle, _ = place_of(rig, time, y)
        pressure_1, pressure_2, _, _ = gas_of(rig, angle, y)
        seen[due[MEASURED], 0] = pressure_1
        seen[due[MEASURED], 1] = pressure_2
        due[MEASURED] += 1
    while due[DECIDED] < commands.size and due[DECIDED] * law.period <= time + SAME_INSTANT:
        commands[due[DECIDED]] = decide(rig, time, seen[due[DECIDED]], memory)
        due[DECIDED] += 1
    while due[ARRIVED] < commands.size and due[ARRIVED] * law.period + rig.valve.delay <= time + SAME_INSTANT:
        due[ARRIVED] += 1
    return commands[due[ARRIVED] - 1] if due[ARRIVED] > 0 else 0.0


def settle_valve(valve: Valve, y: Any, coils: Any, command: float, time: float) -> tuple[float, float]:
    """Where the spool is asked to go, and the next time at which the valve does something abrupt by itself."""
    if valve.solenoid > 0.0:
        return 0.0, settle_coils(valve, coils, command, time)
    target = opening_asked(valve, command)
    arrival = time + abs(target - y[ASKED]) / valve.slew if valve.slew > 0.0 else time
    if arrival > time + SAME_INSTANT:
        return target, arrival
    y[ASKED] = target
    return target, NEVER


def next_known(rig: Rig, time: float, due: Any, samples: int, record: float) -> float:
    """The next instant known ahead: a record, a measurement, a decision, a late command, a corner of the path."""
    law = rig.law
    soonest = min(record, corner_after(rig.path, time))
    if due[MEASURED] < samples:
        soonest = min(soonest, due[MEASURED] * law.period - law.delay)
    if due[DECIDED] < samples:
        soonest = min(soonest, due[DECIDED] * law.period)
    if due[ARRIVED] < samples:
        soonest = min(soonest, due[ARRIVED] * law.period + rig.valve.delay)
    return soonest


def first_way(rig: Rig, y: Any) -> float:
    """The way of the vane at the start; one that is thrown at the stop it stands on rebounds at once."""
    if rig.led > 0.0:
        return LED
    if y[VELOCITY] == 0.0:
        return leaves(rig, 0.0, y)
    way = math.copysign(1.0, y[VELOCITY])
    return what_follows(rig, 0.0, y, way)[0] if happened(rig, 0.0, y, way) else way


def solve(rig: Rig, y: Any, interval: float, records: Any, impacts: Any, tolerance: float) -> Any:
    """Fill the records, a row every ``interval`` [s]; steps, impacts and events counted."""
    counts = np.zeros(3, np.int64)
    due = np.zeros(3, np.int64)
    work = np.zeros((8, y.size))
    coils = np.zeros((2, 4))
    memory = np.zeros(4)
    coils[:, 2] = -1.0e9
    samples = int(interval * (records.shape[0] - 1) / rig.law.period + 1.0e-9) + 1
    seen = np.zeros((samples, 2))
    commands = np.zeros(samples)
    way = first_way(rig, y)
    time = 0.0
    recorded = 0
    h = 1.0e-6
    while True:
        command = settle_loop(rig, time, y, due, seen, commands, memory)
        target, change = settle_valve(rig.valve, y, coils, command, time)
        if interval * recorded <= time + SAME_INSTANT:
            angle, velocity = place_of(rig, time, y)
            pressure_1, pressure_2, _, _ = gas_of(rig, angle, y)
            records[recorded, 0] = time
            records[recorded, 1] = angle
            records[recorded, 2] = velocity
            records[recorded, 3] = pressure_1
            records[recorded, 4] = pressure_2
            records[recorded, 5] = y[TAKEN]
            recorded += 1
        if recorded >= records.shape[0] or counts[0] > MOST_STEPS:
            return counts
        until = min(change, next_known(rig, time, due, samples, interval * recorded))
        way, h = advance(rig, time, until, y, way, coils, target, work, h, tolerance, impacts, counts)
        time = until


def restriction(orifice: Any, scenario: Scenario) -> Restriction:
    """An orifice in either form, equation (6) or ISO 6358 for another gas than air."""
    gas = scenario.device.gas
    k = gas.heat_capacity_ratio
    constant = UNIVERSAL_GAS_CONSTANT / gas.molar_mass
    if hasattr(orifice, "area"):
        choked = math.sqrt(k / (constant * gas.temperature) * (2.0 / (k + 1.0)) ** ((k + 1.0) / (k - 1.0)))
        conductance = orifice.discharge_coefficient * orifice.area * choked
        return Restriction(conductance, (2.0 / (k + 1.0)) ** (k / (k - 1.0)), k)
    air = REFERENCE_PRESSURE / (REFERENCE_DENSITY * REFERENCE_TEMPERATURE)
    warmth = math.sqrt(REFERENCE_TEMPERATURE / gas.temperature * air / constant)
    return Restriction(orifice.sonic_conductance * REFERENCE_DENSITY * warmth, orifice.critical_ratio, 0.0)


def path_of(choice: Any) -> Path:
    """A profile as numbers."""
    s = choice.settings
    kind = PROFILES[choice.kind]
    if kind == SINE:
        return Path(kind, s["level"], s["amplitude"], s["frequency"], s["phase"])
    if kind == RAMP_HOLD:
        return Path(kind, s["start_level"], s["level"], s["ramp_start"], s["ramp_time"])
    return Path(kind, s["level"], 0.0, 0.0, 0.0)


def leg_of(leg: Any) -> Leg:
    """The leg as numbers."""
    still = Path(CONSTANT, 0.0, 0.0, 0.0, 0.0)
    if leg is None:
        return Leg(0.0, 0.0, 0.0, 0.0, still, 0.0, 0.0, np.zeros((3, 1)))
    moment = leg.foot_mass * leg.foot_mass_centre
    body = (1.0, moment, leg.foot_inertia + moment * leg.foot_mass_centre, leg.shank_length)
    if leg.curves is None:
        return Leg(*body, path_of(leg.shank), 0.0, 0.0, np.zeros((3, 1)))
    curves = [
        [series.mean, *(item.cosine for item in series.harmonics), *(item.sine for item in series.harmonics)]
        for series in (leg.curves.shank, leg.curves.knee_forward, leg.curves.knee_up)
    ]
    return Leg(*body, still, leg.curves.frequency, leg.curves.start, np.array(curves))


def valve_of(scenario: Scenario) -> Valve:
    """The valve as numbers."""
    s = scenario.device.valve.settings
    if scenario.device.valve.kind == "solenoid":
        delays = (s["opening_delay"], s["closing_delay"], s["switching_interval"])
        return Valve(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, *delays)
    spool = (s["spool_frequency"], s["spool_damping_ratio"], s["slew_limit"])
    return Valve(0.0, s["dead_band"], s["delay"], *spool, 0.0, 0.0, 0.0)


def law_of(scenario: Scenario, bias: float) -> Law:
    """Controller and sensors as numbers; their noise must be off."""
    s = scenario.controller.settings
    sensors = scenario.sensors
    if sensors.angle_noise or sensors.pressure_noise:
        raise ValueError("the reference knows no noise")
    names = ("proportional_gain", "integral_gain", "derivative_gain", "derivative_filter", "anti_windup", "dead_band")
    gains = (s.get(name, 0.0) for name in names)
    seen = (sensors.delay, sensors.pressure_resolution, bias)
    return Law(CONTROLLERS[scenario.controller.kind], scenario.controller.period, s.get("command", 0.0), *gains, *seen)


def rig_of(scenario: Scenario, bias: float = 0.0, relieving: bool | None = None, joint: Joint | None = None) -> Rig:
    """The numbers of a scenario; of an actuator that is no vane, the ``joint``."""
    device = scenario.device
    motion = scenario.motion
    warm = scenario.gas_model
    actuator = device.actuator
    friction = device.friction
    supply = device.supply
    gas = device.gas
    free = isinstance(motion, FreeMotion)
    leg = motion.leg if free else None
    return Rig(
        actuator.torque_constant if joint is None else math.nan,
        actuator.displacement_per_radian if joint is None else math.nan,
        actuator.angle_min,
        actuator.angle_max,
        actuator.dead_volume_1,
        actuator.dead_volume_2,
        actuator.restitution,
        friction.static_torque,
        friction.dynamic_torque,
        friction.viscous_damping,
        device.foot_plate.inertia,
        device.foot_plate.gravity_torque,
        (motion.external_torque if free else 0.0) if leg is None else -leg.ankle_torque,
        supply.pressure,
        supply.dorsiflexion_pressure,
        supply.atmospheric_pressure,
        float(getattr(supply, "relieving", True) if relieving is None else relieving),
        UNIVERSAL_GAS_CONSTANT / gas.molar_mass,
        gas.heat_capacity_ratio,
        gas.temperature,
        device.flow.linear_ratio,
        0.0 if warm is None else 1.0,
        0.0 if warm is None else warm.heat_transfer_coefficient,
        0.0 if warm is None else warm.wall_area_per_volume,
        0.0 if free else 1.0,
        restriction(device.valve.orifice, scenario),
        restriction(actuator.leak, scenario),
        valve_of(scenario),
        law_of(scenario, bias),
        Path(CONSTANT, 0.0, 0.0, 0.0, 0.0) if free else path_of(motion.profile),
        path_of(scenario.reference),
        leg_of(leg),
        joint,
    )


def start_of(scenario: Scenario, rig: Rig, moved: float) -> Any:
    """The unknowns at the start, with angle [rad] and pressures (relative) moved by so much."""
    y = np.zeros(10)
    y[ANGLE], y[VELOCITY] = follow(rig.path, 0.0)
    if rig.led == 0.0:
        middle = 0.5 * (rig.lowest + rig.highest)
        y[ANGLE] = scenario.motion.angle + math.copysign(moved, middle - scenario.motion.angle)
        y[VELOCITY] = scenario.motion.angular_velocity * (1.0 + moved)
    product = rig.gas_constant * rig.temperature
    content_1 = scenario.initial.pressure_1 * (1.0 + moved)
    content_2 = scenario.initial.pressure_2 * (1.0 - moved)
    if rig.joint is None:
        content_1 *= rig.dead_1 + rig.displacement_per_radian * (y[ANGLE] - rig.lowest)
        content_2 *= rig.dead_2 + rig.displacement_per_radian * (rig.highest - y[ANGLE])
    else:
        content_1 *= rig.joint.chamber(0, y[ANGLE], content_1).volume
        content_2 *= rig.joint.chamber(1, y[ANGLE], content_2).volume
    y[MASS_1] = content_1 / product
    y[MASS_2] = content_2 / product
    y[ENERGY_1] = content_1 / (rig.k - 1.0)
    y[ENERGY_2] = content_2 / (rig.k - 1.0)
    return y


def independent_run(
    scenario: Scenario,
    tolerance: float = 1.0e-9,
    moved: float = 0.0,
    bias: float = 0.0,
    relieving: bool | None = None,
    joint: Joint | None = None,
) -> Answer:
    """What the equations say of a scenario, at the times of its recording.

    ``tolerance`` is the error allowed in a step; ``moved`` moves the start, ``bias`` [Pa] what the controller measures.
    Supplies take gas back where ``relieving`` says so, or the device does; one that says nothing takes it back.
    An actuator that is no vane is given as a ``joint``.
    """
    rig = rig_of(scenario, bias, relieving, joint)
    records = np.full((round(scenario.run.duration / scenario.run.output_interval) + 1, 6), np.nan)
    impacts = np.zeros(10_000)
    start = start_of(scenario, rig, moved)
    counts = solve(rig, start, scenario.run.output_interval, records, impacts, tolerance)
    return Answer(*records.T, impacts[: counts[1]], int(counts[0]))
