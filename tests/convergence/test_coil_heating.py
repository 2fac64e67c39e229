"""Coils that warm: the parabola is the formula, and a coil that is on warms; runs are in ``test_effects.py``."""

from types import SimpleNamespace

import numpy as np
import pytest

from ppafo.model.effects.coil_heating import (
    COPPER,
    CoilRises,
    CoilSettings,
    advance,
    prepare,
    relative_opening_time,
    warm_opening_time,
)
from ppafo.model.effects.kind import PlantSnapshot

SETTINGS = CoilSettings(steady_rise=80.0, time_constant=0.2, pull_in_share=0.6)


def test_the_parabola_is_the_opening_time_of_a_coil_with_resistance_and_inductance() -> None:
    row = prepare(SETTINGS._replace(steady_rise=100.0), SimpleNamespace())
    for rise in np.linspace(0.0, 100.0, 41).tolist():
        ratio = 1.0 + COPPER * rise
        exact = np.log(1.0 - 0.6 * ratio) / (ratio * np.log(0.4))
        assert relative_opening_time(rise, 0.6) == pytest.approx(exact, rel=1e-12)
        assert warm_opening_time(8e-3, 1.0, row, CoilRises(rise, 0.0)) == pytest.approx(8e-3 * exact, rel=6e-3)
        assert warm_opening_time(8e-3, 0.0, row, CoilRises(rise, 0.0)) == 8e-3


def test_a_coil_that_is_on_warms_and_the_other_cools() -> None:
    row, now = prepare(SETTINGS, SimpleNamespace()), PlantSnapshot(0.0, 0.0, 1e5, 1e5, 0.0, 0.0, 1.0)
    after = advance(row, CoilRises(10.0, 10.0), now, now, 0.1)
    kept = np.exp(-0.5)
    assert after == pytest.approx((80.0 + (10.0 - 80.0) * kept, 10.0 * kept), rel=1e-9)
