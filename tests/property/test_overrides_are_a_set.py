"""Overrides in any order: one result or one error, for random sets of values, kinds and forms."""

import itertools
import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.errors import PpafoError
from ppafo.loading import load_scenario
from ppafo.parameters import apply_overrides, load_parameter_set

OF_A_DEVICE = (
    "valve.area=3 mm^2",
    "valve.area=4 mm^2",
    "valves.proportional.area=5 mm^2",
    "valves.solenoid.area=6 mm^2",
    "valve.discharge_coefficient=0.6",
    "valve.sonic_conductance=1 L/(s bar)",
    "valve.critical_ratio=0.3",
    "actuator.leak.area=0.1 mm^2",
    "gas.species=N2",
    "gas.molar_mass=30 g/mol",
    "supply.pressure=40 psi_g",
    "supply.dorsiflexion_pressure=55 psi_g",
    "supply.atmospheric_pressure=90 kPa_a",
    "supply.atmospheric_pressure=1 psi_g",
    "supply.relieving=true",
    "friction.statik_torque=1 N m",
    "foot_plate.inertia=3 m",
)
OF_A_VANE = (
    *OF_A_DEVICE,
    "device.valve=solenoid",
    "device.valve=proportional",
    "controller.kind=pid",
    "controller.kind=on_off",
    "controller.kind=constant",
    "controller.proportional_gain=0.5",
    "controller.band=0.1 N m",
    "controller.command=0.5",
    "controller.rate=500 Hz",
    "controller.period=4 ms",
    "motion.kind=locked",
    "motion.kind=free",
    "motion.kind=prescribed",
    "motion.angle=75 deg",
    "motion.profile.kind=constant",
    "motion.profile.kind=sine",
    "motion.profile.level=80 deg",
    "motion.profile.amplitude=5 deg",
    "motion.profile.frequency=1 Hz",
    "reference.kind=sine",
    "reference.level=2 N m",
    "reference.frequency=1 Hz",
    "gas_model.kind=thermal",
    "gas_model.kind=isothermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
    "run.duration=1 s",
    "run.output_interval=3 ms",
    "run.zzz=1",
    "run.duration",
)
OF_A_WALK = (
    *OF_A_DEVICE,
    "controller.kind=event_on_off",
    "controller.peak_torque=4 N m",
    "controller.rate=500 Hz",
    "controller.period=1 ms",
    "motion.gait=normal-adult",
    "gait=normal-adult",
    "wearer.body_mass=70 kg",
    "motion.kind=walk",
    "wearer.stature=1.8 m",
    "gas_model.kind=isothermal",
    "gas_model.wall_area_per_volume=100 1/m",
)


def numbers_of(scenario: Any) -> str:
    """All of a scenario but where it comes from, as text."""
    return str([(name, getattr(scenario, name)) for name in scenario.__slots__ if name != "origin"])


def outcomes(load: Any, words: list[str], seed: int) -> set[str]:
    """What orders of a set of overrides come to, all of up to four and random ones of more: results or errors."""
    shuffled = random.Random(seed)
    orders = (
        itertools.permutations(words) if len(words) < 5 else (shuffled.sample(words, len(words)) for _ in range(12))
    )
    found = set()
    for order in orders:
        try:
            found.add(load(order))
        except PpafoError as error:
            found.add(f"{type(error).__name__}: {error}")
    return found


@pytest.mark.parametrize("name", ["torque-task-proportional", "torque-task-moving-ankle"])
@settings(max_examples=25, deadline=None)
@given(words=st.lists(st.sampled_from(OF_A_VANE), min_size=2, max_size=7), seed=st.integers(0, 99))
def test_a_scenario_is_the_same_for_all_orders(name: str, words: list[str], seed: int) -> None:
    assert len(outcomes(lambda order: numbers_of(load_scenario(name, order)), words, seed)) == 1


@settings(max_examples=8, deadline=None)
@given(words=st.lists(st.sampled_from(OF_A_WALK), min_size=2, max_size=4), seed=st.integers(0, 99))
def test_a_walk_is_the_same_for_all_orders(words: list[str], seed: int) -> None:
    assert len(outcomes(lambda order: numbers_of(load_scenario("proportional", order)), words, seed)) == 1


@settings(max_examples=25, deadline=None)
@given(words=st.lists(st.sampled_from(OF_A_DEVICE), min_size=2, max_size=6), seed=st.integers(0, 99))
def test_a_parameter_set_is_the_same_for_all_orders(words: list[str], seed: int) -> None:
    completed = load_parameter_set("ppafo2011")
    assert len(outcomes(lambda order: str(apply_overrides(completed, order).entries()), words, seed)) == 1


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("torque-task-proportional", ["valve.area=30 mm^2", "valve.sonic_conductance=1 L/(s bar)"]),
        ("torque-task-proportional", ["controller.proportional_gain=0.5", "controller.kind=on_off"]),
        ("torque-task-proportional", ["controller.rate=500 Hz", "controller.period=4 ms"]),
        ("torque-task-proportional", ["valve.area=3 mm^2", "valves.proportional.area=4 mm^2"]),
        ("torque-task-moving-ankle", ["motion.profile.kind=sine", "motion.kind=locked"]),
        ("torque-task-moving-ankle", ["motion.angle=75 deg", "motion.kind=prescribed"]),
        ("proportional", ["motion.gait=normal-adult", "gait=normal-adult"]),
    ],
)
def test_a_value_that_another_leaves_without_use_is_an_error_that_names_both(name: str, words: list[str]) -> None:
    for order in (words, words[::-1]):
        with pytest.raises(PpafoError) as caught:
            load_scenario(name, order)
        assert all(f"'{word}'" in str(caught.value) for word in words)
