"""In which order several effects act at one port: as the page on the equations says."""

import inspect
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

from ppafo.model.catalog import EFFECTS, ordered_effects
from ppafo.model.effects.ice import IceState
from ppafo.model.effects.kind import laws_in_order
from ppafo.model.effects.line_resistance import LineResistance
from ppafo.model.effects.seal_friction import SealFriction
from ppafo.model.effects.silencer import Silencer
from ppafo.model.effects.stribeck import Stribeck
from ppafo.model.ports import exhaust_path, friction_in_motion

PAGE = Path(__file__).parents[2] / "docs" / "equations.md"
ROWS = {
    "line_resistance": LineResistance(1.0 / 0.5**2),
    "silencer": Silencer(1.0 / 0.25**2),
    "ice_state": IceState(0.5),
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


def test_ice_narrows_the_valve_and_silencer_and_line_are_in_series_with_that() -> None:
    EFFECTS.load_own()
    found = laws_in_order([effect for effect in ordered_effects() if EFFECTS.is_own(effect.name)])
    valve, narrowed = 0.8, 0.8 / (1.0 + 0.5)
    passes = composed(found, exhaust_path, found[exhaust_path])(valve)
    assert 1.0 / passes**2 == pytest.approx(1.0 / narrowed**2 + 1.0 / 0.25**2 + 1.0 / 0.5**2, rel=1e-14)
    # Ice at the end of the path would be another device.
    narrowed_path = (1.0 / valve**2 + 1.0 / 0.25**2 + 1.0 / 0.5**2) ** -0.5 / (1.0 + 0.5)
    assert narrowed_path / passes < 0.8


def test_friction_terms_are_added() -> None:
    EFFECTS.load_own()
    found = laws_in_order([effect for effect in ordered_effects() if EFFECTS.is_own(effect.name)])
    rubs = composed(found, friction_in_motion, found[friction_in_motion])(0.2, 0.5, 3.0e5, 1.0e5)
    assert rubs == pytest.approx(0.2 + 1.0e-6 * 2.0e5 + 0.3 / (1.0 + 4.0 * 0.5**2), rel=1e-14)
