"""Closed formulas, each beside its test, for the package and for the independent simulator in ``tests/reference``.

a = C R T / V is the rate at which a chamber of volume V fills or empties through a choked orifice of conductance C.
What the energy balance says of fillings, emptyings and led compressions as a whole is in ``test_thermal_gas.py``.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import batch_of
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from tests.reference.reference_solver import chamber_pressures_of, plant_states
from tests.reference.simulator import independent_run

K = 1.3
PRODUCT = 8.314 * 298.0 / 0.044
CHOKED = math.sqrt(K / PRODUCT * (2.0 / (K + 1.0)) ** ((K + 1.0) / (K - 1.0)))
CONDUCTANCE = 0.113 * 31.6e-6 * CHOKED
PER_ANGLE = 51e-6
DEAD = 2e-6
LOWEST = math.radians(20.0)
HIGHEST = math.radians(130.0)
HELD = DEAD + PER_ANGLE * math.radians(55.0)
RATE = CONDUCTANCE * PRODUCT / HELD
VOLUMES = (
    "actuator.displacement_per_radian=51 cm^3/rad",
    "actuator.dead_volume_1=2 cm^3",
    "actuator.dead_volume_2=2 cm^3",
)
SEALED = ("actuator.leak.area=0 mm^2", "controller.kind=constant", "controller.command=0")
ADIABATIC = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=0 W/(m^2 K)",
    "gas_model.wall_area_per_volume=300 1/m",
)
FRICTIONLESS = tuple(f"friction.{name}=0 N m" for name in ("static_torque", "dynamic_torque"))
FRICTIONLESS += ("friction.viscous_damping=0 N m s/rad",)

Course = dict[str, Any]
Simulator = Callable[[Scenario], Course]


def by_package(scenario: Scenario) -> Course:
    """What the package says."""
    record = simulate(scenario).recording
    names = ("angle", "angular_velocity", "pressure_1", "pressure_2")
    return {"time": record.time} | {name: record[name] for name in names}


def by_reference(scenario: Scenario) -> Course:
    """What the reference says."""
    answer = independent_run(scenario)
    return answer._asdict() | {"angular_velocity": answer.velocity}


@pytest.fixture(params=[by_package, by_reference], ids=["package", "reference"])
def course(request: pytest.FixtureRequest) -> Simulator:
    """Who is held against the formula."""
    return request.param  # type: ignore[no-any-return]


def held(command: float, pressure: float, duration: float, *more: str) -> Scenario:
    """Chamber 1 of a vane held at 75 deg, with one command."""
    lines = ("actuator.leak.area=0 mm^2", "controller.kind=constant", f"controller.command={command}")
    lines += (f"initial.pressure_1={pressure} Pa_a", f"run.duration={duration} s")
    return load_scenario("torque-task-proportional", (*lines, *VOLUMES, *more))


def thrown(angle: float, speed: float, duration: float, *more: str) -> Scenario:
    """A free vane between two sealed chambers at the pressure of the atmosphere."""
    lines = (*SEALED, f"motion.angle={angle} deg", f"motion.angular_velocity={speed} rad/s")
    lines += (f"run.duration={duration} s", "initial.pressure_2=atmosphere")
    return load_scenario("step-response", ("motion.kind=free", *lines, *VOLUMES, *more))


@pytest.mark.parametrize(("gas", "exponent"), [((), 1.0), (ADIABATIC, K)], ids=["isothermal", "adiabatic"])
def test_choked_filling_raises_the_pressure_along_a_line(
    course: Simulator, gas: tuple[str, ...], exponent: float
) -> None:
    """P = P_0 + a P_source t; k times as fast where no wall takes the heat of the gas that comes in."""
    source = 800_000.0
    start = 101_325.0
    found = course(held(1.0, start, 0.027, f"supply.pressure={source} Pa_a", *gas))
    expected = start + exponent * RATE * source * found["time"]
    assert 3.0 * start < expected[-1] < 0.5457 * source
    np.testing.assert_allclose(found["pressure_1"], expected, rtol=3e-6)


def test_choked_isothermal_blow_down_is_an_exponential(course: Simulator) -> None:
    """P = P_0 exp(-a t)."""
    found = course(held(-1.0, 900_000.0, 0.13))
    expected = 900_000.0 * np.exp(-RATE * found["time"])
    assert 101_325.0 / 0.5457 < expected[-1] < 300_000.0
    np.testing.assert_allclose(found["pressure_1"], expected, rtol=1e-5)


def test_choked_adiabatic_blow_down_is_a_power(course: Simulator) -> None:
    """P = P_0 (1 + (k - 1)/2 a t)^(-2 k/(k - 1))."""
    found = course(held(-1.0, 900_000.0, 0.1, *ADIABATIC))
    expected = 900_000.0 * (1.0 + 0.5 * (K - 1.0) * RATE * found["time"]) ** (-2.0 * K / (K - 1.0))
    assert 101_325.0 / 0.5457 < expected[-1] < 300_000.0
    np.testing.assert_allclose(found["pressure_1"], expected, rtol=1e-5)


def volumes(angle: Any) -> tuple[Any, Any]:
    """Volumes of both chambers, equations (4) and (5) with stops and dead volumes."""
    return DEAD + PER_ANGLE * (angle - LOWEST), DEAD + PER_ANGLE * (HIGHEST - angle)


@pytest.mark.parametrize(("gas", "exponent"), [((), 1.0), (ADIABATIC, K)], ids=["isothermal", "adiabatic"])
def test_vane_thrown_between_sealed_chambers_keeps_their_energy_and_its_own(
    course: Simulator, gas: tuple[str, ...], exponent: float
) -> None:
    """P_i V_i^n = const, and I omega^2/2 changes by K/B times the work of both gases; n is 1 or k."""
    found = course(thrown(75.0, 25.0, 0.3, *gas, *FRICTIONLESS))
    work = 0.0
    for number, volume in enumerate(volumes(found["angle"]), start=1):
        pressure = 101_325.0 * (volume[0] / volume) ** exponent
        np.testing.assert_allclose(found[f"pressure_{number}"], pressure, rtol=1e-4)
        lnv = np.log(volume / volume[0])
        content = 101_325.0 * volume[0]
        work = work + content * (lnv if exponent == 1.0 else -np.expm1(-(exponent - 1.0) * lnv) / (exponent - 1.0))
    square = 25.0**2 + 2.0 / 8.4e-3 * (1.451e-5 / PER_ANGLE) * work
    assert square.min() < 0.5 * 25.0**2
    assert volumes(found["angle"])[1].min() < 0.4 * volumes(found["angle"])[1][0]
    np.testing.assert_allclose(found["angular_velocity"] ** 2, square, atol=2e-4 * 25.0**2)


@pytest.mark.parametrize("damping", [0.0, 0.032])
def test_decay_with_coulomb_and_viscous_friction_stops_when_and_where_it_should(
    course: Simulator, damping: float
) -> None:
    """I omega' = -beta omega - T_d: an exponential that ends at I/beta ln(1 + beta omega_0/T_d), or a parabola."""
    inertia = 8.4e-3
    dynamic = 0.03
    speed = 1.0
    lines = ("actuator.torque_constant=1e-18 m^3", f"friction.dynamic_torque={dynamic} N m")
    found = course(thrown(60.0, speed, 0.4, *lines, f"friction.viscous_damping={damping} N m s/rad"))
    end = inertia * speed / dynamic
    if damping > 0.0:
        end = inertia / damping * math.log1p(damping * speed / dynamic)
    time = np.minimum(found["time"], end)
    velocity = speed - dynamic / inertia * time
    path = speed * time - 0.5 * dynamic / inertia * time**2
    if damping > 0.0:
        tail = dynamic / damping
        rate = damping / inertia
        velocity = (speed + tail) * np.exp(-rate * time) - tail
        path = -(speed + tail) * np.expm1(-rate * time) / rate - tail * time
    assert 0.1 < end < 0.35
    np.testing.assert_allclose(found["angular_velocity"], velocity, atol=1e-5 * speed)
    np.testing.assert_allclose(found["angle"] - math.radians(60.0), path, atol=1e-6)


