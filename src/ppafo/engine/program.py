"""Which compiled components a run is made of, and what these put in the place of functions of the model."""

import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, get_type_hints

from ppafo.control.kind import OPEN_LOOP, ControllerKind, ProfileKind
from ppafo.control.profiles import CONSTANT
from ppafo.engine.components import Feed, GasScheme, LegScheme
from ppafo.engine.over_samples import called_over_samples, in_columns
from ppafo.engine.scheme.actuators import links_of
from ppafo.engine.scheme.isothermal_gas import ISOTHERMAL
from ppafo.engine.scheme.motion import FreePart, Pace, PartEnd, PartSlide, PrescribedStep
from ppafo.engine.scheme.pneumatics import HeldChambers, SlopedFlows, StageFlows
from ppafo.engine.source_text import Collector, SourceCollector
from ppafo.errors import ProgramError
from ppafo.kinds import kind_at
from ppafo.model.actuators.kind import ActuatorModel
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.model.effects.kind import Effect, State, effect_problem, laws_in_order
from ppafo.model.plant import PlantState
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves.kind import ValveModel
from ppafo.signals.meter import Course, MeterKind


class LaneTiming(NamedTuple):
    """Longest step and sample period [s]; shares of a step by which commands and signals are late beyond whole steps.

    ``tolerance`` is the error over the one that a run is allowed by default [-].
    """

    step: float
    period: float
    command_lag: float
    signal_lag: float
    tolerance: float


class LaneResult(NamedTuple):
    """Command in force [-], first time [s] at which a run left what is possible (huge where it did not).

    ``too_many_parts`` is 1 where it failed because a step was cut into more parts than are made of one.
    """

    command: float
    failure_time: float
    too_many_parts: float


class LaneStart(NamedTuple):
    """Step of the block at which the run of a lane began, a whole number [-]."""

    step: float


class NoParameters(NamedTuple):
    """Stands where a program has no such component."""


