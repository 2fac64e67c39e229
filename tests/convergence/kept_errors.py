"""How far a run at the default tolerance is from itself at a tolerance of 1e-6, over the errors that it promises."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.scheme.motion import ALLOWED_OF_ANGLE
from ppafo.signals.recording import Recording
from ppafo.simulation.check import (
    LARGEST_OF_ANGLE,
    LARGEST_OF_PRESSURE,
    LARGEST_OF_TEMPERATURE,
    MOVE,
    finer,
    start_moved,
)
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import results_of
from tests.reference.comparison import AROUND_IMPACTS

FINEST = 1.0e-3
"""Allowed error of the run that is taken for the truth, over the default one: a tolerance of 1e-6."""
DOUBT = MOVE / ALLOWED_OF_ANGLE
"""Change over the promised error by a start that is moved by 1e-7: beyond it the error that one part may have is seen.

Such a task says more about where it starts than about the steps.
"""
LARGEST_PRESSURE = 10.0
"""Pressure over the supplies' (gauge) beyond which a chamber is crushed within a millisecond: nothing is promised."""
NEAR_A_STOP = 5.0e-3
"""Distance from a stop over the range of the angle within which a reversal is a rebound."""


class Kept(NamedTuple):
    """Largest errors of angle, pressures and temperatures over the promised ones; the last 0 without any.

    ``doubt`` is what a moved start and a coarser reference change; ``failure`` says why there is nothing to say.
    """

    angle: float
    pressure: float
    temperature: float
    doubt: float
    failure: str = ""

    @property
    def is_determined(self) -> bool:
        """True where the errors are the steps'."""
        return not self.failure and self.doubt <= DOUBT

    @property
    def worst(self) -> float:
        """The largest of the errors over what is promised."""
        return max(self.angle, self.pressure, self.temperature)


def away_from_impacts(scenario: Scenario, recording: Recording) -> Any:
    """True for samples with no impact within 5 ms."""
    actuator = scenario.device.actuator
    angle = recording["angle"]
    rate = recording["angular_velocity"]
    span = actuator.angle_max - actuator.angle_min
    distance = np.minimum(angle - actuator.angle_min, actuator.angle_max - angle)
    rests = distance < 1.0e-9 * span
    comes_or_goes = rests[1:] != rests[:-1]
    rebounds = (rate[1:] * rate[:-1] < 0.0) & (np.minimum(distance[1:], distance[:-1]) < NEAR_A_STOP * span)
    impacts = recording.time[1:][comes_or_goes | rebounds]
    keep = np.ones(len(recording), dtype=bool)
    for impact in impacts:
        keep &= np.abs(recording.time - impact) > AROUND_IMPACTS
    return keep


def kept(scenario: Scenario) -> Kept:
    """The errors of a task, away from impacts."""
    run = plan_run(scenario)
    fine = replace(finer(run), tolerance=FINEST * run.tolerance)
    others = [replace(fine, tolerance=10.0 * fine.tolerance), *(start_moved(fine, MOVE, way) for way in (1.0, -1.0))]
    results = results_of(scenario, [run, fine, *others])
    failures = [result.status.message for result in results if not result.status.is_completed]
    if failures:
        return Kept(0.0, 0.0, 0.0, np.inf, failures[0])
    usual, truth, *doubtful = (result.recording for result in results)
    actuator = scenario.device.actuator
    supply = scenario.device.supply
    outside = [supply.pressure, supply.dorsiflexion_pressure, supply.atmospheric_pressure]
    pressures = np.concatenate([truth["pressure_1"], truth["pressure_2"], outside])
    if pressures.max() - supply.atmospheric_pressure > LARGEST_PRESSURE * (max(outside) - supply.atmospheric_pressure):
        return Kept(0.0, 0.0, 0.0, np.inf, f"a chamber is crushed to {pressures.max():.3g} Pa")
    promised = {
        ("angle",): LARGEST_OF_ANGLE * (actuator.angle_max - actuator.angle_min),
        ("pressure_1", "pressure_2"): LARGEST_OF_PRESSURE * float(np.ptp(pressures)),
        ("temperature_1", "temperature_2"): LARGEST_OF_TEMPERATURE * scenario.device.gas.temperature,
    }
    keep = away_from_impacts(scenario, truth)

    def gaps(other: Recording) -> list[float]:
        return [
            max(
                (float(np.abs(other[name] - truth[name])[keep].max(initial=0.0)) for name in names if name in truth),
                default=0.0,
            )
            / allowed
            for names, allowed in promised.items()
        ]

    return Kept(*gaps(usual), max(max(gaps(other)) for other in doubtful))
