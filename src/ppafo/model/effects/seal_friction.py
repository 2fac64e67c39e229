"""Friction that increases with pressure: the gas presses the seals of the vane against the walls."""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.ports import friction_at_rest, friction_in_motion


class SealFriction(NamedTuple):
    """Friction torque per pressure between the chambers [N m/Pa], at rest and in motion."""

    static_per_pressure: Annotated[
        float, Number("N m/Pa", "largest friction torque at rest per pressure", 0.0, 0.0, 1.0)
    ]
    dynamic_per_pressure: Annotated[float, Number("N m/Pa", "friction torque in motion per pressure", 0.0, 0.0, 1.0)]


def static_seal_friction(torque: float, pressure_1: float, pressure_2: float, seal_friction: SealFriction) -> float:
    """Largest friction torque at rest [N m]: ``T_s + c_s |P_1 - P_2|``."""
    return friction_at_rest(torque, pressure_1, pressure_2) + seal_friction.static_per_pressure * abs(
        pressure_1 - pressure_2
    )


def dynamic_seal_friction(
    torque: float, angular_velocity: float, pressure_1: float, pressure_2: float, seal_friction: SealFriction
) -> float:
    """Size of the friction torque in motion [N m]: ``T_d + c_d |P_1 - P_2|``."""
    without = friction_in_motion(torque, angular_velocity, pressure_1, pressure_2)
    return without + seal_friction.dynamic_per_pressure * abs(pressure_1 - pressure_2)


EFFECT = Effect(
    name="seal_friction",
    summary="Friction that grows with the pressure between the chambers.",
    settings=SealFriction,
    parameters=SealFriction,
    prepare=None,
    switch=("static_per_pressure", "dynamic_per_pressure"),
    laws={friction_at_rest: static_seal_friction, friction_in_motion: dynamic_seal_friction},
    source="assumed: linear in the pressure on the seals, to be fitted to an actuator; the simulated bench has it too",
    equation="T_f = T_f0 + c |P_1 - P_2|",
    symbols=(
        ("c_s", "static_per_pressure", "N m/Pa", "friction torque at rest per pressure between the chambers"),
        ("c_d", "dynamic_per_pressure", "N m/Pa", "friction torque in motion per pressure between the chambers"),
    ),
)
