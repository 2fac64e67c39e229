"""Declarations of controllers and profiles, and device numbers that the defaults of their settings may follow."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

from ppafo.model.columns import Problem
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Quantity

OPEN_LOOP = "constant"
"""The controller that follows no reference: its recordings have none, so that no tracking error is made of it."""

VALVE_LAG, VALVE_DELAY = "lag of the valve", "dead time of the valve"
PRESSURE_LAG, FORCE_LAG = "lag of the pressure sensors", "lag of the force sensors"
"""Sensor lags that the default of a setting may follow, where a device has them: names for ``Quantity.follows``."""


def nominal_term(name: str) -> str:
    """Term that the default of a model-based law's setting may follow: a number of the device, by its name there.

    ``simulation.nominal`` gives each its value.
    """
    return f"nominal {name.replace('_', ' ')}"


DEAD_BAND = Quantity(
    "dead_band",
    "",
    "believed smallest command that opens the valve",
    None,
    0.0,
    0.99,
    follows=(nominal_term("dead_band"),),
)
BelievedBand = Annotated[float, DEAD_BAND]
"""Setting of a law that opens the valve beyond its dead band, by ``control.torque_loop.beyond_dead_band``."""

Plan = Callable[[Mapping[str, Any], Any, Any, tuple[Any, Any]], tuple[dict[str, Any], tuple[Problem, ...]]]
"""Function that computes the numbers of a law from its settings."""


@dataclass(frozen=True, slots=True)
class ControllerKind:
    """A controller in the catalogue.

    ``parameters`` is a NamedTuple class whose numbers, nested ones in their place, are the quantities in
    order; ``initial`` is the start of the state, a NamedTuple of floats or of further ones. ``update(parameters, state,
    reference, measurement, period)`` returns the command from -1 to 1 and the next state, once every ``period`` [s].
    At a command of 0 a proportional valve is closed and both chambers keep their gas; a solenoid pair vents both.

    ``restart(state, requested, continues)`` is the state of a torque law while a task of a gait goes on (1) and where
    another one begins (0), at a requested torque [N m]; without it the law begins anew there. A law that
    ``only_switches`` asks for full openings or none, so that it fits a pair of solenoid valves in walking. One without
    ``needs_reference`` never looks at the reference, so that a scenario may be without one.

    ``controls`` names what it can follow a reference of, in ``model.controlled.CONTROLLED``. One that controls more
    than a torque has ``*, parts: ErrorFunctions = OF_TORQUE`` of there as the last parameter of ``update``, acts on
    ``seen_error`` or ``seen_value`` alone, to which it hands them, and its settings in N m are in the unit of what is
    controlled. Where the supplies are vacuums a command above 0 lowers the torque: these, and one of the angle by
    ``parts.steered``, then turn round, and laws of a torque alone are refused.

    A law with a ``plan`` has other numbers than its settings: ``plan(settings, period, torque_constant, reference)``
    makes them, by name, from settings in SI units, a period [s], the device's torque constant [N m/Pa] and the lowest
    and highest reference [N m], each of which may be an array (runs,), and says what may be wrong with them.
    """

    name: str
    summary: str
    source: str
    quantities: tuple[Quantity, ...]
    parameters: type
    initial: Any
    update: Callable[..., tuple[Any, Any]]
    restart: Callable[[Any, float, float], Any] | None = None
    only_switches: bool = False
    needs_reference: bool = True
    plan: Plan | None = None
    controls: tuple[str, ...] = (TORQUE,)


@dataclass(frozen=True, slots=True)
class ProfileKind:
    """A function of time in the catalogue, for a reference or a prescribed angle.

    ``parameters`` is a NamedTuple class whose fields are the quantities in order; ``value(parameters, time)`` returns
    value, rate and second derivative at a time [s]; ``bounds(parameters)`` the lowest and highest value of all time.
    A quantity with unit ``""`` takes the unit of what is prescribed; those among ``differences`` are differences of two
    values of it, as an amplitude is. A profile that ``is_monotone`` only rises, only
    falls or rests, so that both ends of a stretch of time have its extremes. One that ``is_smooth`` has no corners, at
    which a foot on a shank that moves so would be struck. ``until_jump(parameters, time)`` is the time [s], above 0,
    until the second derivative of a smooth one jumps; None where it never does.
    """

    name: str
    summary: str
    quantities: tuple[Quantity, ...]
    parameters: type
    value: Callable[[Any, float], Any]
    bounds: Callable[[Any], tuple[float, float]]
    differences: tuple[str, ...] = ()
    is_monotone: bool = False
    is_smooth: bool = False
    until_jump: Callable[[Any, float], float] | None = None


class PythonController(Protocol):
    """Any Python object can control: it is asked sample by sample."""

    def reset(self) -> None:
        """Forget everything; called once before the run."""

    def update(self, time: float, reference: float, measurement: Any) -> float:
        """Return the command from -1 to 1 at a time [s], for a reference and a ``Measurement``.

        The reference is a torque [N m], or what else ``reference.of`` names: an angle [rad] or a pressure [Pa].

        In a walk it is a ``GaitMeasurement`` with the forces under heel and toes, the reference is 0, and
        ``model.command.VENT`` is a command too: it joins both chambers to the atmosphere.

        Above 0 chamber 1 is joined to the supply and chamber 2 to the atmosphere, below 0 the other way round. At 0 a
        proportional valve is closed and both chambers hold their gas; a solenoid pair vents both.
        """
