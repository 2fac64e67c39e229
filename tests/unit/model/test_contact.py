"""Forces under heel and toes over a stance."""

import pytest

from ppafo.model import contact as ground
from ppafo.model.elementary import QUARTER_TURN
from ppafo.model.gait import GaitNow, GaitTiming

TIMING = GaitTiming(1.0, 0.0, 0.42, 0.64, 0.7, 0.96, -0.07)
NOW = GaitNow(*[0.0] * len(GaitNow._fields))._replace(phase=0.17, shank=-0.1, shank_rate=-1.0)
FLAT_ANGLE = -0.1 + QUARTER_TURN + 0.07


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


@pytest.mark.parametrize(("keeps_gait", "contact"), [(0.0, ground.HEEL), (1.0, ground.FLAT)])
def test_the_foot_of_who_keeps_the_gait_is_flat_while_it_is_nearly_so(keeps_gait: float, contact: float) -> None:
    """A measured foot rolls its last degrees for a tenth of a stride; a free one falls through them."""
    nearly = FLAT_ANGLE - 0.9 * ground.NEARLY_FLAT
    landed = ground.landing(ground.HEEL, TIMING, NOW._replace(ankle=nearly), nearly, 0.0, keeps_gait)
    assert landed.contact == contact
    assert landed.offset == 0.0
    steep = FLAT_ANGLE - 1.1 * ground.NEARLY_FLAT
    now = NOW._replace(ankle=steep)
    assert ground.landing(ground.HEEL, TIMING, now, steep, 0.0, keeps_gait).contact == ground.HEEL


def test_muscles_that_keep_the_gait_keep_it_on_a_flat_foot_too() -> None:
    now = NOW._replace(ankle=1.5, ankle_rate=0.3)
    assert ground.prescribed_ankle(ground.FLAT, now, -0.07, keeps_gait=1.0) == (1.5, 0.3, 0.0)
    assert ground.prescribed_ankle(ground.FLAT, now, -0.07, keeps_gait=0.0) == pytest.approx((FLAT_ANGLE, -1.0, 0.0))
