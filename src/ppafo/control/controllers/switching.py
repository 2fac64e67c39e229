"""Constant command and switching laws: sign of the error (equation 14), dead zone, sliding mode with boundary layer.

Units are given for a torque; where another quantity is controlled, read its unit in place of N m.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import BelievedBand, ControllerKind
from ppafo.control.torque_loop import (
    beyond_dead_band,
    boundary_layer,
    dead_zone,
    dead_zone_opening,
    integral_rate,
    release,
)
from ppafo.model.controlled import ANYTHING, OF_TORQUE, ErrorFunctions, seen_error
from ppafo.model.declaration import EmptyRow, Number, quantities_of
from ppafo.model.sensors import Measurement

ROUNDING = 1.0e-9
"""Error [N m] below which an error counts as zero, so that rounding does not decide the first command."""


class ConstantParameters(NamedTuple):
    """Setting of a constant-command law: the command [-] from -1 to 1."""

    command: Annotated[float, Number("", "command, above 0 feeds chamber 1", 1.0, -1.0, 1.0)]


def constant_update(
    parameters: ConstantParameters, state: EmptyRow, reference: float, measurement: Measurement, period: float
) -> tuple[float, EmptyRow]:
    """Constant command [-] from -1 to 1, independent of the measurement, and the state."""
    return parameters.command, state


CONSTANT = ControllerKind(
    name="constant",
    summary="The same command from beginning to end.",
    source="the paper, section on model validation: valve fully open",
    quantities=quantities_of(ConstantParameters),
    parameters=ConstantParameters,
    initial=EmptyRow(),
    update=constant_update,
    needs_reference=False,
)


def on_off_update(
    parameters: EmptyRow,
    state: EmptyRow,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, EmptyRow]:
    """Command by equation (14): 1 (valve A) for an error [N m] of 0 or more, else -1 (valve B)."""
    error = seen_error(reference, measurement, parts=parts)
    return (1.0 if error >= -ROUNDING else -1.0), state


ON_OFF = ControllerKind(
    name="on_off",
    summary="Valve A where the torque is below the reference, valve B where it is above.",
    source="the paper, equation (14)",
    quantities=(),
    parameters=EmptyRow,
    initial=EmptyRow(),
    update=on_off_update,
    controls=ANYTHING,
    only_switches=True,
)


class OnOffDeadZoneParameters(NamedTuple):
    """Errors at which the valve opens and closes again [N m], and the command while open [-]."""

    dead_zone: Annotated[float, Number("N m", "error at which the valve opens", None, 0.0, 100.0, follows=dead_zone)]
    release: Annotated[
        float,
        Number("N m", "error at which it closes again; the dead zone at most", None, 0.0, 100.0, follows=release),
    ]
    opening: Annotated[float, Number("", "command while it is open", None, 0.0, 1.0, follows=dead_zone_opening)]


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
    """Command: ``opening`` in the direction of the error [N m] outside of the dead zone, 0 inside.

    An open valve stays open until the error falls below ``release``. A command of 0 closes a proportional valve and
    vents both chambers of a solenoid pair.
    """
    error = seen_error(reference, measurement, parts=parts)
    # A release beyond the dead zone would open and close the valve in turn, sample by sample.
    release = min(parameters.release, parameters.dead_zone)
    limit_up = release if state.direction > 0.0 else parameters.dead_zone
    limit_down = release if state.direction < 0.0 else parameters.dead_zone
    direction = 1.0 if error > limit_up else (-1.0 if error < -limit_down else 0.0)
    return direction * parameters.opening, OnOffDeadZoneState(direction)


ON_OFF_DEAD_ZONE = ControllerKind(
    name="on_off_dead_zone",
    summary="On/off with a dead zone and hysteresis: the valve opens for a large error and closes for a small one.",
    source="relay with dead zone and hysteresis: Gelb and Vander Velde 1968, Multiple-Input Describing Functions",
    quantities=quantities_of(OnOffDeadZoneParameters),
    parameters=OnOffDeadZoneParameters,
    initial=OnOffDeadZoneState(0.0),
    update=dead_zone_update,
    controls=ANYTHING,
    only_switches=True,
)


class SlidingModeParameters(NamedTuple):
    """Slope of the surface [1/s], half width of the boundary layer [N m], opening outside it [-], dead band [-]."""

    surface_slope: Annotated[
        float,
        Number("1/s", "weight of the error's integral in the surface", None, 0.0, 1.0e5, follows=integral_rate),
    ]
    boundary_layer: Annotated[
        float, Number("N m", "half width of the layer without switching", None, 1.0e-6, 1.0e4, follows=boundary_layer)
    ]
    reaching_command: Annotated[float, Number("", "opening outside the layer", 1.0, 0.0, 1.0)]
    dead_band: BelievedBand


class SlidingModeState(NamedTuple):
    """State of a sliding-mode law: integral of the torque error [N m s]."""

    integral: float


def sliding_update(
    parameters: SlidingModeParameters,
    state: SlidingModeState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, SlidingModeState]:
    """Command [-] for the torque error e [N m], with the boundary layer phi [N m] and the slope lambda [1/s]:

        s = e + lambda (integral of e),    u = reaching_command min(1, max(-1, s / phi))

    The command compensates the dead band of the valve. The integral is frozen outside of the boundary layer, where the
    valve is at its largest opening already (anti-windup).
    """
    error = seen_error(reference, measurement, parts=parts)
    integral = state.integral + period * error
    surface = error + parameters.surface_slope * integral
    is_inside = abs(surface) < parameters.boundary_layer
    fraction = max(-1.0, min(1.0, surface / parameters.boundary_layer))
    command = beyond_dead_band(parameters.reaching_command * fraction, parameters.dead_band)
    return command, SlidingModeState(integral if is_inside else state.integral)


SLIDING_MODE = ControllerKind(
    name="sliding_mode",
    summary="Sliding mode on the torque error and its integral, with a boundary layer.",
    source="Slotine and Li 1991, Applied Nonlinear Control, chapter 7; on pneumatic actuators Bone and Ning 2007",
    quantities=quantities_of(SlidingModeParameters),
    parameters=SlidingModeParameters,
    initial=SlidingModeState(0.0),
    update=sliding_update,
    controls=ANYTHING,
)
