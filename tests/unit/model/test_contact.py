"""Forces under heel and toes over a stance."""

import pytest

from ppafo.model import contact as ground
from ppafo.model.gait import GaitTiming

TIMING = GaitTiming(1.0, 0.0, 0.42, 0.64, 0.7, 0.96, -0.07)


def test_the_heel_carries_all_while_the_foot_rolls_on_it_and_less_until_it_rises() -> None:
    assert ground.heel_fraction(ground.HEEL, TIMING, 0.05, 0.0) == 1.0
    assert ground.heel_fraction(ground.FLAT, TIMING, 0.21, 0.0) == pytest.approx(0.5)
    assert ground.heel_fraction(ground.FLAT, TIMING, 0.42, 0.0) == 0.0
    assert ground.heel_fraction(ground.TOE, TIMING, 0.5, 0.0) == 0.0


@pytest.mark.parametrize("contact", [ground.HEEL, ground.FLAT])
def test_a_foot_that_meets_the_ground_with_its_toes_loads_them_first(contact: float) -> None:
    assert ground.heel_fraction(contact, TIMING, 0.0, 1.0) == 0.0
    assert ground.heel_fraction(contact, TIMING, 0.02, 1.0) < 0.2
    settled = TIMING.heel_off / ground.SETTLES
    assert ground.heel_fraction(ground.FLAT, TIMING, settled, 1.0) == pytest.approx(
        ground.heel_fraction(ground.FLAT, TIMING, settled, 0.0)
    )
