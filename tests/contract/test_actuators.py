"""Every kind of actuator gives the shaft what its gas gives, and its three functions are of one relation."""

import importlib
import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from ppafo import load_device
from ppafo.engine.scheme.actuators import torque_of
from ppafo.errors import ParameterError
from ppafo.model.actuators.kind import ActuatorModel
from ppafo.model.catalog import ACTUATORS
from ppafo.model.plant import PlantParameters
from ppafo.parameters.natural_laws import actuator_departure
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
POINTS = 400
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


def test_every_kind_of_the_catalogue_has_its_set() -> None:
    assert set(ACTUATORS) == set(SETS)


@pytest.mark.parametrize("kind", SETS)
def test_the_shaft_gets_the_work_of_the_gas_that_fills_the_chambers(kind: str) -> None:
    assert actuator_departure(*actuator_of(kind)).size < ALLOWED


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (("torque", lambda torque: lambda *given: 1.3 * torque(*given)), "by virtual work both are one number"),
        (("pressures", lambda inverse: lambda *given: (1.01 * inverse(*given)[0], inverse(*given)[1])), "gas of these"),
        (("chambers", lambda of: lambda *given: of(*given)._replace(compliance_1=1e-9)), "its compliance is 1 cm"),
    ],
)
def test_a_kind_of_a_user_that_breaks_a_law_of_nature_is_refused_with_its_numbers(
    changes: tuple[str, Callable[[Any], Any]], said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    own, (name, change) = ACTUATORS["cylinder"], changes
    broken = replace(own.model, **{name: change(getattr(own.model, name))})
    set_file = resources.files("ppafo.parameters") / "sets" / "cylinder-lever.toml"
    for called, model in (("honest", own.model), ("broken", broken)):
        monkeypatch.setitem(ACTUATORS, called, replace(own, name=called, model=model))
        text = set_file.read_text(encoding="utf-8").replace('kind = "cylinder"', f'kind = "{called}"')
        (tmp_path / f"{called}.toml").write_text(text, encoding="utf-8")
    load_device(tmp_path / "honest.toml")
    with pytest.raises(ParameterError, match=f"actuator 'broken': at .* deg with .*{said}"):
        load_device(tmp_path / "broken.toml")


@pytest.mark.parametrize("kind", SETS)
def test_only_a_kind_that_says_so_has_chambers_that_no_pressure_widens(kind: str) -> None:
    model, plant = actuator_of(kind)
    filled = [model.chambers(plant, *point) for point in points_of(plant)[::10]]
    widest = max(max(chamber.compliance_1, chamber.compliance_2) for chamber in filled)
    assert model.gives or widest == 0.0


@pytest.mark.parametrize("kind", SETS)
def test_only_a_kind_that_says_so_has_a_torque_constant(kind: str) -> None:
    model, plant = actuator_of(kind)
    for angle, first, second in points_of(plant)[::40]:
        by_constant = plant.torque_constant * (first - second)
        assert not model.has_torque_constant or model.torque(plant, angle, first, second) == by_constant


@pytest.mark.parametrize("kind", SETS)
def test_pressure_in_chamber_1_turns_the_joint_on_and_in_chamber_2_back(kind: str) -> None:
    model, plant = actuator_of(kind)
    for angle, first, second in points_of(plant)[::40]:
        torque = torque_of(model, plant, angle, first, second)
        assert torque_of(model, plant, angle, first + 1e4, second) > torque
        assert torque_of(model, plant, angle, first, second + 1e4) <= torque
