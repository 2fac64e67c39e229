"""The league: who plays, on which devices, and what is said of whom."""

import dataclasses
import importlib.util
import shlex

import numpy as np
import pytest

import ppafo
from ppafo.control.catalog import CONTROLLERS
from ppafo.errors import ScenarioError, SimulationError
from ppafo.questions.league import bound, torque
from ppafo.questions.league.answer import League, league_remarks
from ppafo.questions.league.solve import league
from ppafo.questions.league.standing import ENTRANTS, UNCERTAINTIES, Robustness, draw_devices, draw_factors
from ppafo.simulation.simulate import Status

SHORT = ("run.duration=0.6 s", "reference.ramp_time=0.3 s", "reference.level=3 N m")
BY_NAME = {entrant.name: entrant for entrant in ENTRANTS}


@pytest.fixture(scope="module")
def small() -> League:
    """Three entrants on a short task, with a few draws."""
    chosen = [BY_NAME[name] for name in ("on_off", "pid-paper", "feedback_linearisation")]
    return league("torque-task-proportional", SHORT, draws=6, entrants=chosen)


def test_an_entrant_whose_run_diverges_is_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    contest = torque.torque_contest("torque-task-proportional", SHORT)
    failed = dataclasses.replace(
        torque.simulate(contest.scenario_of(BY_NAME["pid-paper"])),
        status=Status("diverged", 0.1, "it diverged"),
    )
    monkeypatch.setattr(torque, "simulate", lambda _: failed)
    with pytest.raises(SimulationError, match="it diverged"):
        contest.evaluate(BY_NAME["pid-paper"], 0, 1, print)


def test_every_controller_that_follows_a_reference_plays_under_a_name_of_its_own() -> None:
    assert {entrant.kind for entrant in ENTRANTS} == {name for name, law in CONTROLLERS.items() if law.plan is None} - {
        "constant"
    }
    assert len(BY_NAME) == len(ENTRANTS)
    assert all(entrant.source and entrant.found for entrant in ENTRANTS)


def test_the_best_stands_first_with_its_source_and_a_command_that_runs_it_again(small: League) -> None:
    names = [standing.entrant.name for standing in small.standings]
    assert names == ["feedback_linearisation", "pid-paper", "on_off"]
    standing = small.standings[1]
    scenario = ppafo.load_scenario("torque-task-proportional", [*standing.entrant.overrides, *SHORT])
    assert standing.measures["rms_error"] == ppafo.simulate(scenario).metrics["rms_error"].value
    assert standing.command.startswith("ppafo simulate torque-task-proportional --set controller.kind=pid")


def test_the_command_of_an_entrant_that_learnt_has_its_table() -> None:
    played = league("torque-task-proportional", SHORT, draws=0, entrants=[BY_NAME["damped_proportional-learnt"]])
    (standing,) = played.standings
    words = shlex.split(standing.command)
    again = ppafo.simulate(words[2], [word for word in words[3:] if word != "--set"])
    assert standing.measures["rms_error"] == again.metrics["rms_error"].value
    assert standing.learning is not None
    assert standing.measures["rms_error"] == min(standing.learning.errors) < standing.learning.errors[0]


def test_an_entrant_keeps_its_own_gains_whatever_the_scenario_has() -> None:
    scenario = ppafo.load_scenario("torque-task-proportional", BY_NAME["damped_proportional"].overrides)
    assert scenario.control.settings["proportional_gain"] == 1.7
    anti_windup = ppafo.load_scenario("torque-task-anti-windup", BY_NAME["pid-paper"].overrides)
    assert anti_windup.control.settings == ppafo.load_scenario("torque-task-proportional").control.settings


@pytest.mark.skipif(importlib.util.find_spec("casadi") is None, reason="needs the extra 'optimal'")
def test_every_standing_is_above_the_bound_of_its_valve(small: League) -> None:
    assert set(small.bounds) == {"proportional", "solenoid"}
    assert not small.without_bound
    for standing in small.standings:
        error, gas = small.error_above_least(standing), small.gas_above_least(standing)
        assert error is not None
        assert error >= 0.0
        assert (gas is None) == (standing.entrant.valve == "solenoid")
        assert gas is None or gas > -1e-6
    pair = small.bounds["solenoid"]
    assert isinstance(pair, torque.TorqueBound)
    assert pair.sampled is not None
    assert pair.bound.least_error.rms_error < pair.sampled.certified == pair.least_error
    assert len(small.bounds["proportional"].played) == 1 + len(small.bounds["proportional"].bound.curve)
    assert small.bounds["solenoid"].played == ()


