"""The valves, actuators and effects that a device can have. To add one: a module in their folder and one line here.

Those of other packages are found by an entry point.
"""

from collections.abc import Iterable

from ppafo.errors import KindError, one_line
from ppafo.kinds import Kinds
from ppafo.model.actuators import bladder, cylinder, muscle_pair, table, vane
from ppafo.model.actuators.kind import ActuatorKind
from ppafo.model.effects import (
    bandwidth,
    coil_heating,
    ice,
    leak_opening,
    line_resistance,
    restitution,
    seal_friction,
    silencer,
    spool_play,
    stribeck,
)
from ppafo.model.effects.kind import SECTION, Effect, effect_problem
from ppafo.model.valves import proportional, solenoid, solenoid_recycling
from ppafo.model.valves.kind import ValveKind

VALVES: Kinds[ValveKind] = Kinds(
    "ppafo.valves", "valve", ValveKind, (proportional.KIND, solenoid.KIND, solenoid_recycling.KIND)
)


ACTUATORS: Kinds[ActuatorKind] = Kinds(
    "ppafo.actuators", "actuator", ActuatorKind, (vane.KIND, cylinder.KIND, muscle_pair.KIND, bladder.KIND, table.KIND)
)


_OWN = (
    restitution.EFFECT,
    line_resistance.EFFECT,
    silencer.EFFECT,
    ice.EFFECT,
    leak_opening.EFFECT,
    spool_play.EFFECT,
    coil_heating.EFFECT,
    seal_friction.EFFECT,
    stribeck.EFFECT,
    bandwidth.EFFECT,
)
EFFECTS: Kinds[Effect] = Kinds("ppafo.effects", "effect", Effect, _OWN)


def find_effects(paths: Iterable[str]) -> None:
    """Load the effects that some paths name, where they are those of other packages.

    KindError for one that is there and cannot be used.
    """
    for path in paths:
        section, _, rest = path.partition(".")
        name = rest.partition(".")[0]
        if section == SECTION and name and name not in tuple(EFFECTS):
            effect = EFFECTS.get(name)
            problem = "" if effect is None else effect_problem(effect)
            if problem:
                del EFFECTS[name]
                raise KindError(f"effect '{one_line(name)}': {problem}")


def ordered_effects() -> tuple[Effect, ...]:
    """Return all effects that are loaded, in the order in which they act: those of the package, then by name."""
    others = sorted((effect for effect in EFFECTS.values() if effect not in _OWN), key=lambda effect: effect.name)
    return (*_OWN, *others)


def device_effects() -> tuple[Effect, ...]:
    """Return the effects whose settings stand in parameter sets, in the order in which they act."""
    return tuple(effect for effect in ordered_effects() if effect.is_of_device)
