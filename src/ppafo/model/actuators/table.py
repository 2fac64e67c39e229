"""Measured actuator: volumes of both chambers as functions of angle and pressure, from a file.

As a function of the angle a volume is a cubic spline through the measured values, with two continuous derivatives; as a
function of pressure it is linear between measured pressures, and constant outside. Its integral over the pressure is
known in closed form, and the torque is the derivative of this integral with respect to the angle: d tau/dp = dV/dangle
holds to rounding for every measurement.
"""

from typing import Annotated, NamedTuple

from ppafo.model.actuators.kind import ActuatorKind, ActuatorModel, Chambers, Range, ShapedPlant
from ppafo.model.actuators.linear_chambers import LinearChamber, pressure_in
from ppafo.model.declaration import Number

# Number of inner knots of the splines in the angle, and number of intervals between measured pressures.
BENDS = 8
RISES = 4
MOST_ANGLES = BENDS + 4
MOST_PRESSURES = RISES + 1


class Curve(NamedTuple):
    """Cubic spline [m^3] over the relative angle: four polynomial coefficients, and one coefficient per inner knot."""

    powers: Annotated[tuple[float, ...], 4]
    bends: Annotated[tuple[float, ...], BENDS]


class Rise(NamedTuple):
    """Interval between two gauge pressures [Pa]: lower end, length, and volume gain over the interval."""

    lower: float
    length: float
    gain: Curve


class TabulatedChamber(NamedTuple):
    """Tabulated chamber: volume [m^3] up to the lowest measured pressure, and gains of the pressure intervals."""

    lowest: Curve
    rises: Annotated[tuple[Rise, ...], RISES]


class Table(NamedTuple):
    """Volumes of both chambers over the relative angle, which is 0 to 1 from the first to the last angle.

    ``first_angle`` and ``last_angle`` [rad], ``per_angle`` the inverse of their difference [1/rad], and ``bends`` the
    inner knots of the splines [-].
    """

    first_angle: float
    last_angle: float
    per_angle: float
    bends: Annotated[tuple[float, ...], BENDS]
    chamber_1: TabulatedChamber
    chamber_2: TabulatedChamber


class Measured(NamedTuple):
    """Table with additional dead volumes [m^3], passive stiffness [N m/rad], and its angle of zero torque [rad]."""

    table: Table
    dead_volume_1: float
    dead_volume_2: float
    stiffness: float
    rest_angle: float


class Level(NamedTuple):
    """Volume of a chamber [m^3] and its derivative with respect to the angle [m^3/rad] at one pressure."""

    volume: float
    slope: float


def bases_at(table: Table, angle: float) -> tuple[Curve, Curve]:
    """Spline basis of a table at an angle [rad], for the value [-] and the slope [1/rad]."""
    # Truncated powers: the cube of max(share - bend, 0) begins at its bend with two continuous derivatives.
    share = (angle - table.first_angle) * table.per_angle
    square = share * share
    per = table.per_angle
    at = table.bends
    d0 = max(share - at[0], 0.0)
    d1 = max(share - at[1], 0.0)
    d2 = max(share - at[2], 0.0)
    d3 = max(share - at[3], 0.0)
    d4 = max(share - at[4], 0.0)
    d5 = max(share - at[5], 0.0)
    d6 = max(share - at[6], 0.0)
    d7 = max(share - at[7], 0.0)
    s0 = d0 * d0
    s1 = d1 * d1
    s2 = d2 * d2
    s3 = d3 * d3
    s4 = d4 * d4
    s5 = d5 * d5
    s6 = d6 * d6
    s7 = d7 * d7
    three = 3.0 * per
    return (
        Curve(
            (1.0, share, square, square * share),
            (s0 * d0, s1 * d1, s2 * d2, s3 * d3, s4 * d4, s5 * d5, s6 * d6, s7 * d7),
        ),
        Curve(
            (0.0, per, 2.0 * per * share, three * square),
            (three * s0, three * s1, three * s2, three * s3, three * s4, three * s5, three * s6, three * s7),
        ),
    )


