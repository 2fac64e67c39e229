"""What the pieces of a program put in the place of functions of the model: the actuator's own, and laws of effects."""

import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ppafo.engine.program import Program
from ppafo.engine.scheme.actuators import links_of
from ppafo.engine.source_text import Collector, SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.effects.kind import Effect, effect_problem, laws_in_order


def link_program(program: Program, collector: Collector) -> None:
    """Let a collector call what the pieces of a program have in the place of functions of the model.

    ProgramError for an effect that cannot act, or whose name is that of other rows of the program.
    """
    own = links_of(program.actuator)
    collector.links.update(own)
    if not program.effects:
        return
    bare = replace(program, effects=())
    taken = {*bare.parameter_rows(), *bare.state_rows(), *bare.step_rows()}
    for effect in program.effects:
        if taken & set(effect.rows):
            raise ProgramError(f"effect '{effect.name}': other rows of a program have this name; it needs another")
    link_effects(program.effects, collector, own)


def link_effects(effects: Sequence[Effect], collector: Collector, own: Mapping[Any, Any] | None = None) -> None:
    """Let a collector call the laws of effects at their places, of which an actuator may have its ``own``.

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
            asked = law.__code__.co_varnames[: law.__code__.co_argcount]
            collector.effects[law] = tuple(row for row in effect.rows if row in asked)


def python_place(
    place: Callable[..., Any], effects: Sequence[Effect], rows: Sequence[Any]
) -> Callable[..., Any] | None:
    """Return a place as Python calls it with effects and their rows; None where no effect acts there.

    Before its own arguments it takes the states of effects by name.
    """
    if not any(place in effect.laws for effect in effects):
        return None
    given = {effect.name: row for effect, row in zip(effects, rows, strict=True)}
    collector = SourceCollector("")
    link_effects(effects, collector)
    name = collector.add(place)
    scope: dict[str, Any] = {"math": math, "namedtuple": namedtuple}
    exec(collector.text(), scope)
    composed, needed = scope[name], collector.needs[name]

    def called(states: Mapping[str, Any], *own: float) -> Any:
        return composed(*((given | dict(states))[row] for row in needed), *own)

    return called