@dataclass(frozen=True, slots=True)
class Program:
    """One combination of components; each combination is compiled once.

    ``angle`` None leaves the vane unconstrained, otherwise that profile prescribes it. ``controller`` None leaves the
    command to the caller, sample by sample. ``ideal_sensors`` False adds noise and quantisation of the signals,
    ``late_signals`` True a delay. ``late_readings`` True lets sensors of a walk be whole samples late.
    ``late_commands`` True adds a dead time before the valve. ``gas`` is what the gas keeps or exchanges, ``feed`` what
    feeds it, None for constant pressures. ``leg`` is a walking one that the device is on, whose foot is free or where
    the ground and a gait lead it (``angle`` is None then; its sensors are its own). ``is_adaptive`` True divides each
    step as its error asks, ``samples_inside`` True where recorded samples lie between the steps. ``meters`` are updated
    at every sample that a recording would have, ``traced`` names channels, or paths of the state, that are kept at some
    of them. ``starts_apart`` True lets the run of each lane begin at a step of its own, while others of the block are
    under way. ``actuator`` is what stands between the chambers and the joint. ``effects`` act in this order at the
    ports of their laws. ``shank`` None leaves an unconstrained vane to itself; otherwise it carries a foot on a shank
    that moves so (``engine/led_leg.py``).
    """

    valve: ValveModel
    reference: ProfileKind
    controller: ControllerKind | None
    angle: ProfileKind | None
    ideal_sensors: bool
    late_commands: bool
    late_signals: bool = False
    late_readings: bool = False
    gas: GasScheme = ISOTHERMAL
    leg: LegScheme | None = None
    feed: Feed | None = None
    is_adaptive: bool = False
    samples_inside: bool = False
    meters: tuple[MeterKind, ...] = ()
    traced: tuple[str, ...] = ()
    starts_apart: bool = False
    actuator: ActuatorModel = VANE
    effects: tuple[Effect, ...] = ()
    shank: ProfileKind | None = None

    def parameter_rows(self) -> dict[str, type]:
        """Groups of parameter rows of this program, in order."""
        shank = self.shank
        return {
            "timing": LaneTiming,
            "plant": self.actuator.plant,
            **self.gas.parameters,
            "valve": self.valve.parameters,
            "controller": NoParameters if self.controller is None else self.controller.parameters,
            "reference": self.reference.parameters,
            "path": NoParameters if self.angle is None else self.angle.parameters,
            "sensors": SensorParameters,
            **({} if self.leg is None else self.leg.parameters),
            **({} if self.feed is None else self.feed.parameters),
            # By its place, for few vanes carry a leg.
            **({"load": kind_at("ppafo.model.leg:FootLoad"), "shank": shank.parameters} if shank is not None else {}),
            **{effect.name: effect.parameters for effect in self.effects},
        }

    @property
    def is_on_gait(self) -> bool:
        """True where a gait leads the shank of a leg, whose knee moves too (``engine/led_leg.py``)."""
        return self.shank is not None and self.shank.name == "gait"

    @property
    def effect_rows(self) -> dict[str, type]:
        """Groups of rows that the laws of effects may ask for, by their names: parameters, and states."""
        return {effect.name: effect.parameters for effect in self.effects} | self.effect_states

    @property
    def stated(self) -> dict[str, State]:
        """States of the effects that have one, by the names of the effects."""
        return {effect.name: effect.state for effect in self.effects if effect.state is not None}

    @property
    def effect_states(self) -> dict[str, type]:
        """Groups of rows of the states of effects, by their names."""
        return {f"{name}_state": kind.row for name, kind in self.stated.items()}

    def state_rows(self) -> dict[str, type]:
        """Groups of state rows of this program, in order."""
        return {
            "result": LaneResult,
            "pace": Pace,
            "state": PlantState,
            **self.gas.states,
            "valve_state": self.valve.state,
            "controller_state": NoParameters if self.controller is None else type(self.controller.initial),
            **({} if self.leg is None else self.leg.states),
            **({} if self.feed is None else self.feed.states),
            **self.effect_states,
            "course": Course if self.follows_reference else NoParameters,
            **{group: kind.state for group, kind in self.meter_groups.items()},
            **({"start": LaneStart} if self.starts_apart else {}),
        }

    @property
    def is_thermal(self) -> bool:
        """True where the gas has an energy balance."""
        return bool(self.gas.parameters)

    @property
    def has_true_masses(self) -> bool:
        """True where the true masses of the gas stand beside what ``PlantState`` counts."""
        return bool(self.gas.states)

    @property
    def walks(self) -> bool:
        """True where the device is on a walking leg."""
        return self.leg is not None

    @property
    def takes_task_sequence(self) -> bool:
        """True where that leg walks a task sequence: it stands, starts, changes its speed and stops."""
        return self.leg is not None and self.leg.takes_task_sequence

    @property
    def fails(self) -> bool:
        """True where the plant of a walk may fail, or a shut-off valve is in its line."""
        return self.leg is not None and self.leg.fails

    @property
    def chambers(self) -> str:
        """What the first stage of the chambers is called in a step."""
        return "gas" if self.feed is None else self.feed.chambers

    @property
    def meter_groups(self) -> dict[str, MeterKind]:
        """Meters by the name of their group of state rows."""
        return {f"{kind.name}_meter": kind for kind in self.meters}

    @property
    def has_reference(self) -> bool:
        """True where the controller follows a reference; a constant command follows none."""
        return self.controller is None or self.controller.name != OPEN_LOOP

    @property
    def follows_reference(self) -> bool:
        """True where a meter needs to know the reference over the whole run."""
        return any(kind.needs_course for kind in self.meters)

    @property
    def is_parted(self) -> bool:
        """True where a step is done in parts."""
        return self.is_adaptive or self.samples_inside or self.late_commands or self.late_signals or self.valve.jumps

    @property
    def parts_are_rare(self) -> bool:
        """True where a step is in parts only when a valve jumps inside it: lanes hardly ever wait for others then."""
        others = self.is_adaptive or self.samples_inside or self.late_commands or self.late_signals
        return self.valve.jumps and not others

    @property
    def is_locked(self) -> bool:
        """True where the angle is prescribed by a profile that never changes."""
        return self.angle is CONSTANT

    @property
    def has_shape(self) -> bool:
        """True where the actuator is no vane, so that its kind gives chambers and torque."""
        return self.actuator is not VANE

    @property
    def keeps_volumes(self) -> bool:
        """True where the chamber volumes of a locked vane are computed once; all others are treated as moving."""
        return self.is_locked and not (self.has_true_masses or self.feed is not None or self.has_shape)

    @property
    def hands_chambers_on(self) -> bool:
        """True where the chambers are known as a step begins: once for all, or from the step before."""
        return self.keeps_volumes or self.walks

    def step_rows(self) -> dict[str, type]:
        """Groups of numbers that a phase of a step hands to the later ones, in order."""
        free = FreePart if self.leg is None else self.leg.begun
        begun = free if self.angle is None else (NoParameters if self.is_locked else PrescribedStep)
        gas = self.gas.begun(self) if self.feed is None else self.feed.begun(self)
        # In the order of declaration: plant, what the valve shows beside its openings, result.
        _, shown, _ = get_type_hints(self.valve.connect).values()
        return {
            **({} if self.leg is None else self.leg.led),
            **({"held": HeldChambers} if self.hands_chambers_on else {}),
            **({} if self.leg is None else self.leg.handed),
            "begun": begun,
            "flowing": SlopedFlows,
            "gas": gas,
            "passing": StageFlows,
            "shown": shown,
            **({"change": self.gas.change} if self.angle is None else {}),
            **({"slid": PartSlide, "moved": PartEnd} if self.angle is None and self.leg is None else {}),
            **({} if self.leg is None else self.leg.ended),
            **({"next_valve": self.valve.state} if self.is_parted else {}),
            **(
                {self.feed.stored[name]: row for name, row in self.feed.states.items()}
                if self.is_parted and self.feed is not None
                else {}
            ),
        }


