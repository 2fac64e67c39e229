"""The best that any control could do: below every controller, and confirmed by the engine."""

import dataclasses
import itertools
import sys

import numpy as np
import pytest

import ppafo
from ppafo.errors import SimulationError
from ppafo.model.orifice import FlowCurve, orifice_flow
from ppafo.model.plant import BlendedPort, Openings, blended_port_flow, blended_ports
from ppafo.parameters.plant import plant_parameters
from ppafo.questions.league.bound import (
    SMOOTH,
    WAYS,
    BoundSolver,
    LowerBound,
    Optimum,
    at_once,
    lower_bound,
    mean_openings,
    play_optimum,
    valve_command,
)
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.translation.symbolic import symbolic

pytestmark = pytest.mark.thorough

casadi = pytest.importorskip("casadi", reason="the lower bound needs the extra 'optimal'")
SHORT = ("run.duration=1 s", "reference.ramp_time=0.4 s")


def short_task(*overrides: str) -> Scenario:
    """A short torque task within reach of the supply."""
    return ppafo.load_scenario("torque-task-proportional", [*SHORT, "reference.level=4 N m", *overrides])


@pytest.fixture(scope="module")
def bound() -> LowerBound:
    """The bound of the short task, within reach."""
    return lower_bound(short_task(), (0.2,))


@pytest.fixture(scope="module")
def unreachable() -> LowerBound:
    """The bound of the short task above what the supply can hold."""
    return lower_bound(short_task("reference.level=6 N m"))


def test_the_flow_is_that_of_the_engine_but_for_the_bend_near_equal_pressures() -> None:
    plant = plant_parameters(ppafo.load_device("ppafo2011"))
    flow = symbolic(orifice_flow, float, float, float, FlowCurve, around=SMOOTH)
    first, second = casadi.SX.sym("first"), casadi.SX.sym("second")
    smooth = casadi.Function("flow", [first, second], [flow(first, second, 1e-8, plant.valve_curve)])
    for ratio in (0.2, 0.5, 0.6, 0.9, 0.99, 0.995, 0.9995):
        for pair in ((4e5, 4e5 * ratio), (4e5 * ratio, 4e5)):
            exact = orifice_flow(*pair, 1e-8, plant.valve_curve)
            assert float(smooth(*pair)) == pytest.approx(exact, rel=0.002 if ratio <= 0.995 else 0.5)
    assert float(smooth(4e5, 4e5)) == 0.0


@pytest.mark.parametrize("relieving", [False, True])
def test_the_supply_is_that_of_the_engine_also_above_its_pressure(relieving: bool) -> None:
    device = ppafo.load_device("ppafo2011", overrides=[f"supply.relieving={str(relieving).lower()}"])
    plant, pressure = plant_parameters(device), casadi.SX.sym("p")
    port = blended_ports(plant, Openings(source_1=1.0, vent_1=0.0, source_2=0.0, vent_2=1.0))[0]
    flow = symbolic(blended_port_flow, float, BlendedPort, FlowCurve, around=SMOOTH)
    fed = casadi.Function("fed", [pressure], [flow(pressure, port, plant.valve_curve).from_source])
    choked = plant.valve_conductance * plant.supply_pressure
    for ratio in (0.3, 0.7, 0.99, 1.0, 1.01, 1.2, 2.0):
        exact = blended_port_flow(ratio * plant.supply_pressure, port, plant.valve_curve).from_source
        assert float(fed(ratio * plant.supply_pressure)) == pytest.approx(exact, rel=0.002, abs=6e-4 * choked)
    assert (float(fed(2.0 * plant.supply_pressure)) < 0.0) == relieving


@pytest.mark.parametrize(("valve", "feeds", "vents"), [("proportional", 0.0, 0.0), ("solenoid", 1.0, 1.0)])
def test_a_valve_has_the_mean_of_its_ways_and_rests_for_what_is_left(valve: str, feeds: float, vents: float) -> None:
    run = plan_run(at_once(short_task(f"device.valve={valve}")))
    found = mean_openings(run, WAYS, (0.3, 0.2))
    assert found == pytest.approx((0.3, 0.2 + 0.5 * feeds, 0.2, 0.3 + 0.5 * vents))


def test_the_curve_falls_from_the_least_error_on(bound: LowerBound, unreachable: LowerBound) -> None:
    for item in (bound, unreachable):
        optima = (item.least_error, *item.curve)
        assert all(first.rms_error < second.rms_error for first, second in itertools.pairwise(optima))
        assert all(first.gas > second.gas for first, second in itertools.pairwise(optima))
        assert item.moved < 0.01


def test_what_the_supply_cannot_hold_is_an_error_that_nobody_avoids(bound: LowerBound, unreachable: LowerBound) -> None:
    assert bound.is_attainable
    assert not unreachable.is_attainable
    supply = ppafo.load_device("ppafo2011").supply
    held = 1.451e-5 * (supply.pressure - supply.atmospheric_pressure)
    hold_only = np.sqrt((6.0 - held) ** 2 * 0.6)
    assert unreachable.least_error.rms_error > 0.99 * hold_only


