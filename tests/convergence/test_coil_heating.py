"""Coils that warm: lanes and reference solver agree, the parabola is the formula, a warm coil opens its valve later."""

from types import SimpleNamespace

import numpy as np
import pytest

from ppafo.model.effects.coil_heating import (
    COPPER,
    CoilRises,
    CoilSettings,
    advance,
    opening_when_warm,
    prepare,
    slower,
)
from ppafo.model.effects.kind import Moment
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.simulate import simulate
from tests.reference.reference_solver import compare_with_reference

SETTINGS = CoilSettings(steady_rise=80.0, time_constant=0.2, pull_in_share=0.6)
WARM = tuple(
    f"effects.coil_heating.{path}" for path in ("steady_rise=80 K", "time_constant=0.2 s", "pull_in_share=0.6")
)
SLOW = ("valve.opening_delay=8 ms", "valve.closing_delay=5 ms")


@pytest.mark.parametrize(
    "texts", [("run.duration=1 s",), ("motion.kind=free", "run.duration=0.4 s"), ("device.valve=solenoid_recycling",)]
)
def test_warm_coils_in_the_lanes_are_those_of_the_reference_solver(texts: tuple[str, ...]) -> None:
    own = SLOW if "recycling" not in texts[0] else ("run.duration=0.5 s",)
    agreement = compare_with_reference(plan_run(load_scenario("torque-task-solenoid", (*own, *texts, *WARM))))
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3


def test_the_parabola_is_the_opening_time_of_a_coil_with_resistance_and_inductance() -> None:
    row = prepare(SETTINGS._replace(steady_rise=100.0), SimpleNamespace())
    for rise in np.linspace(0.0, 100.0, 41).tolist():
        ratio = 1.0 + COPPER * rise
        exact = np.log(1.0 - 0.6 * ratio) / (ratio * np.log(0.4))
        assert slower(rise, 0.6) == pytest.approx(exact, rel=1e-12)
        assert opening_when_warm(8e-3, 1.0, row, CoilRises(rise, 0.0)) == pytest.approx(8e-3 * exact, rel=6e-3)
        assert opening_when_warm(8e-3, 0.0, row, CoilRises(rise, 0.0)) == 8e-3


def test_a_coil_that_is_on_warms_and_the_other_cools() -> None:
    row, now = prepare(SETTINGS, SimpleNamespace()), Moment(0.0, 0.0, 1e5, 1e5, 0.0, 0.0, 1.0)
    after = advance(row, CoilRises(10.0, 10.0), now, now, 0.1)
    kept = np.exp(-0.5)
    assert after == pytest.approx((80.0 + (10.0 - 80.0) * kept, 10.0 * kept), rel=1e-9)


def test_a_column_of_it_has_the_bits_of_the_single_runs_and_a_warm_coil_changes_the_torque() -> None:
    texts = (*SLOW, WARM[1], "run.duration=0.6 s")
    rises = np.array([0.0, 40.0, 100.0])
    base = load_scenario("torque-task-solenoid", texts)
    found = run_ensemble(base, {"effects.coil_heating.steady_rise": rises}, ["gas_vented"]).metrics["gas_vented"]
    alone = [
        simulate(load_scenario("torque-task-solenoid", (*texts, f"effects.coil_heating.steady_rise={rise} K")))
        for rise in rises.tolist()
    ]
    assert found.tolist() == [result.metrics["gas_vented"].value for result in alone]
    assert len(set(found.tolist())) == 3
