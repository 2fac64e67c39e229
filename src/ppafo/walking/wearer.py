"""Who wears the device: segments of one leg and the ankle, in SI units."""

from dataclasses import dataclass
from typing import NamedTuple

from ppafo.constants import STANDARD_GRAVITY
from ppafo.model.declaration import Quantity
from ppafo.model.leg import LegParameters

WEARER = (
    Quantity("body_mass", "kg", "mass of the body", 72.5, 10.0, 300.0),
    Quantity("shank_length", "m", "knee to ankle", 0.46, 0.1, 1.0),
    Quantity("shank_mass_centre", "m", "knee to the mass centre of the shank", 0.199, 0.0, 1.0),
    Quantity("shank_mass", "kg", "mass of the shank", 4.5, 0.1, 30.0),
    Quantity("shank_inertia", "kg m^2", "inertia of the shank about its mass centre", 0.1, 1.0e-4, 5.0),
    Quantity("foot_mass_centre", "m", "ankle to the mass centre of the foot", 0.09, 0.0, 0.5),
    Quantity("foot_mass", "kg", "mass of the foot", 1.0, 0.05, 10.0),
    Quantity("foot_inertia", "kg m^2", "inertia of the foot about its mass centre", 0.001, 1.0e-5, 1.0),
    Quantity("heel_lever", "m", "ankle back to the heel; bounds the lever of the ground force", 0.05, 0.0, 0.2),
    Quantity("toe_lever", "m", "ankle forward to the toes", 0.18, 0.0, 0.5),
    Quantity("ankle_stiffness", "N m/rad", "stiffness of tissue at the ankle", 4.0, 0.0, 500.0),
    Quantity("ankle_rest_angle", "rad", "angle at which passive tissue exerts no torque", 1.92, 0.5, 3.0),
    Quantity("ankle_damping", "N m s/rad", "damping of tissue at the ankle", 0.2, 0.0, 50.0),
    Quantity(
        "residual_share", "1", "fraction of the healthy ankle moment that the wearer can still produce", 0.0, 0.0, 1.0
    ),
    Quantity(
        "keeps_gait",
        "1",
        "1: nondisabled, muscles keep the measured ankle whatever the device does; 0: the ankle follows the torques",
        0.0,
        0.0,
        1.0,
    ),
)
"""Defaults: the paper's subject (after equation (12)); what it does not print is said in docs/decisions/0008."""


class HeelRocker(NamedTuple):
    """Lever [m] of the ground force behind the ankle: nearly flat, far up, and the tilt [rad] half of the way up."""

    flat: float
    raised: float
    half: float


@dataclass(frozen=True, slots=True)
class Wearer:
    """One leg of a person; lengths [m], masses [kg], inertias [kg m^2], the ankle as in ``LegParameters``."""

    body_mass: float
    shank_length: float
    shank_mass_centre: float
    shank_mass: float
    shank_inertia: float
    foot_mass_centre: float
    foot_mass: float
    foot_inertia: float
    heel_lever: float
    toe_lever: float
    ankle_stiffness: float
    ankle_rest_angle: float
    ankle_damping: float
    residual_share: float
    keeps_gait: float

    def leg(self) -> LegParameters:
        """The leg as the engine takes it, on a heel that does not roll."""
        return leg_parameters(self, HeelRocker(self.heel_lever, self.heel_lever, 1.0))


def leg_parameters(wearer: Wearer, rocker: HeelRocker) -> LegParameters:
    """The leg of a wearer as the engine takes it."""
    return LegParameters(
        shank_length=wearer.shank_length,
        shank_mass_centre=wearer.shank_mass_centre,
        shank_mass=wearer.shank_mass,
        shank_inertia=wearer.shank_inertia,
        foot_mass_centre=wearer.foot_mass_centre,
        foot_mass=wearer.foot_mass,
        foot_inertia=wearer.foot_inertia,
        body_mass=wearer.body_mass,
        ankle_stiffness=wearer.ankle_stiffness,
        ankle_rest_angle=wearer.ankle_rest_angle,
        ankle_damping=wearer.ankle_damping,
        residual_share=wearer.residual_share,
        keeps_gait=wearer.keeps_gait,
        heel_lever=rocker.raised,
        flat_heel_lever=rocker.flat,
        heel_roll_angle=rocker.half,
        toe_lever=wearer.toe_lever,
        gravity=STANDARD_GRAVITY,
    )


def paper_subject() -> Wearer:
    """The wearer of the defaults."""
    return Wearer(**{item.name: float(item.default or 0.0) for item in WEARER})
