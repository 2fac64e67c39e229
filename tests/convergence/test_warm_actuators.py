"""Gas with an energy balance in chambers that are no vane's: closed forms, an independent run, the reference solver."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import batch_of
from ppafo.engine.scheme.actuators import filled_chambers
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PrescribedMotion, ProfileChoice, Scenario
from tests.actuators.soft import soft
from tests.reference.joints import BladderJoint, Chamber, CylinderJoint, Joint
from tests.reference.reference_solver import chamber_pressures_of, plant_states
from tests.reference.simulator import independent_run

EXAMPLES = Path(__file__).parents[1] / "actuators"
RATIO = 1.4
WARM = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=300 1/m",
)
ADIABATIC = (*WARM[:1], "gas_model.heat_transfer_coefficient=0 W/(m^2 K)", *WARM[2:])
Case = tuple[Scenario, Joint]


def cylinder(_folder: Path) -> Case:
    """The cylinder with a lever, from its lower stop to its upper one."""
    scenario = load_scenario(EXAMPLES / "step-response-cylinder.toml", [*WARM, "run.duration=0.3 s"])
    return scenario, CylinderJoint(scenario)


def bladder(_folder: Path) -> Case:
    """The measured bladder, which fills while it begins to move."""
    given = [*WARM, "run.duration=0.3 s", "initial.pressure_2=atmosphere"]
    scenario = load_scenario(EXAMPLES / "step-response-measured-bladder.toml", given)
    return scenario, BladderJoint(scenario, EXAMPLES / "measured-bladder.csv")


def soft_case(folder: Path, chambers: int) -> Case:
    """A soft actuator that begins in the middle of its range."""
    base = EXAMPLES / "step-response-measured-bladder.toml"
    given = soft(folder, chambers)
    more = ["motion.angle=60 deg", "run.duration=0.25 s", *(["initial.pressure_2=40 psi_g"] if chambers == 2 else [])]
    scenario = load_scenario(base, [*WARM, given, *more])
    return scenario, BladderJoint(scenario, folder / "soft.csv")


CASES: dict[str, Callable[[Path], Case]] = {
    "cylinder": cylinder,
    "bladder": bladder,
    "soft, one chamber": lambda folder: soft_case(folder, 1),
    "soft, two chambers": lambda folder: soft_case(folder, 2),
}


def gaps(scenario: Scenario, joint: Joint) -> tuple[float, float, float]:
    """Largest gap of the angle over its range, of both pressures over theirs, and of the gas drawn over all of it."""
    record = simulate(scenario).recording
    answer = independent_run(scenario, joint=joint)
    actuator = scenario.device.actuator
    supply = scenario.device.supply
    pressures = [name for name in ("pressure_1", "pressure_2") if name in record]
    pressed = max(float(np.abs(record[name] - getattr(answer, name)).max()) for name in pressures)
    turned = float(np.abs(record["angle"] - answer.angle).max())
    drawn = float(np.abs(record["supplied_mass"] - answer.drawn).max())
    return (
        turned / (actuator.angle_max - actuator.angle_min),
        pressed / (supply.pressure - supply.atmospheric_pressure),
        drawn / float(answer.drawn.max()),
    )


@pytest.mark.parametrize("case", CASES)
def test_warm_gas_of_any_actuator_is_what_the_independent_run_says(case: str, tmp_path: Path) -> None:
    scenario, joint = CASES[case](tmp_path)
    turned, pressed, drawn = gaps(scenario, joint)
    assert turned < 2.0e-4
    assert pressed < 1.0e-3
    assert drawn < 1.0e-3
    record = simulate(scenario).recording
    assert np.ptp(record["temperature_1"]) > 0.5, "the gas must change its temperature for this to say anything"


class Stiff(BladderJoint):
    """A bladder whose walls take no work."""

    def chamber(self, which: int, angle: float, pressure: float) -> Chamber:
        """The chamber as if no pressure widened it from here on."""
        return super().chamber(which, angle, pressure)._replace(by_pressure=0.0)


def test_the_independent_run_would_see_gas_that_does_no_work_on_a_wall_that_gives(tmp_path: Path) -> None:
    scenario, _ = soft_case(tmp_path, 2)
    _, pressed, drawn = gaps(scenario, Stiff(scenario, tmp_path / "soft.csv"))
    assert max(pressed, drawn) > 1.0e-2


def squeezed(folder: Path, step: float) -> float:
    """Largest relative departure from the isentrope of closed soft chambers while the joint swings, in steps [s]."""
    base = load_scenario(
        EXAMPLES / "step-response-measured-bladder.toml",
        [*ADIABATIC, soft(folder, 2), "initial.pressure_1=200 kPa_g", "initial.pressure_2=150 kPa_g"],
    )
    swing = ProfileChoice("sine", {"level": 1.1, "amplitude": 0.5, "frequency": 2.0, "phase": 0.0})
    shut = dataclasses.replace(base.controller, kind="constant", settings={"command": 0.0}, period=step)
    planned = plan_run(dataclasses.replace(base, motion=PrescribedMotion(swing), controller=shut))
    counts = {"steps_per_sample": 1, "step_count": round(0.5 / step), "record_every": 1}
    run = dataclasses.replace(planned, step=step, tolerance=1e9, **counts)
    states = plant_states(run, run_batch(batch_of(run)))
    pressures = chamber_pressures_of(run, states)
    volumes = filled_chambers(run.program.actuator, run.plant, states[:, 0], *pressures)[:2]
    return max(
        float(np.abs(pressure * volume**RATIO / (pressure[0] * volume[0] ** RATIO) - 1.0).max())
        for pressure, volume in zip(pressures, volumes, strict=True)
    )


def test_a_closed_chamber_that_gives_follows_the_isentrope_with_order_two(tmp_path: Path) -> None:
    coarse = squeezed(tmp_path, 2.0e-3)
    fine = squeezed(tmp_path, 1.0e-3)
    assert fine < 2.0e-4
    assert 3.5 < coarse / fine < 4.5


def held(folder: Path, *more: str) -> Scenario:
    """A soft actuator held in the middle of its range, whose chamber 1 is filled from the supply."""
    given = [
        *(soft(folder, 2), "motion.kind=locked", "motion.angle=60 deg", "initial.pressure_1=120 kPa_a"),
        *("initial.pressure_2=atmosphere", "run.duration=0.2 s"),
    ]
    return load_scenario(EXAMPLES / "torque-task-measured-bladder.toml", [*given, *more])


def test_what_enters_a_held_chamber_is_energy_of_its_gas_and_work_on_its_wall(tmp_path: Path) -> None:
    result = simulate(held(tmp_path, *ADIABATIC, "controller.kind=constant", "controller.command=1"))
    record = result.recording
    run = plan_run(result.scenario)
    pressure = record["pressure_1"]
    other = record["pressure_2"]
    volume = filled_chambers(run.program.actuator, run.plant, record["angle"], pressure, other).volume_1
    # The wall gives in proportion to the pressure from one measured pressure to the next: few terms are exact.
    grid = np.linspace(pressure[0], pressure[-1], 20001)
    angles = np.full(grid.size, record["angle"][0])
    volumes = filled_chambers(run.program.actuator, run.plant, angles, grid, other[0]).volume_1
    wall = float(np.trapezoid(grid, volumes))
    energy = (pressure[-1] * volume[-1] - pressure[0] * volume[0]) / (RATIO - 1.0)
    entered = RATIO / (RATIO - 1.0) * run.plant.gas_product * (record["mass_1"][-1] - record["mass_1"][0])
    assert wall > 0.04 * entered
    assert energy + wall == pytest.approx(entered, rel=5.0e-5)
    assert record["gas_work"][-1] == pytest.approx(wall, rel=2.0e-3)
    assert abs(result.metrics["energy_imbalance"].value) < 1.0e-4 * entered
