"""Sensor noise as one more uncertain value: its seed, drawn once for each draw and the same in all configurations.

A scenario has one seed, so that a single run can be repeated. A statement about a device must not depend on that one
realisation: where sensors are noisy, every draw gets a noise stream of its own.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ppafo.simulation.declaration import LARGEST_SEED
from ppafo.simulation.scenario import Scenario, worn_kind
from ppafo.simulation.simulate import OPEN_LOOP
from ppafo.studies.distributions import Floats, WholeNumbersBetween
from ppafo.studies.sampling import Factor, permute
from ppafo.studies.study import Drawn

NOISE = "sensors.seed"
"""The path by which a run is given its realisation of the noise."""
_LEVELS = ("sensors.angle_noise", "sensors.pressure_noise", "sensors.force_noise")
_KEY = 1


def is_noisy(scenarios: Iterable[Scenario], paths: Sequence[str] = ()) -> bool:
    """Tell whether a controller receives noise in any of some scenarios, or where some paths vary."""
    closed = [item for item in scenarios if item.control.kind != OPEN_LOOP]
    heard = any(np.any(np.asarray(_noise_of(item)) > 0.0) for item in closed)
    return heard or (bool(closed) and any(path in _LEVELS for path in paths))


def _noise_of(scenario: Scenario) -> Any:
    """Return the sum of the levels of noise of a scenario, which may be an array (runs,)."""
    worn = worn_kind(scenario)
    return scenario.sensors.angle_noise + scenario.sensors.pressure_noise if worn is None else worn.noise(scenario)


def with_noise(
    drawn: tuple[Drawn, ...], scores: Factor | None, scenarios: Iterable[Scenario], paths: Sequence[str]
) -> tuple[tuple[Drawn, ...], Factor | None]:
    """Return distributions and factor with the noise last among them, independent of the others, if there is any.

    ``paths`` are all that vary; a seed among them is left as it is.
    """
    if NOISE in paths or not is_noisy(scenarios, paths):
        return drawn, scores
    noise = Drawn(NOISE, WholeNumbersBetween(0.0, float(LARGEST_SEED)))
    if scores is None:
        return (*drawn, noise), None
    alone = (*(0.0,) * len(drawn), 1.0)
    return (*drawn, noise), (*((*row, 0.0) for row in scores), alone)


def other_noise(seeds: Floats) -> Floats:
    """Return for each seed that of another stream."""
    return permute(seeds.astype(np.uint64), LARGEST_SEED + 1, _KEY, 0).astype(np.float64)
