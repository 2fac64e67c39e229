"""Environments of one program, advanced in lanes, each with an episode that starts at its own step."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.entries import with_arrays
from ppafo.engine.lane_rows import VECTOR, lanes_of
from ppafo.engine.lanes import SIGNAL_ROWS, Batch, Clock, Floats
from ppafo.engine.loading import compiled
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths
from ppafo.engine.step.lane import LaneStart
from ppafo.errors import ScenarioError
from ppafo.gym.kernel import OWN_PATHS, Action, PythonKernel, kernel_source
from ppafo.gym.tasks import Outcome, Task
from ppafo.model.sensors import Measurement

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

_OUTCOMES = len(Outcome._fields)
_FIRST_FLAG = Outcome._fields.index("failed")
"""Index of the first outcome that is a flag; all later outcomes are flags."""


class FromOutside:
    """Placeholder controller of a scenario whose commands come from an agent."""

    def reset(self) -> None:
        """Do nothing, since there is no controller state."""

    def update(self, time: float, reference: float, measurement: Measurement) -> float:  # noqa: ARG002 - a protocol
        """Raise an error, because an agent acts through its environment."""
        raise ScenarioError(
            "this scenario has no controller: it is for an environment, in which an agent gives the commands; to "
            "simulate it without an agent, give a controller"
        )


def episode_program(batch: Batch) -> tuple[Program, Clock]:
    """Return program and clock of a run with external commands. Raises ScenarioError for samples within a step."""
    if batch.program.samples_inside:
        raise ScenarioError("run.output_interval: must be a multiple of run.step in an environment")
    return replace(batch.program, controller=None, starts_apart=True), batch.clock


@dataclass(frozen=True, slots=True)
class EpisodeStarts:
    """Initial values of episodes (rows, episodes): parameters and states of the program, and goals."""

    parameters: Floats
    states: Floats
    goals: Floats

    def repeated(self, count: int) -> "EpisodeStarts":
        """Return the initial values of ``count`` equal episodes, from a single episode."""
        return EpisodeStarts(*(np.repeat(rows, count, axis=1) for rows in (self.parameters, self.states, self.goals)))


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Reward weights of squared error and gas, and bounds (2, observed) of the observations."""

    error_weight: float
    gas_weight: float
    bounds: Floats


@dataclass(frozen=True, slots=True)
class BatchStep:
    """Result of a step in every environment: observations (environments, observed), all else (environments,)."""

    observations: NDArray[np.float32]
    rewards: Floats
    errors: Floats
    supplied: Floats
    terminated: Flags
    truncated: Flags

    def then(self, later: "BatchStep") -> "BatchStep":
        """Combine the results of two successive steps; an episode that ended in the first step is unchanged."""
        ended = self.terminated | self.truncated
        return BatchStep(
            observations=np.where(ended[:, None], self.observations, later.observations),
            rewards=self.rewards + np.where(ended, 0.0, later.rewards),
            errors=np.where(ended, self.errors, later.errors),
            supplied=np.where(ended, self.supplied, later.supplied),
            terminated=self.terminated | (later.terminated & ~ended),
            truncated=self.truncated | (later.truncated & ~ended),
        )


