"""A stride near the best one: from a walk, or from another optimum."""

from dataclasses import dataclass

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.errors import SimulationError
from ppafo.model.command import VENTS_ABOVE
from ppafo.studies.league.walking.programme import Programme
from ppafo.studies.league.walking.stride import Stride
from ppafo.studies.league.walking.task import PROFILE_KIND, PROFILE_VALVE, WalkingTask
from ppafo.walking.walk import walk


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """One stride, from which the optimiser starts: each (samples,) at ``phases`` from the heel strike.

    Pressures [Pa], angle [rad], angular velocity [rad/s]; ``openings`` (times, 3) at phases ``middles`` of their own.
    """

    phases: Floats
    pressure_1: Floats
    pressure_2: Floats
    angle: Floats
    angular_velocity: Floats
    middles: Floats
    openings: Floats

    def unknowns(self, built: Programme, stride: Stride) -> Floats:
        """The stride as the unknowns of a programme have it."""
        phases, free = stride.phases % 1.0, stride.grid.free_points
        pressures = np.array([self._at(phases, row) for row in (self.pressure_1, self.pressure_2)])
        angle, rate = (self._at(phases[:free], row) for row in (self.angle, self.angular_velocity))
        middles = stride.middle_phases % 1.0
        openings = [np.interp(middles, self.middles, row, period=1.0) for row in self.openings.T]
        parts = (pressures.T.ravel() / built.scale, angle, rate, np.sign(rate), np.array(openings).T.ravel())
        guess: Floats = np.clip(np.concatenate(parts), built.lowest, built.highest)
        return guess

    def _at(self, phases: Floats, row: Floats) -> Floats:
        return np.asarray(np.interp(phases, self.phases, row, period=1.0), dtype=np.float64)


def walked_guess(task: WalkingTask) -> Guess:
    """The last whole stride of a controlled walk; SimulationError where it has none."""
    result = walk(task.configuration(PROFILE_KIND, PROFILE_VALVE), task.seconds / 60.0)
    if not result.status.is_completed:
        raise SimulationError(f"the walk that the optimiser starts from ended early: {result.status.message}")
    stride = slice(int(result.starts[-2]), int(result.starts[-1]))
    recorded = result.recording
    phases = np.arange(stride.stop - stride.start) / (stride.stop - stride.start)
    return Guess(
        phases,
        np.array(recorded["pressure_1"][stride]),
        np.array(recorded["pressure_2"][stride]),
        np.array(recorded["angle"][stride]),
        np.array(recorded["angular_velocity"][stride]),
        phases,
        _openings(np.array(recorded["command"][stride])),
    )


def _openings(command: Floats) -> Floats:
    """Openings (samples, 3) of commands (samples,)."""
    vents = command > VENTS_ABOVE
    return np.array([np.where(vents, 0.0, np.maximum(command, 0.0)), np.maximum(-command, 0.0), 1.0 * vents]).T
