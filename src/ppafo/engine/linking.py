"""Linking of effect laws to their ports."""

from collections.abc import Sequence
from dataclasses import replace

from ppafo.engine.definitions import place_of
from ppafo.engine.program import Program
from ppafo.engine.source_text import Replacements
from ppafo.errors import ProgramError
from ppafo.model.effects.kind import Effect, laws_in_order
from ppafo.model.plant import PlantParameters, net_torque, viscous_torque
from ppafo.model.ports import exhaust_path, supply_path

TEST_ANGLES = (1.0, 1.5)
"""Angles [rad] at which the torque on a joint at rest is tested; a spring is relaxed at one of them at most."""


def link_program(program: Program, replacements: Replacements) -> None:
    """Add the functions with which the components of a program replace functions of the model.

    Raises ProgramError for an effect that cannot act, or whose name is already used by other rows of the program.
    """
    for path in (supply_path, exhaust_path):
        closed = path(0.0)
        if closed != 0.0:
            raise ProgramError(f"{place_of(path)}: {path.__name__} of a closed valve is {closed:.4g} kg/(s Pa), not 0")
    # Friction and stops balance ``load_torque`` alone at rest: a spring missing there would move a joint at rest.
    at_rest = [net_torque(0.0, 0.0, 0.0, 0.0, angle, 0.0) for angle in TEST_ANGLES]
    for function, torque in ((viscous_torque, viscous_torque(0.0, 0.0)), (net_torque, -max(at_rest, key=abs))):
        if torque != 0.0:
            raise ProgramError(
                f"{place_of(function)}: {function.__name__} subtracts {torque:.4g} N m at rest, which friction "
                "does not balance; subtract this torque in load_torque of ppafo.model.ports"
            )
    if program.actuator.plant is not PlantParameters:
        replacements.constructed[PlantParameters] = program.actuator.plant
    if not program.effects:
        return
    # Two effects that share a name are refused by the catalogue: here an effect and another component.
    without_effects = replace(program, effects=())
    used_names = {*without_effects.parameter_rows(), *without_effects.state_rows(), *without_effects.step_rows()}
    for effect in program.effects:
        if used_names & set(effect.rows):
            raise ProgramError(
                f"effect '{effect.name}': a component of the program already has this name; rename the effect"
            )
    link_effects(program.effects, replacements)


def link_effects(effects: Sequence[Effect], replacements: Replacements) -> None:
    """Add the laws of effects at their ports. ProgramError for an effect that cannot act."""
    for port, law in laws_in_order(effects).items():
        # A law and its port name the function that the law calls as its port.
        (replacements.inside if isinstance(port, tuple) else replacements.everywhere)[port] = law
    for effect in effects:
        for law in effect.laws.values():
            parameters = law.__code__.co_varnames[: law.__code__.co_argcount]
            replacements.rows[law] = tuple(row for row in effect.rows if row in parameters)
