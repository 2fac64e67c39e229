"""Rebound of the vane from its stops: every device has a coefficient of restitution, which may be 0."""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.ports import rebound


class Restitution(NamedTuple):
    """Coefficient of restitution at a stop [-], 0 to 1: rebound speed divided by impact speed."""

    restitution: Annotated[float, Number("", "rebound speed over impact speed at a stop", minimum=0.0, maximum=1.0)]


def rebound_velocity(angular_velocity: float, restitution: Restitution) -> float:
    """Angular velocity [rad/s] of the vane after an impact on a stop: ``-e w``, Newton's law of impact."""
    return -restitution.restitution * angular_velocity


EFFECT = Effect(
    name="restitution",
    summary="Rebound of the vane from its stops.",
    settings=Restitution,
    parameters=Restitution,
    prepare=None,
    switch=(),
    laws={rebound: rebound_velocity},
    source="Newton's law of impact",
    equation="w_after = -e w_before",
    symbols=(("e", "restitution", "-", "rebound speed over impact speed at a stop"),),
    section_of_files="actuator",
    always=True,
)
