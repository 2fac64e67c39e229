"""A drawn scenario against the reference: is its result determined, and how far off is the package?"""

from typing import Any, NamedTuple

import numpy as np

from ppafo.errors import PpafoError
from ppafo.running import simulate
from ppafo.simulation.scenario import Scenario
from tests.reference.simulator import Answer, independent_run

LARGEST_ANGLE = 2.0e-4
LARGEST_PRESSURE = 1.0e-3
AROUND_IMPACTS = 5.0e-3
"""Time [s] before and after an impact that is left out: a shift of it by 1 us turns velocities over."""
FRACTION = 0.1
"""Share of a limit by which the reference may disagree with itself on a determined run."""
MOVED = 1.0e-7
BIAS = 1.0e-5
"""Share of the pressure range by which what the controller measures is moved, one chamber up and the other down.

A hundredth of the limit: a loop that makes more than the whole limit of it hangs on decisions that nobody can follow.
"""


class Verdict(NamedTuple):
    """Largest errors over their limits, and what the reference says of itself over the same limits."""

    angle: float
    pressure: float
    moved: float
    biased: float
    own: float
    compared: int
    failure: str

    @property
    def is_repeatable(self) -> bool:
        """True where neither the start nor the reference's own step changes the result."""
        return self.compared > 0 and max(self.moved, self.own) <= FRACTION

    @property
    def is_determined(self) -> bool:
        """True where, besides, no decision of the controller hangs by a hair."""
        return self.is_repeatable and self.biased <= 1.0

    @property
    def worst(self) -> float:
        """The larger of both errors over its limit, infinite for a run that failed."""
        return np.inf if self.failure else max(self.angle, self.pressure)

    @property
    def is_wrong(self) -> bool:
        """True where a determined run is above a limit, or failed."""
        return self.is_determined and not self.worst <= 1.0


def pressure_range(scenario: Scenario, answer: Answer) -> float:
    """Highest less lowest of all pressures of a run [Pa]: chambers, supplies and atmosphere."""
    supply = scenario.device.supply
    fixed = [supply.pressure, supply.dorsiflexion_pressure, supply.atmospheric_pressure]
    values = np.concatenate([answer.pressure_1, answer.pressure_2, fixed])
    return float(values.max() - values.min())


def away_from_impacts(times: Any, *impacts: Any) -> Any:
    """True where no impact is near."""
    keep = np.ones(times.size, dtype=bool)
    for impact in np.concatenate(impacts):
        keep &= np.abs(times - impact) > AROUND_IMPACTS
    return keep


def differences(scenario: Scenario, answer: Answer, other: Any, keep: Any) -> tuple[float, float]:
    """Largest differences of angle and pressures over their limits, where ``keep`` is True."""
    actuator = scenario.device.actuator
    if not keep.any():
        return 0.0, 0.0
    angle = np.abs(other[0] - answer.angle)[keep].max() / (actuator.angle_max - actuator.angle_min)
    gap_1 = np.abs(other[1] - answer.pressure_1)
    gap_2 = np.abs(other[2] - answer.pressure_2)
    pressure = np.maximum(gap_1, gap_2)[keep].max() / pressure_range(scenario, answer)
    return float(angle) / LARGEST_ANGLE, float(pressure) / LARGEST_PRESSURE


def columns(answer: Answer) -> tuple[Any, Any, Any]:
    """Angle and both pressures."""
    return answer.angle, answer.pressure_1, answer.pressure_2


def package_columns(scenario: Scenario, count: int) -> tuple[Any, str]:
    """What the package says, and why it says nothing where it does not."""
    try:
        result = simulate(scenario)
    except PpafoError as refusal:
        return None, f"refused: {refusal}"
    record = result.recording
    if not result.status.is_completed or len(record) != count:
        return None, f"failed: {result.status.message}"
    return (record["angle"], record["pressure_1"], record["pressure_2"]), ""


def verdict(scenario: Scenario) -> Verdict:
    """How far the package is from the reference on a scenario, and whether the reference can say."""
    answer = independent_run(scenario)
    span = pressure_range(scenario, answer)
    others = [independent_run(scenario, moved=MOVED), independent_run(scenario, tolerance=1.0e-11)]
    if scenario.controller.kind != "constant":
        others += [independent_run(scenario, bias=BIAS * span), independent_run(scenario, bias=-BIAS * span)]
    keep = away_from_impacts(answer.time, answer.impacts, *(other.impacts for other in others))
    gaps = [max(differences(scenario, answer, columns(other), keep)) for other in others]
    doubts = (gaps[0], max(gaps[2:], default=0.0), gaps[1], int(keep.sum()))
    seen, failure = package_columns(scenario, answer.time.size)
    errors = (np.inf, np.inf) if failure else differences(scenario, answer, seen, keep)
    return Verdict(*errors, *doubts, failure)
