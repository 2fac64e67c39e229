"""What the paper's results imply about the settings that it does not print."""

import numpy as np
import pytest

from ppafo.answers.writing import text_of
from ppafo.cli.main import main
from ppafo.errors import ScenarioError
from ppafo.parameters import load_device
from ppafo.questions.unreported.answer import (
    REPLICATES,
    TOO_FEW,
    Family,
    conclusions,
    implications_of,
    spread_of,
    strongest_links,
    weighted_quantiles,
    within_reach,
)
from ppafo.questions.unreported.proposal import Proposal, from_rows, normal_scale, shipped_proposal, to_rows
from ppafo.questions.unreported.settings import (
    ATTITUDE,
    CELLS,
    EVIDENCE,
    FALL,
    GAS,
    IMPROVEMENT,
    MASS_CENTRE,
    METRICS,
    PLATEAU,
    PROPORTIONAL,
    RISE,
    SETTINGS,
    SOLENOID,
    STEP,
    STEP_RUN,
    TEXT_OF_SOLENOID,
    TEXT_OF_STEP,
    VOLUME,
    agreement,
    agreement_with,
    columns,
    effective,
    improvement,
    spread,
    step_columns,
    step_observables,
    values_of,
)
from ppafo.questions.unreported.solve import NEGLIGIBLE, infer_settings, step_metrics
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.studies.distributions import jackknife_reach
from ppafo.studies.draws import replicate_seed

PAPER = {
    SOLENOID: {"rms_error": 1.0, "gas_supplied": 1.1e-3, "oscillations_ramp": 8.0, "oscillations_hold": 0.0},
    PROPORTIONAL: {"rms_error": 0.85, "gas_supplied": 0.407e-3, "oscillations_ramp": 0.0, "oscillations_hold": 0.0},
    STEP: {PLATEAU: 0.0, FALL: 5.0, RISE: 0.0},
}


def metrics_with(**changed: float) -> dict[str, dict[str, np.ndarray]]:
    """One completion that agrees with the paper, with numbers of the solenoid pair changed."""
    found = {valve: {name: np.array([value]) for name, value in of.items()} for valve, of in PAPER.items()}
    found[SOLENOID] |= {name: np.array([value]) for name, value in changed.items()}
    return found


@pytest.fixture(scope="module")
def family() -> Family:
    return infer_settings(4096, seed=1)


def test_a_completion_that_gives_what_is_printed_agrees_fully() -> None:
    assert agreement(metrics_with())[0] > 0.95


@pytest.mark.parametrize(
    "changed", [{"oscillations_ramp": 2.0}, {"oscillations_hold": 5.0}, {"gas_supplied": 2.0e-3}, {"rms_error": 0.8}]
)
def test_a_completion_that_contradicts_the_paper_counts_for_nothing(changed: dict[str, float]) -> None:
    assert agreement(metrics_with(**changed))[0] < 1e-3


def test_what_is_left_out_does_not_count() -> None:
    worse = metrics_with(rms_error=0.8)
    assert improvement(worse)[0] < 0.0
    assert agreement(worse, (IMPROVEMENT,))[0] > 0.95
    assert agreement(metrics_with(gas_supplied=2.0e-3), GAS)[0] > 0.95


def test_points_of_the_unit_cube_become_settings_within_what_is_allowed() -> None:
    draws = values_of(spread(512, seed=3))
    for setting in SETTINGS:
        values = draws[setting.name]
        if setting.choices:
            assert set(values) == set(setting.choices)
        else:
            assert setting.low <= values.min() < values.max() <= setting.high


@pytest.mark.parametrize("valve", [SOLENOID, PROPORTIONAL])
def test_a_completion_is_the_scenario_with_the_same_overrides(family: Family, valve: str) -> None:
    first = {name: values[:1] for name, values in family.draws.items()}
    overrides = {path: float(values[0]) for path, values in columns(first, valve).items()}
    units = {"motion.angle": "rad", "actuator.dead_volume_1": "m^3", "actuator.dead_volume_2": "m^3"}
    units |= {"supply.pressure": "Pa_a", "supply.dorsiflexion_pressure": "Pa_a", "controller.rate": "Hz"}
    units |= {"run.duration": "s", "reference.ramp_time": "s", "reference.level": "N m", "reference.start_level": "N m"}
    units |= {"valve.opening_delay": "s", "valve.closing_delay": "s", "actuator.volume_per_angle": "m^3/rad"}
    texts = [f"{path}={value!r} {units.get(path, '')}".strip() for path, value in overrides.items()]
    alone = simulate(load_scenario(f"torque-task-{valve}", texts)).metrics
    for name, value in family.metrics[valve].items():
        assert value[0] == pytest.approx(alone[name].value, rel=1e-9)


