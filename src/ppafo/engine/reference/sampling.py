"""The sampled controller beside a solution in continuous time: late signals, late commands; and its stretches."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.run import Run
from ppafo.engine.scheme.actuators import measurement_of
from ppafo.errors import SimulationError
from ppafo.model.sensors import Measurement, measure

SAME_TIME = 1.0e-12

Signals = tuple[float, float, float]
"""Angle [rad] and both absolute pressures [Pa]."""


class SampledControl:
    """Keeps what the sensors have seen, the controller's state, and the commands that are on their way to the valve."""

    def __init__(self, run: Run, first_signals: Signals) -> None:
        if run.program.controller is None:
            raise SimulationError("the reference solver runs controllers of the catalogue only")
        self._run = run
        self._controller = run.program.controller
        self._state = run.program.controller.initial
        self._first_signals = first_signals
        self._seen: dict[int, Signals] = {}
        self._on_the_way: list[tuple[float, float]] = []
        self.decided = 0.0

    def decide(self, sample: int, time: float, present: Signals) -> None:
        """Take a sample at ``time`` [s] and send the new command on its way."""
        run = self._run
        wanted = run.program.reference.value(run.reference, time)[0]
        seen = self._measurement(sample, present)
        self.decided, self._state = self._controller.update(run.controller, self._state, wanted, seen, run.period)
        self._on_the_way.append((time + run.command_delay, self.decided))

    def looks(self, next_sample: int) -> dict[float, int]:
        """Times [s] before the next sample at which a late sensor looks, each with the sample that will use it."""
        run = self._run
        if run.signal_delay <= 0.0:
            return {}
        ahead = range(next_sample, next_sample + int(run.signal_delay / run.period) + 2)
        return {index * run.period - run.signal_delay: index for index in ahead}

    def keep(self, sample: int, signals: Signals) -> None:
        """Keep what a late sensor sees now for a sample to come."""
        self._seen[sample] = signals

    def arriving(self, time: float, command: float) -> float:
        """Command at the valve at ``time`` [s]: the last that has arrived, else the one in force."""
        while self._on_the_way and self._on_the_way[0][0] <= time + SAME_TIME:
            command = self._on_the_way.pop(0)[1]
        return command

    def arrivals(self) -> list[float]:
        """Times [s] at which commands will arrive."""
        return [moment for moment, _ in self._on_the_way]

    def _measurement(self, sample: int, present: Signals) -> Measurement:
        run = self._run
        before_start = sample * run.period < run.signal_delay - SAME_TIME
        signals = self._seen.pop(sample, None) or (self._first_signals if before_start else present)
        if run.program.ideal_sensors:
            angle, pressure_1, pressure_2 = signals
            return Measurement(
                angle=angle,
                pressure_1=pressure_1,
                pressure_2=pressure_2,
                torque=run.program.actuator.torque(run.plant, angle, pressure_1, pressure_2),
            )
        seen = measure(run.sensors, *signals, run.plant.torque_constant, sample)
        return measurement_of(run.program.actuator, run.plant, seen) if run.program.has_shape else seen


Floats = NDArray[np.float64]


def solve_segment(solver: Any, y: Floats, time: float, end: float, wanted: Floats, name: str) -> Any:
    """Solution from ``time`` to ``end`` [s], or to an event before, also at the ``wanted`` times that lie ahead.

    ``wanted`` may hold times before ``time`` and after ``end``. SimulationError, which calls the solver ``name``, where
    the solver gives up.
    """
    inside = wanted[(wanted > time + SAME_TIME) & (wanted < end - SAME_TIME)]
    grid = np.unique(np.concatenate([[time], inside, [end]]))
    # With only two times the solver would return its own steps instead of the end.
    times = grid if grid.size > 2 else np.array([grid[0], 0.5 * (grid[0] + grid[1]), grid[1]])
    solution = solver.solve(times, y)
    if not solution.success:
        raise SimulationError(f"{name} stopped at t = {solution.t[-1]:.6g} s: {solution.message}")
    return solution