def test_the_engine_confirms_error_and_gas_of_the_optimal_commands(bound: LowerBound, unreachable: LowerBound) -> None:
    for item, level in ((bound, 4), (unreachable, 6)):
        for optimum in (item.least_error, *item.curve):
            run = play_optimum(short_task(f"reference.level={level} N m"), optimum)
            assert run.rms_error == pytest.approx(optimum.rms_error, rel=0.005, abs=1e-4)
            assert run.gas == pytest.approx(optimum.gas, rel=0.005)
            assert optimum.overlap < 1e-3


def test_a_record_with_fewer_samples_than_steps_gives_the_same_error(bound: LowerBound) -> None:
    optimum = bound.least_error
    run = play_optimum(short_task("reference.level=4 N m", "run.step=0.5 ms", "run.output_interval=2 ms"), optimum)
    assert run.rms_error == pytest.approx(optimum.rms_error, rel=0.02, abs=1e-4)


@pytest.mark.parametrize("level", [4, 6])
@pytest.mark.parametrize(
    "kind", ["pid", "pid_feedforward", "sliding_mode", "damped_proportional", "feedback_linearisation"]
)
def test_no_controller_is_better(kind: str, level: int, bound: LowerBound, unreachable: LowerBound) -> None:
    item = bound if level == 4 else unreachable
    task = short_task(f"reference.level={level} N m", f"controller.kind={kind}")
    metrics = ppafo.simulate(task).metrics
    error = metrics["rms_error"].value
    assert item.is_attainable or error > 0.9999 * item.least_error.rms_error
    assert metrics["gas_supplied"].value > 0.999 * item.gas_at(error)


def test_a_point_of_the_curve_is_where_it_was_asked_for(bound: LowerBound) -> None:
    point = next(optimum for optimum in bound.curve if optimum.rms_error == pytest.approx(0.2, rel=1e-4))
    assert bound.gas_at(0.2) == pytest.approx(point.gas, rel=1e-3)
    assert bound.gas_at(0.0) == bound.least_error.gas


def test_a_led_ankle_has_a_bound_too() -> None:
    task = ppafo.load_scenario("torque-task-moving-ankle", ["run.duration=1 s", "reference.ramp_start=0 s"])
    optimum = BoundSolver(task, 100).least_gas(0.1)
    run = play_optimum(task, optimum)
    assert run.rms_error == pytest.approx(0.1, rel=0.03)
    assert run.gas == pytest.approx(optimum.gas, rel=0.02)


def test_a_command_both_ways_at_once_becomes_one_way_and_then_the_other_with_the_same_means() -> None:
    openings = np.array([0.3, 0.2, 0.0]), np.array([0.0, 0.3, 0.4])
    optimum = Optimum(0.0, 0.0, np.array([0.0, 0.01, 0.02]), *openings)
    command = valve_command(optimum, 0.001, 30)
    assert command[:10] == pytest.approx(0.3)
    assert command[10:20] == pytest.approx([0.5] * 4 + [-0.5] * 6)
    assert command[20:] == pytest.approx(-0.4)


def test_a_step_over_the_end_of_an_interval_has_the_mean_of_both() -> None:
    optimum = Optimum(0.0, 0.0, np.array([0.0, 0.015]), np.array([0.2, 0.0]), np.array([0.0, 0.6]))
    assert valve_command(optimum, 0.01, 3) == pytest.approx([0.2, -0.2, -0.6])


def test_the_solenoid_pair_needs_more_gas_even_if_it_switches_infinitely_fast(bound: LowerBound) -> None:
    solver = BoundSolver(short_task("device.valve=solenoid"), 75)
    assert solver.least_gas(0.2).gas > 1.5 * bound.gas_at(0.2)


def test_a_free_ankle_and_warm_gas_are_refused() -> None:
    with pytest.raises(SimulationError, match="needs a fixed or prescribed ankle, not a free one"):
        lower_bound(ppafo.load_scenario("torque-task-proportional", ["motion.kind=free"]))
    warm = ["gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"]
    with pytest.raises(SimulationError, match="isothermal gas"):
        lower_bound(ppafo.load_scenario("torque-task-proportional", [*warm, "gas_model.wall_area_per_volume=300 1/m"]))


def test_a_reference_that_asks_for_nothing_is_refused() -> None:
    with pytest.raises(SimulationError, match="0 N m throughout"):
        lower_bound(ppafo.load_scenario("torque-task-proportional", ["reference.level=0 N m"]))


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    # The package exports a function of the module's name, so the module itself is found by its full name.
    monkeypatch.setattr(sys.modules["ppafo.questions.league.bound"], "find_spec", lambda _: None)
    with pytest.raises(SimulationError, match=r"pip install ppafo\[optimal\]"):
        lower_bound(short_task())


def test_an_optimum_is_a_value(bound: LowerBound) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        bound.least_error.gas = 0.0  # type: ignore[misc]
