"""Torque that an actuator gives at most, what a reference requests beyond that, and what is missed on purpose."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.scheme.actuators import torque_of
from ppafo.metrics.metric import Floats
from ppafo.metrics.settled import SettledPart
from ppafo.model.catalog import ACTUATORS
from ppafo.model.controlled import TORQUE
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import reaching_pressures
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.rule import excess_of_part, only_switches

_ANGLES = 9
"""Number of angles between the stops at which the torque of a moving joint is evaluated."""
_LEAST_REACH = 1.0e-9
"""Torque within reach that is judged at least [N m]: an actuator without a supply gives none."""
_PHASES = np.sin(np.linspace(0.0, 2.0 * math.pi, 32, endpoint=False))[:, None]
"""Course of a moving reference about its mean, divided by its amplitude [-]."""


def shortfall(scenario: Scenario) -> Floats:
    """Largest reference minus the available torque [N m] in each run (runs,); 0 if the torque suffices."""
    if scenario.controlled != TORQUE:
        return np.zeros(1)
    lowest, highest = available_torque(scenario)
    least, most = profile_bounds(scenario.reference)
    return np.atleast_1d(np.maximum(0.0, np.maximum(most - highest, lowest - least)))


def available_torque(scenario: Scenario) -> tuple[Floats, Floats]:
    """Lowest and highest torque of the actuator [N m] in each run (runs,).

    One chamber is at its supply and the other vented, independent of the controller. For a moving joint the angle with
    the largest torque counts.
    """
    device = scenario.device
    actuator, locked = device.actuator, scenario.motion.locked_angle
    fractions = (0.0,) if locked is not None else np.linspace(0.0, 1.0, _ANGLES).tolist()
    first, travel = (actuator.angle_min, actuator.angle_max - actuator.angle_min) if locked is None else (locked, 0.0)
    model, plant = ACTUATORS[actuator.kind].model, plant_parameters(device)
    at_lowest, at_highest = reaching_pressures(device)
    angles = [first + fraction * travel for fraction in fractions]
    highest = [torque_of(model, plant, angle, *at_highest) for angle in angles]
    lowest = [torque_of(model, plant, angle, *at_lowest) for angle in angles]
    return np.min(lowest, axis=0), np.max(highest, axis=0)


def misses_for_reach(scenario: Scenario, parts: Iterable[SettledPart], turning: Floats | float) -> NDArray[np.bool_]:
    """True for each run (runs,) that reach alone keeps from its reference: it gives what the actuator can give.

    ``parts`` are the judged parts, ``turning`` is the number of command reversals divided by its limit.
    """
    lacking, switches = shortfall(scenario) > 0.0, only_switches(scenario, scenario.law)
    if not lacking.any():
        return lacking
    reach = available_torque(scenario)
    found = np.fmax.reduce([excess_of_part(_within_reach(part, *reach), switches).largest for part in parts])
    return np.asarray(lacking & (np.fmax(found, turning) <= 1.0))


def _within_reach(part: SettledPart, lowest: Floats, highest: Floats) -> SettledPart:
    """Judged part with the errors that are left of a reference cut at the lowest and highest torque [N m].

    A moving reference is taken for a wave of the same mean and deviation.
    """
    reference = part.reference_mean + math.sqrt(2.0) * np.asarray(part.reference_deviation) * _PHASES
    cut = np.clip(reference, lowest, highest)
    beyond = reference - cut
    mean = part.mean_error + beyond.mean(axis=0)
    deviation = np.maximum(part.error_deviation - beyond.std(axis=0), 0.0)
    farthest = np.abs(beyond).max(axis=0)
    left: dict[str, Any] = part._asdict() | {
        "wanted_change": np.minimum(part.wanted_change, np.maximum(np.maximum(highest, -lowest), _LEAST_REACH)),
        "rms_error": np.hypot(mean, deviation),
        "mean_error": mean,
        "error_deviation": deviation,
        "error_range": np.maximum(part.error_range - np.ptp(beyond, axis=0), 0.0),
        "largest_error": np.maximum(part.largest_error - farthest, 0.0),
        # The error of a wave whose peaks are cut reverses more often than the wave.
        "error_reversals": np.where((np.asarray(part.rests) > 0.0) | (farthest == 0.0), part.error_reversals, 0.0),
        "reference_deviation": cut.std(axis=0),
    }
    return SettledPart._make(np.broadcast_arrays(*left.values()))
