"""Restitution is an effect that every device has: its number is one of the actuator, and it has no switch."""

from dataclasses import replace

from ppafo.model.catalog import device_effects
from ppafo.model.effects.kind import effect_problem
from ppafo.model.effects.restitution import EFFECT, Restitution
from ppafo.parameters.effects import effect_rows, effects_of
from ppafo.parameters.loading import load_device


def test_it_is_on_at_0_too_and_no_section_of_effects_has_it() -> None:
    device = load_device("ppafo2011", overrides=("actuator.restitution=0",))
    assert effects_of(device) == (EFFECT,)
    assert effect_rows(device) == (Restitution(0.0),)
    assert EFFECT not in device_effects()


def test_an_effect_that_is_always_on_with_a_switch_or_without_a_section_is_refused() -> None:
    assert "always on" in effect_problem(replace(EFFECT, switch=("restitution",)))
    assert "always on" in effect_problem(replace(EFFECT, section_of_files=""))
    assert effect_problem(EFFECT) == ""
