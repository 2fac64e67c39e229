"""On/off control of a pair of solenoid valves, equation (14)."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.sensors import Measurement

ROUNDING = 1.0e-9
"""N m: an error this small counts as zero, so that rounding does not decide the first command."""


class OnOffParameters(NamedTuple):
    """The law has no parameters; the paper has no dead zone."""


class OnOffState(NamedTuple):
    """The law has no state."""


def update(
    parameters: OnOffParameters, state: OnOffState, reference: float, measurement: Measurement, period: float
) -> tuple[float, OnOffState]:
    """Command: 1 (valve A) where the error [N m] is 0 or more, else -1 (valve B). Equation (14)."""
    error = reference - measurement.torque
    return (1.0 if error >= -ROUNDING else -1.0), state


KIND = ControllerKind(
    name="on_off",
    summary="Valve A where the torque is below the reference, valve B where it is above.",
    source="the paper, equation (14)",
    quantities=(),
    parameters=OnOffParameters,
    initial=OnOffState(),
    update=update,
    only_switches=True,
)
