"""Effects on the ways of the gas: linear model and runs agree, formulas are what they name; see ``test_effects.py``."""

import numpy as np
import pytest

from ppafo.analyses.linearise.question import linearise
from ppafo.errors import ScenarioError, SimulationError
from ppafo.model.effects.laminar_leak import LaminarLeak, leak_with_gap
from ppafo.model.effects.leak_opening import LeakOpening, lifted_leak
from ppafo.model.effects.line_resistance import LineSettings, fed_through_line, prepare
from ppafo.model.effects.spool_play import SpoolPlace, SpoolPlay, command_behind_play, settle, spool_position
from ppafo.model.flow_curve import isentropic_curve
from ppafo.model.orifice import area_conductance, orifice_flow
from ppafo.parameters.loading import load_device
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.simulate import simulate

CURVE = isentropic_curve(1.4, 0.999)
OPENING = ("effects.leak_opening.pressure=150 kPa_d",)
THERMAL = (
    *("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"),
    "gas_model.wall_area_per_volume=100 1/m",
)


def test_a_leak_that_opens_at_a_pressure_is_tight_below_and_whole_far_above() -> None:
    row = LeakOpening(3.0e4, 1.0)
    assert lifted_leak(2.0e-9, 1.0e5, 1.29e5, CURVE, row) == 0.0
    assert (
        lifted_leak(2.0e-9, 1.0e5, 1.6e5, CURVE, row)
        == lifted_leak(2.0e-9, 1.6e5, 1.0e5, CURVE, row)
        == pytest.approx(1.0e-9)
    )
    assert lifted_leak(2.0e-9, 1.0e5, 3.1e6, CURVE, row) == pytest.approx(2.0e-9, rel=0.011)


@pytest.mark.parametrize("rise", [0.01, 0.3, 1.0, 7.0])
def test_half_of_a_leak_is_open_where_its_rise_says(rise: float) -> None:
    row = LeakOpening(3.0e4, rise)
    assert lifted_leak(2.0e-9, 1.0e5, 1.3e5, CURVE, row) == pytest.approx(0.0, abs=1e-22)
    assert lifted_leak(2.0e-9, 1.0e5, 1.3e5, CURVE, row) >= 0.0
    assert lifted_leak(2.0e-9, 1.0e5, 1.3e5 + rise * 3.0e4, CURVE, row) == pytest.approx(1.0e-9)


def test_a_leak_that_never_opens_loses_nothing() -> None:
    leaked = [
        simulate(load_scenario("step-response", texts)).metrics["gas_leaked"].value
        for texts in ((), OPENING, ("effects.leak_opening.pressure=10 bar_d",))
    ]
    assert leaked[0] > leaked[1] > leaked[2] == 0.0


def test_a_linear_model_has_the_leak_as_a_difference_of_two_runs_has() -> None:
    venting = ("controller.kind=constant", "controller.command=-0.4", "run.duration=0.3 s", *OPENING)
    rates = linearise("torque-task-proportional", at=0.2, overrides=venting).found.rates
    step = ("run.step=0.01 ms", "run.output_interval=0.01 ms")
    found = simulate(load_scenario("torque-task-proportional", (*venting, *step))).recording
    here = int(np.searchsorted(found.time, 0.2 - 1e-9))
    slope = (found["pressure_2"][here + 20] - found["pressure_2"][here - 20]) / (40 * 1e-5)
    assert rates[1] == pytest.approx(slope, rel=1e-3)


PLAY = ("effects.spool_play.width=0.2",)


def test_a_spool_with_play_is_the_one_of_the_rig_and_lags_on_the_way_back() -> None:
    row, place, rig, shown = SpoolPlay(0.2), SpoolPlace(0.0), 0.0, []
    for command in (0.0, 0.05, 0.5, 1.0, 0.9, 0.7, -1.0, -0.95, 2.0, -0.5):
        now = command_behind_play(command, row, place)
        place = settle(row, place, now)
        if command <= 1.5:
            rig = spool_position(rig, command, 0.2)
            assert now == pytest.approx(rig, abs=1e-15)
        shown.append(now)
    assert shown[1] == 0.0
    assert shown[3:5] == [1.0, 1.0]
    assert shown[6:9] == [-1.0, -1.0, 2.0]


@pytest.mark.parametrize(("text", "name"), [(PLAY[0], "spool_play"), ("effects.ice.blockage_per_gas=100 1/kg", "ice")])
def test_a_linear_model_refuses_an_effect_with_a_state_in_one_line(text: str, name: str) -> None:
    with pytest.raises(SimulationError, match=f"effect '{name}' has state variables, .*switch the effect off"):
        linearise("torque-task-proportional", at=0.2, overrides=("run.duration=0.3 s", text))


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


REAL = ("effects.second_virial.share=1",)


def test_gas_that_is_not_ideal_loses_no_mass_and_fills_a_chamber_with_two_percent_more() -> None:
    ideal, real = (simulate(load_scenario("step-response", texts)).recording for texts in ((), REAL))
    stored = real["mass_1"] + real["mass_2"]
    balance = real["supplied_mass"] - real["vented_mass"] - (stored - stored[0])
    assert np.abs(balance).max() < 1e-15
    assert real["mass_1"][-1] / ideal["mass_1"][-1] == pytest.approx(1.025, abs=0.002)
    assert real["pressure_1"][-1] == pytest.approx(ideal["pressure_1"][-1], rel=1e-3)


def test_a_linear_model_of_gas_that_is_not_ideal_is_a_difference_of_two_runs() -> None:
    moving = ("controller.kind=constant", "controller.command=-0.4", "run.duration=0.3 s", *REAL)
    rates = linearise("torque-task-proportional", at=0.2, overrides=moving).found.rates
    step = ("run.step=0.01 ms", "run.output_interval=0.01 ms")
    found = simulate(load_scenario("torque-task-proportional", (*moving, *step))).recording
    here = int(np.searchsorted(found.time, 0.2 - 1e-9))
    slope = (found["pressure_2"][here + 20] - found["pressure_2"][here - 20]) / (40 * 1e-5)
    assert rates[1] == pytest.approx(slope, rel=1e-3)


@pytest.mark.parametrize(
    ("texts", "what"),
    [(THERMAL, "gas_model.kind=thermal"), (("supply_line.plantarflexion.droop=3e6 Pa s/kg",), r"\[supply_line\]")],
)
def test_gas_that_is_not_ideal_is_refused_where_it_has_no_step(texts: tuple[str, ...], what: str) -> None:
    with pytest.raises(ScenarioError, match=f"effect 'second_virial'.*{what}.*effects.second_virial.share=0"):
        plan_run(load_scenario("step-response", (*texts, *REAL)))


def test_a_laminar_gap_passes_its_coefficient_times_the_difference_of_the_squares_at_any_pressures() -> None:
    gap = LaminarLeak(1.0e-15)
    for first, second in ((6.0e5, 1.0e5), (2.0e5, 3.0e5), (3.0e5, 2.9995e5), (3.0e5, 3.0e5 - 1.0), (2.0e5, 2.0e5)):
        through = orifice_flow(first, second, leak_with_gap(1.0e-10, first, second, CURVE, gap), CURVE)
        alone = orifice_flow(first, second, 1.0e-10, CURVE)
        assert through - alone == pytest.approx(1.0e-15 * (first**2 - second**2), rel=1e-9, abs=1e-22)
