"""Loads at the joint in addition to the foot plate: drag, spring, and weight of a link."""

import math
from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.plant import gravity_torque
from ppafo.model.ports import load_torque


class _JointLoad(NamedTuple):
    """Parameters of a load at the joint, equal to its settings."""

    drag: Annotated[float, Number("N m s^2/rad^2", "drag torque per square of the rate", 0.0, 0.0, 1.0e3)]
    stiffness: Annotated[float, Number("N m/rad", "stiffness of a spring", 0.0, 0.0, 1.0e4)]
    weight: Annotated[
        float,
        Number(
            "N m",
            "largest torque of a weight towards 180 deg; towards 0 deg: foot_plate.gravity_torque below 0",
            0.0,
            0.0,
            1.0e3,
        ),
    ]
    rest_angle: Annotated[
        float, Number("rad", "angle at which the spring rests", 0.5 * math.pi, -math.pi, 2.0 * math.pi)
    ]


def joint_load_torque(torque: float, angle: float, rate: float, joint_load: _JointLoad) -> float:
    """Load torque [N m] of drag, spring and weight at the joint: ``c w |w| + k (theta - theta_0) + T_w(theta)``."""
    others = load_torque(torque, angle, rate)
    drag = joint_load.drag * rate * abs(rate)
    spring = joint_load.stiffness * (angle - joint_load.rest_angle)
    return others + drag + spring + gravity_torque(angle, joint_load.weight)


EFFECT = Effect(
    name="joint_load",
    summary="A load at the joint beside the foot plate: drag, spring, weight of a link.",
    settings=_JointLoad,
    parameters=_JointLoad,
    prepare=None,
    switch=("drag", "stiffness", "weight"),
    laws={load_torque: joint_load_torque},
    source="quadratic drag, Hooke's spring, and the weight of a link",
    equation="T_l = c w |w| + k (theta - theta_0) - W cos(theta - 90 deg)",
    symbols=(
        ("c", "drag", "N m s^2/rad^2", "drag torque of a load per square of the angular velocity"),
        ("k", "stiffness", "N m/rad", "stiffness of a spring at the joint"),
        ("W", "weight", "N m", "largest torque of the weight of a link at the joint"),
        ("theta_0", "rest_angle", "rad", "angle at which the spring rests"),
    ),
)
