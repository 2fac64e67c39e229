"""What a model-based controller believes: the device of its defaults, and the inverse of its own model."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import ppafo
from ppafo.control.chamber_model import (
    NOMINAL_QUANTITIES,
    NominalChambers,
    TorqueRates,
    ellipse_flow,
    opening_for_rate,
    torque_rates,
)
from ppafo.model.orifice import iso6358_flow_function
from ppafo.parameters.plant import plant_parameters

NOMINAL = NominalChambers(*(item.default for item in NOMINAL_QUANTITIES))
PRESSURES = st.floats(1.02e5, 4.4e5)
"""Between the atmosphere and the supply."""


def test_the_defaults_are_those_of_the_completed_set() -> None:
    plant = plant_parameters(ppafo.load_device("ppafo2011"))
    believed = NOMINAL._asdict()
    assert believed.pop("critical_ratio") == pytest.approx(plant.valve_curve.critical_ratio)
    assert believed == pytest.approx({name: getattr(plant, name) for name in believed})


@given(PRESSURES, PRESSURES)
def test_flow_is_the_ellipse_of_the_standard_and_changes_sign_with_the_sides(first: float, second: float) -> None:
    upstream, downstream = max(first, second), min(first, second)
    expected = 1.0e-8 * upstream * iso6358_flow_function(downstream / upstream, 0.5)
    assert abs(ellipse_flow(first, second, 1.0e-8, 0.5)) == pytest.approx(expected, abs=1e-12)
    assert ellipse_flow(first, second, 1.0e-8, 0.5) == -ellipse_flow(second, first, 1.0e-8, 0.5) or first == second


@given(PRESSURES, PRESSURES, st.floats(0.4, 2.2), st.floats(-3.0, 3.0), st.floats(-200.0, 200.0))
def test_the_opening_gives_the_rate_that_was_wanted_where_the_valve_can(
    first: float, second: float, angle: float, velocity: float, wanted: float
) -> None:
    rates = torque_rates(NOMINAL, angle, velocity, first, second)
    opening = opening_for_rate(rates, wanted)
    gain = rates.rising if opening >= 0.0 else rates.falling
    if abs(opening) < 1.0:
        assert rates.closed + gain * opening == pytest.approx(wanted, abs=1e-6)
    else:
        assert (wanted - rates.closed - gain * opening) * opening > -1e-6


def test_a_valve_that_changes_nothing_is_opened_fully_and_not_divided_by_zero() -> None:
    assert opening_for_rate(TorqueRates(0.0, 0.0, 0.0), 1.0) == 1.0
    assert opening_for_rate(TorqueRates(0.0, 0.0, 0.0), -1.0) == -1.0


@pytest.mark.parametrize("command", [0.3, -0.3])
def test_the_believed_rate_is_that_of_the_engine(command: float) -> None:
    task = ["controller.kind=constant", f"controller.command={command}", "run.duration=0.02 s"]
    task += ["initial.pressure_1=20 psi_g", "initial.pressure_2=10 psi_g"]
    run = ppafo.simulate("torque-task-proportional", task).recording
    rates = torque_rates(NOMINAL, float(run["angle"][5]), 0.0, float(run["pressure_1"][5]), float(run["pressure_2"][5]))
    believed = rates.closed + command * (rates.rising if command > 0.0 else rates.falling)
    measured = (run["torque"][6] - run["torque"][4]) / (run.time[6] - run.time[4])
    assert believed == pytest.approx(measured, rel=0.02)
    assert believed * command > 0.0


def test_a_vane_that_turns_changes_the_torque_of_closed_chambers_against_the_motion() -> None:
    turning = torque_rates(NOMINAL, 1.3, 1.0, 2.0e5, 2.0e5)
    volume_1, volume_2 = 2.0e-6 + 5.1e-5 * (1.3 - 0.34906585), 2.0e-6 + 5.1e-5 * (2.26892803 - 1.3)
    expected = -1.451e-5 * 5.1e-5 * 2.0e5 * (1.0 / volume_1 + 1.0 / volume_2)
    assert turning.closed == pytest.approx(expected, rel=1e-6)
