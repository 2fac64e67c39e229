"""Declarations of controllers and profiles, and device properties from which their settings may take defaults."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

from ppafo.model.columns import Problem
from ppafo.model.controlled import TORQUE
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import GaitMeasurement

OPEN_LOOP = "constant"
"""Name of the controller without a reference: its recordings have no reference, and so no tracking error."""


DEAD_BAND = Quantity(
    "dead_band",
    "",
    "believed smallest command that opens the valve",
    None,
    0.0,
    0.99,
    follows="dead_band",
)
BelievedBand = Annotated[float, DEAD_BAND]
"""Dead band of the valve [-] that a law compensates, by ``control.torque_loop.beyond_dead_band``."""

Plan = Callable[[Mapping[str, Any], Any, Any, tuple[Any, Any]], tuple[dict[str, Any], tuple[Problem, ...]]]
"""Function that computes the parameters of a law from its settings."""


@dataclass(frozen=True, slots=True)
class ControllerKind:
    """Controller in the catalogue.

    ``parameters`` is a NamedTuple class whose numbers, with nested NamedTuples flattened, are the ``quantities`` in
    order; ``initial`` is the initial state, a NamedTuple of floats or of NamedTuples. ``update(parameters, state,
    reference, measurement, period)`` returns the command from -1 to 1 and the next state, once every ``period`` [s].
    At a command of 0 a proportional valve is closed and both chambers keep their gas; a solenoid pair vents both.

    ``restart(state, requested, continues)`` returns the state of a torque law at a sample of a gait, given the
    requested torque [N m]: ``continues`` is 1 within a task and 0 where a new task starts. A law without ``restart`` is
    reset at a new task. ``only_switches`` is True for a law whose commands are full openings or 0, as a pair of
    solenoid valves needs in walking. ``needs_reference`` is False for a law that does not use the reference; a scenario
    may then omit it.

    ``controls`` names the quantities that the law can control, as in ``model.controlled.CONTROLLED``. A law that
    controls more than a torque has ``*, parts: ErrorFunctions = OF_TORQUE`` as the last parameter of ``update``, passes
    ``parts`` to ``seen_error`` or ``seen_value`` and uses no other measured value; settings in N m then have the unit
    of the controlled quantity. With vacuum supplies a command above 0 lowers the torque: ``parts.steered`` then changes
    the sign of the error, and laws of a torque alone are refused.

    ``plan`` computes the parameters of a law whose parameters differ from its settings:
    ``plan(settings, period, torque_constant, reference)`` takes settings in SI units, a period [s], the device's torque
    constant [N m/Pa] and the lowest and highest reference [N m], each of which may be an array (runs,). It returns the
    parameters by name and the problems of the settings.
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


def reads_gait(update: Callable[..., Any]) -> bool:
    """Tell whether a law detects gait phases: whether its ``update`` annotates a ``GaitMeasurement``."""
    annotated = getattr(update, "__annotations__", {}).get("measurement")
    return annotated in (GaitMeasurement, GaitMeasurement.__name__)


def unbounded(_parameters: Any) -> tuple[float, float]:
    """Infinite bounds, for a profile that follows a recording and has unknown extremes."""
    return -math.inf, math.inf


@dataclass(frozen=True, slots=True)
class ProfileKind:
    """Function of time in the catalogue, for a reference or a prescribed angle.

    ``parameters`` is a NamedTuple class whose fields are the quantities in order; ``value(parameters, time)`` returns
    value, rate and second derivative at a time [s]; ``bounds(parameters)`` returns the lowest and highest value over
    all times. A quantity with unit ``""`` takes the unit of the prescribed quantity. ``differences`` names the
    quantities that are differences of two values, such as an amplitude. ``is_monotone`` is True for a profile that only
    rises, only falls or is constant, so that its extremes over an interval are at both ends. ``is_smooth`` is True for
    a profile without corners: a corner in the motion of the shank would be an impact on the foot.
    ``until_jump(parameters, time)`` returns the time [s], above 0, until the next jump of the second derivative of a
    smooth profile; None without jumps. ``period(parameters)`` returns the period [s]; None without one.
    """

    name: str
    summary: str
    quantities: tuple[Quantity, ...]
    parameters: type
    value: Callable[[Any, float], Any]
    bounds: Callable[[Any], tuple[float, float]] = unbounded
    differences: tuple[str, ...] = ()
    is_monotone: bool = False
    is_smooth: bool = False
    until_jump: Callable[[Any, float], float] | None = None
    period: Callable[[Any], float] | None = None

    @property
    def is_wave(self) -> bool:
        """True for a wave without knots, of which no stretch is straight."""
        return self.is_smooth and not self.is_monotone and self.until_jump is None


class PythonController(Protocol):
    """Controller in Python, as any object with these methods; it is called once per sample."""

    def reset(self) -> None:
        """Reset the controller; called once before the run."""

    def update(self, time: float, reference: float, measurement: Any) -> float:
        """Return the command from -1 to 1 at a time [s], for a reference and a ``Measurement``.

        The reference is a torque [N m], or the quantity named by ``reference.of``: an angle [rad] or a pressure [Pa].

        In a walk the measurement is a ``GaitMeasurement`` with the forces under heel and toes, and the reference is the
        torque that the controller of the scenario requests, 0 if it requests none. As a compiled torque law, the object
        is reset where another task starts, and both chambers are vented where no torque is requested. An ``update``
        that annotates its measurement as ``GaitMeasurement`` is in charge of the whole gait: it is reset only once, and
        its commands are used as they are; ``VENT`` (2) is one, which vents both chambers.

        A command above 0 connects chamber 1 to the supply and chamber 2 to the atmosphere, a command below 0 the
        reverse. At 0 a proportional valve is closed and both chambers keep their gas; a solenoid pair vents both.
        """
