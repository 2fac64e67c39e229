"""In which order several effects act at one port: as the page on the equations says."""

import inspect
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

from ppafo import load_device
from ppafo.model.catalog import EFFECTS, ordered_effects
from ppafo.model.effects.kind import laws_in_order
from ppafo.model.effects.seal_friction import SealFriction
from ppafo.model.effects.stribeck import Stribeck
from ppafo.model.ports import friction_in_motion
from ppafo.parameters.natural_laws import ALLOWED, effect_departure
from ppafo.parameters.plant import plant_parameters

PAGE = Path(__file__).parents[2] / "docs" / "equations.md"
ROWS = {
    "seal_friction": SealFriction(0.0, 1.0e-6),
    "stribeck": Stribeck(0.3, 4.0),
}


def composed(found: Mapping[Any, Any], port: Any, law: Any) -> Callable[..., float]:
    """A law with what it gets where it calls its port: the law of the effect before it, and so on."""
    if law is port:
        return FunctionType(port.__code__, port.__globals__)
    inner = composed(found, port, found[law, port])
    own = FunctionType(law.__code__, {**law.__globals__, port.__name__: inner})
    rows = {name: ROWS[name] for name in inspect.signature(law).parameters if name in ROWS}

    def call(*given: float) -> float:
        return float(own(*given, **rows))

    return call


def test_the_page_lists_the_effects_in_the_order_in_which_they_act() -> None:
    EFFECTS.load_own()
    listed = re.findall(r"^### (\w+): ", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert listed == [effect.name for effect in ordered_effects() if EFFECTS.is_own(effect.name)]


def test_friction_terms_are_added_and_take_power() -> None:
    EFFECTS.load_own()
    found = laws_in_order([effect for effect in ordered_effects() if EFFECTS.is_own(effect.name)])
    rubs = composed(found, friction_in_motion, found[friction_in_motion])(0.2, 0.5, 3.0e5, 1.0e5)
    plant = plant_parameters(load_device("ppafo2011"))
    for name, row in ROWS.items():
        assert effect_departure(EFFECTS[name], row, plant).size == 0.0
    pushing = effect_departure(EFFECTS["stribeck"], Stribeck(-0.3, 4.0), plant)
    assert pushing.size > ALLOWED
    assert re.search(r"friction_in_motion\(.*\) is -0.\d+, on the wrong side of 0", pushing.text)
    assert rubs == pytest.approx(0.2 + 1.0e-6 * 2.0e5 + 0.3 / (1.0 + 4.0 * 0.5**2), rel=1e-14)
