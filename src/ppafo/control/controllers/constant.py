"""A command that never changes: open-loop tests such as the step response."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class ConstantParameters(NamedTuple):
    """The command [-], -1 to 1."""

    command: float


class ConstantState(NamedTuple):
    """The law has no state."""


def update(
    parameters: ConstantParameters, state: ConstantState, reference: float, measurement: Measurement, period: float
) -> tuple[float, ConstantState]:
    """Command from -1 to 1: the setting."""
    return parameters.command, state


KIND = ControllerKind(
    name="constant",
    summary="The same command from beginning to end.",
    source="the paper, section on model validation: valve fully open",
    quantities=(Quantity("command", "", "command, above 0 feeds chamber 1", 1.0, -1.0, 1.0),),
    parameters=ConstantParameters,
    initial=ConstantState(),
    update=update,
)
