"""CasADi expressions from the text of the model: the values of Python, and derivatives of one side at an edge."""

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.engine.rows import leaf_paths, leaves, numbers, rebuilt
from ppafo.engine.scheme.pneumatics import GAMMA, SlopedFlows, linearise, sloped_flows
from ppafo.engine.scheme.thermal_gas import transport
from ppafo.errors import ProgramError
from ppafo.model import sensors
from ppafo.model.orifice import FlowCurve, fitted_flow_function, isentropic_flow_function, orifice_flow
from ppafo.model.plant import (
    BlendedPort,
    Openings,
    PlantParameters,
    ThermalParameters,
    blended_port_flow_slopes,
    blended_ports,
    gravity_torque,
    pressures_per_mass,
)
from ppafo.model.valves import proportional, solenoid, vent_valve
from ppafo.parameters.plant import plant_parameters
from ppafo.translation.plant_rates import gas_flows
from ppafo.translation.symbolic import symbolic

casadi = pytest.importorskip("casadi", reason="expressions need the extra 'control'")
PLANT = plant_parameters(ppafo.load_device("ppafo2011"))


def flows(pressure_1: float, pressure_2: float, opening: float) -> Any:
    """Flows of a valve that is open towards chamber 1."""
    openings = Openings(source_1=opening, vent_1=0.0, source_2=0.0, vent_2=opening)
    return gas_flows(PLANT, openings, pressure_1, pressure_2)


def many_returns(value: float, other: float) -> float:
    """Branches that return, branches that do not, and a loop."""
    total = 0.0
    for number in range(3):
        total += value * number
    if value > 1.0:
        total = total + other
        if other > 0.5:
            return total * 2.0
    elif value < -1.0:
        total = -other
    if abs(other) < 0.25 or not value <= 0.5:
        return total - 1.0
    return total / (2.0 + min(value, other, 0.0))


def settled_and_moving(
    valve: proportional.MovingProportional, state: proportional.SpoolState, command: float
) -> tuple[float, ...]:
    """Rates of a spool after the changes that it makes at once."""
    return proportional.rates_moving(valve, proportional.settle_moving(valve, state, command, 0.0), command)


CASES: dict[str, tuple[Callable[..., Any], tuple[Any, ...], Callable[[random.Random], tuple[Any, ...]]]] = {
    "returns": (many_returns, (float, float), lambda draw: (draw.uniform(-2.0, 2.0), draw.uniform(-1.0, 1.0))),
    "gravity": (gravity_torque, (float, float), lambda draw: (draw.uniform(0.0, 3.0), 2.0)),
    "orifice": (
        orifice_flow,
        (float, float, float, FlowCurve),
        lambda draw: (draw.uniform(1e5, 5e5), draw.uniform(1e5, 5e5), 1e-8, PLANT.valve_curve),
    ),
    "gas": (
        gas_flows,
        (PlantParameters, Openings, float, float),
        lambda draw: (PLANT, Openings(*(draw.random() for _ in range(4))), *(draw.uniform(1e5, 6e5) for _ in range(2))),
    ),
    "transport": (
        transport,
        (ThermalParameters, float, float, float),
        lambda draw: (ThermalParameters(1.3, 0.1, 298.0), draw.uniform(-1.0, 1.0), draw.random(), draw.random()),
    ),
    "spool step": (
        proportional.spool_step,
        (float, float, float),
        lambda draw: (draw.uniform(10.0, 900.0), draw.uniform(0.3, 1.5), draw.uniform(1e-4, 1e-2)),
    ),
    "spool": (
        settled_and_moving,
        (proportional.MovingProportional, proportional.SpoolState, float),
        lambda draw: (
            proportional.MovingProportional(0.05, draw.choice([20.0, 1e12]), draw.choice([0.0, 20.0]), 0.7),
            proportional.SpoolState(draw.uniform(-1.0, 1.0), draw.uniform(-1.0, 1.0), draw.uniform(-9.0, 9.0)),
            draw.uniform(-1.2, 1.2),
        ),
    ),
    "vent valve": (
        vent_valve.instant_ideal,
        (proportional.IdealProportional, proportional.NoValveState, float),
        lambda draw: (
            proportional.IdealProportional(0.05, 1.0 / 0.95),
            proportional.NoValveState(0.0),
            draw.choice([-1.5, -0.5, 0.02, 0.7, 2.0]),
        ),
    ),
    "coils": (
        solenoid.settle_timed,
        (solenoid.TimedSolenoid, solenoid.PairState, float, float),
        lambda draw: (
            solenoid.TimedSolenoid(0.01, draw.choice([0.0, 0.02]), 0.05),
            rebuilt(solenoid.PairState, map(float, [draw.choice([0.0, 1.0]) for _ in range(8)])),
            draw.choice([-1.0, 0.0, 1.0, 2.0]),
            draw.uniform(0.0, 2.0),
        ),
    ),
}


def flat(value: Any) -> list[Any]:
    """All numbers of a result."""
    return leaves(value) if isinstance(value, tuple) else [value]


@pytest.mark.parametrize("name", CASES)
def test_expressions_have_the_values_of_python(name: str) -> None:
    function, types, drawn = CASES[name]
    draw = random.Random(1)
    given = [value for row in drawn(draw) for value in flat(row)]
    symbols = [casadi.SX.sym(f"x{number}") for number in range(len(given))]
    taken, arguments = iter(symbols), []
    for kind in types:
        own = [next(taken) for _ in leaf_paths(kind, "x")]
        arguments.append(own[0] if kind is float else rebuilt(kind, own))
    written = symbolic(function, *types)(*arguments)
    evaluate = casadi.Function("f", symbols, flat(written))
    for _ in range(300):
        values = drawn(draw)
        expected = numbers(wrapped) if isinstance(wrapped := function(*values), tuple) else [wrapped]
        found = [float(item) for item in evaluate.call([number for row in values for number in flat(row)])]
        assert found == pytest.approx(expected, rel=1e-15, abs=1e-300)