def test_the_conclusion_on_gas_holds_over_nearly_all_completions(family: Family) -> None:
    found = conclusions(family)
    assert [item.reading for item in found[::3]] == ["U is the opening", "U is in volts of 5", "U is in volts of 10"]
    for better, less, both in zip(found[::3], found[1::3], found[2::3], strict=True):
        assert less.of_all > 0.8
        assert both.of_all <= min(better.of_all, less.of_all)
        assert both.of_weight <= min(better.of_weight, less.of_weight), "one set of weights"


def test_within_reach_of_the_supply_the_proportional_valve_tracks_better_and_15_percent_lie_beyond(
    family: Family,
) -> None:
    found = within_reach(family)
    assert found.count >= 8
    assert found.better > 0.9
    assert found.improvement[1] > 60.0
    assert found.demand[1] > 1.0


def test_of_the_shipped_sets_the_fitted_one_agrees_best_with_all_that_the_paper_says() -> None:
    sets = ("ppafo2011", "ppafo2011-consistent", "ppafo2011-fitted")
    actuators = [load_device(name).actuator for name in sets]
    device = {
        path: np.array([getattr(actuator, path.partition(".")[2]) for actuator in actuators])
        for path in ("actuator.volume_per_angle", "actuator.dead_volume_1", "actuator.dead_volume_2")
    }
    metrics = {
        valve: run_ensemble(load_scenario(f"torque-task-{valve}"), device, METRICS).metrics
        for valve in (SOLENOID, PROPORTIONAL)
    }
    of_task = agreement_with([entry.id for entry in EVIDENCE if entry.id not in TEXT_OF_STEP], metrics)
    attitudes = np.arange(-90.0, 91.0, 15.0)
    lying = {path: np.repeat(values, attitudes.size) for path, values in device.items()}
    lying["motion.shank.level"] = np.tile(np.radians(attitudes), len(sets))
    of_text = agreement_with(TEXT_OF_STEP, {STEP: step_metrics(lying)}).reshape(len(sets), attitudes.size)
    printed, consistent, fitted = np.log(of_task * of_text.mean(axis=1) + 1e-300)
    assert fitted > consistent + 1.0
    assert fitted > printed + 5.0


def test_the_attitude_of_the_leg_changes_what_the_text_of_figure_7_says_of_a_volume() -> None:
    """With 51 cm^3/rad and 2 cm^3 pressure 2 rises at every attitude; with 18.1 and 32 pressure 1 never falls."""
    degrees = np.array([-90.0, 0.0, 90.0])
    volumes = np.repeat([51e-6, 18.1e-6], 3), np.repeat([2e-6, 32e-6], 3)
    varied = {"actuator.volume_per_angle": volumes[0], "motion.shank.level": np.tile(np.radians(degrees), 2)}
    varied |= {f"actuator.dead_volume_{number}": volumes[1] for number in (1, 2)}
    found = step_metrics(varied)
    assert found[RISE][:3] == pytest.approx([8.4, 43.6, 46.7], abs=0.1)
    assert found[PLATEAU][:3] == pytest.approx([0.0, 0.0, 32.0], abs=1.1)
    assert found[FALL][3:] == pytest.approx([0.0, 0.0, 0.0], abs=0.1)


