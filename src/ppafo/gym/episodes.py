"""Where episodes begin, as the file has it or drawn from what is not known about it, and the kernel that steps them.

One compiled call for one step of all environments: commands in; physics, sensors, observations and rewards out.

The lane loop of every other run steps them; sensors, observations and rewards around it are written from the same
components. Each environment is a lane, whose episode began at a step of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.assistance import TorqueProfile
from ppafo.engine.entries import ARRAY, ARRAY_2D, ARRAY_3D, FLOAT, HEADER, INLINE, INT, entry_text, indent, with_arrays
from ppafo.engine.generator import StepText
from ppafo.engine.lane_rows import ARGUMENTS, COMPILED, VECTOR, lanes_of
from ppafo.engine.lanes import SIGNAL_ROWS, Batch, Clock, Floats
from ppafo.engine.loading import load_source
from ppafo.engine.loop_text import Call, RowsOfLanes, lane_loop
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers
from ppafo.engine.run import batch_of
from ppafo.engine.scheme.pneumatics import HeldChambers
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step.lane import LaneStart, Now
from ppafo.engine.step.phases import hold_chambers
from ppafo.engine.step.sample import fill_signals, remember_readings, sense
from ppafo.errors import ScenarioError, UnitError
from ppafo.gym.tasks import (
    Goal,
    Memory,
    Outcome,
    Requested,
    Task,
    finite,
    reward_of,
    within,
)
from ppafo.model.plant import chamber_pressures, joint_torque
from ppafo.model.sensors import Measurement
from ppafo.parameters import load_parameter_set
from ppafo.parameters.graph import ATMOSPHERE_PATH, gauge_link
from ppafo.parameters.parameter_set import atmospheric_pressure, entry_in_si
from ppafo.simulation.ensemble.planning import plan_ensemble
from ppafo.simulation.loading import set_name
from ppafo.simulation.numbers import absolute, check_columns, chosen_path, declared_numbers, number_at, with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.studies.varying import VariedPath, in_its_unit, varied_path
from ppafo.units import parse_quantity
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import draw_gaits
from ppafo.walking.planning import batch_of_many, plan_walk
from ppafo.walking.wearer import draw_builds

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

OWN = {"goal": Goal, "memory": Memory}
"""Rows of an environment beside the rows of its run."""
OWN_PATHS = [path for name, row in OWN.items() for path in leaf_paths(row, name)]
OUTCOMES = len(Outcome._fields)
FAILED = Outcome._fields.index("failed")
"""Row of the outcomes from which on they are truth values."""

_PARAMETERS = {
    **dict.fromkeys(("all_states", "all_parameters"), ARRAY_2D),
    **{"all_signals": ARRAY_3D, "all_commands": ARRAY_2D, "record": ARRAY_3D, "trace": ARRAY_3D, "all_own": ARRAY_2D},
    **{"actions": ARRAY_2D, "bounds": ARRAY_2D, "chosen": ARRAY, "observations": ARRAY_2D, "outcomes": ARRAY_2D},
    **dict.fromkeys(("error_weight", "gas_weight"), FLOAT),
    **dict.fromkeys(("moment", "steps", "steps_in_all", "steps_per_sample", "signal_delay", "command_delay"), INT),
}
"""Parameters of ``go_on``; a name that begins with ``all`` holds the rows of all blocks, one block after another."""


def observe(
    parts: Program,
    lane: Any,
    task: Task,
    now: Now,
    error_weight: float,
    gas_weight: float,
    steps_in_all: int,
) -> None:
    """Sense, observe and judge one environment, and say whether its episode ends."""
    sense(parts, lane, now)
    time = now.step * lane.timing.step
    torque_wanted, rate, _ = parts.reference.value(lane.reference, time)
    wanted = Requested(torque_wanted, rate)
    pressure_1, pressure_2 = chamber_pressures(lane.plant, lane.state.angle, lane.state.mass_1, lane.state.mass_2)
    torque = joint_torque(lane.plant, lane.state.angle, pressure_1, pressure_2)
    gas = lane.state.supplied_mass - lane.memory.supplied_mass
    lane.memory = task.kept(lane.memory, lane.state.supplied_mass, lane.seen, time)
    lane.view = task.observed(lane.seen, lane.goal, lane.memory, wanted, lane.result.command, time)
    phase = lane.walk.now.phase if parts.leg is not None else 0.0
    error = task.error(lane.goal, wanted, lane.state.angle, phase, torque)
    lane.outcome = Outcome(
        reward=finite(reward_of(error, gas, error_weight, gas_weight, lane.timing.period)),
        error=finite(error),
        supplied=finite(lane.state.supplied_mass),
        failed=1.0 if lane.result.failure_time <= time else 0.0,
        through=1.0 if now.step >= steps_in_all else 0.0,
    )


@lru_cache(maxsize=16)
def kernel_source(program: Program, task: Task) -> str:
    """Source text of the module whose ``go_on`` takes all environments of a program a step further."""
    collector = SourceCollector(INLINE)
    step = StepText(program, collector, further={**OWN, "view": task.view, "outcome": Outcome})
    loop = lane_loop(step, COMPILED, "advance", ARGUMENTS)
    kernel = _kernel(step, task)
    return "\n\n\n".join([HEADER, collector.text(), loop, entry_text("go_on", _PARAMETERS, kernel)])


def _kernel(step: StepText, task: Task) -> list[str]:
    """Lines of ``go_on``: block by block the commands, the lane loop, and what is observed at its end."""
    # Between two calls of the lane loop rows stand in the arrays, and what a step hands on is gone.
    rows = RowsOfLanes(step)
    rows.cells = {path: cell for path, cell in rows.cells.items() if path not in rows.step_at}
    rows.cells.update({path: path.replace(".", "_") for path in leaf_paths(HeldChambers, "held")})
    count = len(rows.state_at)
    rows.cells.update({path: f"states[{row}, lane]" for path, row in rows.state_at.items()})
    rows.cells.update({path: f"parameters[{row - count}, lane]" for path, row in rows.parameter_at.items()})
    rows.cells.update({path: f"own[{row}, lane]" for row, path in enumerate(OWN_PATHS)})
    rows.cells.update({f"outcome.{name}": f"outcomes[{row}, first + lane]" for row, name in enumerate(Outcome._fields)})
    rows.cells.update({path: f"observations[first + lane, {row}]" for row, path in enumerate(task.observed_paths)})
    add = step.collector.add
    command = add(task.command)
    heights = {
        "states": str(count),
        "parameters": str(len(rows.parameter_at)),
        "own": str(len(OWN_PATHS)),
        "signal_history": str(SIGNAL_ROWS),
        "command_history": "(command_delay + 2)",
    }
    whole = {"signal_history": "all_signals", "command_history": "all_commands"}
    parts = [
        f"{name} = {whole.get(name, f'all_{name}')}[block * {height}:(block + 1) * {height}]"
        for name, height in heights.items()
    ]
    given = {name: name for name in ("now", "error_weight", "gas_weight", "steps_in_all")}
    filled = rows.called(Call(step.phase(fill_signals), {"slot": "slot"})) if step.parts.late_signals else ["pass"]
    held = rows.called(Call(step.phase(hold_chambers), {})) if step.parts.hands_chambers_on else []
    readings = rows.called(Call(step.phase(remember_readings), given)) if step.parts.late_readings else []
    within_bounds = [
        f"{rows.cells[path]} = {add(within)}({rows.cells[path]}, bounds[0, {row}], bounds[1, {row}])"
        for row, path in enumerate(task.observed_paths)
    ]
    observed = [
        "if chosen[first + lane] == 0.0:",
        "    continue",
        rows.load("start"),
        "step = moment - int(start.step)",
        "sample = step // steps_per_sample",
        *held,
        "if step == 0:",
        "    for slot in range(signal_history.shape[1]):",
        # Late signals of an episode begin with the readings at its start.
        *indent(indent(filled)),
        f"now = {add(Now)}(step, sample, 1.0, 0, 0, late, 0, sample % slots, slots)",
        *readings,
        *rows.called(Call(step.phase(observe, {"task": task}), given)),
        *within_bounds,
    ]
    body = [
        *parts,
        "first = block * states.shape[1]",
        "width = min(states.shape[1], actions.shape[0] - first)",
        "slots = signal_history.shape[1]",
        # A call with 0 steps senses and observes alone: this is how episodes begin.
        "if steps > 0:",
        "    for lane in range(states.shape[1]):",
        # Lanes without an environment take the action of the last one.
        "        place = min(first + lane, actions.shape[0] - 1)",
        f"        {rows.cells['result.command']} = {command}(actions[place, 0], actions[place, actions.shape[1] - 1])",
        "    advance(states, parameters, signal_history, command_history, record, trace, moment - steps, steps, -1, "
        "steps_per_sample, 1.0, -1, 0, 0, signal_delay, command_delay)",
        "late = (moment - signal_delay) % slots",
        "for lane in range(width):",
        *indent(observed),
    ]
    return [f"for block in range(all_states.shape[0] // {heights['states']}):", *indent(body)]


@dataclass(frozen=True, slots=True)
class Columns:
    """Starts of episodes: parameters and states as the program has them, and goals (rows, episodes)."""

    parameters: Floats
    states: Floats
    goals: Floats


@dataclass(frozen=True, slots=True)
class Judging:
    """Weights of the reward for squared error and gas, and bounds (2, observed) of what is observed."""

    error_weight: float
    gas_weight: float
    bounds: Floats


@dataclass(frozen=True, slots=True)
class Seen:
    """What a step shows of every environment: observations (environments, observed), the rest (environments,)."""

    observations: NDArray[np.float32]
    rewards: Floats
    errors: Floats
    supplied: Floats
    terminated: Flags
    truncated: Flags

    def then(self, later: "Seen") -> "Seen":
        """Return what two samples show one after the other; an episode that ended with the first stays as it was."""
        ended = self.terminated | self.truncated
        pairs = {name: (getattr(self, name), getattr(later, name)) for name in ("errors", "supplied")}
        chosen = {name: np.where(ended, *pair) for name, pair in pairs.items()}
        return Seen(
            observations=np.where(ended[:, None], self.observations, later.observations),
            rewards=self.rewards + np.where(ended, 0.0, later.rewards),
            terminated=self.terminated | (later.terminated & ~ended),
            truncated=self.truncated | (later.truncated & ~ended),
            **chosen,
        )


def episode_program(batch: Batch) -> tuple[Program, Clock]:
    """Program and clock of a run whose commands come from outside; ScenarioError for samples inside a step."""
    if batch.program.samples_inside:
        raise ScenarioError("run.output_interval: an environment needs one that is a whole number of steps")
    return replace(batch.program, controller=None, starts_apart=True), batch.clock


@final
class Environments:
    """Some environments of one program side by side, each a lane with an episode of its own."""

    def __init__(self, program: Program, clock: Clock, task: Task, count: int, judging: Judging) -> None:
        self.count = count
        self._clock, self._judging = clock, judging
        self._program, self._task = program, task
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
        self._chosen = np.zeros(count)
        self._observations = np.zeros((count, len(task.observed_paths)))
        self._outcomes = np.zeros((OUTCOMES, count))
        self._signals = np.zeros((blocks * SIGNAL_ROWS, clock.signal_delay + 2, width))
        self._now = 0
        self._go_on = with_arrays(
            load_source(kernel_source(program, task)).go_on,
            self._states.reshape(-1, width),
            self._parameters.reshape(-1, width),
            self._signals,
            self._commands.reshape(-1, width),
            np.empty((0, len(state_rows), width)),
            np.empty((0, 0, width)),
            self._own.reshape(-1, width),
            self.actions,
            np.ascontiguousarray(judging.bounds),
            self._chosen,
            self._observations,
            self._outcomes,
        )

    def __deepcopy__(self, memo: dict[int, Any]) -> "Environments":
        """Return environments that go on from here by themselves; the compiled program is the same."""
        other = Environments(self._program, self._clock, self._task, self.count, self._judging)
        other.resume(self.state())
        memo[id(self)] = other
        return other

    def state(self) -> dict[str, Floats | int]:
        """Return all that changes from step to step: copies of the arrays, and the number of the step."""
        arrays = {name: value.copy() for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return {**arrays, "_now": self._now}

    def resume(self, state: Mapping[str, Floats | int]) -> None:
        """Go on from a state; the compiled program keeps the places of the arrays, so that they are filled."""
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                getattr(self, name)[...] = value
            else:
                self._now = value

    def begin(self, places: Places, columns: Columns) -> Seen:
        """Begin episodes of some environments at once; what the others show is not to be used."""
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
        self._chosen[places] = 1.0
        return self._call(0)

    def step(self) -> Seen:
        """Take ``actions`` for a sample period, and show what follows."""
        self._chosen[:] = 1.0
        return self._call(self._clock.steps_per_sample)

    def numbers(self, place: int) -> dict[str, float]:
        """The state of one environment as the engine has it, in SI units, by path such as ``state.angle``."""
        block, lane = divmod(place, self._states.shape[2])
        return {path: float(self._states[block, row, lane]) for path, row in self.rows.items()}

    def _call(self, steps: int) -> Seen:
        clock = self._clock
        self._now += steps
        self._go_on(
            self._judging.error_weight,
            self._judging.gas_weight,
            self._now,
            steps,
            clock.step_count,
            clock.steps_per_sample,
            clock.signal_delay,
            clock.command_delay,
        )
        # Copies, because the kernel writes the same arrays at the next step.
        rewards, errors, supplied = self._outcomes[:FAILED].copy()
        failed, through = self._outcomes[FAILED:] != 0.0
        return Seen(self._observations.astype(np.float32), rewards, errors, supplied, failed, through)


Generators = Sequence[np.random.Generator]
Ranges = Mapping[str, tuple[str | float, str | float]]
"""Lowest and highest value by dotted path, as texts with units."""

NO_PROFILE = TorqueProfile(peak_torque=0.0, peak_time=0.5, rise_time=1.0, fall_time=1.0)
MOST_DRAWS = 100
"""Draws of one episode until one is a run of the program; where none is, too much varies."""
_SEED = "sensors.seed"


class FromOutside:
    """Stands for the controller of a scenario whose commands come from an agent."""

    def reset(self) -> None:
        """Do nothing."""

    def update(self, time: float, reference: float, measurement: Measurement) -> float:  # noqa: ARG002 - a protocol
        """Refuse: an agent is asked through its environment."""
        raise ScenarioError("the commands of an environment come from its agent; give the scenario a controller")


@dataclass(frozen=True, slots=True)
class ScenarioEpisodes:
    """Episodes of a scenario; ``ranges`` in SI by path are drawn evenly, and so is the angle to turn to, ``targets``.

    Without ``ranges`` each is the scenario as it stands, noise included, and turns to the middle of ``targets``. Values
    of the paths in ``gauge`` count from the atmosphere of their episode.
    """

    base: Scenario
    program: Program
    clock: Clock
    ranges: Mapping[str, tuple[float, float]]
    targets: tuple[float, float]
    plain: Columns
    gauge: frozenset[str] = frozenset()

    def draw(self, generators: Generators) -> tuple[Columns, Floats]:
        """Return an episode for each generator, and what was drawn of each (numbers, episodes) in SI.

        Drawn again where a draw breaks a rule of scenarios, or asks for another program, as a chamber that is too quick
        does. ScenarioError where nothing fits.
        """
        count = len(generators)
        columns, values = _repeated(self.plain, count), np.zeros((len(self.ranges), count))
        if not self.ranges:
            return columns, values
        left, reason = np.arange(count), ""
        for _ in range(MOST_DRAWS):
            for number in left.tolist():
                generator = generators[number]
                drawn = (generator.uniform(*ends) for ends in self.ranges.values())
                # A seed is drawn as all numbers are, and has to be whole.
                values[:, number] = [
                    float(np.floor(value)) if path == _SEED else value
                    for path, value in zip(self.ranges, drawn, strict=True)
                ]
                columns.goals[0, number] = generator.uniform(*self.targets)
            left, reason = self._plan(columns, values, left)
            if not left.size:
                return columns, values
        raise ScenarioError(f"{self.base.name}: {MOST_DRAWS} draws of an episode do not fit it: {reason}; vary less")

    def shown(self, drawn: Floats) -> Scenario:
        """Return the scenario of what was drawn of one episode (numbers,) in SI."""
        numbers = dict(zip(self.ranges, drawn.tolist(), strict=True))
        return with_numbers(self.base, absolute(self.base, numbers, self.gauge))

    def _plan(self, columns: Columns, values: Floats, left: Places) -> tuple[Places, str]:
        """Write the columns of some episodes; return the places of those that do not fit, and why one does not."""
        given = dict(zip(self.ranges, values[:, left], strict=True))
        plan = plan_ensemble(check_columns(self.base, given, self.gauge))
        reason = next(iter(plan.reasons.values()), "another program, step or delay")
        for members, batch in plan.batches:
            if episode_program(batch) == (self.program, self.clock):
                columns.parameters[:, left[members]] = batch.parameters
                columns.states[:, left[members]] = batch.states
                # What is left has another program or clock, cannot go with the others, and is drawn again.
                left = np.where(np.isin(np.arange(left.size), members), -1, left) if members.size else left
        return left[left >= 0], reason


def scenario_episodes(base: Scenario, randomise: bool, vary: Ranges, targets: tuple[str, str]) -> ScenarioEpisodes:
    """Return the episodes of a scenario: what its parameter set has an interval for, ``vary`` and the seed are drawn.

    ScenarioError for a path or range that cannot be.
    """
    base = base.controlled_by(FromOutside())
    lowest, highest = (parse_quantity(text, "rad", base.device.supply.atmospheric_pressure) for text in targets)
    ranges: dict[str, tuple[float, float]] = {}
    gauge: set[str] = set()
    if randomise:
        ranges, gauge = intervals_of(base)
        varies = ATMOSPHERE_PATH in {*ranges, *vary}
        # Where the atmosphere varies as well, a gauge pressure keeps its distance from it.
        atmosphere = base.device.supply.atmospheric_pressure
        gauge = gauge - set(vary) if varies else set()
        ranges |= {path: (ranges[path][0] - atmosphere, ranges[path][1] - atmosphere) for path in gauge}
        for path, ends in vary.items():
            varied, ranges[path] = _range(base, path, ends, varies)
            gauge |= {path} if varied.is_gauge else set()
        # Each episode has noise of its own, unless the caller says how the seed varies.
        ranges.setdefault(_SEED, (0.0, float(LARGEST_SEED)))
    batch = batch_of(plan_run(base))
    program, clock = episode_program(batch)
    middle = Goal(angle=0.5 * (lowest + highest), profile=NO_PROFILE)
    plain = Columns(batch.parameters, batch.states, np.array([numbers(middle)]).T)
    return ScenarioEpisodes(base, program, clock, ranges, (lowest, highest), plain, frozenset(gauge))


def intervals_of(base: Scenario) -> tuple[dict[str, tuple[float, float]], set[str]]:
    """Return the ends of each interval of the scenario's parameter set, about the scenario's value, in SI by path.

    And the paths of those that are given in gauge.
    """
    origin = base.origin
    folder = Path() if origin.file is None else Path(origin.file).parent
    parameter_set = load_parameter_set(set_name(origin.parameter_set, folder))
    atmosphere, declared = atmospheric_pressure(parameter_set), parameter_set.declarations()
    known, ranges, gauge = declared_numbers(base), {}, set()
    for path, entry in parameter_set.numbers.items():
        own = chosen_path(path, base)
        if entry.uncertainty and own in known:
            # The upper end in the unit of the entry, so that a gauge pressure is converted as its value is.
            above = entry.model_copy(update={"value": entry.value + entry.uncertainty})
            ends = [entry_in_si(text, declared[path], atmosphere) for text in (entry, above)]
            value, half = number_at(base, own), ends[1] - ends[0]
            ranges[own] = (value - half, value + half)
            gauge |= {own} if gauge_link(own, entry.value, entry.unit) else set()
    return ranges, gauge


def _range(
    base: Scenario, path: str, ends: tuple[str | float, str | float], atmosphere_varies: bool
) -> tuple[VariedPath, tuple[float, float]]:
    varied = varied_path(path, base)
    try:
        varied = in_its_unit(varied, ends) if atmosphere_varies else varied
        lowest, highest = (varied.level(end) for end in ends)
    except (UnitError, ValueError) as error:
        raise ScenarioError(f"vary: {path} = {ends!r}: {error}; give the lowest and the highest value") from error
    if lowest > highest:
        raise ScenarioError(f"vary: {path} = {ends!r}: give the lowest value before the highest")
    return varied, (lowest, highest)


def _repeated(columns: Columns, count: int) -> Columns:
    rows = (columns.parameters, columns.states, columns.goals)
    return Columns(*(np.repeat(values, count, axis=1) for values in rows))


@dataclass(frozen=True, slots=True)
class WalkEpisodes:
    """Episodes of a walk, ``commanded`` from outside; ``randomise`` draws another wearer with another gait for each."""

    base: Scenario
    commanded: Scenario
    program: Program
    clock: Clock
    randomise: bool
    plain: Columns

    def draw(self, generators: Generators) -> tuple[Columns, Floats]:
        """Return an episode for each generator, and no drawn numbers: a wearer is not a list of numbers."""
        columns = _repeated(self.plain, len(generators))
        for number, generator in enumerate(generators if self.randomise else ()):
            # Person 0 of a population is always the one of the configuration; the second one is drawn.
            seed = float(generator.integers(0, LARGEST_SEED))
            drawn = replace(self.commanded, sensors=replace(self.commanded.sensors, seed=int(seed)))
            build = draw_builds(2, generator)
            gaits = draw_gaits(walk_of(self.base).gait, build.stature, generator)
            batch = batch_of_many(drawn, build, gaits, generator)
            columns.parameters[:, number], columns.states[:, number] = batch.parameters[:, 1], batch.states[:, 1]
        return columns, np.zeros((0, len(generators)))

    def shown(self, drawn: Floats) -> Scenario:  # noqa: ARG002 - a wearer is no list of numbers
        """Return the walk before anything is drawn."""
        return self.base


def walk_episodes(configuration: Scenario, randomise: bool, seconds: float) -> WalkEpisodes:
    """Return the episodes of a walk of some length [s]; the profile of its controller is the requested torque.

    ScenarioError for a walk with a task sequence or a bottle, or whose controller has no profile.
    """
    for name in ("task_sequence", "bottle"):
        if getattr(walk_of(configuration), name) is not None:
            raise ScenarioError(
                f"{configuration.origin.file}: {name}: an environment does not support it; leave it out"
            )
    settings = configuration.controller.settings
    if not set(TorqueProfile._fields) <= set(settings):
        kind = configuration.controller.kind
        raise ScenarioError(
            f"{configuration.origin.file}: controller.kind = '{kind}' has no torque profile; event_pid has one"
        )
    goal = Goal(angle=0.0, profile=TorqueProfile(**{name: settings[name] for name in TorqueProfile._fields}))
    commanded = with_duration(configuration, seconds).controlled_by(FromOutside())
    batch = batch_of(plan_walk(commanded))
    program, clock = episode_program(batch)
    plain = Columns(batch.parameters, batch.states, np.array([numbers(goal)]).T)
    # Nothing is recorded between two samples: an agent sees what is observed.
    return WalkEpisodes(configuration, commanded, program, replace(clock, record_every=0), randomise, plain)
