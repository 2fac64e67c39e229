"""Laws that open the valve by a fixed amount: always, by the sign of the error (equation 14), or beyond a dead zone."""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import DEAD_ZONE, OPENING, RELEASE
from ppafo.model.controlled import ANYTHING, OF_TORQUE, ErrorFunctions, seen_error
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.sensors import Measurement


class ConstantParameters(NamedTuple):
    """Setting of a law that gives one command [-] from -1 to 1 all the time."""

    command: Annotated[float, Number("", "command, above 0 feeds chamber 1", 1.0, -1.0, 1.0)]


class ConstantState(NamedTuple):
    """A constant command remembers nothing."""


def constant_update(
    parameters: ConstantParameters, state: ConstantState, reference: float, measurement: Measurement, period: float
) -> tuple[float, ConstantState]:
    """Command [-] from -1 to 1, which is the setting whatever is measured, and the state."""
    return parameters.command, state


CONSTANT = ControllerKind(
    name="constant",
    summary="The same command from beginning to end.",
    source="the paper, section on model validation: valve fully open",
    quantities=quantities_of(ConstantParameters),
    parameters=ConstantParameters,
    initial=ConstantState(),
    update=constant_update,
    needs_reference=False,
)


class OrderedParameters(NamedTuple):
    """Orders [-] from outside: the command, and the assistance level, from 0 to 3; at 3 a shut-off valve shuts."""

    command: Annotated[float, Number("", "command, above 0 feeds chamber 1", 1.0, -1.0, 2.0)]
    safe_state: Annotated[float, Number("", "assistance level, 3 has stopped", 0.0, 0.0, 3.0)]


class Help(NamedTuple):
    """Level of help, where the safety of a controller of walking has it."""

    level: float


class OrderedState(NamedTuple):
    """State of a controller whose assistance level is set from outside."""

    safety: Help


def ordered_update(
    parameters: OrderedParameters, state: OrderedState, reference: float, measurement: Measurement, period: float
) -> tuple[float, OrderedState]:
    """Command [-] and state, which are what was ordered whatever is measured."""
    return parameters.command, OrderedState(Help(parameters.safe_state))


ORDERED = ControllerKind(
    name="ordered",
    summary="Command and assistance level from outside, for a plant whose shut-off valve follows the level.",
    source="chosen here",
    quantities=quantities_of(OrderedParameters),
    parameters=OrderedParameters,
    initial=OrderedState(Help(0.0)),
    update=ordered_update,
    needs_reference=False,
)


ROUNDING = 1.0e-9
"""N m: an error this small counts as zero, so that rounding does not decide the first command."""


class OnOffParameters(NamedTuple):
    """The law has no parameters; the paper has no dead zone."""


class OnOffState(NamedTuple):
    """On/off switching with a dead zone remembers nothing."""


def on_off_update(
    parameters: OnOffParameters,
    state: OnOffState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, OnOffState]:
    """Command: 1 (valve A) where the error [N m] is 0 or more, else -1 (valve B). Equation (14)."""
    error = seen_error(reference, measurement, parts=parts)
    return (1.0 if error >= -ROUNDING else -1.0), state


ON_OFF = ControllerKind(
    name="on_off",
    summary="Valve A where the torque is below the reference, valve B where it is above.",
    source="the paper, equation (14)",
    quantities=(),
    parameters=OnOffParameters,
    initial=OnOffState(),
    update=on_off_update,
    controls=ANYTHING,
    only_switches=True,
)


class OnOffDeadZoneParameters(NamedTuple):
    """Errors at which the valve opens and at which it closes again [N m]; command while it is open [-]."""

    dead_zone: Annotated[float, Number("N m", "error at which the valve opens", None, 0.0, 100.0, follows=(DEAD_ZONE,))]
    release: Annotated[
        float,
        Number("N m", "error at which it closes again; the dead zone at most", None, 0.0, 100.0, follows=(RELEASE,)),
    ]
    opening: Annotated[float, Number("", "command while it is open", None, 0.0, 1.0, follows=(OPENING,))]


class OnOffDeadZoneState(NamedTuple):
    """Direction in which the valve is open: 1, 0 or -1."""

    direction: float


def dead_zone_update(
    parameters: OnOffDeadZoneParameters,
    state: OnOffDeadZoneState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, OnOffDeadZoneState]:
    """Command: the opening, towards the reference, beyond the dead zone of the error [N m]; 0 inside.

    Once open, the valve stays so until the error is below ``release``. 0 closes a proportional valve and vents both
    chambers of a solenoid pair.
    """
    error = seen_error(reference, measurement, parts=parts)
    # A release beyond the dead zone would open and close the valve in turn, sample by sample.
    release = min(parameters.release, parameters.dead_zone)
    limit_up = release if state.direction > 0.0 else parameters.dead_zone
    limit_down = release if state.direction < 0.0 else parameters.dead_zone
    direction = 1.0 if error > limit_up else (-1.0 if error < -limit_down else 0.0)
    return direction * parameters.opening, OnOffDeadZoneState(direction)


def dead_zone_restart(state: OnOffDeadZoneState, requested: float, continues: float) -> OnOffDeadZoneState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return OnOffDeadZoneState(direction=state.direction * continues)


ON_OFF_DEAD_ZONE = ControllerKind(
    name="on_off_dead_zone",
    summary="On/off with a dead zone and hysteresis: the valve opens for a large error and closes for a small one.",
    source="relay with dead zone and hysteresis: Gelb and Vander Velde 1968, Multiple-Input Describing Functions",
    quantities=quantities_of(OnOffDeadZoneParameters),
    parameters=OnOffDeadZoneParameters,
    initial=OnOffDeadZoneState(0.0),
    update=dead_zone_update,
    restart=dead_zone_restart,
    controls=ANYTHING,
    only_switches=True,
)
