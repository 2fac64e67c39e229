"""A cylinder servo and a sealed vane, computed from the textbook's equations with nothing of the package's engine.

Every formula is written here again: law of cosines, ISO 6358, Coulomb friction, the cascade; small steps of the
Runge-Kutta method of fourth order. Numbers of the device come from the set, gains from the run.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

GAS = 8.314462618
STEP = 5.0e-5


class Servo(NamedTuple):
    """Lever [m], base [m], offset [rad], areas [m^2], dead volumes [m^3], lengths at the stops [m], R T [J/kg].

    Then conductance [kg/(s Pa)], critical ratio, supply and room [Pa], inertia, frictions and damping in SI.
    """

    lever: float
    base: float
    offset: float
    piston: float
    rod_side: float
    dead_1: float
    dead_2: float
    shortest: float
    longest: float
    product: float
    conductance: float
    critical: float
    supply: float
    room: float
    inertia: float
    static: float
    dynamic: float
    damping: float


def pin_distance(lever: float, base: float, between: float) -> float:
    return math.sqrt(lever**2 + base**2 - 2.0 * lever * base * math.cos(between))


def servo_of(scenario: Scenario) -> Servo:
    device = scenario.device
    cylinder, gas, friction = device.actuator, device.gas, device.friction
    product = GAS / gas.molar_mass * gas.temperature
    lever, base, offset = cylinder.lever_length, cylinder.base_distance, cylinder.lever_offset
    # ISO 6358: C times the density at 100 kPa and 20 degC, corrected for the temperature of the gas.
    density = 1.0e5 / (GAS / gas.molar_mass * 293.15)
    return Servo(
        lever=lever,
        base=base,
        offset=offset,
        piston=0.25 * math.pi * cylinder.bore**2,
        rod_side=0.25 * math.pi * (cylinder.bore**2 - cylinder.rod_diameter**2),
        dead_1=cylinder.dead_volume_1,
        dead_2=cylinder.dead_volume_2,
        shortest=pin_distance(lever, base, cylinder.angle_min + offset),
        longest=pin_distance(lever, base, cylinder.angle_max + offset),
        product=product,
        conductance=device.valve.sonic_conductance * density * math.sqrt(293.15 / gas.temperature),
        critical=device.valve.critical_ratio,
        supply=device.supply.pressure,
        room=device.supply.atmospheric_pressure,
        inertia=device.foot_plate.inertia,
        static=friction.static_torque,
        dynamic=friction.dynamic_torque,
        damping=friction.viscous_damping,
    )


def chambers(servo: Servo, angle: float) -> tuple[float, float, float]:
    """Both volumes [m^3], and the arm [m]."""
    between = angle + servo.offset
    length = pin_distance(servo.lever, servo.base, between)
    arm = servo.lever * servo.base * math.sin(between) / length
    volume_1 = servo.dead_1 + servo.piston * (length - servo.shortest)
    return volume_1, servo.dead_2 + servo.rod_side * (servo.longest - length), arm


def pressures_and_torque(servo: Servo, y: np.ndarray) -> tuple[float, float, float]:
    volume_1, volume_2, arm = chambers(servo, y[0])
    first, second = y[2] * servo.product / volume_1, y[3] * servo.product / volume_2
    gauge_1, gauge_2 = first - servo.room, second - servo.room
    return first, second, arm * (servo.piston * gauge_1 - servo.rod_side * gauge_2)


def orifice(servo: Servo, up: float, down: float, opening: float) -> float:
    """Mass flow [kg/s] through an opening [-]; a supply takes nothing back."""
    if up <= down:
        return 0.0
    ratio = max(down / up, servo.critical)
    shape = (ratio - servo.critical) / (1.0 - servo.critical)
    return opening * servo.conductance * up * math.sqrt(max(0.0, 1.0 - shape * shape))


def rates(servo: Servo, y: np.ndarray, command: float, is_stuck: bool) -> np.ndarray:
    first, second, torque = pressures_and_torque(servo, y)
    opening = abs(command)
    if command >= 0.0:
        flow_1, flow_2 = orifice(servo, servo.supply, first, opening), -orifice(servo, second, servo.room, opening)
    else:
        flow_1, flow_2 = -orifice(servo, first, servo.room, opening), orifice(servo, servo.supply, second, opening)
    net = torque - servo.damping * y[1] - servo.dynamic * np.sign(y[1])
    return np.array([y[1], 0.0 if is_stuck else net / servo.inertia, flow_1, flow_2])


class Cascade:
    """The cascade, written again, with what it remembers."""

    def __init__(self, law: Any) -> None:
        self.law, self.is_begun, self.is_held, self.is_full = law, False, False, False
        self.rate = self.slope = self.quickening = self.before = self.asked = self.angle = self.place = self.still = 0.0
        self.load = self.breaking = self.torque = self.lagged = self.jump = 0.0

    def command(self, wanted: float, angle: float, shown: float) -> float:
        law, dt = self.law, self.law.period
        asked = self.sense(wanted, angle, shown)
        error = wanted - angle
        moves = self.is_begun and 0.02 * self.still < law.rest_distance
        allowed = 2.0 * law.tolerance if self.is_held else law.tolerance
        self.is_held = asked == 0.0 and abs(error) < allowed and not moves
        acting = max(-law.error_limit, min(law.error_limit, error))
        slip = asked + 2.0 * law.angle_stiffness / law.angle_damping * acting
        friction = 0.7 * law.friction_torque * max(-1.0, min(1.0, slip / 0.05))
        self.lagged += (self.torque - self.lagged) * dt / (dt + law.torque_lag)
        if self.is_full or not self.is_begun:
            self.lagged = shown
        if not self.is_held:
            self.learn(friction, error, moves)
            self.torque = self.load + self.breaking + friction + law.inertia * self.quickening
            self.torque += law.angle_stiffness * acting + law.angle_damping * (asked - self.rate)
        self.is_begun = True
        unlimited: float = law.torque_gain * (self.torque - shown)
        self.is_full = abs(unlimited) >= 1.0
        return max(-1.0, min(1.0, unlimited))

    def sense(self, wanted: float, angle: float, shown: float) -> float:
        """Take a sample, and return the rate of the reference [rad/s]."""
        law, dt = self.law, self.law.period
        asked = (wanted - self.before) / dt if self.is_begun else 0.0
        turned = angle - self.angle if self.is_begun else 0.0
        self.slope = (turned - dt * self.rate) / (dt + law.rate_filter)
        self.rate += self.slope
        # The first rate of the reference has none before it.
        jump = asked - self.asked if self.jump else 0.0
        self.quickening += (jump - dt * self.quickening) / (dt + 8.0 * law.rate_filter)
        if abs(angle - self.place) > law.rest_distance:
            self.place, self.still = angle, 0.0
        elif self.is_begun:
            self.still += dt
        if not self.is_begun:
            self.load = self.torque = shown
        self.before, self.asked, self.angle, self.jump = wanted, asked, angle, float(self.is_begun)
        return asked

    def learn(self, friction: float, error: float, moves: bool) -> None:
        law, dt = self.law, self.law.period
        self.load += (self.lagged - friction - self.breaking - self.load) * dt / law.load_time
        self.load -= law.inertia * self.slope / law.load_time
        creep = 0.0
        if abs(error) > law.tolerance and not moves:
            speed = min(abs(error) / math.radians(1.0), 10.0)
            creep = math.copysign(law.static_torque / (5.0 * law.torque_lag) * speed * dt, error)
        breaks = 0.0 if moves else self.breaking + creep
        if abs(breaks) <= law.static_torque:
            self.breaking = breaks
        elif not self.is_full:
            self.load += creep


def independent(scenario: Scenario, duration: float) -> np.ndarray:
    """Time [s], angle [rad] and pressure in chamber 1 [Pa] of the servo at each sample of its law (3, samples)."""
    servo, law, reference = servo_of(scenario), scenario.controller, scenario.reference
    late, cascade = round(scenario.sensors.delay / law.period), Cascade(law)
    volume_1, volume_2, _ = chambers(servo, scenario.motion.angle)
    y = np.array(
        [scenario.motion.angle, 0.0, servo.room * volume_1 / servo.product, servo.room * volume_2 / servo.product]
    )
    seen: list[tuple[float, float]] = []
    rows: list[tuple[float, float, float]] = []
    for sample in range(round(duration / law.period)):
        pressure, _, torque = pressures_and_torque(servo, y)
        rows.append((sample * law.period, float(y[0]), pressure))
        seen.append((float(y[0]), torque))
        turned = math.sin(2.0 * math.pi * reference.frequency * sample * law.period)
        command = cascade.command(reference.level + reference.amplitude * turned, *seen[max(0, sample - late)])
        for _ in range(round(law.period / STEP)):
            y = stepped(servo, y, command)
    return np.array(rows).T


def stepped(servo: Servo, y: np.ndarray, command: float) -> np.ndarray:
    """One small step; a joint at rest stays while the torque is within its static friction."""
    _, _, torque = pressures_and_torque(servo, y)
    is_stuck = y[1] == 0.0 and abs(torque) <= servo.static
    if y[1] == 0.0 and not is_stuck:
        y = y + np.array([0.0, 1.0e-12 * np.sign(torque), 0.0, 0.0])
    k1 = rates(servo, y, command, is_stuck)
    k2 = rates(servo, y + 0.5 * STEP * k1, command, is_stuck)
    k3 = rates(servo, y + 0.5 * STEP * k2, command, is_stuck)
    k4 = rates(servo, y + STEP * k3, command, is_stuck)
    after = y + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    if not is_stuck and after[1] * y[1] < 0.0:
        after[1] = 0.0
    return np.asarray(after)


def gaps(scenario: Scenario, answer: np.ndarray) -> tuple[float, float]:
    """Largest differences of angle [rad] and of the pressure in chamber 1 [Pa] from an independent answer."""
    recording = simulate(scenario).recording
    times, angle, pressure = answer
    found = [np.interp(times, recording.time, recording[name]) for name in ("angle", "pressure_1")]
    return float(np.max(np.abs(found[0] - angle))), float(np.max(np.abs(found[1] - pressure)))


def test_the_cylinder_servo_is_what_its_equations_say() -> None:
    scenario = load_scenario("cylinder-servo", ["run.duration=1 s"])
    answer = independent(scenario, 1.0)
    turned, pressed = gaps(scenario, answer)
    # Small steps and the instants of sticking leave some thousandths of the 20 deg and of the 5 bar.
    assert turned < math.radians(0.03)
    assert pressed < 2.0e3
    assert np.ptp(answer[1]) > math.radians(15.0)


def test_the_reference_would_see_a_cylinder_whose_bore_is_wrong_by_two_per_cent() -> None:
    scenario = load_scenario("cylinder-servo", ["run.duration=0.4 s"])
    other = load_scenario("cylinder-servo", ["run.duration=0.4 s", "actuator.bore=26.2 mm"])
    _, pressed = gaps(scenario, independent(other, 0.4))
    assert pressed > 2.0e3


@pytest.mark.parametrize(("thermal", "exponent"), [((), 1.0), (("adiabatic",), 1.3)], ids=["isothermal", "adiabatic"])
def test_a_vane_between_two_closed_chambers_swings_at_the_frequency_of_its_gas(
    thermal: tuple[str, ...], exponent: float
) -> None:
    warm = ("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=0 W/(m^2 K)")
    scenario = load_scenario(
        "step-response",
        [
            *("motion.kind=free", "motion.angle=75.2 deg", "run.duration=1.5 s", "run.output_interval=0.2 ms"),
            *("controller.kind=constant", "controller.command=0", "device.valve=proportional"),
            *("actuator.leak.area=0 mm^2", "friction.static_torque=0 N m", "friction.dynamic_torque=0 N m"),
            *("friction.viscous_damping=0 N m s/rad", "foot_plate.gravity_torque=0 N m", "run.step=0.2 ms"),
            *("initial.pressure_1=300 kPa_a", "initial.pressure_2=300 kPa_a", "run.tolerance=1e-5"),
            *((*warm, "gas_model.wall_area_per_volume=100 1/m") if thermal else ()),
        ],
    )
    actuator, inertia = scenario.device.actuator, scenario.device.foot_plate.inertia
    middle, growth = scenario.motion.angle, actuator.displacement_per_radian
    volume_1 = actuator.dead_volume_1 + growth * (middle - actuator.angle_min)
    volume_2 = actuator.dead_volume_2 + growth * (actuator.angle_max - middle)
    spring = actuator.torque_constant * growth * exponent * 300.0e3 * (1.0 / volume_1 + 1.0 / volume_2)
    # Equal pressures hold it where it starts: a small push makes it swing about there.
    pushed = load_scenario("step-response", [*scenario.origin.overrides, "motion.angular_velocity=10 deg/s"])
    angle = simulate(pushed).recording
    course = angle["angle"] - middle
    up = np.flatnonzero((course[:-1] < 0.0) & (course[1:] >= 0.0))
    crossings = angle.time[up] - course[up] * (angle.time[up + 1] - angle.time[up]) / (course[up + 1] - course[up])
    assert crossings.size >= 2
    period = float(np.mean(np.diff(crossings)))
    assert 2.0 * math.pi / period == pytest.approx(math.sqrt(spring / inertia), rel=3.0e-3)
