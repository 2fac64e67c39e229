"""What is timed: the paper's torque task with the proportional valve, once or as thousands of different runs."""

from dataclasses import replace

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.rows import leaf_paths
from ppafo.engine.run import Run, batch_of
from ppafo.model.plant import chamber_1_volume, chamber_2_volume, chamber_mass
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario

SCENARIO = "torque-task-proportional"
SEED = 20110301
PSI = 6894.757293168361

SPREAD: dict[str, tuple[float, float]] = {
    "plant.valve_conductance": (0.5, 1.3),
    "controller.gains.proportional_gain": (0.5, 2.0),
    "controller.gains.integral_gain": (0.5, 2.0),
    "controller.gains.derivative_gain": (0.5, 1.2),
    "reference.level": (0.5, 1.2),
}
"""Smallest and largest factor on the scenario. With larger gains some runs chatter, and chaos would hide an error."""

DEAD_VOLUME = (4.0e-6, 16.0e-6)
SUPPLY = (STANDARD_ATMOSPHERE + 40.0 * PSI, STANDARD_ATMOSPHERE + 70.0 * PSI)


def torque_task(duration: float) -> Run:
    """The torque task over ``duration`` [s], recorded at every sample."""
    return plan_run(torque_task_scenario(duration))


def torque_task_scenario(duration: float) -> Scenario:
    """The scenario of that."""
    return load_scenario(SCENARIO, (f"run.duration={duration!r} s",))


def named_rows(groups: dict[str, type], values: Floats) -> dict[str, Floats]:
    """Rows of a batch by their paths, such as ``plant.valve_conductance``; views, so that they can be written to."""
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return dict(zip(paths, values, strict=True))


def ensemble(runs: int, duration: float) -> Batch:
    """``runs`` torque tasks that differ in area, dead volume, supply, gains and reference level; no records."""
    single = batch_of(replace(torque_task(duration), record_every=0))
    parameters = np.repeat(single.parameters, runs, axis=1)
    states = np.repeat(single.states, runs, axis=1)
    batch = Batch(single.program, single.clock, parameters, states)
    _vary(named_rows(batch.program.parameter_rows(), parameters), runs)
    _fill_with_atmosphere(batch)
    return batch


def _vary(rows: dict[str, Floats], runs: int) -> None:
    draw = np.random.default_rng(SEED)
    for path, (smallest, largest) in SPREAD.items():
        rows[path] *= draw.uniform(smallest, largest, runs)
    rows["plant.dead_volume_1"][:] = draw.uniform(*DEAD_VOLUME, runs)
    rows["plant.dead_volume_2"][:] = draw.uniform(*DEAD_VOLUME, runs)
    rows["plant.supply_pressure"][:] = draw.uniform(*SUPPLY, runs)
    rows["plant.dorsiflexion_pressure"][:] = rows["plant.supply_pressure"]


def _fill_with_atmosphere(batch: Batch) -> None:
    rows = named_rows(batch.program.parameter_rows(), batch.parameters)
    states = named_rows(batch.program.state_rows(), batch.states)
    volumes = volumes_of(batch)
    for name, volume in zip(("mass_1", "mass_2"), volumes, strict=True):
        pairs = zip(rows["plant.atmospheric_pressure"], volume, rows["plant.gas_product"], strict=True)
        states[f"state.{name}"][:] = [chamber_mass(*pair) for pair in pairs]


def volumes_of(batch: Batch) -> tuple[Floats, Floats]:
    """Volumes of both chambers [m^3] of every run at the angle at which its vane is held."""
    rows = named_rows(batch.program.parameter_rows(), batch.parameters)
    angle = named_rows(batch.program.state_rows(), batch.states)["state.angle"]
    first = zip(
        angle, rows["plant.angle_min"], rows["plant.displacement_per_radian"], rows["plant.dead_volume_1"], strict=True
    )
    second = zip(
        angle, rows["plant.angle_max"], rows["plant.displacement_per_radian"], rows["plant.dead_volume_2"], strict=True
    )
    return (
        np.array([chamber_1_volume(*values) for values in first]),
        np.array([chamber_2_volume(*values) for values in second]),
    )
