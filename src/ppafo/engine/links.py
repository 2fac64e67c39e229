"""What the pieces of a program put in the place of functions of the model: the actuator's own, and laws of effects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ppafo.engine.program import Program
from ppafo.engine.scheme.shaped_gas import links_of
from ppafo.engine.source_text import Collector
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
        if effect.name in taken:
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
        collector.effects.update(dict.fromkeys(effect.laws.values(), (effect.name,)))
