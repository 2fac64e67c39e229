"""Effects on the ways of the gas: linear model and runs agree, formulas are what they name; see ``test_effects.py``."""

import numpy as np
import pytest

from ppafo.analyses.linearise.question import linearise
from ppafo.model.effects.laminar_leak import LaminarLeak, leak_with_gap
from ppafo.model.effects.line_resistance import LineSettings, fed_through_line, prepare
from ppafo.model.flow_curve import isentropic_curve
from ppafo.model.orifice import area_conductance, orifice_flow
from ppafo.parameters.loading import load_device
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate

CURVE = isentropic_curve(1.4, 0.999)
LAMINAR = ("effects.laminar_leak.coefficient=1e-15 kg/(s Pa^2)",)


def test_a_linear_model_has_the_leak_as_a_difference_of_two_runs_has() -> None:
    venting = ("controller.kind=constant", "controller.command=-0.4", "run.duration=0.3 s", *LAMINAR)
    rates = linearise("torque-task-proportional", at=0.2, overrides=venting).found.rates
    step = ("run.step=0.01 ms", "run.output_interval=0.01 ms")
    found = simulate(load_scenario("torque-task-proportional", (*venting, *step))).recording
    here = int(np.searchsorted(found.time, 0.2 - 1e-9))
    slope = (found["pressure_2"][here + 20] - found["pressure_2"][here - 20]) / (40 * 1e-5)
    assert rates[1] == pytest.approx(slope, rel=1e-3)


def test_lines_slow_the_filling_of_one_chamber_and_the_venting_of_the_other() -> None:
    held = ("motion.kind=locked", "motion.angle=90 deg", "controller.kind=constant", "controller.command=1")
    plain, narrow = (
        simulate(load_scenario("step-response", (*held, "run.duration=0.1 s", *texts))).recording
        for texts in ((), ("effects.line_resistance.area=1 mm^2",))
    )
    for name in ("pressure_1", "pressure_2"):
        slow, quick = (abs(one[name][-1] - one[name][0]) for one in (narrow, plain))
        assert 0.05 * quick < slow < 0.5 * quick


def test_a_line_counts_as_the_orifice_of_the_rig_does() -> None:
    row = prepare(LineSettings(2e-5, 0.6), load_device("ppafo2011"))
    alone = area_conductance(2e-5, 0.6, 1.289, 188.92, 293.15)
    assert row.resistance == pytest.approx(alone**-2, rel=0.02)
    assert fed_through_line(1.0, row) == pytest.approx(row.resistance**-0.5)


def test_a_laminar_gap_passes_its_coefficient_times_the_difference_of_the_squares_at_any_pressures() -> None:
    gap = LaminarLeak(1.0e-15)
    for first, second in ((6.0e5, 1.0e5), (2.0e5, 3.0e5), (3.0e5, 2.9995e5), (3.0e5, 3.0e5 - 1.0), (2.0e5, 2.0e5)):
        through = orifice_flow(first, second, leak_with_gap(1.0e-10, first, second, CURVE, gap), 1.0, CURVE)[0]
        alone = orifice_flow(first, second, 1.0e-10, 1.0, CURVE)[0]
        assert through - alone == pytest.approx(1.0e-15 * (first**2 - second**2), rel=1e-9, abs=1e-22)