def test_the_step_response_is_inferred_with_its_leg_and_the_attitude_of_its_shank(family: Family) -> None:
    first = {name: values[:1] for name, values in family.draws.items()}
    texts = [
        f"motion.shank.level={float(family.draws[ATTITUDE][0])!r} deg",
        f"motion.foot_mass_centre={float(family.draws[MASS_CENTRE][0])!r} cm",
        *(
            f"{path}={float(values[0])!r} {'' if 'coefficient' in path else 'm^3'}".strip()
            for path, values in step_columns(first).items()
            if path.startswith(("actuator.dead", "valve."))
        ),
        f"actuator.volume_per_angle={float(family.draws[VOLUME][0])!r} cm^3/rad",
    ]
    base = load_scenario("step-response", [*STEP_RUN, *texts])
    recording = simulate(base).recording
    traces = {name: recording[name][:, None] for name in ("angle", "pressure_1", "pressure_2")}
    supply = base.device.supply
    alone = step_observables(recording.time, traces, supply.pressure, supply.atmospheric_pressure)
    for name, value in alone.items():
        assert family.metrics[STEP][name][0] == pytest.approx(value[0], abs=1e-6)


def test_what_the_text_rules_out_is_not_run_any_further(family: Family) -> None:
    later = slice(family.even, None)
    assert family.drawn > family.weights.size
    assert np.isfinite(family.metrics[PROPORTIONAL]["rms_error"]).all()
    text = (*TEXT_OF_STEP, *TEXT_OF_SOLENOID)
    assert (agreement_with(text, family.metrics)[later] > NEGLIGIBLE).all()
    assert (agreement_with(text, family.metrics)[: family.even] <= NEGLIGIBLE).any(), "even draws are all run"


def test_every_setting_gets_a_verdict(family: Family) -> None:
    found = implications_of(family)
    assert [item.setting.name for item in found] == [setting.name for setting in SETTINGS]
    assert {item.verdict for item in found} == {TOO_FEW}, "4096 draws are worth only a few"
    ramp = found[1]
    assert ramp.low <= ramp.median <= ramp.high
    assert len(strongest_links(family)) == 4


def test_the_share_of_all_is_within_its_error_as_often_as_is_said() -> None:
    """Against a large even sample of a stand-in whose truth is known: the share of a corner of the cube."""
    held = []
    for seed in range(60):
        points = [spread(41, replicate_seed(seed, number))[:, 3] < 0.3 for number in range(REPLICATES)]
        sums, sizes = np.array([part.sum() for part in points]), np.array([part.size for part in points])
        left_out = (sums.sum() - sums) / (sizes.sum() - sizes)
        reach = jackknife_reach(left_out, 0.95)
        held.append(abs(sums.sum() / sizes.sum() - 0.3) <= reach)
    assert np.mean(held) >= 0.9


def test_weighted_quantiles_are_those_of_repeated_values() -> None:
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([0.25, 0.5, 0.25])
    assert weighted_quantiles(values, weights, (0.4, 0.6, 0.9)) == [1.0, 2.0, 3.0]
    assert np.isnan(weighted_quantiles(values, np.zeros(3), (0.5,))[0])


def test_the_same_seed_gives_the_same_family(family: Family) -> None:
    again = infer_settings(4096, seed=1)
    np.testing.assert_array_equal(again.weights, family.weights)


