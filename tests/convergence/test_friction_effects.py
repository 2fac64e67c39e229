"""Friction with pressure and near standstill: formulas are what they name; the lanes are in ``test_effects.py``."""

import pytest

from ppafo.model.effects.seal_friction import SealFriction, dynamic_seal_friction, static_seal_friction
from ppafo.model.effects.stribeck import Stribeck, stribeck_friction
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

SEALS = (
    "effects.seal_friction.static_per_pressure=2e-6 N m/Pa",
    "effects.seal_friction.dynamic_per_pressure=1e-6 N m/Pa",
)


def test_the_formulas_are_those_that_they_name() -> None:
    seals = SealFriction(2.0e-6, 1.0e-6)
    assert static_seal_friction(0.5, 1.0e5, 4.0e5, seals) == pytest.approx(1.1)
    assert dynamic_seal_friction(0.4, 3.0, 4.0e5, 1.0e5, seals) == pytest.approx(0.7)
    near = Stribeck(friction_rise=0.09, velocity_scale=0.25)
    assert stribeck_friction(0.4, 0.0, 1.0e5, 1.0e5, near) == pytest.approx(0.49)
    assert stribeck_friction(0.4, -2.0, 1.0e5, 1.0e5, near) == pytest.approx(0.445)


def test_the_torque_on_a_prescribed_joint_has_the_friction_of_the_effects() -> None:
    texts = ("run.duration=0.3 s",)
    with_seals, without = (
        simulate(load_scenario("torque-task-moving-ankle", own)).recording for own in ((*texts, SEALS[1]), texts)
    )
    more = abs(with_seals["pressure_1"] - with_seals["pressure_2"]) * 1.0e-6
    found = abs(with_seals["external_torque"] - without["external_torque"])
    assert found[50:].max() == pytest.approx(more[50:].max(), rel=1e-6)
