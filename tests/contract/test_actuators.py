"""Every kind of actuator gives the shaft what its gas gives, and its three functions are of one relation."""

import importlib
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ppafo import load_device
from ppafo.engine.scheme.actuators import pressures_of, torque_of, volumes_of
from ppafo.model.actuators.kind import ActuatorModel
from ppafo.model.catalog import ACTUATORS
from ppafo.model.plant import PlantParameters
from ppafo.parameters.plant import plant_parameters

TESTS = Path(__file__).parents[1]
PACKAGE = TESTS.parent / "src" / "ppafo" / "examples" / "add-an-actuator"
SETS = {
    "vane": ("ppafo2011", ()),
    "cylinder": ("cylinder-lever", ()),
    "table": (str(TESTS / "actuators" / "measured-bladder.toml"), ()),
    "muscle_pair": (str(PACKAGE / "muscle-pair.toml"), ()),
}
"""A set with an actuator of each kind, the last one of the example package, and what of it is changed."""
POINTS = 4000
ALLOWED = 1.0e-6


@pytest.fixture(scope="module", autouse=True)
def _with_the_package_of_the_example() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PACKAGE)
        ACTUATORS["muscle_pair"] = importlib.import_module("my_actuators.muscle_pair").KIND
        yield
    del ACTUATORS["muscle_pair"]
    for name in [name for name in sys.modules if name.partition(".")[0] == "my_actuators"]:
        del sys.modules[name]


def actuator_of(kind: str) -> tuple[ActuatorModel, PlantParameters]:
    """A kind and a plant with it."""
    name, overrides = SETS[kind]
    device = load_device(name, overrides=overrides)
    assert device.actuator.kind == kind
    return ACTUATORS[kind].model, plant_parameters(device)


def points_of(plant: PlantParameters) -> list[tuple[float, float, float]]:
    """Angles [rad] and both pressures [Pa] around a closed cycle through most of what the actuator can do."""
    middle, half = 0.5 * (plant.angle_min + plant.angle_max), 0.45 * (plant.angle_max - plant.angle_min)
    room, gauge = plant.atmospheric_pressure, plant.supply_pressure - plant.atmospheric_pressure
    turns = [2.0 * math.pi * number / POINTS for number in range(POINTS)]
    return [
        (
            middle + half * math.cos(turn),
            room + gauge * (0.5 + 0.45 * math.sin(turn)),
            room + gauge * (0.4 + 0.35 * math.sin(2.0 * turn + 1.0)),
        )
        for turn in turns
    ]


def works_of(model: ActuatorModel, plant: Any) -> tuple[float, float]:
    """Work of the gas, the sum of p dV of both chambers, and of the shaft, that of torque times angle [J]."""
    cycle = points_of(plant)
    gas = shaft = 0.0
    for (angle, first, second), (next_angle, next_first, next_second) in zip(cycle, cycle[1:] + cycle[:1], strict=True):
        before, after = (
            model.chambers(plant, angle, first, second),
            model.chambers(plant, next_angle, next_first, next_second),
        )
        gas += 0.5 * (first + next_first) * (after.volume_1 - before.volume_1)
        gas += 0.5 * (second + next_second) * (after.volume_2 - before.volume_2)
        torques = model.torque(plant, angle, first, second), model.torque(plant, next_angle, next_first, next_second)
        shaft += 0.5 * sum(torques) * (next_angle - angle)
    return gas, shaft


def test_every_kind_of_the_catalogue_has_its_set() -> None:
    assert set(ACTUATORS) == set(SETS)


@pytest.mark.parametrize("kind", SETS)
def test_a_closed_cycle_gives_the_shaft_what_the_gas_gives(kind: str) -> None:
    gas, shaft = works_of(*actuator_of(kind))
    assert abs(gas) > 0.05
    assert shaft == pytest.approx(gas, rel=ALLOWED)


def test_the_test_of_the_cycle_sees_a_torque_that_is_one_part_in_a_thousand_too_large() -> None:
    model, plant = actuator_of("cylinder")
    gas, _ = works_of(model, plant)
    _, shaft = works_of(model, plant._replace(shape=plant.shape._replace(lever=1.001 * plant.shape.lever)))
    assert shaft != pytest.approx(gas, rel=100.0 * ALLOWED)


@pytest.mark.parametrize("kind", SETS)
def test_the_pressures_of_some_gas_are_those_at_which_it_fills_the_chambers(kind: str) -> None:
    model, plant = actuator_of(kind)
    for angle, first, second in points_of(plant)[::97]:
        volume_1, volume_2 = volumes_of(model, plant, angle, first, second)
        masses = first * volume_1 / plant.gas_product, second * volume_2 / plant.gas_product
        assert pressures_of(model, plant, angle, *masses) == pytest.approx((first, second), rel=1e-12)


@pytest.mark.parametrize("kind", SETS)
def test_only_a_kind_that_says_so_has_chambers_that_no_pressure_widens(kind: str) -> None:
    model, plant = actuator_of(kind)
    filled = [model.chambers(plant, *point) for point in points_of(plant)[::97]]
    widest = max(max(chamber.compliance_1, chamber.compliance_2) for chamber in filled)
    assert model.gives or widest == 0.0


@pytest.mark.parametrize("kind", SETS)
def test_only_a_kind_that_says_so_has_a_torque_constant(kind: str) -> None:
    model, plant = actuator_of(kind)
    for angle, first, second in points_of(plant)[::397]:
        by_constant = plant.torque_constant * (first - second)
        assert not model.has_torque_constant or model.torque(plant, angle, first, second) == by_constant


@pytest.mark.parametrize("kind", SETS)
def test_compliance_is_the_growth_of_the_volume_with_the_pressure(kind: str) -> None:
    model, plant = actuator_of(kind)
    step = 1.0
    for angle, first, second in points_of(plant)[::97]:
        here, more = (
            model.chambers(plant, angle, first, second),
            model.chambers(plant, angle, first + step, second + step),
        )
        assert (more.volume_1 - here.volume_1) / step == pytest.approx(here.compliance_1, rel=1e-4, abs=1e-16)
        assert (more.volume_2 - here.volume_2) / step == pytest.approx(here.compliance_2, rel=1e-4, abs=1e-16)


@pytest.mark.parametrize("kind", SETS)
def test_pressure_in_chamber_1_turns_the_joint_on_and_in_chamber_2_back(kind: str) -> None:
    model, plant = actuator_of(kind)
    for angle, first, second in points_of(plant)[::397]:
        torque = torque_of(model, plant, angle, first, second)
        assert torque_of(model, plant, angle, first + 1e4, second) > torque
        assert torque_of(model, plant, angle, first, second + 1e4) <= torque