def curve_value(curve: Curve, basis: Curve) -> float:
    """Value of a spline, or its slope, for the basis at an angle."""
    a = curve.powers
    b = basis.powers
    c = curve.bends
    d = basis.bends
    smooth = (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
    low = (c[0] * d[0] + c[1] * d[1]) + (c[2] * d[2] + c[3] * d[3])
    return smooth + (low + ((c[4] * d[4] + c[5] * d[5]) + (c[6] * d[6] + c[7] * d[7])))


def level_of(curve: Curve, bases: tuple[Curve, Curve]) -> Level:
    """Value and slope of a spline at an angle."""
    return Level(curve_value(curve, bases[0]), curve_value(curve, bases[1]))


def levels_of(chamber: TabulatedChamber, bases: tuple[Curve, Curve], dead_volume: float) -> tuple[Level, ...]:
    """Volume of a chamber with its dead volume [m^3] at the lowest pressure, and gain of each pressure interval."""
    lowest = level_of(chamber.lowest, bases)
    rises = chamber.rises
    return (
        Level(lowest.volume + dead_volume, lowest.slope),
        level_of(rises[0].gain, bases),
        level_of(rises[1].gain, bases),
        level_of(rises[2].gain, bases),
        level_of(rises[3].gain, bases),
    )


def share_of(rise: Rise, gauge: float) -> float:
    """Fraction of a pressure interval [-] below a gauge pressure [Pa]."""
    return max(0.0, min(1.0, (gauge - rise.lower) / rise.length))


def filled_share(rise: Rise, gauge: float) -> float:
    """Integral of ``share_of`` [Pa] from the lower end of the interval to a gauge pressure [Pa]."""
    inside = share_of(rise, gauge)
    return rise.length * 0.5 * inside * inside + max(gauge - rise.lower - rise.length, 0.0)


def filled_from_vented(rise: Rise, gauge: float) -> float:
    """Integral of ``share_of`` [Pa] from a gauge pressure of 0 to a gauge pressure [Pa]."""
    # A stretch below the atmosphere is filled in part where the chamber is vented.
    return filled_share(rise, gauge) - filled_share(rise, 0.0)


def volume_at(chamber: TabulatedChamber, levels: tuple[Level, ...], gauge: float) -> float:
    """Volume of a chamber [m^3] at a gauge pressure [Pa]."""
    rises = chamber.rises
    low = levels[1].volume * share_of(rises[0], gauge) + levels[2].volume * share_of(rises[1], gauge)
    high = levels[3].volume * share_of(rises[2], gauge) + levels[4].volume * share_of(rises[3], gauge)
    return levels[0].volume + (low + high)


def compliance_in(rise: Rise, gain: Level, gauge: float) -> float:
    """Compliance [m^3/Pa] within a pressure interval, 0 outside."""
    # Half-open, so that no two stretches both count where they meet.
    return gain.volume / rise.length if gauge >= rise.lower and gauge < rise.lower + rise.length else 0.0


def compliance_at(chamber: TabulatedChamber, levels: tuple[Level, ...], gauge: float) -> float:
    """Compliance of a chamber [m^3/Pa] at a gauge pressure [Pa]."""
    rises = chamber.rises
    low = compliance_in(rises[0], levels[1], gauge) + compliance_in(rises[1], levels[2], gauge)
    return low + (compliance_in(rises[2], levels[3], gauge) + compliance_in(rises[3], levels[4], gauge))


def chamber_torque(chamber: TabulatedChamber, levels: tuple[Level, ...], gauge: float) -> float:
    """Torque [N m] of a chamber at a gauge pressure [Pa]: the pressure integral of the volume's slope."""
    rises = chamber.rises
    low = levels[1].slope * filled_from_vented(rises[0], gauge) + levels[2].slope * filled_from_vented(rises[1], gauge)
    high = levels[3].slope * filled_from_vented(rises[2], gauge) + levels[4].slope * filled_from_vented(rises[3], gauge)
    return levels[0].slope * gauge + (low + high)


def stretch_pressure(rise: Rise, gain: Level, volume: float, found: float, content: float, atmosphere: float) -> float:
    """Absolute pressure [Pa] for a gas content [J] in the interval, else the pressure ``found`` in a lower one."""
    begin = rise.lower + atmosphere
    stretch = LinearChamber(
        rest=volume, compliance=gain.volume / rise.length, rest_slope=gain.slope, compliance_slope=0.0
    )
    # Stretches from the lowest up: the last one that the content reaches says the pressure.
    inside = pressure_in(stretch, content, begin)
    beyond = content / (volume + gain.volume)
    # Above the last measured pressure the volume is constant.
    own = inside if inside < begin + rise.length else beyond
    return own if content > begin * volume else found


def pressure_at(chamber: TabulatedChamber, levels: tuple[Level, ...], content: float, atmosphere: float) -> float:
    """Absolute pressure [Pa] of a chamber with a gas content p V [J]."""
    rises = chamber.rises
    volume = levels[0].volume
    pressure = stretch_pressure(rises[0], levels[1], volume, content / volume, content, atmosphere)
    second = volume + levels[1].volume
    pressure = stretch_pressure(rises[1], levels[2], second, pressure, content, atmosphere)
    third = second + levels[2].volume
    pressure = stretch_pressure(rises[2], levels[3], third, pressure, content, atmosphere)
    return stretch_pressure(rises[3], levels[4], third + levels[3].volume, pressure, content, atmosphere)


def chambers(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Volumes and compliances of both chambers at an angle [rad] and two absolute pressures [Pa]."""
    shape: Measured = plant.shape
    room = plant.atmospheric_pressure
    first = shape.table.chamber_1
    second = shape.table.chamber_2
    bases = bases_at(shape.table, angle)
    levels_1 = levels_of(first, bases, shape.dead_volume_1)
    levels_2 = levels_of(second, bases, shape.dead_volume_2)
    return Chambers(
        volume_1=volume_at(first, levels_1, pressure_1 - room),
        volume_2=volume_at(second, levels_2, pressure_2 - room),
        compliance_1=compliance_at(first, levels_1, pressure_1 - room),
        compliance_2=compliance_at(second, levels_2, pressure_2 - room),
    )


def pressures(plant: ShapedPlant, angle: float, mass_1: float, mass_2: float) -> tuple[float, float]:
    """Absolute pressures [Pa] of both chambers for two masses [kg]. Equation (3)."""
    shape: Measured = plant.shape
    room = plant.atmospheric_pressure
    first = shape.table.chamber_1
    second = shape.table.chamber_2
    bases = bases_at(shape.table, angle)
    return (
        pressure_at(first, levels_of(first, bases, shape.dead_volume_1), mass_1 * plant.gas_product, room),
        pressure_at(second, levels_of(second, bases, shape.dead_volume_2), mass_2 * plant.gas_product, room),
    )


def torque(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque [N m] of both chambers at two absolute pressures [Pa], and of the passive stiffness."""
    shape: Measured = plant.shape
    room = plant.atmospheric_pressure
    first = shape.table.chamber_1
    second = shape.table.chamber_2
    bases = bases_at(shape.table, angle)
    # A dead volume does not change with the angle, so it gives no torque: 0 stands for it.
    active_1 = chamber_torque(first, levels_of(first, bases, 0.0), pressure_1 - room)
    active_2 = chamber_torque(second, levels_of(second, bases, 0.0), pressure_2 - room)
    return active_1 + active_2 - shape.stiffness * (angle - shape.rest_angle)


def has_one_chamber(table: Table) -> bool:
    """Return whether the volume of chamber 2 is 0 at every angle and pressure."""
    curves = (table.chamber_2.lowest, *(rise.gain for rise in table.chamber_2.rises))
    return not any(number for curve in curves for number in (*curve.powers, *curve.bends))


class _TableSettings(NamedTuple):
    """Settings of a tabulated actuator: passive stiffness without pressure, and its angle of zero torque."""

    passive_stiffness: Annotated[
        float, Number("N m/rad", "torque of the material per angle from rest", 0.0, 0.0, 1.0e4)
    ]
    rest_angle: Annotated[float, Number("rad", "angle at which the material gives no torque", 0.0, -10.0, 10.0)]


def prepare(settings: _TableSettings, stops: Range, table: Table) -> Measured:
    """Numbers of the actuator from settings, stops and table."""
    return Measured(
        table=table,
        dead_volume_1=stops.dead_volume_1,
        dead_volume_2=stops.dead_volume_2,
        stiffness=settings.passive_stiffness,
        rest_angle=settings.rest_angle,
    )


KIND = ActuatorKind(
    name="table",
    summary="An actuator that was measured: volumes over angle and pressure, from a CSV file.",
    settings=_TableSettings,
    # The file is judged where it is read.
    model=ActuatorModel(Measured, prepare, chambers, pressures, torque, table=Table),
    has_one_chamber=has_one_chamber,
)
