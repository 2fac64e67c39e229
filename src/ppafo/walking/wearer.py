"""Wearer of the device: segments of one leg and the ankle, in SI units, and their scaling between people.

A person is scaled in mass and length. Each segment keeps its fraction of the body mass, its fraction of the stature and
the relative position of its mass centre (as in table 4.1 of Winter, Biomechanics and Motor Control of Human Movement,
4th ed. 2009). Masses are therefore proportional to body mass, lengths to stature, and inertias to mass times length
squared; the fractions are taken from the original wearer. The tissue of the ankle is not scaled. The default wearer of
a walk file is the subject of the named gait, or the paper's subject if no gait is named. If the file states the
stature, all segments without a stated value are scaled with body mass and stature.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, NamedTuple

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import ScenarioError
from ppafo.gait import Gait
from ppafo.model.declaration import Number, Quantity, quantities_of
from ppafo.model.leg import LegParameters
from ppafo.parameters.declared import value_at
from ppafo.parameters.graph import Graph, Link
from ppafo.simulation.declaration import FOOT
from ppafo.simulation.document import DocumentReader

SHANK_SHARE = 0.246
"""Shank length as a fraction of the stature: figure 4.1 of Winter, Biomechanics and Motor Control of Human Movement,
4th ed. 2009. The paper states a shank of 0.46 m and no stature, which results in 1.87 m."""

_SAME = 1.0e-3
"""Relative difference of body masses or statures that is due to rounding."""

_STATURE = (FOOT["shank_length"].default or 0.0) / SHANK_SHARE
_KEEPS_GAIT = (
    "1: nondisabled, muscles keep the measured ankle whatever the device does; 0: the ankle follows the torques"
)

STATURES = (1.45, 2.0)
"""Range of statures [m] of nearly all adults, for which the segment fractions were measured."""


SCALED_MASS = (0.6, 1.7)
"""Range of body masses, relative to the gait's subject, in which moment and force are scaled without a remark.

About the 2nd to the 98th percentile of adults for a subject in their middle: 45 to 120 kg for 72 kg. Children do not
only have less mass but walk differently.
"""
STATURE = "wearer.stature"
BODY_MASS = "wearer.body_mass"


class HeelRocker(NamedTuple):
    """Heel rocker: lever of the ground force behind the ankle as a function of foot tilt.

    ``flat`` [m] is the lever with the foot nearly flat, ``raised`` [m] the lever of a raised foot, ``half`` [rad] the
    tilt at which the lever is halfway between both.
    """

    flat: float
    raised: float
    half: float


@dataclass(frozen=True, slots=True)
class Wearer:
    """Leg of a person, in SI units; fields without a declaration here are declared in ``FOOT``.

    Default values are of the paper's subject (after equation (12)); docs/decisions/0008 explains values that the paper
    does not state.
    """

    body_mass: Annotated[float, Number("kg", "mass of the body", 72.5, 10.0, 300.0)]
    stature: Annotated[
        float, Number("m", "height of the body; given, the segments follow it and the body mass", _STATURE, 0.5, 2.5)
    ]
    shank_length: float
    shank_mass_centre: Annotated[float, Number("m", "knee to the mass centre of the shank", 0.199, 0.0, 1.0)]
    shank_mass: Annotated[float, Number("kg", "mass of the shank", 4.5, 0.1, 30.0)]
    shank_inertia: Annotated[float, Number("kg m^2", "inertia of the shank about its mass centre", 0.1, 1.0e-4, 5.0)]
    foot_mass_centre: float
    foot_mass: float
    foot_inertia: float
    heel_lever: Annotated[
        float, Number("m", "distance from ankle back to heel; limits the lever arm of the ground force", 0.05, 0.0, 0.2)
    ]
    toe_lever: float
    ankle_stiffness: Annotated[float, Number("N m/rad", "stiffness of tissue at the ankle", 4.0, 0.0, 500.0)]
    ankle_rest_angle: Annotated[float, Number("rad", "angle at which passive tissue exerts no torque", 1.92, 0.5, 3.0)]
    ankle_damping: Annotated[float, Number("N m s/rad", "damping of tissue at the ankle", 0.2, 0.0, 50.0)]
    residual_share: Annotated[
        float, Number("1", "fraction of the healthy ankle moment that the wearer can still produce", 0.0, 0.0, 1.0)
    ]
    keeps_gait: Annotated[float, Number("1", _KEEPS_GAIT, 0.0, 0.0, 1.0)]

    def leg(self) -> LegParameters:
        """Return the leg as parameters of the engine, with a heel that does not roll."""
        return leg_parameters(self, HeelRocker(self.heel_lever, self.heel_lever, 1.0))


_DECLARED = FOOT | {quantity.name: quantity for quantity in quantities_of(Wearer)}
WEARER = tuple(_DECLARED[number.name] for number in fields(Wearer))
"""Declarations of the numbers of ``[wearer]``, in the order of the fields."""

SCALING = {
    "body_mass": (1, 0),
    "shank_length": (0, 1),
    "shank_mass_centre": (0, 1),
    "shank_mass": (1, 0),
    "shank_inertia": (1, 2),
    "foot_mass_centre": (0, 1),
    "foot_mass": (1, 0),
    "foot_inertia": (1, 2),
    "heel_lever": (0, 1),
    "toe_lever": (0, 1),
}
"""Exponents of body mass and of stature with which the numbers of a leg scale between people."""


def scaled(leg: Wearer, mass: float, stature: float) -> dict[str, Any]:
    """Return the numbers of a leg [SI] multiplied for a relative body mass and stature [-]."""
    masses = (1.0, mass)
    statures = (1.0, stature, stature * stature)
    return {
        name: getattr(leg, name) * masses[of_mass] * statures[of_stature]
        for name, (of_mass, of_stature) in SCALING.items()
    }


def leg_parameters(wearer: Wearer, rocker: HeelRocker) -> LegParameters:
    """Return the leg of a wearer as parameters of the engine."""
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
    """Return the default wearer of a walk: the subject of the paper."""
    return Wearer(**{quantity.name: float(quantity.default or 0.0) for quantity in WEARER})


_PAPER = paper_subject()
_SHARES: Mapping[str, float] = {
    name: getattr(_PAPER, name) / (_PAPER.body_mass**of_mass * _PAPER.stature**of_stature)
    for name, (of_mass, of_stature) in SCALING.items()
} | {"shank_length": SHANK_SHARE}
"""Numbers of the paper subject's leg divided by the powers of body mass and stature from ``SCALING``."""


