"""Values that define a run, used by the compiled engine and by the reference solver."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.groups import Role, filled
from ppafo.engine.lanes import Batch, BatchResult, Clock, effort_for, load_programs, run_blocks
from ppafo.engine.program import Program, place_of_group
from ppafo.engine.rows import of_each, row_numbers
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.engine.scheme.motion import StepControl
from ppafo.engine.scheme.thermal_gas import masses_at_start
from ppafo.engine.step.lane import MAXIMUM_PARTS, LaneResult, LaneTiming
from ppafo.model.columns import larger, truncated
from ppafo.model.declaration import EmptyRow
from ppafo.model.effects.kind import PlantSnapshot
from ppafo.model.plant import ActuatorFunctions, PlantParameters, PlantState, ThermalParameters
from ppafo.model.sensors import NOTHING_SEEN, GaitSensors, SensorParameters

if TYPE_CHECKING:  # for most runs know no leg, no line and no walk
    from ppafo.engine.scheme.walking import DeviceShare, WalkState
    from ppafo.model.gait import GaitSeries, GaitTiming
    from ppafo.model.leg import FootLoad, LegParameters
    from ppafo.model.regulator import LineState, SupplyLines

Members = NDArray[np.intp]

NEVER_FAILED = 1.0e300
AT_REST = LaneResult(command=0.0, failure_time=NEVER_FAILED, too_many_parts=0.0)
"""Command and failure flags of a device before its first step."""
TOO_MANY_PARTS = (
    f"one step needs more than {MAXIMUM_PARTS:,} substeps: use a smaller run.step, and check the delays of the valve, "
    "the inertia and the volumes (ppafo sets audit)"
)
"""Remedy for a run ended by ``LaneResult.too_many_parts``."""
WHOLE = 1.0e-9
_GROUPS_OF_RUN = ("plant", "thermal", "valve", "controller", "reference", "path", "sensors")
"""Groups of parameters that every run has as a field of this name."""


@dataclass(frozen=True, slots=True)
class Walk:
    """Leg that follows a gait of equal strides."""

    leg: "LegParameters"
    share: "DeviceShare"
    gait: "GaitSeries"
    timing: "GaitTiming"
    sensors: GaitSensors
    initial: "WalkState"


@dataclass(frozen=True, slots=True)
class Lines:
    """Supply lines behind regulators, whose set pressures are the supply pressures of the plant."""

    parameters: "SupplyLines"
    initial: "LineState"


@dataclass(frozen=True, slots=True)
class LedLeg:
    """Foot on a prescribed shank: load that turns about the ankle, and profile of the shank."""

    load: "FootLoad"
    shank: Any


@dataclass(frozen=True, slots=True)
class Run:
    """Device in one experiment, in SI units.

    ``step`` divides the controller ``period``. ``valve``, ``controller``, ``reference`` and ``path`` are the parameters
    of the program's components, () without parameters. Delays are in seconds. ``tolerance`` is the allowed error
    divided by the default allowed error. ``effects`` are the rows of the program's effects, in their order. For an
    ensemble, any number in one ``Run``, including integers and truth values, may be an array (runs,). ``needs_parts``
    and ``record_every`` then determine which runs have an adaptive program or a program with samples inside its steps,
    whatever ``program`` states.
    """

    program: Program
    plant: PlantParameters
    thermal: ThermalParameters | EmptyRow
    initial: PlantState
    valve: Any
    controller: Any
    reference: Any
    path: Any
    sensors: SensorParameters
    step: float
    step_count: int
    steps_per_sample: int
    record_every: float
    signal_delay: float
    command_delay: float
    needs_parts: bool = False
    tolerance: float = 1.0
    walk: Walk | None = None
    lines: Lines | None = None
    effects: tuple[Any, ...] = ()
    leg: LedLeg | None = None

    @property
    def period(self) -> float:
        """Sampling period of the controller [s]."""
        return self.step * self.steps_per_sample


def whole_and_rest(delay: float, step: float) -> tuple[float, float]:
    """Whole steps in a delay [s], and the remainder as a fraction of a step; either may be an array (runs,)."""
    steps = delay / step
    complete = truncated(steps + WHOLE)
    return complete, larger(0.0, steps - complete)


def batch_of(run: Run) -> Batch:
    """Return a run as a batch of one run."""
    return batches_of(run, 1)[0][1]


def state_row_numbers(run: Run) -> dict[str, int]:
    """Return the row index of each number of the state, by path such as ``state.angle``."""
    return row_numbers(run.program.state_rows())


def batches_of(run: Run, runs: int) -> list[tuple[Members, Batch]]:
    """Return batches of ``runs`` runs of one program, one batch per clock, each with the indices of its runs.

    Any number in ``run`` may be an array (runs,), one value per run.
    """
    program = run.program
    command_steps, command_lag = whole_and_rest(run.command_delay, run.step)
    signal_steps, signal_lag = whole_and_rest(run.signal_delay, run.step)
    timing = LaneTiming(
        step=run.step, period=run.period, command_lag=command_lag, signal_lag=signal_lag, tolerance=run.tolerance
    )
    declared_at = partial(place_of_group, program)
    parameters = filled(program.parameter_rows(), _parameters_of(run, timing), runs, Role.PARAMETER, declared_at)
    states = filled(program.state_rows(), _states_of(run), runs, Role.STATE, declared_at)
    numbers = (run.needs_parts, run.step_count, run.steps_per_sample, run.record_every, signal_steps, command_steps)
    counts = np.column_stack([np.full(runs, number, dtype=np.float64) for number in numbers])
    if runs == 1 or (counts == counts[0]).all():
        clocks = counts[:1]
        groups = [np.arange(runs)]
    else:
        clocks, group = np.unique(counts, axis=0, return_inverse=True)
        # Places of the runs of each clock, in order.
        order = np.argsort(group.reshape(-1), kind="stable")
        groups = np.split(order, np.cumsum(np.bincount(group.reshape(-1), minlength=len(clocks)))[:-1])
    batches = []
    for clock, members in zip(clocks, groups, strict=True):
        needs_parts, step_count, steps_per_sample, every, signal_delay, command_delay = clock.tolist()
        own = replace(program, is_adaptive=bool(needs_parts), samples_inside=not every.is_integer())
        every = every if own.samples_inside else int(every)
        ticks = Clock(int(step_count), int(steps_per_sample), every, int(signal_delay), int(command_delay))
        ordered = members
        if own.is_adaptive and members.size > 1:
            # The runs of a block wait for the slowest at every step; when a vane moves depends on how long its valve
            # takes to move the gas.
            plant = run.plant
            swept = plant.displacement_per_radian * (plant.angle_max - plant.angle_min)
            gas = plant.dead_volume_1 + plant.dead_volume_2 + swept
            duration = np.broadcast_to(gas / (plant.valve_conductance * plant.gas_product), (runs,))
            ordered = members[np.argsort(duration[members], kind="stable")]
        batches.append((ordered, Batch(own, ticks, parameters[:, ordered], states[:, ordered])))
    return batches


def _parameters_of(run: Run, timing: LaneTiming) -> dict[str, Any]:
    """Return the groups of parameters of a run, by name."""
    walk = run.walk
    of_walk = ("leg", "share", "gait", "gait_timing", "gait_sensors")
    return {
        "timing": timing,
        **{name: getattr(run, name) for name in _GROUPS_OF_RUN},
        **({} if walk is None else {name: getattr(walk, name.removeprefix("gait_")) for name in of_walk}),
        **({} if run.lines is None else {"lines": run.lines.parameters}),
        **({} if run.leg is None else {"load": run.leg.load, "shank": run.leg.shank}),
        **{effect.name: row for effect, row in zip(run.program.effects, run.effects, strict=True)},
        **{name: of_each(of_plant, run.plant) for name, of_plant in run.program.groups_of_plant.items()},
    }


def _states_of(run: Run) -> dict[str, Any]:
    """Return the groups of initial states of a run, by name."""
    program = run.program
    return {
        "result": AT_REST,
        "pace": StepControl(run.step),
        "state": run.initial,
        "masses": masses_at_start(run.initial) if program.is_thermal else EmptyRow(),
        "valve_state": program.valve.state(),
        "controller_state": EmptyRow() if program.controller is None else program.controller.initial,
        **({} if run.walk is None else {"walk": run.walk.initial, "gait_seen": NOTHING_SEEN}),
        **({} if run.lines is None else {"line_state": run.lines.initial}),
        **dict(zip(program.effect_states, states_at_start(run), strict=True)),
    }


def states_at_start(run: Run) -> list[Any]:
    """Return the initial effect states of a run, in the order of the program; arrays (runs,) if the run has arrays."""
    initial = run.initial
    program = run.program
    if not program.effect_states:
        return []
    pressures = pressures_of(program.actuator, run.plant, initial.angle, initial.mass_1, initial.mass_2)
    now = PlantSnapshot(initial.angle, initial.angular_velocity, *pressures)
    return [
        effect.state.row() if effect.state.start is None else of_each(effect.state.start, row, now)
        for effect, row in zip(program.effects, run.effects, strict=True)
        if effect.state is not None
    ]


def moment_at_start(plant: PlantParameters, initial: PlantState, *, parts: ActuatorFunctions) -> PlantSnapshot:
    """Return the motion and pressures, without flow, from which effect laws compute their initial states."""
    pressure_1, pressure_2 = parts.pressures(plant, initial.angle, initial.mass_1, initial.mass_2)
    return PlantSnapshot(initial.angle, initial.angular_velocity, pressure_1, pressure_2)


def run_together(runs: Sequence[Run], threads: int | None = None) -> list[BatchResult]:
    """Return the results of many runs, each identical to a separate run; runs of one program and clock share blocks."""
    batches = [batch_of(run) for run in runs]
    groups: dict[tuple[Program, Clock], list[int]] = {}
    for index, batch in enumerate(batches):
        groups.setdefault((batch.program, batch.clock), []).append(index)
    results: dict[int, BatchResult] = {}
    together = [
        Batch(
            program,
            clock,
            np.concatenate([batches[index].parameters for index in members], axis=1),
            np.concatenate([batches[index].states for index in members], axis=1),
        )
        for (program, clock), members in groups.items()
    ]
    load_programs((batch.program, effort_for(batch)) for batch in together)
    for batch, members in zip(together, groups.values(), strict=True):

        def take(block: slice, outcome: BatchResult, members: list[int] = members) -> None:
            for column, index in enumerate(members[block]):
                one = slice(column, column + 1)
                results[index] = BatchResult(outcome.states[:, one], outcome.record[:, :, one])

        run_blocks(batch, take, threads, effort_for(batch))
    return [results[index] for index in range(len(runs))]
