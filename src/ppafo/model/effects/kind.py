"""Declaration of a physical effect: settings, parameters, laws, state and texts in a single value.

Files, overrides, columns of studies, fits, exported libraries, the page, linear models, the reference solver and walks
use an effect by this value alone; none of them names an effect.
"""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.errors import ProgramError
from ppafo.model.declaration import PlainFunction, Quantity, quantities_of

SECTION = "effects"
"""Section of a parameter set with the settings of effects, and first part of their paths."""


class PlantSnapshot(NamedTuple):
    """State of the plant on which an effect depends: angle [rad], its rate [rad/s], absolute pressures [Pa].

    Flows [kg/s] from the supplies and to the atmosphere, and the valve command [-], 0 before the first step. For a
    completed step both snapshots contain the mean flows of the step.
    """

    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float
    supplied_flow: float = 0.0
    vented_flow: float = 0.0
    command: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """State of an effect: ``row``, a NamedTuple of floats, and its dynamics.

    ``start(row, now)`` makes the initial state from the effect's parameters and the plant at the start; None if the
    initial state is the defaults of ``row``. ``advance(row, state, before, after, step)`` returns the state after a
    step [s] between two snapshots. ``slopes(row, state, now)`` returns the rates in continuous time: the reference
    solver integrates them, and the second stage of a step uses ``state + step * slopes`` where a law acts on the gas.
    ``tolerances`` contains the permissible error of each number in one step, estimated by ``advance`` minus ``state +
    step * slopes``; without tolerances, as where ``advance`` is exact, the state limits no step. ``settle(row, state,
    command)`` returns the state after the instantaneous change at a new valve command: a step does this in ``advance``,
    the reference solver between two integration intervals.
    """

    row: type
    start: Callable[[Any, PlantSnapshot], Any] | None
    advance: Callable[[Any, Any, PlantSnapshot, PlantSnapshot, float], Any]
    slopes: Callable[[Any, Any, PlantSnapshot], Any]
    tolerances: tuple[float, ...] = ()
    settle: Callable[[Any, Any, float], Any] | None = None

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the numbers of ``row``."""
        row: Any = self.row
        return tuple(row._fields)


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """Physical effect: name in files, summary, settings in SI units, parameters, and laws.

    ``settings`` is a NamedTuple class that declares them, each an ``Annotated[float, Number(...)]``.

    ``switch`` names settings that are never below 0; if all of them are 0 the effect is off, and programs are composed
    without the effect, bit for bit as if it did not exist. An effect that is ``always`` on has no switch: its settings
    are numbers of every device, in a separate section of a parameter set.

    ``prepare(settings, device)`` makes the NamedTuple ``parameters`` from the settings and the numbers of the device
    (``device.gas``, ``.actuator``, ``.friction``, ``.foot_plate`` and ``.supply``, by their names in a parameter set).
    It must be in the compiled subset of Python, because an exported library has it in C. None if the parameters are the
    settings in order, which columns of an ensemble then fill without a call for each run.

    ``laws`` maps ports of ``ppafo.model.ports`` to the functions that act there. A law takes the arguments of its port,
    and its parameters in an additional argument with the name of the effect, which the caller of the port passes on. A
    law that calls its own port calls the law of the previous effect, or the port as it is without effects.

    ``state`` declares the dynamics of the effect's own state, which laws take as ``NAME_state``; None without a state.

    ``source`` is the source of law and numbers, ``equation`` is the line of the effect in the equations; ``symbols``
    are lines of the nomenclature: symbol, name in the code, unit, meaning.
    """

    name: str
    summary: str
    settings: type
    parameters: type
    prepare: Callable[[Any, Any], Any] | None
    switch: tuple[str, ...]
    laws: Mapping[PlainFunction, PlainFunction]
    source: str = ""
    equation: str = ""
    symbols: tuple[tuple[str, str, str, str], ...] = ()
    state: State | None = None
    section_of_files: str = ""
    always: bool = False

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that the settings declare."""
        return quantities_of(self.settings)

    @property
    def section(self) -> str:
        """Section of the settings in files and start of their paths; by default, in a parameter set."""
        return self.section_of_files or f"{SECTION}.{self.name}"

    @property
    def is_of_device(self) -> bool:
        """Return whether the settings belong to a parameter set, with the numbers of the device."""
        return not self.section_of_files

    @property
    def state_name(self) -> str:
        """Name of the state in a program, and of the parameter by which laws take it."""
        return f"{self.name}_state"

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the structs that the laws may take."""
        return (self.name,) if self.state is None else (self.name, self.state_name)

    def defaults(self) -> dict[str, float]:
        """Default settings [SI] of a device whose parameter set does not mention the effect."""
        return {item.name: float(item.default or 0.0) for item in self.quantities}

    def is_on(self, settings: Mapping[str, Any]) -> Any:
        """Return whether the effect is on with some settings; an array of truth values if some are arrays (runs,)."""
        found: Any = self.always
        for name in self.switch:
            # Not "or": settings may be columns of an ensemble.
            found = found | (settings[name] > 0.0)
        return found


def effect_problem(effect: Effect) -> str:
    """Describe the first fault in the declaration of an effect; empty if there is none."""
    return next(_problems(effect), "")


def _problems(effect: Effect) -> Iterator[str]:
    """Yield the faults in the declaration of an effect, each as a clause that follows the effect's name."""
    if not effect.name.isidentifier():
        yield "has a name that is not a Python identifier; laws take the parameters of the effect under this name"
    if effect.always and (effect.switch or effect.is_of_device):
        yield "is always on, so it must have no switch and must give section_of_files"
    if not effect.always:
        for item in effect.quantities:
            if item.default is None:
                yield f"'{item.name}' has no default; give a default with which the effect is off"
        # A switch below 0 would be on or off by its sign.
        lowest = {item.name: item.minimum for item in effect.quantities}
        if not effect.switch:
            yield "has no switch"
        for name in effect.switch:
            if lowest.get(name) != 0.0:
                yield f"switch names '{name}', which must be a quantity with minimum 0"
        if effect.is_on(effect.defaults()):
            yield "is on with its defaults; give defaults with which the effect is off"
    for port, law in effect.laws.items():
        given = _parameters(port)
        taken = [name for name in _parameters(law) if name not in effect.rows]
        if taken != given:
            yield f"{law.__name__}({', '.join(taken)}) must take the arguments of {port.__name__}: ({', '.join(given)})"


def laws_in_order(effects: Sequence[Effect]) -> dict[Any, Any]:
    """Return the law for each port, and for each pair of law and port the function that the law calls as its port.

    Effects act in the given order: each effect but the first at a port must call the port, otherwise it would disable
    the effects before it. Raises ProgramError if one does not.
    """
    found: dict[Any, Any] = {}
    last: dict[Any, Effect] = {}
    for effect in effects:
        for port, law in effect.laws.items():
            # A law calls its port by a global name of its own module, so that the names in its bytecode tell without a
            # run of it.
            if port in last and not any(law.__globals__.get(name) is port for name in law.__code__.co_names):
                raise ProgramError(
                    f"effects '{last[port].name}' and '{effect.name}' both act on {port.__name__}, but {law.__name__} "
                    f"of '{effect.name}' does not call {port.__name__}, so effect '{last[port].name}' would be lost; "
                    f"call {port.__name__} in {law.__name__}, or switch one of the two effects off"
                )
            # A law that calls its port gets what stood there before it.
            found[law, port] = found.get(port, port)
            found[port] = law
            last[port] = effect
    return found


def _parameters(function: PlainFunction) -> list[str]:
    return list(inspect.signature(function).parameters)
