"""A small net as a law: what ``learn_a_controller.py`` trains, and what then plays in the league.

Nine inputs from what a controller is shown, six hidden units with x / (1 + |x|), and a linear part beside them. It is
plain arithmetic, so that the training calls it with arrays, one number for each environment, and the lanes with floats.
"""

from typing import Annotated, Any, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

INPUTS = 9
HIDDEN = 6
WEIGHTS = HIDDEN * (INPUTS + 2) + INPUTS + 1
"""Of each hidden unit those of its inputs, its offset, and its own in the sum; those of the linear part; an offset."""
SLOW = 0.03
"""Time constant of what is slow about error and angle [s]."""
FORGETTING = 0.5
"""Rate at which the integral of the error is forgotten [1/s]."""


class PolicyParameters(NamedTuple):
    """Weights of the net [-]."""

    weights: Annotated[tuple[float, ...], 76]


class PolicyState(NamedTuple):
    """Slow angle [rad] and error [N m], integral of the error [N m s], last command [-], 1 once begun."""

    angle: float
    error: float
    integral: float
    command: float
    started: float


def squash(value: Any) -> Any:
    """A value from -1 to 1 that grows with the given one [-]."""
    return value / (1.0 + abs(value))


def inputs_of(state: PolicyState, reference: Any, measurement: Measurement, period: float) -> tuple[Any, PolicyState]:
    """What the net is shown, all of order 1, and the next state with the old command."""
    error = reference - measurement.torque
    before = state.angle + (measurement.angle - state.angle) * (1.0 - state.started)
    was = state.error + (error - state.error) * (1.0 - state.started)
    angle = before + (measurement.angle - before) * (period / SLOW)
    slow = was + (error - was) * (period / SLOW)
    integral = state.integral + period * (error - FORGETTING * state.integral)
    shown = (
        error,
        3.0 * (error - slow),
        5.0 * integral,
        20.0 * (measurement.angle - angle),
        5.0 * (measurement.angle - 1.48),
        (measurement.pressure_1 - 3.0e5) / 1.5e5,
        (measurement.pressure_2 - 1.5e5) / 1.5e5,
        reference - 2.0,
        state.command,
    )
    after = PolicyState(angle=angle, error=slow, integral=integral, command=state.command, started=1.0)
    return shown, after


def output_of(weights: Any, shown: Any) -> Any:
    """What the net gives [-], before it is clipped."""
    total = weights[WEIGHTS - 1] * 1.0
    for number in range(INPUTS):
        total = total + weights[HIDDEN * (INPUTS + 2) + number] * shown[number]
    for unit in range(HIDDEN):
        first = unit * (INPUTS + 2)
        inside = weights[first + INPUTS] * 1.0
        for number in range(INPUTS):
            inside = inside + weights[first + number] * shown[number]
        total = total + weights[first + INPUTS + 1] * squash(inside)
    return total


def update(
    parameters: PolicyParameters, state: PolicyState, reference: float, measurement: Measurement, period: float
) -> tuple[float, PolicyState]:
    """Command from -1 to 1 of the net, and the next state."""
    shown, after = inputs_of(state, reference, measurement, period)
    command = max(-1.0, min(1.0, output_of(parameters.weights, shown)))
    state = PolicyState(
        angle=after.angle, error=after.error, integral=after.integral, command=command, started=after.started
    )
    return command, state


KIND = ControllerKind(
    name="learnt_policy",
    summary="A small net, trained on its task.",
    source="examples/learn_a_controller.py",
    quantities=tuple(
        Quantity(f"weight_{number}", "", "weight of the net", 0.0, -1.0e3, 1.0e3) for number in range(WEIGHTS)
    ),
    parameters=PolicyParameters,
    initial=PolicyState(angle=0.0, error=0.0, integral=0.0, command=0.0, started=0.0),
    update=update,
)
