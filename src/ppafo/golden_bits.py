"""Golden runs, bitwise equal on every computer, with reference hashes in ``golden_bits.json``."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Batch, BatchResult, run_batch
from ppafo.engine.run import batch_of
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking import list_walks
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import with_duration

VARIED = {
    "noisy-sensors": (
        "torque-task-proportional",
        ("sensors.delay=2.3 ms", "sensors.pressure_noise=0.1 psi_d", "sensors.pressure_resolution=0.05 psi_d"),
    ),
    "thermal-gas-behind-lines": (
        "step-response",
        (
            "gas_model.kind=thermal",
            "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
            "gas_model.wall_area_per_volume=100 1/m",
            "supply_line.plantarflexion.droop=3e6 Pa s/kg",
        ),
    ),
}
"""Golden runs of scenarios with special settings, for features that no bundled scenario uses."""
WALKED = 4.0
"""Duration of a golden walk [s]."""


def names() -> tuple[str, ...]:
    """Return the names of all golden runs."""
    return (*list_scenarios(), *VARIED, *list_walks())


def plain_batch(name: str) -> Batch:
    """Return a golden run by name: a scenario, or the first seconds of a walk."""
    if name in VARIED:
        scenario, settings = VARIED[name]
        return batch_of(plan_run(load_scenario(scenario, settings)))
    if name in list_scenarios():
        return batch_of(plan_run(load_scenario(name)))
    return batch_of(plan_run(with_duration(load_walk(name), WALKED)))


def digest(result: BatchResult) -> str:
    """Return the hash of all numbers of a result; all NaNs are equal."""
    return hash_of((result.states, result.record))


def hash_of(arrays: tuple[NDArray[np.float64], ...]) -> str:
    """Return the hash of arrays; all NaNs are equal."""
    found = hashlib.sha256()
    for values in arrays:
        # Little-endian on every computer.
        found.update(np.where(np.isnan(values), np.nan, values).astype("<f8").tobytes())
    return found.hexdigest()[:16]


GOLDEN = Path(__file__).with_name("golden_bits.json")
Hashes = Mapping[str, Mapping[str, str | int]]


def golden_hashes() -> Hashes:
    """Load the reference hashes by name of the golden run."""
    found: dict[str, dict[str, str | int]] = json.loads(GOLDEN.read_text(encoding="utf-8"))
    return found


def found_bits() -> Iterator[tuple[str, bool]]:
    """Yield the name of each golden run, and whether this computer reproduces its hash."""
    golden = golden_hashes()
    for name in names():
        yield name, digest(run_batch(plain_batch(name))) == golden[name]["run"]
