"""Declaration of a valve: settings, and its functions for the time stepping and for the reference solver.

A command is from -1 to 1, as in equation (8); one further value, ``VENT``, stands for free motion.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_args, get_type_hints

from ppafo.model.declaration import PlainFunction, Quantity, quantities_of
from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import Openings, PlantParameters, PortFlow, PortSlopes

# Beyond full opening, so that one number says both, and no rounding of -1 to 1 comes near it.
VENT = 2.0
"""Command that vents both chambers: solenoids off; a proportional valve needs a vent valve for this command."""

# Half-way between full opening and VENT: either may pass through sums of floats.
VENTS_ABOVE = 1.5
"""Commands above this value vent."""


@dataclass(frozen=True, slots=True)
class ValveModel:
    """Functions of a valve for the time stepping and for the reference solver.

    ``parameters`` and ``state`` are NamedTuple classes of floats. ``prepare(settings)`` makes the parameters from the
    declared settings; a run begins with the defaults of the state. ``advance(parameters, state, command, time, step)``
    returns the valve output during the step, and the next state. ``connect(plant, shown)`` converts the output, of the
    class with which ``shown`` is annotated, to the ports of both chambers; ``port_flow`` is the flow through one.
    ``jumps`` is True for a valve that switches by itself within a step, as given by ``next_event`` and ``settle``: the
    step is then divided at the switching times. ``shift(state, next_state)`` is the relative change of the opening of a
    valve that moves within a step, None for a valve that stands still between two switchings.
    ``command_delay(settings)`` is the dead time [s] before a command reaches the valve.

    The reference solver uses the same valve in continuous time: ``instant(parameters, state, command)`` returns the
    openings at an instant, ``rates(parameters, state, command)`` the time derivatives of the state,
    ``next_event(parameters, state, command, time)`` the time of the next abrupt change (1e9 or more for never), and
    ``settle(parameters, state, command, time)`` the state after the abrupt changes that are due. ``instant`` and
    ``rates`` are None for a valve that regulates pressures, whose openings follow from these.

    Such a valve has ``connect_ahead(plant, shown)``, the ports at the second stage of a step, and ``command_for(
    parameters, opening, pressure_1, pressure_2)``, the command [-] at which it changes the measured pressures [Pa] as
    the opening [-] wanted by a law would; None for others. ``holding(parameters, command, pressure_1, pressure_2)`` is
    the state in which it holds these pressures [Pa] under a command [-], for a recording that begins in operation; None
    for a valve whose state follows from a command that has stood long enough.
    """

    parameters: type
    state: type
    prepare: Callable[[Any], Any]
    advance: Callable[[Any, Any, float, float, float], tuple[Any, Any]]
    connect: PlainFunction
    port_flow: Callable[[float, Any, FlowCurve], tuple[PortFlow, PortSlopes]]
    jumps: bool
    shift: Callable[[Any, Any], float] | None
    command_delay: Callable[[Any], float]
    instant: Callable[[Any, Any, float], Openings] | None
    rates: Callable[[Any, Any, float], Any] | None
    next_event: Callable[[Any, Any, float, float], float]
    settle: Callable[[Any, Any, float, float], Any]
    connect_ahead: Callable[[PlantParameters, Any], tuple[Any, Any]] | None = None
    command_for: Callable[[Any, float, float, float], float] | None = None
    holding: Callable[[Any, float, float, float], Any] | None = None

    @property
    def regulates(self) -> bool:
        """True for a valve whose command is a set pressure: its openings follow the pressures in the chambers."""
        return self.command_for is not None

    @property
    def shown(self) -> Any:
        """Class of the output, a float or a NamedTuple, as ``connect`` takes it; None if that is not annotated."""
        return get_type_hints(self.connect).get(self.connect.__code__.co_varnames[1])


def valve_problem(valve: ValveModel) -> str:
    """Describe a state without defaults, or an output whose class is not known, or another; empty without a fault."""
    if not isinstance(valve, ValveModel):
        return f"choose(settings) must return a ValveModel, not {valve!r}"
    if not callable(valve.next_event) or not isinstance(valve.jumps, bool):
        return f"next_event must be a function and jumps a bool, not {valve.next_event!r} and {valve.jumps!r}"
    without = [name for name in valve.state._fields if name not in valve.state._field_defaults]  # type: ignore[attr-defined]
    if without:
        return (
            f"a run begins with the defaults of its state: give those of {valve.state.__name__}: {', '.join(without)}"
        )
    shown = valve.shown
    connect = valve.connect.__name__
    if not (shown is float or hasattr(shown, "_fields")):
        return f"{connect}: annotate its second parameter with the class of the output, float or a NamedTuple"
    given = (*get_args(get_type_hints(valve.advance).get("return")), None)[0]
    if given in (shown, Any, None):
        return ""
    return f"{connect} takes a {shown.__name__}, but advance returns a {getattr(given, '__name__', given)}"


@dataclass(frozen=True, slots=True)
class ValveKind:
    """Valve in the catalogue: name, summary, settings besides the orifice's, and models.

    ``settings`` is a NamedTuple class that declares the settings, each an ``Annotated[float, Number(...)]``.

    ``lag(settings)`` is the time [s] after which the flow has followed a command, None if this is the dead time.

    ``vents_at_rest`` is True for a valve that connects both chambers to the atmosphere at a command of 0, at which
    others are closed.

    ``regulation(settings)`` is the change of a pressure per command [Pa], the deviation that opens the valve fully
    [Pa], and the time constant of the set pressure [s], of a valve that regulates pressures; None for others.

    ``choose(settings)`` returns the simplest model that is exact for the settings. It may only distinguish settings
    that are 0: runs of an ensemble with zeros in the same settings share one model.
    """

    name: str
    summary: str
    settings: type
    choose: Callable[[Any], ValveModel]
    lag: Callable[[Any], float] | None = None
    vents_at_rest: bool = False
    regulation: Callable[[Any], tuple[float, float, float]] | None = None

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that the settings declare."""
        return quantities_of(self.settings)


def never(valve: Any, state: Any, command: float, time: float) -> float:
    """Time [s] of the next event of a valve that changes with its command only: never between two commands."""
    return math.inf
