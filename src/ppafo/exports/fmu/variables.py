"""The variables of a unit: the settings of the scenario, what it gives at each sample, metrics, and inputs."""

from dataclasses import dataclass

from ppafo.exports.c_library.files import OUTPUTS, Library, Setting

FIXED_SECTIONS = ("run", "initial", "gas", "actuator", "foot_plate", "wearer", "motion", "motion.profile")
"""Settings that the start of a run is made of: they cannot change under way."""
FIXED_NAMES = ("period", "delay", "seed")
"""So cannot these, which count steps or begin the noise."""
TUNABLE_OF_WEARER = ("residual_share", "ankle_stiffness", "ankle_rest_angle", "ankle_damping")
"""Of the wearer these may: what a leg weighs stays."""
STEPPED = ("command", "reference", "strides", "contact", "controller_phase", "safe_state")
"""Outputs that jump from sample to sample."""


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable of a unit: name, number, unit and meaning; ``causality`` and ``variability`` in words of FMI.

    ``start`` None is calculated, limits None are none.
    """

    name: str
    number: int
    unit: str
    summary: str
    causality: str
    variability: str
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True, slots=True)
class Input:
    """What a unit is given at each step: name, unit, meaning and first value."""

    name: str
    unit: str
    summary: str
    start: float


@dataclass(frozen=True, slots=True)
class Interface:
    """What a unit shows of a library: inputs, outputs, metrics, settings that are none of its variables.

    ``template`` has the C that moves it on, ``words`` what is filled in there. ``time`` says for people how it goes
    on, ``tuning`` when a changed parameter is taken. ``step`` is the communication step that it takes by default [s],
    ``is_step_fixed`` true where others must be multiples of it. ``clock`` is what the clock of the controller says.
    """

    name: str
    library: Library
    template: str
    time: str
    tuning: str
    step: float
    duration: float
    outputs: tuple[str, ...]
    shows_metrics: bool
    is_step_fixed: bool
    clock: str | None
    hidden: frozenset[str]
    inputs: tuple[Input, ...]
    words: dict[str, str]


def change_of(interface: Interface, setting: Setting) -> str:
    """``h`` for a setting that is no variable, ``t`` for one that may change under way, else ``f``."""
    if setting.path in interface.hidden:
        return "h"
    section, _, name = setting.path.rpartition(".")
    if section == "wearer" and name in TUNABLE_OF_WEARER:
        return "t"
    return "f" if section in FIXED_SECTIONS or name in FIXED_NAMES else "t"


def variables_of(interface: Interface) -> tuple[Variable, ...]:
    """All variables, in the order of their numbers, which are those of the C."""
    library = interface.library
    first_metric = len(library.settings) + len(library.program.outputs)
    first_input = first_metric + len(library.program.metrics)
    return (
        *_parameters(interface),
        *(
            Variable(name, len(library.settings) + place, *OUTPUTS[name], "output", variability_of(name))
            for place, name in enumerate(library.program.outputs)
            if name in interface.outputs
        ),
        *(
            Variable(f"metrics.{kind.name}", first_metric + place, kind.unit, kind.summary, "local", "continuous")
            for place, kind in enumerate(library.program.metrics if interface.shows_metrics else ())
        ),
        *(
            Variable(item.name, first_input + place, item.unit, item.summary, "input", "continuous", item.start)
            for place, item in enumerate(interface.inputs)
        ),
    )


def variability_of(name: str) -> str:
    """Whether an output jumps, ``discrete``, or goes on, ``continuous``."""
    return "discrete" if name in STEPPED else "continuous"


def _parameters(interface: Interface) -> list[Variable]:
    found = []
    for number, item in enumerate(interface.library.settings):
        change, quantity = change_of(interface, item), item.quantity
        if change == "h":
            continue
        low, high = (limit if abs(limit) < 1e308 else None for limit in (quantity.minimum, quantity.maximum))
        said = quantity.summary or quantity.name
        kind = "tunable" if change == "t" else "fixed"
        found.append(Variable(item.path, number, quantity.unit, said, "parameter", kind, item.value, low, high))
    return found
