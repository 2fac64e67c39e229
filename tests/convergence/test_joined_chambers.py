"""Chambers that a valve joins with each other: closed form, an independent integration, CVODE, and balances."""

import dataclasses
import itertools
import math
from typing import NamedTuple

import numpy as np
import pytest

from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.engine.scheme.motion import with_gas
from ppafo.engine.scheme.pneumatics import (
    begin_still_gas,
    held_chambers,
    held_pressures,
    plant_with_joined_chambers,
    second_still_stage,
    sloped_flows,
    stage_flows,
    still_change,
)
from ppafo.model.orifice import ExactOrifice
from ppafo.model.plant import (
    Openings,
    ThermalParameters,
    chamber_pressures,
    chamber_volumes,
    single_port_flow,
    single_port_flow_slopes,
)
from ppafo.model.valves import solenoid_recycling
from ppafo.parameters import load_device
from ppafo.parameters.plant import plant_parameters, valve_settings
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run, state_with_volumes
from ppafo.simulation.scenario import ProfileChoice
from tests.reference.reference_slopes import joined_thermal_rates, thermal_gas_rates
from tests.reference.reference_solver import compare_with_reference

K, PRODUCT, ROOM, SOURCE = 1.3, 8.314 * 298.0 / 0.044, 101_325.0, 101_325.0 + 50.0 * 6_894.757
CHOKED = math.sqrt(K / PRODUCT * (2.0 / (K + 1.0)) ** ((K + 1.0) / (K - 1.0)))
CONDUCTANCE = 0.113 * 12.6e-6 * CHOKED
LEAK = 0.3 / 12.6
VOLUME_1 = 36.0e-6 + 14.51e-6 * math.radians(55.0)
VOLUME_2 = 36.0e-6 + 14.51e-6 * math.radians(55.0)
PUSHED, JOINED = 0.15, 0.25
"""End of push-off and length of the joint [s] in the scripted runs."""


STEP = 1.0e-4


class Course(NamedTuple):
    """Both pressures [Pa], gas in both chambers and the totals drawn and across [kg], at ``time`` [s]."""

    time: np.ndarray
    pressure_1: np.ndarray
    pressure_2: np.ndarray
    mass_1: np.ndarray
    mass_2: np.ndarray
    supplied: np.ndarray


def stepped(*overrides: str) -> Course:
    """Push-off and then lifting with a vane held at 75 deg, by the functions of the lanes in plain Python."""
    device = load_device(
        "ppafo2011", valve="solenoid_recycling", overrides=(f"valve.joining_time={JOINED} s", *overrides)
    )
    plant = plant_parameters(device)
    valve, coils = solenoid_recycling.prepare(valve_settings(device.valve)), solenoid_recycling.RecyclingState()
    angle = math.radians(75.0)
    state = state_with_volumes(plant, angle, 0.0, *chamber_volumes(plant, angle), ROOM, ROOM)
    held = held_chambers(plant, state.angle, parts=VANE_FUNCTIONS)
    rows = []
    for number in range(round(0.6 / STEP) + 1):
        time = number * STEP
        rows.append((time, *chamber_pressures(plant, state.angle, *state[2:4]), *state[2:5]))
        command = 1.0 if time < PUSHED - 1e-9 else -1.0
        shown, coils = solenoid_recycling.advance(valve, coils, command, time, STEP)
        ports = solenoid_recycling.connect(plant, shown)
        joined = plant_with_joined_chambers(plant, solenoid_recycling.joined_opening(shown))
        flowing = sloped_flows(joined, *held_pressures(plant, held, state), *ports, single_port_flow_slopes)
        begun = begin_still_gas(plant, state, held, flowing, STEP, parts=VANE_FUNCTIONS)
        passing = stage_flows(joined, begun.end_1, begun.end_2, *ports, single_port_flow)
        second = second_still_stage(begun, passing)
        state = with_gas(state, still_change(joined, begun, second, STEP))
    return Course(*np.array(rows).T)


def flow(up: float, down: float) -> float:
    """Equations (6) and (7), linear above a ratio of 0.999, from the first side to the second."""
    if up < down:
        return -flow(down, up)
    ratio = down / up
    inside = min(ratio, 0.999)
    critical = (2.0 / (K + 1.0)) ** (K / (K - 1.0))
    value = 1.0
    if inside > critical:
        value = inside ** (1.0 / K) * math.sqrt(1.0 - inside ** ((K - 1.0) / K))
        value /= (2.0 / (K + 1.0)) ** (1.0 / (K - 1.0)) * math.sqrt((K - 1.0) / (K + 1.0))
    return CONDUCTANCE * up * value * min((1.0 - ratio) / 1e-3, 1.0)