def test_draws_are_the_same_for_all_and_within_their_shares() -> None:
    factors = draw_factors(200)
    assert np.array_equal(factors, draw_factors(200))
    shares = np.array([item.fraction for item in UNCERTAINTIES])
    assert (np.abs(factors - 1.0) <= shares).all()
    assert (np.abs(factors - 1.0).max(axis=0) > 0.9 * shares).all()


def test_each_factor_scales_its_own_value_of_the_device() -> None:
    scenario = ppafo.load_scenario("torque-task-proportional")
    factors = np.array([[1.1, 0.9, 1.2, 0.8, 1.05, 0.7]])
    (drawn,) = draw_devices(scenario, factors)
    before, after = scenario.device, drawn.device
    assert after.valve.orifice.area == pytest.approx(1.1 * before.valve.orifice.area)  # type: ignore[union-attr]
    assert after.actuator.leak.area == pytest.approx(0.9 * before.actuator.leak.area)  # type: ignore[union-attr]
    assert after.actuator.dead_volume_1 == pytest.approx(1.2 * before.actuator.dead_volume_1)
    assert after.actuator.dead_volume_2 == pytest.approx(0.8 * before.actuator.dead_volume_2)
    gauge = [device.supply.pressure - device.supply.atmospheric_pressure for device in (before, after)]
    assert gauge[1] == pytest.approx(1.05 * gauge[0])
    assert after.friction.static_torque == pytest.approx(0.7 * before.friction.static_torque)
    assert drawn.initial_pressure_1 == scenario.initial_pressure_1


def test_a_run_that_diverged_counts_as_worst(small: League) -> None:
    robust = Robustness((*({"rms_error": value} for value in (0.1, 0.2)), None, {"rms_error": 0.3}))
    assert (robust.failed, *(robust.not_exceeded("rms_error", share) for share in (0.5, 0.95))) == (1, 0.3, np.inf)
    assert all(standing.robustness and standing.robustness.failed == 0 for standing in small.standings)


@pytest.mark.thorough
def test_every_draw_has_noise_of_its_own_and_its_share_is_told() -> None:
    noisy = (*SHORT, "sensors.pressure_noise=5 kPa_d")
    one, other = (
        league("torque-task-proportional", (*noisy, f"sensors.seed={seed}"), draws=4, entrants=[BY_NAME["pid-paper"]])
        for seed in (1, 2)
    )
    robust, again = one.standings[0].robustness, other.standings[0].robustness
    assert robust is not None
    assert again is not None
    assert robust.drawn == again.drawn, "the seed of the scenario does not decide"
    noise = robust.noise("rms_error")
    assert noise is not None
    assert noise.high > 0.0
    assert any("due to sensor noise: pid-paper" in note for note in league_remarks(one))


def test_who_cannot_play_is_absent_and_the_reason_is_told() -> None:
    chosen = [BY_NAME[name] for name in ("on_off", "pid-paper")]
    played = league("torque-task-slow-valve", ["run.duration=0.3 s", "motion.kind=free"], draws=0, entrants=chosen)
    assert [standing.entrant.name for standing in played.standings] == ["pid-paper"]
    assert "spool_frequency" in played.absent["on_off"]
    assert "free" in played.without_bound or "CasADi" in played.without_bound
    assert played.standings[0].robustness is None
    assert played.error_above_least(played.standings[0]) is None


def test_without_the_extra_the_league_is_played_and_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bound, "find_spec", lambda _: None)
    played = league("torque-task-proportional", SHORT, draws=0, entrants=[BY_NAME["pid-paper"]])
    assert played.bounds == {}
    assert "pip install ppafo[optimal]" in played.without_bound
    assert played.gas_above_least(played.standings[0]) is None


@pytest.mark.parametrize("override", ["controller.rate=100 Hz", "device.valve=solenoid"])
def test_overrides_of_controller_and_valve_are_refused(override: str) -> None:
    with pytest.raises(ScenarioError, match="has its own settings and valve"):
        league(overrides=[override])


def test_a_scenario_without_reference_and_senseless_draws_are_refused() -> None:
    with pytest.raises(ScenarioError, match=r"has no \[reference\]"):
        league("step-response", draws=0)
    with pytest.raises(ScenarioError, match="draws = -1: must be from 0"):
        league(draws=-1)


def test_standings_are_values(small: League) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        small.standings[0].command = ""  # type: ignore[misc]
