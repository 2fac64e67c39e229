"""One-sided slopes by differences: known ones, towards a side of a kink, on a short straight piece, of a whole step."""

import math

import numpy as np
import pytest

import ppafo
from ppafo.analyses.linearise.model import one_sided_slopes
from ppafo.engine.lanes import Floats
from ppafo.engine.scheme.pneumatics import GAMMA, flow_rates, gas_flows, linearise
from ppafo.model.orifice import fitted_flow_function, orifice_flow
from ppafo.model.plant import Openings, blended_port_flow, blended_ports, chamber_volumes, pressures_per_mass
from ppafo.parameters.plant import plant_parameters

PLANT = plant_parameters(ppafo.load_device("ppafo2011"))


def test_smooth_functions_have_their_derivatives_and_honest_errors() -> None:
    def several(value: float) -> Floats:
        return np.array([math.sin(value), math.exp(value), math.sqrt(value), value, 3.0])

    exact = np.array([math.cos(0.7), math.exp(0.7), 0.5 / math.sqrt(0.7), 1.0, 0.0])
    for side in (1.0, -1.0):
        slopes, errors = one_sided_slopes(several, 0.7, side, 1.0)
        assert np.abs(slopes - exact).max() < 1.0e-11
        assert (np.abs(slopes - exact) <= 10.0 * errors + 1.0e-15).all()


def test_a_kink_and_a_jump_have_the_slope_of_the_side() -> None:
    def kinked(value: float) -> Floats:
        return np.array([abs(value), 5.0 * value if value > 0.0 else 0.0, 2.0 * value + (1.0 if value == 0.0 else 0.0)])

    assert one_sided_slopes(kinked, 0.0, 1.0, 1.0)[0] == pytest.approx([1.0, 5.0, 2.0], rel=1e-12)
    assert one_sided_slopes(kinked, 0.0, -1.0, 1.0)[0] == pytest.approx([-1.0, 0.0, 2.0], rel=1e-12)


def test_near_equal_pressures_the_slope_is_of_the_straight_line_that_the_flow_is_there() -> None:
    curve = PLANT.valve_curve
    slope = 1e-8 * fitted_flow_function(curve.linear_ratio, curve)[0] / (1.0 - curve.linear_ratio)
    for side in (1.0, -1.0):
        slopes, _ = one_sided_slopes(
            lambda value: np.array([orifice_flow(value, 3e5, 1e-8, 1.0, curve)[0]]), 3e5, side, 1e5
        )
        assert slopes == pytest.approx([slope], rel=1e-8)


@pytest.mark.parametrize("ratios", [(0.9, 0.4), (0.3, 0.7), (0.98, 0.97), (1.1, 0.6)])
def test_the_jacobian_of_a_step_of_the_lanes_is_that_of_its_own_flows(ratios: tuple[float, float]) -> None:
    """The lanes have their Jacobian written by hand; here the flows beside it are differentiated."""
    openings = Openings(source_1=0.6, vent_1=0.1, source_2=0.2, vent_2=0.5)
    per_mass, step = pressures_per_mass(PLANT.gas_product, *chamber_volumes(PLANT, 1.2)), 1e-3
    pressures = [ratio * PLANT.supply_pressure for ratio in ratios]
    ports = blended_ports(PLANT, openings)

    def flows_at(pressure_1: float, pressure_2: float) -> Floats:
        return np.array(flow_rates(gas_flows(PLANT, pressure_1, pressure_2, *ports, blended_port_flow).flows)[:2])

    linear = linearise(*per_mass, gas_flows(PLANT, *pressures, *ports, blended_port_flow), step)
    by_1 = one_sided_slopes(lambda value: flows_at(value, pressures[1]), pressures[0], 1.0, 1e5)[0] * per_mass[0]
    by_2 = one_sided_slopes(lambda value: flows_at(pressures[0], value), pressures[1], 1.0, 1e5)[0] * per_mass[1]
    found = np.eye(2) - GAMMA * step * np.array([by_1, by_2]).T
    assert np.array([[linear.a, linear.b], [linear.c, linear.d]]) == pytest.approx(found, rel=1e-9, abs=1e-12)