def test_too_few_draws_are_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ScenarioError, match="draws = 10"):
        infer_settings(10)
    assert main(["unreported", "--draws", "10"]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_the_command_writes_figure_and_document(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["unreported", "--draws", "1000", "--out", str(tmp_path / "out")]) == 0
    assert "reference level" in capsys.readouterr().out
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {
        "unreported.json",
        "unreported.txt",
        "report.html",
        "unreported-settings.png",
        "unreported-settings.svg",
    } <= names


def test_a_choice_is_implied_where_one_alone_is_left_and_open_where_all_are_alike() -> None:
    assert spread_of([1.0, 0.0]) == pytest.approx(0.0)
    assert spread_of([0.97, 0.03]) < 0.2
    assert spread_of([0.5, 0.5]) == pytest.approx(1.0)
    assert spread_of([1 / 3] * 3) == pytest.approx(1.0)
    assert np.isnan(spread_of([0.0, 0.0]))


def mixture() -> Proposal:
    """Two parts over two numbers and a choice of three."""
    shapes = np.array([[[0.5, 0.0], [0.3, 0.2]], [[0.8, 0.0], [-0.4, 0.6]]])
    shares = (np.array([[0.6, 0.3, 0.1], [0.2, 0.2, 0.6]]),)
    return Proposal(np.array([0.7, 0.3]), np.array([[-0.5, 0.2], [1.0, -0.3]]), shapes, shares, (0, 3, 0))


def test_a_proposal_has_the_density_that_it_draws_from() -> None:
    chance = np.random.default_rng(5)
    drawn, even = mixture().draw(200_000, chance), chance.random((200_000, 3))
    density = mixture().density(even)
    assert density.mean() == pytest.approx(1.0, abs=0.02)
    for column in range(3):
        for low, high in ((0.0, 0.1), (0.1, 0.5), (0.7, 1.0)):
            share = ((drawn[:, column] >= low) & (drawn[:, column] < high)).mean()
            inside = (even[:, column] >= low) & (even[:, column] < high)
            assert share == pytest.approx((density * inside).mean(), abs=0.012)


def test_weights_by_a_proposal_recover_a_posterior_that_is_known() -> None:
    """Two correlated numbers, normally distributed in the normal scale, and a choice; the mixture fits neither well.

    With a quarter spread evenly, means, correlation and shares are those of the posterior within five times the error
    that the effective sample size has.
    """
    chance = np.random.default_rng(11)
    count, even = 40_000, 10_000
    points = np.concatenate([chance.random((even, 3)), mixture().draw(count - even, chance)])
    density = 0.25 + 0.75 * mixture().density(points)
    at = normal_scale(points[:, [0, 2]])
    mean, covariance = np.array([0.3, -0.6]), np.array([[0.25, 0.15], [0.15, 0.36]])
    away = at - mean
    logarithm = -0.5 * np.einsum("ni,ij,nj->n", away, np.linalg.inv(covariance), away) + 0.5 * (at**2).sum(axis=1)
    shares = np.array([0.2, 0.5, 0.3])
    chosen = np.floor(3.0 * points[:, 1]).astype(int)
    weights = np.exp(logarithm) * shares[chosen] / density
    weights /= weights.sum()
    error = 5.0 / np.sqrt(effective(weights))
    assert effective(weights) > 2000.0
    assert weights @ at == pytest.approx(mean, abs=error * 0.6)
    assert (weights[:, None] * away).T @ away == pytest.approx(covariance, abs=error * 0.5)
    assert np.bincount(chosen, weights) == pytest.approx(shares, abs=error * 0.5)


def test_a_proposal_is_the_same_when_it_is_written_and_read() -> None:
    again = from_rows(to_rows(mixture()), (0, 3, 0))
    points = np.random.default_rng(2).random((100, 3))
    assert again.density(points) == pytest.approx(mixture().density(points), rel=1e-12)


def test_the_shipped_proposal_covers_the_cube_and_every_choice() -> None:
    proposal = shipped_proposal()
    even = spread(256, seed=4)
    assert proposal.cells == CELLS
    assert np.isfinite(np.log(proposal.density(even))).all()
    assert all((table > 0.0).all() for table in proposal.shares)


def test_the_proposal_finds_what_even_draws_rarely_meet(family: Family) -> None:
    agrees = agreement(family.metrics) > 1e-3
    assert agrees[family.even :].mean() > 20.0 * agrees[: family.even].mean()
    assert family.weights.sum() == pytest.approx(1.0)
    assert family.drawn >= family.weights.size


def test_every_share_has_the_error_between_independent_replicates(family: Family) -> None:
    from scipy.stats import t as student

    assert set(family.replicate) == set(range(REPLICATES))
    others = family.without_each()
    for number, other in enumerate(others):
        assert set(other.replicate) == set(range(REPLICATES)) - {number}
    shares = np.array([[item.of_all for item in conclusions(other)] for other in others])
    reach = student(REPLICATES - 1).ppf(0.975) * np.sqrt((REPLICATES - 1) * np.var(shares, axis=0))
    assert [item.error[0] for item in conclusions(family)] == pytest.approx(reach)
    for item in implications_of(family):
        errors = item.error["shares"] if item.setting.choices else item.error["median"]
        assert max(errors) > 0.0
    text = text_of(family.answer())
    assert text.count("±") > 20
    assert "4 independent replicates" in text
