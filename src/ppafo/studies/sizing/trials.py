"""Runs of the profile on the lanes: many pressures, gains and openings of one valve at once."""

from dataclasses import dataclass
from itertools import product
from typing import final

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.parts import Part
from ppafo.simulation.ensemble import run_ensemble
from ppafo.studies.design.columns import valve_numbers
from ppafo.studies.sizing.problem import SizingProblem

Floats = NDArray[np.float64]

ERROR, GAS = "rms_error", "gas_supplied"
_OPENINGS = ("valve.area", "valve.sonic_conductance")
_CHUNK = 16_384
"""Runs handed to the lanes at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """RMS error [N m], gas per repetition [kg] and number of the set of gains of trials; all (trials,).

    Error and gas are nan where a run failed.
    """

    error: Floats
    gas: Floats
    gains: NDArray[np.intp]

    def at(self, members: NDArray[np.intp]) -> "Trial":
        """Return some of the trials."""
        return Trial(self.error[members], self.gas[members], self.gains[members])


@final
class Trials:
    """Runs trials of a problem and counts the runs and their failures.

    ``gain_sets`` (sets, gains) has every combination of the gain factors, one for each gain.
    """

    def __init__(self, problem: SizingProblem, threads: int | None = None) -> None:
        self.problem = problem
        self.gain_sets: Floats = np.array(list(product(problem.gain_factors, repeat=len(problem.gains))))
        self.runs = 0
        self.failures: dict[str, int] = {}
        self._threads = threads

    def run(self, valve: Part, pressure: Floats, gains: NDArray[np.intp], opening: Floats) -> Trial:
        """Return what came of a valve at pressures [Pa absolute], with sets of gains and factors on its opening."""
        parts = [slice(start, start + _CHUNK) for start in range(0, pressure.size, _CHUNK)]
        found = [self._run(valve, pressure[part], gains[part], opening[part]) for part in parts]
        error, gas = (np.concatenate([item[name] for item in found]) for name in (ERROR, GAS))
        return Trial(error, gas / self.problem.simulated, gains)

    def best(self, valve: Part, pressure: Floats, opening: float = 1.0) -> Trial:
        """Return for each pressure the trial with the best set of gains.

        Of those that keep the error limit the one that uses least gas; where none does, the one with the least error.
        """
        sets = self.gain_sets.shape[0]
        pressures, gains = np.repeat(pressure, sets), np.tile(np.arange(sets), pressure.size)
        trial = self.run(valve, pressures, gains, np.full(pressures.size, opening))
        shape = (pressure.size, sets)
        error = np.where(np.isnan(trial.error), np.inf, trial.error).reshape(shape)
        works = error <= self.problem.largest_error
        gas = np.where(works, trial.gas.reshape(shape), np.inf)
        chosen = np.where(works.any(axis=1), gas.argmin(axis=1), error.argmin(axis=1))
        return trial.at(np.arange(pressure.size) * sets + chosen)

    def gain_numbers(self, number: int) -> dict[str, float]:
        """Return the gains of a set in SI, by path."""
        settings = self.problem.scenario.control.settings
        pairs = zip(self.problem.gains, self.gain_sets[number], strict=True)
        return {path: float(factor * settings[path.rpartition(".")[2]]) for path, factor in pairs}

    def _run(self, valve: Part, pressure: Floats, gains: NDArray[np.intp], opening: Floats) -> dict[str, Floats]:
        columns = self.columns(valve, pressure, gains, opening)
        result = run_ensemble(self.problem.scenario, columns, (ERROR, GAS), threads=self._threads)
        self.runs += pressure.size
        for reason in result.reasons.values():
            self.failures[reason] = self.failures.get(reason, 0) + 1
        return result.metrics

    def columns(self, valve: Part, pressure: Floats, gains: NDArray[np.intp], opening: Floats) -> dict[str, Floats]:
        """Return the columns of trials in SI: figures of the parts, both supply pressures, gains."""
        problem, count = self.problem, pressure.size
        columns = {path: np.full(count, number) for path, number in valve_numbers(valve).items()}
        columns |= {path: columns[path] * opening for path in _OPENINGS if path in columns}
        if problem.actuator is not None:
            for name in ("torque_constant", "volume_per_angle"):
                columns[f"actuator.{name}"] = np.full(count, problem.actuator.values[name])
        columns |= {"supply.pressure": pressure, "supply.dorsiflexion_pressure": pressure}
        settings = problem.scenario.control.settings
        for index, path in enumerate(problem.gains):
            columns[path] = self.gain_sets[gains, index] * settings[path.rpartition(".")[2]]
        return columns