def test_what_is_decided_at_a_point_has_the_derivative_of_that_side_and_no_choice_left() -> None:
    compared = []

    def above(sign: str, left: Any, right: Any, place: str) -> bool:
        compared.append(place)
        at = {"first": 3.0e5, "second": 3.0e5}
        one, other = (
            float(
                casadi.Function("v", casadi.symvar(casadi.SX(item)), [item]).call(
                    [at[symbol.name()] for symbol in casadi.symvar(casadi.SX(item))]
                )[0]
            )
            for item in (casadi.SX(left), casadi.SX(right))
        )
        return {"<": one < other, "<=": one <= other, ">": one > other, ">=": one >= other}[sign]

    first, second = casadi.SX.sym("first"), casadi.SX.sym("second")
    decided = symbolic(orifice_flow, float, float, float, FlowCurve, compare=above)(
        first, second, 1e-8, PLANT.valve_curve
    )
    whole = symbolic(orifice_flow, float, float, float, FlowCurve)(first, second, 1e-8, PLANT.valve_curve)
    # On the straight line the flow is the gap times the slope of the line: at equal pressures its derivative is known.
    curve = PLANT.valve_curve
    slope = 1e-8 * fitted_flow_function(curve.linear_ratio, curve) / (1.0 - curve.linear_ratio)
    for flow in (decided, whole):
        by_both = casadi.Function("d", [first, second], [casadi.jacobian(flow, casadi.vertcat(first, second))])
        assert np.array(by_both(3.0e5, 3.0e5)).ravel() == pytest.approx([slope, -slope], rel=1e-12)
    assert "model.orifice.check_valve_flow: pressure_a >= pressure_b" in compared
    assert "?" not in str(decided)


def test_a_function_may_stand_before_one_of_the_model() -> None:
    seen = []

    def doubled(function: Callable[..., Any], *given: Any) -> Any:
        seen.append(given)
        return 2.0 * function(*given)

    around = {fitted_flow_function: doubled}
    pressure = casadi.SX.sym("p")
    types = (float, float, float, FlowCurve)
    given = (pressure, 2e5, 1e-8, PLANT.valve_curve)
    both = [symbolic(orifice_flow, *types)(*given), symbolic(orifice_flow, *types, around=around)(*given)]
    plain, changed = casadi.Function("f", [pressure], both)(4e5)
    assert float(changed) == 2.0 * float(plain)
    assert len(seen) == 1


@pytest.mark.parametrize("ratios", [(0.9, 0.4), (0.3, 0.7), (0.98, 0.97), (1.1, 0.6)])
def test_the_jacobian_of_a_step_of_the_lanes_is_that_of_its_own_flows(ratios: tuple[float, float]) -> None:
    """The lanes have their Jacobian written by hand; here the flows beside it are differentiated."""
    openings = Openings(source_1=0.6, vent_1=0.1, source_2=0.2, vent_2=0.5)
    first, second = casadi.SX.sym("first"), casadi.SX.sym("second")
    per_mass = pressures_per_mass(PLANT, 1.2)
    masses = [ratio * PLANT.supply_pressure / each for ratio, each in zip(ratios, per_mass, strict=True)]
    pressures = (first * per_mass[0], second * per_mass[1])
    ports, step = blended_ports(PLANT, openings), 1e-3
    types = (PlantParameters, float, float, BlendedPort, BlendedPort, blended_port_flow_slopes)
    flowing = symbolic(sloped_flows, *types)(PLANT, *pressures, *ports, blended_port_flow_slopes)
    linear, flows = symbolic(linearise, float, float, SlopedFlows, float)(*per_mass, flowing, step)
    into = casadi.vertcat(flows.mass_1, flows.mass_2)
    found = casadi.jacobian(into, casadi.vertcat(first, second))
    matrix = casadi.vertcat(casadi.horzcat(linear.a, linear.b), casadi.horzcat(linear.c, linear.d))
    evaluate = casadi.Function("f", [first, second], [found, matrix])
    exact, written = (np.array(item) for item in evaluate(*masses))
    assert np.eye(2) - GAMMA * step * exact == pytest.approx(written, rel=1e-12, abs=1e-15)


def test_what_is_outside_the_subset_is_refused_with_file_and_line() -> None:
    with pytest.raises(ProgramError, match=r"orifice\.py:\d+: .*library function"):
        symbolic(isentropic_flow_function, float, float)


def test_what_has_no_expression_is_refused_by_name() -> None:
    value = casadi.SX.sym("value")
    with pytest.raises(ProgramError, match=r"model\.sensors\.quantise: the whole part of a number, which has no expr"):
        symbolic(sensors.quantise, float, float)(value, 0.5)


def test_known_numbers_stay_numbers() -> None:
    found = symbolic(orifice_flow, float, float, float, FlowCurve)(4e5, 2e5, 1e-8, PLANT.valve_curve)
    assert found == orifice_flow(4e5, 2e5, 1e-8, PLANT.valve_curve)
    assert isinstance(found, float)
    assert math.isnan(symbolic(math_root, float)(-1.0))


def math_root(value: float) -> float:
    """A root, which may be none."""
    return math.sqrt(value) / 1.0
