"""Linking of effect laws to their ports, and of an actuator's chambers to the observer of a walk."""

from collections.abc import Sequence
from dataclasses import replace

from ppafo.engine.definitions import place_of
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.effects.kind import Effect, effect_problem, laws_in_order
from ppafo.model.plant import PlantParameters, net_torque
from ppafo.model.valves.kind import valve_problem


def link_program(program: Program, collector: SourceCollector) -> None:
    """Register the functions with which the components of a program replace functions of the model.

    Raises ProgramError for an effect that cannot act, or whose name is already used by other rows of the program.
    """
    problem = valve_problem(program.valve)
    if problem:
        raise ProgramError(f"{place_of(program.valve.connect)}: {problem}")
    # What friction or a stop may hold is decided elsewhere, where a spring in the sum alone would be missed.
    at_rest = [net_torque(0.0, 0.0, 0.0, angle, 0.0) for angle in (1.0, 1.5)]
    if any(at_rest):
        raise ProgramError(
            f"{place_of(net_torque)}: net_torque takes {-max(at_rest, key=abs):.4g} N m of a joint at rest, which "
            "friction would not hold; let load_torque of ppafo.model.ports take it"
        )
    if program.actuator.plant is not PlantParameters:
        collector.links[PlantParameters, "_replace"] = program.actuator.plant
    if program.walks and not program.has_vane:
        from ppafo.engine.scheme.believed import chambers_of_observer  # most devices walk on no leg

        volumes = chambers_of_observer(program.functions)
        collector.links.update(volumes)
        collector.effects.update(dict.fromkeys(volumes.values(), ("plant",)))
    if not program.effects:
        return
    # Names of rows without any effect: two effects that share a name are refused by the catalogue.
    bare = replace(program, effects=())
    taken = {*bare.parameter_rows(), *bare.state_rows(), *bare.step_rows()}
    for effect in program.effects:
        if taken & set(effect.rows):
            raise ProgramError(f"effect '{effect.name}': other rows of a program have this name; it needs another")
    link_effects(program.effects, collector)


def link_effects(effects: Sequence[Effect], collector: SourceCollector) -> None:
    """Register the laws of effects at their ports. ProgramError for an effect that cannot act."""
    for effect in effects:
        problem = effect_problem(effect)
        if problem:
            raise ProgramError(f"effect '{effect.name}': {problem}")
    collector.links.update(laws_in_order(effects))
    for effect in effects:
        for law in effect.laws.values():
            # By the names of its parameters: a law says itself which structs it needs.
            asked = law.__code__.co_varnames[: law.__code__.co_argcount]
            collector.effects[law] = tuple(row for row in effect.rows if row in asked)