def drift(scenario: Scenario, course: Simulator) -> float:
    """Largest relative departure of P V^k from its start, in either chamber."""
    found = course(scenario)
    worst = 0.0
    for number, volume in enumerate(volumes(found["angle"]), start=1):
        content = found[f"pressure_{number}"] * volume**K
        worst = max(worst, float(np.abs(content / content[0] - 1.0).max()))
    return worst


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8, 1.0])
def test_rebounds_leave_sealed_adiabatic_gas_on_its_isentrope(course: Simulator, restitution: float) -> None:
    """P V^k = const whatever the stop gives back: 1e-4 at the default step."""
    assert drift(thrown(75.0, 60.0, 0.5, *ADIABATIC, f"actuator.restitution={restitution}"), course) < 1e-4


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8, 1.0])
def test_steps_of_one_length_approach_the_isentrope_with_order_two_through_rebounds(restitution: float) -> None:
    """P V^k = const: parts end at the stops alone where any error is allowed, and are otherwise as long as the step."""
    scenario = thrown(75.0, 60.0, 0.5, *ADIABATIC, f"actuator.restitution={restitution}")
    run = dataclasses.replace(plan_run(scenario), tolerance=1e9)

    def departure(parts: int) -> float:
        counts = {name: getattr(run, name) * parts for name in ("step_count", "steps_per_sample", "record_every")}
        finer = dataclasses.replace(run, step=run.step / parts, **counts)
        states = plant_states(finer, run_batch(batch_of(finer)))
        pressure, _ = chamber_pressures_of(finer, states)
        content = pressure * volumes(states[:, 0])[0] ** K
        return float(np.abs(content / content[0] - 1.0).max())

    assert departure(2) / departure(8) > 4.0**1.8


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8, 1.0])
def test_rebounds_give_sealed_gas_no_energy(restitution: float) -> None:
    """Stored energy is the work of the vane on the gas, to 1e-4 of what the vane brought."""
    result = simulate(thrown(75.0, 60.0, 0.5, *ADIABATIC, f"actuator.restitution={restitution}"))
    brought = 0.5 * plan_run(result.scenario).plant.inertia * 60.0**2
    assert abs(result.metrics["energy_imbalance"].value) < 1e-4 * brought
