"""Double-acting cylinder between two pins that drives a lever, by the law of cosines for joint, base and rod end.

Chamber 1 is on the piston side, chamber 2 on the rod side. The length of the cylinder increases with the angle.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.model.actuators.kind import ActuatorKind, ActuatorModel, Chambers, Range, ShapedPlant
from ppafo.model.actuators.linear_chambers import LinearChamber, linear_chambers, linear_pressures, linear_torque, rigid
from ppafo.model.declaration import Number
from ppafo.model.elementary import TURN, TURNS_OF_RADIAN, sine_and_cosine_of_turns

LEAST_SINE = 0.05
"""Smallest sine of the angle between lever and base; below it the lever is too close to its dead centre."""
# Places of settings, from 1.
_ROD = 2.0
_OFFSET = 5.0


class Cylinder(NamedTuple):
    """Geometry of a cylinder: areas of piston and rod side [m^2], lever and base from the joint to the pins [m].

    ``lever`` and ``base`` [m], ``offset`` [rad] the angle between them at a joint angle of 0, dead volumes [m^3], and
    the distances ``shortest`` and ``longest`` between the pins at both stops [m].
    """

    piston_area: float
    rod_side_area: float
    lever: float
    base: float
    offset: float
    dead_volume_1: float
    dead_volume_2: float
    shortest: float
    longest: float


def pins_at(lever: float, base: float, between: float) -> tuple[float, float]:
    """Distance of the pins [m] for an angle [rad] between lever and base [m], and its derivative [m/rad].

    Law of cosines; the derivative is the lever arm of the cylinder force.
    """
    sine, cosine = sine_and_cosine_of_turns(between * TURNS_OF_RADIAN)
    # No test for a length of 0: ``problem`` refuses a lever near its dead centre, where the arm would vanish too.
    length = math.sqrt(lever * lever + base * base - 2.0 * lever * base * cosine)
    return length, lever * base * sine / length


def chambers_at(shape: Cylinder, angle: float) -> tuple[LinearChamber, LinearChamber]:
    """Chamber on the piston side, which expands with the angle [rad], and chamber on the rod side, which contracts."""
    length, arm = pins_at(shape.lever, shape.base, angle + shape.offset)
    swept_1 = shape.piston_area * (length - shape.shortest)
    swept_2 = shape.rod_side_area * (shape.longest - length)
    return (
        rigid(shape.dead_volume_1 + swept_1, shape.piston_area * arm),
        rigid(shape.dead_volume_2 + swept_2, -shape.rod_side_area * arm),
    )


def chambers(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Volumes and compliances of both chambers at an angle [rad]."""
    first, second = chambers_at(plant.shape, angle)
    return linear_chambers(plant, first, second, pressure_1, pressure_2)


def pressures(plant: ShapedPlant, angle: float, mass_1: float, mass_2: float) -> tuple[float, float]:
    """Absolute pressures [Pa] of both chambers for two masses [kg]. Equation (3)."""
    first, second = chambers_at(plant.shape, angle)
    return linear_pressures(plant, first, second, mass_1, mass_2)


def torque(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque [N m] at two absolute pressures [Pa]; the atmospheric pressure acts on the rod."""
    first, second = chambers_at(plant.shape, angle)
    return linear_torque(plant, first, second, pressure_1, pressure_2)


class _CylinderSettings(NamedTuple):
    """Settings of a cylinder: bore, rod diameter, and geometry of the lever."""

    bore: Annotated[float, Number("m", "diameter of the piston", minimum=1.0e-3, maximum=0.5)]
    rod_diameter: Annotated[float, Number("m", "diameter of the rod", minimum=0.0, maximum=0.5)]
    lever_length: Annotated[float, Number("m", "joint to rod end", minimum=1.0e-3, maximum=2.0)]
    base_distance: Annotated[float, Number("m", "joint to the base of the cylinder", minimum=1.0e-3, maximum=2.0)]
    lever_offset: Annotated[
        float, Number("rad", "angle between lever and base where the joint is at 0", 0.0, -10.0, 10.0)
    ]


def prepare(settings: _CylinderSettings, stops: Range) -> Cylinder:
    """Geometry of the cylinder from settings and stops."""
    bore = settings.bore
    rod = settings.rod_diameter
    lever = settings.lever_length
    base = settings.base_distance
    offset = settings.lever_offset
    quarter = 0.25 * math.pi
    return Cylinder(
        piston_area=quarter * bore * bore,
        rod_side_area=quarter * (bore * bore - rod * rod),
        lever=lever,
        base=base,
        offset=offset,
        dead_volume_1=stops.dead_volume_1,
        dead_volume_2=stops.dead_volume_2,
        shortest=pins_at(lever, base, stops.angle_min + offset)[0],
        longest=pins_at(lever, base, stops.angle_max + offset)[0],
    )


def flaw(settings: _CylinderSettings, stops: Range) -> float:
    """Return the place of the setting that is impossible, from 1: rod as wide as the bore, lever at its dead centre."""
    low = stops.angle_min + settings.lever_offset
    high = stops.angle_max + settings.lever_offset
    # Both stops suffice: between them the angle runs from one to the other, and the sine has no minimum inside.
    first, _ = sine_and_cosine_of_turns(low * TURNS_OF_RADIAN)
    last, _ = sine_and_cosine_of_turns(high * TURNS_OF_RADIAN)
    is_dead = low <= 0.0 or high >= 0.5 * TURN or first < LEAST_SINE or last < LEAST_SINE
    return _ROD if settings.rod_diameter >= settings.bore else (_OFFSET if is_dead else 0.0)


def problem(settings: _CylinderSettings, stops: Range) -> str:
    """Describe a rod as wide as the bore, or a lever that reaches its dead centre between the stops; else empty."""
    place = flaw(settings, stops)
    if place == _ROD:
        return "rod_diameter must be below bore"
    if place == _OFFSET:
        low, high = (math.degrees(angle + settings.lever_offset) for angle in (stops.angle_min, stops.angle_max))
        return (
            f"the angle between lever and base is {low:.4g} to {high:.4g} deg and must stay at least "
            f"{math.degrees(math.asin(LEAST_SINE)):.2g} deg from 0 and 180 deg: change lever_offset or the stops"
        )
    return ""


KIND = ActuatorKind(
    name="cylinder",
    summary="A double-acting cylinder between two pins that drives a lever.",
    settings=_CylinderSettings,
    model=ActuatorModel(Cylinder, prepare, chambers, pressures, torque, gives=False),
    problem=problem,
    flaw=flaw,
)
