"""Chambers pushed above the pressure of their supply: against the reference solver, with both kinds of supply."""

import dataclasses

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import Run, batch_of
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import GasModel, PrescribedMotion, ProfileChoice, Scenario
from tests.reference.reference_solver import measure_agreement, plant_states, solve_reference

LARGEST_ANGLE = 2.0e-4
LARGEST_PRESSURE = 1.0e-3
LARGEST_RMS = 1.0e-4
PUMPED = 1.0e-4
"""Gas [kg] that a swinging vane pushes back into a relieving supply at least."""
SWING = {"level": 1.3, "amplitude": 0.6, "frequency": 2.0, "phase": 0.0}
SPOOL = ("valve.spool_frequency=60 Hz",)
# A vane that displaces much for its dead volumes squeezes them far above the supply.
SQUEEZED = (
    "actuator.displacement_per_radian=23.5 cm^3/rad",
    "actuator.dead_volume_1=26.5 cm^3",
    "actuator.dead_volume_2=26.5 cm^3",
)


def supplied_gas(run: Run) -> np.ndarray:
    """Gas [kg] drawn from the supply at every record, of a run that agrees with the reference solver in everything."""
    outcome = run_batch(batch_of(run))
    reference = solve_reference(run)
    agreement = measure_agreement(run, outcome, reference)
    assert agreement.angle <= LARGEST_ANGLE, agreement
    assert agreement.worst_pressure <= LARGEST_PRESSURE, agreement
    assert agreement.worst_rms <= LARGEST_RMS, agreement
    supplied = plant_states(run, outcome)[:, 4]
    # As the pressures, in shares of the range: the first gas that a resting chamber gives back is next to nothing.
    drawn = float(np.abs(reference.states[:, 4]).max())
    np.testing.assert_allclose(supplied, reference.states[:, 4], rtol=0.0, atol=max(1.0e-3 * drawn, 1.0e-8))
    return supplied


def swung(name: str, is_relieving: bool, command: float, overrides: tuple[str, ...] = ()) -> Scenario:
    """A vane swung against an open valve: the chamber that is fed is squeezed above its supply twice a second."""
    scenario = load_scenario(name, (f"supply.relieving={str(is_relieving).lower()}", *SQUEEZED, *overrides))
    open_loop = dataclasses.replace(scenario.controller, kind="constant", settings={"command": command})
    return dataclasses.replace(
        scenario,
        motion=PrescribedMotion(ProfileChoice("sine", SWING)),
        controller=open_loop,
        run=dataclasses.replace(scenario.run, duration=1.0),
    )


@pytest.mark.parametrize("walls", [None, 100.0], ids=["isothermal", "thermal"])
@pytest.mark.parametrize(
    ("name", "command", "overrides"),
    [
        ("torque-task-proportional", 1.0, ()),
        ("torque-task-proportional", -0.3, SPOOL),
        ("torque-task-solenoid", 1.0, ()),
    ],
    ids=["proportional", "moving spool", "solenoid"],
)
def test_a_squeezed_chamber_gives_gas_back_to_a_relieving_supply_only(
    name: str, command: float, overrides: tuple[str, ...], walls: float | None
) -> None:
    drawn = []
    for is_relieving in (False, True):
        scenario = swung(name, is_relieving, command, overrides)
        thermal = None if walls is None else GasModel(walls, 300.0)
        drawn.append(supplied_gas(plan_run(dataclasses.replace(scenario, gas_model=thermal))))
    one_way, relieved = (np.diff(gas) for gas in drawn)
    assert one_way.min() >= 0.0
    assert -np.minimum(relieved, 0.0).sum() > PUMPED
    assert drawn[0][-1] > drawn[1][-1] + 0.5 * PUMPED


@pytest.mark.parametrize("is_relieving", [False, True])
def test_a_vane_that_is_pushed_back_is_held_by_the_gas_that_cannot_leave(is_relieving: bool) -> None:
    pushed = ("motion.kind=free", "motion.external_torque=12 N m", "motion.angle=100 deg")
    filled = ("initial.pressure_1=supply", "initial.pressure_2=atmosphere")
    overrides = (*pushed, *filled, *SQUEEZED, f"supply.relieving={str(is_relieving).lower()}")
    run = plan_run(load_scenario("step-response", overrides))
    gas = supplied_gas(run)
    angle = plant_states(run, run_batch(batch_of(run)))[-1, 0]
    assert (gas.min() < -PUMPED) == is_relieving
    assert (angle == run.plant.angle_min) == is_relieving
