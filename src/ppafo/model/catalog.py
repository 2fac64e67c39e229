"""Valves, actuators and effects that a device can have. To add one: a module in their folder and one line here.

Kinds of other packages are found by their entry points.
"""

from collections.abc import Iterable

from ppafo.errors import KindError
from ppafo.kinds import Kinds
from ppafo.model.actuators.kind import ActuatorKind
from ppafo.model.effects import bandwidth, restitution
from ppafo.model.effects.kind import SECTION, Effect
from ppafo.model.valves.kind import ValveKind
from ppafo.wording import one_line

VALVES: Kinds[ValveKind] = Kinds(
    "ppafo.valves",
    "valve",
    ValveKind,
    {
        "proportional": "ppafo.model.valves.proportional:KIND",
        "solenoid": "ppafo.model.valves.solenoid:KIND",
        "pressure_regulator": "ppafo.model.valves.pressure_regulator:KIND",
    },
)


ACTUATORS: Kinds[ActuatorKind] = Kinds(
    "ppafo.actuators",
    "actuator",
    ActuatorKind,
    {
        "vane": "ppafo.model.actuators.vane:KIND",
        "cylinder": "ppafo.model.actuators.cylinder:KIND",
        "table": "ppafo.model.actuators.table:KIND",
    },
)


EFFECTS: Kinds[Effect] = Kinds(
    "ppafo.effects",
    "effect",
    Effect,
    {
        "restitution": restitution.EFFECT,
        "line_resistance": "ppafo.model.effects.line_resistance:EFFECT",
        "laminar_leak": "ppafo.model.effects.laminar_leak:EFFECT",
        "joint_load": "ppafo.model.effects.joint_load:EFFECT",
        "seal_friction": "ppafo.model.effects.seal_friction:EFFECT",
        "stribeck": "ppafo.model.effects.stribeck:EFFECT",
        "opening": "ppafo.model.effects.opening:EFFECT",
        "bandwidth": bandwidth.EFFECT,
    },
    of_modules=False,
)
"""Effects by name. An effect with settings in another part's section is loaded at the start, as no path names it."""


def find_effects(paths: Iterable[str]) -> None:
    """Load the effects named by some paths, also from other packages.

    Raises KindError for an effect that exists but cannot be used.
    """
    for path in paths:
        section, _, rest = path.partition(".")
        name = rest.partition(".")[0]
        if section == SECTION and ":" in name:
            raise KindError(f"effect '{one_line(name)}': an effect is found by its entry point 'ppafo.effects' alone")
        if section == SECTION:
            EFFECTS.get(name)


def ordered_effects() -> tuple[Effect, ...]:
    """Return all loaded effects in the order in which they act: the package's own first, then by name."""
    loaded = EFFECTS.loaded()
    # Entry points come in no order: sorted, a composed program has the same bits on every computer.
    others = sorted((effect for name, effect in loaded.items() if not EFFECTS.is_own(name)), key=lambda item: item.name)
    return (*(effect for name, effect in loaded.items() if EFFECTS.is_own(name)), *others)


def device_effects() -> tuple[Effect, ...]:
    """Return the effects whose settings are in parameter sets, in the order in which they act."""
    return tuple(effect for effect in ordered_effects() if effect.is_of_device)
