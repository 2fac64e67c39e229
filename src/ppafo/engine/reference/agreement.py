"""How far the lanes are from the reference solver on one run."""

from dataclasses import dataclass

import numpy as np

from ppafo.engine.lanes import BatchResult, Floats, run_batch
from ppafo.engine.reference.solver import ReferenceResult, solve_reference
from ppafo.engine.rows import leaf_paths
from ppafo.engine.run import Run, batch_of

IMPACT_WINDOW = 5.0e-3


@dataclass(frozen=True, slots=True)
class Agreement:
    """Largest and root-mean-square differences as fractions of the angle range and of the supply's gauge pressure [-].

    Where the supply is at the pressure of the atmosphere, that pressure stands for the gauge pressure. Instants within
    5 ms of an impact on a stop are left out. ``supplied`` is relative, ``impacts`` in seconds.
    """

    angle: float
    pressure_1: float
    pressure_2: float
    angle_rms: float
    pressure_1_rms: float
    pressure_2_rms: float
    supplied: float
    impacts: tuple[float, ...]

    @property
    def worst_pressure(self) -> float:
        """The larger of the two largest pressure differences [-]."""
        return max(self.pressure_1, self.pressure_2)

    @property
    def worst_rms(self) -> float:
        """The largest of the root-mean-square differences [-]."""
        return max(self.angle_rms, self.pressure_1_rms, self.pressure_2_rms)


def compare_with_reference(run: Run, reference: ReferenceResult | None = None) -> Agreement:
    """Run the lanes and, unless it is given, the reference solver, and compare them at the record times."""
    judge = reference or solve_reference(run)
    return measure_agreement(run, run_batch(batch_of(run)), judge)


def measure_agreement(run: Run, outcome: BatchResult, reference: ReferenceResult) -> Agreement:
    """Differences between a recorded run of the lanes and the reference."""
    plant = run.plant
    states = plant_states(run, outcome)
    away = np.ones(reference.times.size, dtype=bool)
    for impact in reference.impacts:
        away &= np.abs(reference.times - impact) > IMPACT_WINDOW
    gauge = max(plant.supply_pressure, plant.dorsiflexion_pressure) - plant.atmospheric_pressure
    pressure_range = gauge if gauge > 0.0 else plant.atmospheric_pressure
    ours, theirs = chamber_pressures_of(run, states), chamber_pressures_of(run, reference.states)
    differences = [
        (states[:, 0] - reference.states[:, 0]) / (plant.angle_max - plant.angle_min),
        (ours[0] - theirs[0]) / pressure_range,
        (ours[1] - theirs[1]) / pressure_range,
    ]
    largest = [float(np.abs(difference[away]).max()) for difference in differences]
    rms = [float(np.sqrt(np.mean(difference[away] ** 2))) for difference in differences]
    supplied = float(abs(states[-1, 4] - reference.states[-1, 4]) / max(abs(reference.states[-1, 4]), 1e-12))
    return Agreement(
        angle=largest[0],
        pressure_1=largest[1],
        pressure_2=largest[2],
        angle_rms=rms[0],
        pressure_1_rms=rms[1],
        pressure_2_rms=rms[2],
        supplied=supplied,
        impacts=tuple(reference.impacts),
    )


def plant_states(run: Run, outcome: BatchResult) -> Floats:
    """The seven numbers [SI] of ``PlantState`` at each record (records, 7) of the first run in a result."""
    paths = [path for name, row in run.program.state_rows().items() for path in leaf_paths(row, name)]
    first = paths.index("state.angle")
    return outcome.record[:, first : first + 7, 0]


def chamber_pressures_of(run: Run, states: Floats) -> tuple[Floats, Floats]:
    """Both pressures [Pa absolute] of states (records, 7)."""
    pressures = run.program.actuator.pressures
    pairs = [pressures(run.plant, float(row[0]), float(row[2]), float(row[3])) for row in states]
    return np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])