def links_of_stature(document: Mapping[str, Any]) -> Graph:
    """Return links from stature and body mass to segments of a walk file, active now or when a stature is given."""
    when = STATURE if value_at(document, STATURE) is None else ""
    # A link becomes active when its first source is given, so the stature is a source of masses too.
    return {
        f"wearer.{name}": (Link((BODY_MASS,) * of_mass + (STATURE,) * of_stature, when=when, factor=_SHARES[name]),)
        for name, (of_mass, of_stature) in SCALING.items()
        if name != "body_mass" and value_at(document, f"wearer.{name}") is None
    }


def read_wearer(reading: DocumentReader, gait: Gait, is_named: bool) -> Wearer:
    """Return the wearer of a walk file; defaults are of the gait's subject, or of the paper's without a named gait.

    With a given stature, the default segments are scaled with stature and body mass.
    """
    # Without a named gait the wearer is the paper's subject, not the subject of the built-in gait.
    subject = _PAPER
    if is_named:
        # An unknown stature is the paper's.
        stature = _PAPER.stature if gait.stature is None else gait.stature
        of_stature = 1.0 if gait.stature is None else SHANK_SHARE * stature / _PAPER.shank_length
        of_mass = gait.body_mass / _PAPER.body_mass
        subject = replace(_PAPER, stature=stature, **scaled(_PAPER, of_mass, of_stature))
    if value_at(reading.document, STATURE) is not None:
        declared = {quantity.name: quantity for quantity in _quantities(subject)}
        paths = {STATURE: "stature", BODY_MASS: "body_mass"}
        numbers = {path: reading.number(path, declared[name]) for path, name in paths.items()}
        segments = {
            path.partition(".")[2]: float(links[0].number(numbers.__getitem__))
            for path, links in links_of_stature(reading.document).items()
        }
        subject = replace(subject, **segments)
    quantities = _quantities(subject)
    for quantity in quantities if is_named else ():
        value = getattr(subject, quantity.name)
        path = f"wearer.{quantity.name}"
        is_usable = quantity.minimum <= value <= quantity.maximum
        if not is_usable and value_at(reading.document, path) is None:
            raise ScenarioError(
                f"{reading.file}: the subject of gait '{gait.name}' has a body mass of {gait.body_mass:g} kg, so "
                f"{path} would be {value:.3g} {quantity.unit}, but it must be {quantity.minimum:g} to "
                f"{quantity.maximum:g} {quantity.unit}; give {path}"
            )
    return Wearer(**reading.section("wearer", quantities))


def _quantities(subject: Wearer) -> tuple[Quantity, ...]:
    """Return the declarations of a wearer whose defaults are the numbers of a subject."""
    return tuple(replace(quantity, default=getattr(subject, quantity.name)) for quantity in WEARER)


def wearer_origin(reading: DocumentReader, gait: Gait, is_named: bool) -> str:
    """Return a description of the origin of the wearer's body mass."""
    if value_at(reading.document, "wearer.body_mass") is not None:
        return "as wearer.body_mass states"
    return f"the subject of gait '{gait.name}'" if is_named else "the paper's subject"


def who_walks(wearer: Wearer, gait: Gait, origin: str) -> str:
    """Return a line on the wearer, and on the gait's own subject if that is another person."""
    is_subject = origin.startswith("the subject of")
    said = f"wearer: {wearer.body_mass:.4g} kg, {origin}"
    default_stature = gait.stature if is_subject else None
    if abs(wearer.stature - (default_stature or _PAPER.stature)) > _SAME * wearer.stature:
        low, high = STATURES
        tall = wearer.stature
        beyond = "" if low <= tall <= high else f" in the proportions of adults of {low:g} to {high:g} m, extrapolated"
        said += f"; {tall:.4g} m tall, segments scaled by mass and stature{beyond}; curves of the gait are not scaled"
    elif wearer.shank_mass == _PAPER.shank_mass and abs(wearer.body_mass / _PAPER.body_mass - 1.0) > _SAME:
        said += f", with the leg of the paper's subject, {_PAPER.body_mass:g} kg; wearer.stature scales the leg"
    if wearer.stature == default_stature:
        said += f", {wearer.stature:.4g} m"
    if not is_subject and abs(wearer.body_mass - gait.body_mass) > _SAME * gait.body_mass:
        low, high = (fraction * gait.body_mass for fraction in SCALED_MASS)
        beyond = "" if low <= wearer.body_mass <= high else f", extrapolated outside {low:.0f} to {high:.0f} kg"
        said += f"; moment and force of gait '{gait.name}' ({gait.body_mass:.4g} kg) are scaled by body mass{beyond}"
    return said
