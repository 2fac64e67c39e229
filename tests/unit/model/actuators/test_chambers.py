"""Chambers whose volume grows with pressure, and the two sides of a cylinder."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from ppafo.model.actuators import cylinder
from ppafo.model.actuators.kind import Range
from ppafo.model.actuators.linear_chambers import LinearChamber, linear_chambers, linear_pressures, linear_torque

ROOM = 101_325.0
PLANT: Any = SimpleNamespace(atmospheric_pressure=ROOM, gas_product=2.0)
STEP = 1.0e-6


def soft(angle: float) -> LinearChamber:
    """A chamber whose rest volume and compliance are linear in the angle [rad]."""
    return LinearChamber(6.0e-5 + 2.0e-5 * angle, 2.0e-10 + 5.0e-11 * angle, 2.0e-5, 5.0e-11)


def coenergy(chamber: LinearChamber, gauge: float) -> float:
    return chamber.rest * gauge + 0.5 * chamber.compliance * gauge * gauge


@pytest.mark.parametrize("gauge", [-6.0e4, 0.0, 3.0e5])
def test_volume_is_the_slope_of_the_coenergy_by_pressure_and_holds_the_gas(gauge: float) -> None:
    chamber = soft(0.4)
    made = linear_chambers(PLANT, chamber, chamber, ROOM + gauge, ROOM + gauge)
    slope = (coenergy(chamber, gauge + 1.0) - coenergy(chamber, gauge - 1.0)) / 2.0
    assert (made.volume_1, made.volume_2) == pytest.approx((slope, slope), rel=1e-9)
    mass = (ROOM + gauge) * made.volume_1 / PLANT.gas_product
    assert linear_pressures(PLANT, chamber, chamber, mass, mass) == pytest.approx((ROOM + gauge,) * 2, rel=1e-12)


@pytest.mark.parametrize("gauge", [-6.0e4, 3.0e5])
def test_torque_is_the_slope_of_the_coenergy_by_angle(gauge: float) -> None:
    slope = (coenergy(soft(0.4 + STEP), gauge) - coenergy(soft(0.4 - STEP), gauge)) / (2.0 * STEP)
    for pressures in ((ROOM + gauge, ROOM), (ROOM, ROOM + gauge)):
        assert linear_torque(PLANT, soft(0.4), soft(0.4), *pressures) == pytest.approx(slope, rel=1e-6)


def test_the_rod_side_of_a_cylinder_has_the_area_of_the_piston_less_that_of_the_rod() -> None:
    stops = Range(angle_min=0.4, angle_max=1.4, dead_volume_1=3.0e-6, dead_volume_2=2.0e-6)
    settings = cylinder._CylinderSettings(
        bore=0.032, rod_diameter=0.012, lever_length=0.05, base_distance=0.2, lever_offset=0.3
    )
    shape = cylinder.prepare(settings, stops)
    first, last = (cylinder.chambers_at(shape, angle) for angle in (stops.angle_min, stops.angle_max))
    piston = 0.25 * math.pi * 0.032**2
    rod_side = 0.25 * math.pi * (0.032**2 - 0.012**2)
    stroke = shape.longest - shape.shortest
    assert (first[0].rest, last[1].rest) == pytest.approx((3.0e-6, 2.0e-6))
    assert last[0].rest - first[0].rest == pytest.approx(piston * stroke)
    assert first[1].rest - last[1].rest == pytest.approx(rod_side * stroke)
