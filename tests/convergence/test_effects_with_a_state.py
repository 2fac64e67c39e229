"""An effect whose state acts back on the gas keeps the order of the step; its error bounds steps, and it can fail."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, NamedTuple

import pytest

from ppafo.model.catalog import EFFECTS
from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from tests.reference.reference_solver import compare_with_reference, solve_reference

ICE = ("effects.ice.blockage_per_gas=3e4 1/kg", "effects.ice.melting_time=30 ms")
VENTING = (
    *("controller.kind=constant", "controller.command=-0.5", "controller.rate=125 Hz", "initial.pressure_1=40 psi_g"),
    *("actuator.displacement_per_radian=51 cm^3/rad", "actuator.dead_volume_1=2 cm^3", "actuator.dead_volume_2=2 cm^3"),
    *("motion.angle=130 deg", "run.duration=0.2 s", "run.output_interval=4 ms"),
)


def test_a_state_that_acts_on_the_gas_leaves_the_step_its_second_order() -> None:
    reference, errors = None, []
    for step in ("2 ms", "0.25 ms"):
        run = plan_run(load_scenario("torque-task-proportional", (*VENTING, *ICE, f"run.step={step}")))
        whole = replace(run, needs_parts=False)
        reference = reference or solve_reference(whole)
        errors.append(compare_with_reference(whole, reference).pressure_1_rms)
    assert errors[0] / errors[1] > 0.8 * 8**2


def test_the_error_of_a_state_shortens_steps() -> None:
    run = plan_run(
        load_scenario("step-response", ("effects.ice.blockage_per_gas=1e6 1/kg", "effects.ice.melting_time=3 ms"))
    )
    *others, ice = run.program.effects
    assert ice.state is not None
    reference, errors = solve_reference(run), []
    for tolerances in ((), (1e-6,)):
        effect = replace(ice, state=replace(ice.state, tolerances=tolerances))
        own = replace(run, program=replace(run.program, effects=(*others, effect)))
        errors.append(compare_with_reference(own, reference).worst_pressure)
    assert errors[1] < 0.5 * errors[0]


class Runaway(NamedTuple):
    """A rate [1/s]."""

    rate: Annotated[float, Number("1/s", "rate", 0.0, 0.0, 1e6)]


class Amount(NamedTuple):
    """What grows [-]."""

    amount: float


def started(_runaway: Runaway, _now: PlantSnapshot) -> Amount:
    """One."""
    return Amount(1.0)


def advanced(
    runaway: Runaway, runaway_state: Amount, _before: PlantSnapshot, _after: PlantSnapshot, step: float
) -> Amount:
    """More than any float in a few steps."""
    grown = runaway_state.amount * (1.0 + step * runaway.rate)
    return Amount(grown * grown * grown)


def grows(runaway: Runaway, runaway_state: Amount, _now: PlantSnapshot) -> Amount:
    """Its rate [1/s]."""
    return Amount(runaway.rate * runaway_state.amount)


@pytest.fixture
def _runaway() -> Iterator[None]:
    EFFECTS["runaway"] = Effect(
        name="runaway",
        summary="A state that leaves what is possible.",
        settings=Runaway,
        parameters=Runaway,
        prepare=None,
        switch=("rate",),
        laws={},
        state=State(row=Amount, start=started, advance=advanced, slopes=grows),
    )
    yield
    del EFFECTS["runaway"]


@pytest.mark.usefixtures("_runaway")
def test_a_state_that_leaves_what_is_possible_ends_the_run_with_a_status() -> None:
    result = simulate(load_scenario("step-response", ["effects.runaway.rate=1e5 1/s"]))
    assert not result.status.is_completed
    assert "diverged" in str(result.status)