def link_program(program: Program, collector: Collector) -> None:
    """Let a collector call what the components of a program have in the place of functions of the model.

    ProgramError for an effect that cannot act, or whose name other rows of the program have.
    """
    own = links_of(program.actuator)
    collector.links.update(own)
    if not program.effects:
        return
    # Names of rows without any effect: two effects that share a name are refused by the catalogue.
    bare = replace(program, effects=())
    taken = {*bare.parameter_rows(), *bare.state_rows(), *bare.step_rows()}
    for effect in program.effects:
        if taken & set(effect.rows):
            raise ProgramError(f"effect '{effect.name}': other rows of a program have this name; it needs another")
    link_effects(program.effects, collector, own)


def link_effects(effects: Sequence[Effect], collector: Collector, own: Mapping[Any, Any] | None = None) -> None:
    """Let a collector call the laws of effects at their ports, of which an actuator may have its ``own``.

    ProgramError for an effect that cannot act.
    """
    for effect in effects:
        problem = effect_problem(effect)
        if problem:
            raise ProgramError(f"effect '{effect.name}': {problem}")
    for key, stands in laws_in_order(effects).items():
        collector.links[key] = (own or {}).get(stands, stands)
    for effect in effects:
        for law in effect.laws.values():
            # By the names of its parameters: a law says itself which structs it needs.
            asked = law.__code__.co_varnames[: law.__code__.co_argcount]
            collector.effects[law] = tuple(row for row in effect.rows if row in asked)


class Composed(NamedTuple):
    """A function of the model as Python calls it with effects: before its own arguments it takes ``needed`` rows.

    ``of_columns`` is the same over columns of samples, None where it has no such form.
    """

    function: Callable[..., Any]
    needed: tuple[str, ...]
    of_columns: Callable[..., Any] | None


def composed_with(function: Callable[..., Any], effects: Sequence[Effect]) -> Composed | None:
    """Return a function of the model with the laws of effects in it; None where no effect acts in it."""
    if not effects:
        return None
    collector, composed = _composed_with(function, tuple(effects))
    if collector.made_from.is_current():
        return composed
    _composed_with.cache_clear()
    return _composed_with(function, tuple(effects))[1]


@lru_cache(maxsize=64)
def _composed_with(
    function: Callable[..., Any], effects: tuple[Effect, ...]
) -> tuple[SourceCollector, Composed | None]:
    collector = SourceCollector("")
    link_effects(effects, collector)
    name = collector.add(function)
    if name not in collector.needs:
        return collector, None
    scope: dict[str, Any] = {"math": math, "namedtuple": namedtuple}
    text = collector.text()
    # The composed text runs as plain Python: solvers and recordings call single functions, not programs.
    exec(text, scope)
    return collector, Composed(scope[name], tuple(collector.needs[name]), in_columns(text, name))


def python_place(
    place: Callable[..., Any], effects: Sequence[Effect], rows: Sequence[Any]
) -> Callable[..., Any] | None:
    """Return a port as Python calls it with effects and their parameters; None where no effect acts there.

    Before its own arguments it takes the states of effects by name. Any other function of the model will do too.
    """
    composed = composed_with(place, effects)
    if composed is None:
        return None
    given = {effect.name: row for effect, row in zip(effects, rows, strict=True)}

    def called(states: Mapping[str, Any], *own: float) -> Any:
        return composed.function(*((given | dict(states))[row] for row in composed.needed), *own)

    return called


def place_over_samples(
    place: Callable[..., Any], effects: Sequence[Effect], rows: Sequence[Any]
) -> Callable[..., Any] | None:
    """Return what ``python_place`` does, for states and arguments whose numbers are columns (samples,)."""
    composed = composed_with(place, effects)
    if composed is None:
        return None
    given = {effect.name: row for effect, row in zip(effects, rows, strict=True)}

    def called(states: Mapping[str, Any], *own: Any) -> Any:
        of_effects = ((given | dict(states))[row] for row in composed.needed)
        return called_over_samples(composed.function, composed.of_columns, *of_effects, *own)

    return called