def independent(times: np.ndarray) -> np.ndarray:
    """Both pressures [Pa], integrated by SciPy from phase to phase: filling, joint, lifting."""

    from scipy.integrate import solve_ivp

    def slopes(time: float, pressures: np.ndarray) -> list[float]:
        first, second = pressures
        across = LEAK * flow(first, second)
        into_1, into_2 = flow(SOURCE, first), -flow(second, ROOM)
        if PUSHED <= time < PUSHED + JOINED:
            into_1 = into_2 = 0.0
            across += flow(first, second)
        elif time >= PUSHED + JOINED:
            into_1, into_2 = -flow(first, ROOM), max(flow(SOURCE, second), 0.0)
        return [(into_1 - across) * PRODUCT / VOLUME_1, (into_2 + across) * PRODUCT / VOLUME_2]

    state, found = np.array([ROOM, ROOM]), []
    edges = [0.0, PUSHED, PUSHED + JOINED, times[-1] + 1e-6]
    for begin, end in itertools.pairwise(edges):
        wanted = times[(times >= begin - 1e-12) & (times < end - 1e-12)]
        solved = solve_ivp(
            lambda time, y, low=begin, high=end: slopes(min(max(time, low), high - 1e-9), y),
            (begin, end),
            state,
            method="LSODA",
            rtol=1e-9,
            atol=1e-3,
            t_eval=np.append(wanted, end),
        )
        found.append(solved.y[:, :-1])
        state = solved.y[:, -1]
    return np.concatenate(found, axis=1)


def test_joined_chambers_follow_an_independent_integration() -> None:
    course = stepped()
    times = course.time[::50]
    expected = independent(times)
    limit = 1e-3 * (SOURCE - ROOM)
    np.testing.assert_allclose(course.pressure_1[::50], expected[0], rtol=0.0, atol=limit)
    np.testing.assert_allclose(course.pressure_2[::50], expected[1], rtol=0.0, atol=limit)


def test_isothermal_chambers_meet_where_both_share_their_gas_and_lose_none() -> None:
    course = stepped("actuator.leak.area=1e-9 mm^2", "actuator.dead_volume_1=64 cm^3")
    volume_1 = VOLUME_1 + 28e-6
    begin, end = (int(np.searchsorted(course.time, moment - 1e-9)) for moment in (PUSHED, PUSHED + JOINED))
    shared = course.pressure_1[begin] * volume_1 + course.pressure_2[begin] * VOLUME_2
    shared /= volume_1 + VOLUME_2
    assert shared > 2.0 * ROOM
    assert course.pressure_1[end] == pytest.approx(shared, rel=1e-6)
    assert course.pressure_2[end] == pytest.approx(shared, rel=1e-6)
    inside = course.mass_1 + course.mass_2
    np.testing.assert_allclose(inside[begin : end + 1], inside[begin], rtol=1e-13)
    np.testing.assert_array_equal(np.diff(course.supplied[begin : end + 1]), 0.0)
    assert course.supplied[-1] > course.supplied[end], "the source tops chamber 2 up"


def test_gas_that_a_joint_carries_is_that_of_a_leak_of_its_size() -> None:
    """What the reference solver adds for a joint, with an energy balance, against its own leak."""
    plant = plant_parameters(load_device("ppafo2011", valve="solenoid_recycling"))
    thermal = ThermalParameters(heat_capacity_ratio=K, wall_exchange=0.0, temperature=298.0)
    shut = ExactOrifice(conductance=0.0, is_iso6358=0.0, number=K, linear_ratio=0.999)
    wide = shut._replace(conductance=plant.valve_conductance)
    closed = Openings(source_1=0.0, vent_1=0.0, source_2=0.0, vent_2=0.0)
    contents, masses = (3.0e-4, 1.0e-4), (2.5e-4, 1.1e-4)
    given = (closed, contents, masses, math.radians(75.0), 0.0)
    leaking = thermal_gas_rates(plant, thermal, wide, wide, *given, parts=VANE_FUNCTIONS)
    tight = thermal_gas_rates(plant, thermal, wide, shut, *given, parts=VANE_FUNCTIONS)
    pressures = chamber_pressures(plant, math.radians(75.0), *contents)
    warmths = (contents[0] / masses[0], contents[1] / masses[1])
    assert joined_thermal_rates(tight, thermal, wide, 1.0, *pressures, *warmths) == pytest.approx(leaking, rel=1e-12)
    assert leaking.leaked > 0.0


def test_a_free_vane_with_joined_chambers_agrees_with_the_reference_solver() -> None:
    scenario = load_scenario("torque-task-solenoid", ("run.duration=0.9 s",))
    device = load_device(
        "ppafo2011", valve="solenoid_recycling", overrides=("valve.joining_time=60 ms", "valve.holding_time=50 ms")
    )
    wish = ProfileChoice("sine", {"level": 0.0, "amplitude": 4.0, "frequency": 2.0, "phase": 0.0})
    free = load_scenario("step-response").motion
    scenario = dataclasses.replace(scenario, device=device, reference=wish, motion=free)
    agreement = compare_with_reference(plan_run(scenario))
    assert agreement.angle <= 2e-4, agreement
    assert agreement.worst_pressure <= 1e-3, agreement
