"""Stribeck friction: near standstill a sliding vane has nearly its static friction."""

from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.ports import friction_in_motion


class Stribeck(NamedTuple):
    """Additional friction near standstill [N m], and inverse square of the Stribeck velocity [s^2/rad^2]."""

    friction_rise: float
    velocity_scale: float


class StribeckSettings(NamedTuple):
    """Stribeck velocity, at which half of the additional friction is left, and additional friction as a fraction."""

    velocity: Annotated[
        float,
        Number(
            "rad/s", "angular velocity at which half of the additional friction remains, 0 for none", 0.0, 0.0, 1.0e4
        ),
    ]
    share: Annotated[
        float,
        Number(
            "",
            "fraction of the fall from static to dynamic friction that is modelled as velocity-dependent",
            0.9,
            0.0,
            0.99,
        ),
    ]


def prepare(settings: StribeckSettings, device: Any) -> Stribeck:
    """Parameters from the Stribeck velocity and the friction of the device."""
    velocity = settings.velocity
    friction = device.friction
    scale = 1.0 / (velocity * velocity) if velocity > 0.0 else 0.0
    return Stribeck(settings.share * (friction.static_torque - friction.dynamic_torque), scale)


def stribeck_friction(
    torque: float, angular_velocity: float, pressure_1: float, pressure_2: float, stribeck: Stribeck
) -> float:
    """Friction torque in motion [N m], without sign: ``T_d + a (T_s - T_d) / (1 + (w / w_s)^2)``."""
    without = friction_in_motion(torque, angular_velocity, pressure_1, pressure_2)
    return without + stribeck.friction_rise / (1.0 + stribeck.velocity_scale * angular_velocity * angular_velocity)


EFFECT = Effect(
    name="stribeck",
    summary="More friction of the vane near standstill.",
    settings=StribeckSettings,
    parameters=Stribeck,
    prepare=prepare,
    switch=("velocity",),
    laws={friction_in_motion: stribeck_friction},
    source="the curve of Hess and Soom (Journal of Tribology 112, 1990); a share below 1 lets the vane break away",
    equation="T_f = T_d + a (T_s - T_d) / (1 + (w / w_s)^2)",
    symbols=(
        ("a (T_s - T_d)", "friction_rise", "N m", "friction torque near standstill over the dynamic one"),
        ("1/w_s^2", "velocity_scale", "s^2/rad^2", "one over the square of the Stribeck velocity"),
    ),
)
