"""Metabolic rates of a muscle against limits that the publications state, and against the laws of thermodynamics."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.wearer.model.metabolic import (
    Work,
    bhargava_2004,
    mass_of,
    to_three_fifths,
    umberger_2010,
    work_of,
)
from ppafo.wearer.model.muscle import Fibre, Muscle, force_at, lengthening, next_fibre

SLOW = Muscle(force=4000.0, optimum=0.04, velocity=6.0, slack=0.26, slow=1.0)
FAST = SLOW._replace(slow=0.0, velocity=12.0)
STILL = Work(stimulation=1.0, activation=1.0, length=1.0, velocity=0.0, force=1.0, isometric=1.0)


def shortening(muscle: Muscle, share: float) -> Work:
    """Full activation at a share of the largest velocity of shortening."""
    return STILL._replace(velocity=-share * muscle.velocity, force=force_at(-share))


def test_force_and_velocity_are_each_the_inverse_of_the_other() -> None:
    for velocity in np.linspace(-0.999, 0.999, 41):
        assert lengthening(force_at(float(velocity))) == pytest.approx(velocity, abs=1e-12)


def test_a_muscle_has_the_mass_of_its_volume() -> None:
    assert mass_of(SLOW) == pytest.approx(1059.7 * 4000.0 / 250e3 * 0.04)


def test_the_root_is_that_of_the_library() -> None:
    for number in np.geomspace(0.001, 1.0, 50):
        assert to_three_fifths(float(number)) == pytest.approx(number**0.6, rel=1e-6)


@pytest.mark.parametrize(
    ("muscle", "per_mass"), [(SLOW, 1.5 * 25.0), (FAST, 1.5 * (25.0 + 128.0))], ids=["slow", "fast"]
)
def test_a_tetanus_at_rest_takes_the_printed_heat_of_umberger(muscle: Muscle, per_mass: float) -> None:
    assert umberger_2010(muscle, STILL) == pytest.approx(per_mass * mass_of(muscle), rel=1e-9)


@pytest.mark.parametrize(("muscle", "per_mass"), [(SLOW, 40.0 + 74.0), (FAST, 133.0 + 111.0)], ids=["slow", "fast"])
def test_a_tetanus_at_rest_takes_the_printed_heat_of_bhargava(muscle: Muscle, per_mass: float) -> None:
    assert bhargava_2004(muscle, STILL) == pytest.approx(per_mass * mass_of(muscle), rel=1e-8)


def test_a_muscle_without_stimulation_takes_its_resting_heat_or_nothing() -> None:
    idle = Work(stimulation=0.0, activation=0.0, length=0.9, velocity=0.0, force=0.0, isometric=0.9)
    assert umberger_2010(SLOW, idle) == pytest.approx(1.0 * mass_of(SLOW), rel=0.02)
    assert bhargava_2004(SLOW, idle) == 0.0


def test_the_shortening_heat_of_slow_fibres_ends_at_100_watts_per_kilogram() -> None:
    unloaded = shortening(SLOW, 1.0)
    assert unloaded.force == 0.0
    assert umberger_2010(SLOW, unloaded) == pytest.approx(1.5 * (25.0 + 100.0) * mass_of(SLOW), rel=1e-9)
    unloaded = shortening(FAST, 1.0)
    assert umberger_2010(FAST, unloaded) == pytest.approx(1.5 * (153.0 + 153.0) * mass_of(FAST), rel=1e-9)


@pytest.mark.parametrize("rate", [umberger_2010, bhargava_2004])
@pytest.mark.parametrize("muscle", [SLOW, FAST], ids=["slow", "fast"])
def test_a_muscle_is_most_efficient_at_slow_shortening(rate: Callable[[Muscle, Work], float], muscle: Muscle) -> None:
    efficiencies = {}
    for share in np.linspace(0.02, 0.98, 49).tolist():
        work = shortening(muscle, share)
        efficiencies[share] = muscle.force * muscle.optimum * work.force * -work.velocity / rate(muscle, work)
    best = max(efficiencies, key=efficiencies.__getitem__)
    assert 0.05 < best < 0.5
    assert 0.1 < efficiencies[best] < 0.6


def test_umberger_counts_no_negative_work_and_bhargava_does() -> None:
    drawn = STILL._replace(velocity=1.0, force=1.3)
    assert umberger_2010(SLOW, drawn) > umberger_2010(SLOW, STILL)
    assert bhargava_2004(SLOW, drawn) < bhargava_2004(SLOW, STILL)


def test_a_long_muscle_needs_less_heat() -> None:
    long = STILL._replace(length=1.3, isometric=0.6)
    assert umberger_2010(FAST, long) == pytest.approx((0.4 + 0.6 * 0.6) * umberger_2010(FAST, STILL))
    assert bhargava_2004(SLOW, long) == pytest.approx((40.0 + 0.4 * 74.0) * mass_of(SLOW))


def test_the_work_of_a_step_is_that_of_the_force_along_its_way() -> None:
    """A muscle that pulls a tendon of fixed ends stores in it what it works, but for what its own springs keep."""
    step, whole, fibre = 1e-5, 0.30, Fibre(0.01, 0.0398, 0.0)
    done, stored = 0.0, 0.0
    for _ in range(20000):
        after = next_fibre(SLOW, fibre, 0.6, whole, step)
        work = work_of(SLOW, after, 0.6)
        done -= step * SLOW.force * SLOW.optimum * work.force * work.velocity
        fibre = after
    strain = max((whole - fibre.length) / SLOW.slack - 1.0, 0.0)
    stored = SLOW.force * SLOW.slack * strain**3 / (3.0 * 0.04**2)
    assert strain > 0.02
    assert done == pytest.approx(stored, rel=0.01)
    assert not math.isnan(done)
