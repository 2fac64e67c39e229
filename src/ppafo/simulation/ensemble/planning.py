"""From columns to batches for the lanes, without a loop over runs."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Batch
from ppafo.engine.run import Members, batches_of
from ppafo.simulation.ensemble.columns import Columns
from ppafo.simulation.ensemble.screening import Screen, screen_columns
from ppafo.simulation.plan import plan_runs
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class EnsemblePlan:
    """Batches with the places of their runs in the ensemble, and a line for each run that cannot be."""

    batches: tuple[tuple[Members, Batch], ...]
    reasons: dict[int, str]


def plan_ensemble(columns: Columns) -> EnsemblePlan:
    """Batches of all runs that can be; each run has the rows, bit for bit, that ``plan_run`` gives it alone."""
    screen = screen_columns(columns)
    batches: list[tuple[Members, Batch]] = []
    if screen.members.size:
        for places in _of_one_program(screen.scenario, screen.members.size):
            batches += _plan_batches(screen, places)
    return EnsemblePlan(tuple(batches), screen.reasons)


def _plan_batches(screen: Screen, places: Members) -> list[tuple[Members, Batch]]:
    """Batches of some runs that ask for one program; what cannot be planned is refused."""
    part = screen.at(places)
    while part.members.size:
        run, problems = plan_runs(part.scenario)
        bad = [problem for problem in problems if np.any(problem[0])]
        if not bad:
            return [(part.members[members], batch) for members, batch in batches_of(run, part.members.size)]
        part.refuse(*bad[0])
    return []


def _of_one_program(scenario: Scenario, runs: int) -> list[Members]:
    """Places of the runs, those together that have zeros in the same settings of the valve and the sensors."""
    settings: tuple[Any, ...] = (*scenario.device.valve.settings.values(), *scenario.sensors.flaws)
    varied_settings = [setting for setting in settings if isinstance(setting, np.ndarray)]
    if not varied_settings:
        return [np.arange(runs)]
    patterns: NDArray[np.int64] = np.zeros(runs, dtype=np.int64)
    for setting in varied_settings:
        patterns = 2 * patterns + (setting > 0.0)
    return [np.flatnonzero(patterns == pattern) for pattern in np.unique(patterns)]