@final
class Environments:
    """Environments of one program, advanced in lanes, each with its own episode."""

    def __init__(self, program: Program, clock: Clock, task: Task, count: int, judging: RewardWeights) -> None:
        self.count = count
        self._clock, self._judging = clock, judging
        # Lanes in whole vectors: a few environments need no block of full width.
        width = min(lanes_of(program), -(-count // VECTOR) * VECTOR)
        blocks = -(-count // width)
        state_rows = [path for name, row in program.state_rows().items() for path in leaf_paths(row, name)]
        parameter_rows = [path for name, row in program.parameter_rows().items() for path in leaf_paths(row, name)]
        self.rows = {path: row for row, path in enumerate(state_rows)}
        self._start = self.rows[leaf_paths(LaneStart, "start")[0]]
        self._states = np.zeros((blocks, len(state_rows), width))
        self._parameters = np.zeros((blocks, len(parameter_rows), width))
        self._commands = np.zeros((blocks, clock.command_delay + 2, width))
        self._own = np.zeros((blocks, len(OWN_PATHS), width))
        # Where the next actions are written (environments, 1 or 2).
        self.actions = np.zeros((count, task.actions))
        self._actions = np.zeros((blocks, len(Action._fields), width))
        self._chosen = np.zeros((blocks, 1, width))
        self._observations = np.zeros((blocks, len(leaf_paths(task.view, "view")), width))
        self._shown = tuple(task.observed_rows(program.has_one_chamber).values())
        self._outcomes = np.zeros((blocks, _OUTCOMES, width))
        self._signals = np.zeros((blocks, SIGNAL_ROWS, clock.signal_delay + 2, width))
        self._now = 0
        module: Any = compiled(kernel_source(program, task)) or PythonKernel(program, task)
        record, trace = np.empty((0, len(state_rows), width)), np.empty((0, 0, width))
        self._blocks = []
        for block, (states, signals) in enumerate(zip(self._states, self._signals, strict=True)):
            parameters, shown = self._parameters[block], (self._observations[block], self._outcomes[block])
            command = with_arrays(module.command, states, self._actions[block], signals)
            advance = with_arrays(module.advance, states, parameters, signals, self._commands[block], record, trace)
            own = self._own[block], self._chosen[block]
            judge = with_arrays(module.judge, states, parameters, *own, *shown, signals)
            self._blocks.append((command, advance, judge))

    def state(self) -> dict[str, Floats | int]:
        """Return the variable state: copies of the arrays, and the step number."""
        arrays = ((name, value) for name, value in vars(self).items() if isinstance(value, np.ndarray))
        return {**{name: value.copy() for name, value in arrays}, "_now": self._now}

    def resume(self, state: Mapping[str, Floats | int]) -> None:
        """Restore a state into the existing arrays, whose addresses the compiled program uses."""
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                getattr(self, name)[...] = value
            else:
                self._now = value

    def begin(self, places: Places, columns: EpisodeStarts) -> BatchStep:
        """Start episodes in the environments at ``places``; the results of other environments are invalid."""
        lanes = self._states.shape[2]
        # Lanes without an environment repeat the last one, so that each has a run that goes on.
        spare = np.arange(self.count, self._states.shape[0] * lanes)
        last = np.flatnonzero(places == self.count - 1)
        every = np.concatenate([np.arange(places.size), np.repeat(last, spare.size)])
        blocks, own = np.divmod(np.concatenate([places, spare[: spare.size * last.size]]), lanes)
        # The last row is the step at which the episode begins: the drawn columns do not have it.
        self._states[blocks, :-1, own] = columns.states.T[every]
        self._states[blocks, self._start, own] = float(self._now)
        self._parameters[blocks, :, own] = columns.parameters.T[every]
        self._own[blocks, :, own] = 0.0
        self._own[blocks, : columns.goals.shape[0], own] = columns.goals.T[every]
        # Delayed commands of the episode before must not reach this one.
        self._commands[blocks, :, own] = 0.0
        self._chosen[:] = 0.0
        self._chosen[blocks[: places.size], 0, own[: places.size]] = 1.0
        return self._call(0)

    def step(self) -> BatchStep:
        """Apply ``actions`` for a sample period."""
        self._chosen[:] = 1.0
        return self._call(self._clock.steps_per_sample)

    def numbers(self, place: int) -> dict[str, float]:
        """Return the engine state of an environment in SI units, by path such as ``state.angle``."""
        block, lane = divmod(place, self._states.shape[2])
        return {path: float(self._states[block, row, lane]) for path, row in self.rows.items()}

    def _call(self, steps: int) -> BatchStep:
        clock, judging, width = self._clock, self._judging, self._states.shape[2]
        self._now += steps
        # Lanes without an environment take the action of the last one.
        every = np.minimum(np.arange(self._actions.shape[0] * width), self.count - 1).reshape(-1, width)
        for number in range(self._actions.shape[1]):
            self._actions[:, number] = self.actions[every, min(number, self.actions.shape[1] - 1)]
        late = clock.signal_delay, clock.command_delay
        for command, advance, judge in self._blocks:
            # A call with 0 steps senses and observes alone: this is how episodes begin.
            if steps > 0:
                command()
                advance(self._now - steps, steps, -1, clock.steps_per_sample, 1.0, -1, 0, 0, *late)
            judge(
                judging.error_weight,
                judging.gas_weight,
                self._now,
                clock.step_count,
                clock.steps_per_sample,
                clock.signal_delay,
            )
        lowest, highest = judging.bounds
        # fmax gives the lowest value for nan: a converter shows nothing else.
        shown = np.fmin(np.fmax(self._by_environment(self._observations)[:, self._shown], lowest), highest)
        outcomes = self._by_environment(self._outcomes).T
        rewards, errors, supplied = outcomes[:_FIRST_FLAG]
        failed, through = outcomes[_FIRST_FLAG:] != 0.0
        return BatchStep(shown.astype(np.float32), rewards, errors, supplied, failed, through)

    def _by_environment(self, blocks: Floats) -> Floats:
        """Copy arrays (blocks, numbers, lanes) to shape (environments, numbers)."""
        return blocks.transpose(0, 2, 1).reshape(-1, blocks.shape[1])[: self.count].copy()
