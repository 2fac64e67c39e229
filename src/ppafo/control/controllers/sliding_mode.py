"""Sliding mode control of the torque with a boundary layer instead of a switch."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class SlidingModeParameters(NamedTuple):
    """Slope of the surface [1/s], half width of the boundary layer [N m], command outside of it [-]."""

    surface_slope: float
    boundary_layer: float
    reaching_command: float


class SlidingModeState(NamedTuple):
    """Integral of the torque error [N m s]."""

    integral: float


def update(
    parameters: SlidingModeParameters,
    state: SlidingModeState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, SlidingModeState]:
    """Command: saturation of s over the boundary layer, with s = e + slope times the integral of e [N m].

    The integral stands still outside the layer, where a longer error could not open the valve further.
    """
    error = reference - measurement.torque
    integral = state.integral + period * error
    surface = error + parameters.surface_slope * integral
    is_inside = abs(surface) < parameters.boundary_layer
    fraction = max(-1.0, min(1.0, surface / parameters.boundary_layer))
    return parameters.reaching_command * fraction, SlidingModeState(integral if is_inside else state.integral)


def restart(state: SlidingModeState, requested: float, continues: float) -> SlidingModeState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return SlidingModeState(integral=state.integral * continues)


KIND = ControllerKind(
    name="sliding_mode",
    summary="Sliding mode on the torque error and its integral, with a boundary layer.",
    source="Slotine and Li 1991, Applied Nonlinear Control, chapter 7; on pneumatic actuators Bone and Ning 2007",
    quantities=(
        Quantity("surface_slope", "1/s", "weight of the error's integral in the surface", 14.0, 0.0, 1.0e3),
        Quantity("boundary_layer", "N m", "half width of the layer without switching", 0.13, 1.0e-6, 100.0),
        Quantity("reaching_command", "", "command outside the layer", 0.14, 0.0, 1.0),
    ),
    parameters=SlidingModeParameters,
    initial=SlidingModeState(0.0),
    update=update,
    restart=restart,
)
