"""The stopping rule: it stops when it should, and its intervals hold although it looks again and again."""

import math
from collections.abc import Callable, Mapping
from statistics import NormalDist

import numpy as np
import pytest

from ppafo.analyses.sweep.statistic import draw_until, estimate
from ppafo.analyses.sweep.statistic_kind import Statistic, parse_statistic, probability_of
from ppafo.analyses.sweep.stopping import StatisticEstimate, StoppingRule, target_width
from ppafo.errors import StudyError
from ppafo.studies.distributions import Floats, LogNormalAround, NormalAround, UniformBetween
from ppafo.studies.draws import REPLICATES, Uncertainty
from ppafo.studies.intervals import replicates_interval
from ppafo.studies.study import RandomValue
from tests.model_runs import model_runs

METRIC = "rms_error"
SIGMA = 0.5
UNCERTAIN = Uncertainty((RandomValue("x", LogNormalAround(1.0, math.exp(SIGMA))),))
MEAN = math.exp(0.5 * SIGMA**2)
NORMAL = NormalDist(sigma=SIGMA)
THE_MEAN = parse_statistic("mean", METRIC, None)
STUDY = "torque-task-uncertainty"


Model = Callable[[Mapping[str, Floats]], Mapping[str, Floats]]


def value(columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """The uncertain value itself."""
    return {METRIC: columns["x"]}


def drawn_until(
    model: Model, uncertain: Uncertainty, statistic: Statistic, rule: StoppingRule, seed: int
) -> StatisticEstimate:
    """What is found on a formula in place of a simulation."""
    return draw_until(model_runs(model, [METRIC]), uncertain, METRIC, statistic, rule, seed).found


def failing(share: float) -> Model:
    """The same, of which the largest fail."""

    def run(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        failed = columns["x"] > math.exp(NORMAL.inv_cdf(1.0 - share))
        return {METRIC: np.where(failed, np.nan, columns["x"])}

    return run


def test_it_stops_at_the_first_look_that_is_narrow_enough() -> None:
    rule = StoppingRule(0.03, is_relative=False, first=64, maximum=2**16)
    found = drawn_until(value, UNCERTAIN, THE_MEAN, rule, 1)
    widths = [look.interval.width + look.unseen for look in found.looks]
    assert found.is_met
    assert widths[-1] <= 0.03 < min(widths[:-1])
    assert [look.draws for look in found.looks] == [64 * 2**number for number in range(len(widths))]
    assert found.values.size == found.draws
    assert np.array_equal(found.values, UNCERTAIN.replicated_columns(0, found.draws, 1)["x"])


def test_a_width_that_is_out_of_reach_is_said_and_not_hidden() -> None:
    rule = StoppingRule(1e-6, is_relative=True, first=64, maximum=200)
    found = drawn_until(value, UNCERTAIN, THE_MEAN, rule, 1)
    assert not found.is_met
    assert [look.draws for look in found.looks] == [64, 128, 200]


@pytest.mark.parametrize(
    ("statistic", "truth", "width"),
    [
        (THE_MEAN, MEAN, 0.08),
        (parse_statistic("quantile 0.9", METRIC, None), math.exp(NORMAL.inv_cdf(0.9)), 0.3),
        (probability_of(1.5, True, "1.5 N m"), 1.0 - NORMAL.cdf(math.log(1.5)), 0.08),
    ],
)
def test_all_looks_together_hold_the_truth_as_often_as_is_said(
    statistic: Statistic, truth: float, width: float
) -> None:
    # A mean is not believed after so few, and is looked at each time.
    most = 2048 if statistic.is_of_replicates else 8192
    rule = StoppingRule(width, is_relative=False, first=64, maximum=most, confidence=0.9)
    found = [drawn_until(value, UNCERTAIN, statistic, rule, seed) for seed in range(300)]
    held = [all(look.interval.low <= truth <= look.interval.high for look in item.looks) for item in found]
    assert all(item.is_met is not statistic.is_of_replicates for item in found)
    assert np.mean(held) >= 0.9
    assert max(len(item.looks) for item in found) >= 3


def test_without_the_correction_they_would_not() -> None:
    rule = StoppingRule(0.08, is_relative=False, first=64, maximum=2048, confidence=0.9)
    held = []
    for seed in range(300):
        looks = drawn_until(value, UNCERTAIN, THE_MEAN, rule, seed).looks
        values = UNCERTAIN.random_columns(0, looks[-1].draws, seed)["x"]
        intervals = [THE_MEAN.estimate(values[: look.draws], 0.9) for look in looks]
        held.append(all(interval.low <= MEAN <= interval.high for interval in intervals))
    assert np.mean(held) < 0.88


NORMALS = Uncertainty(tuple(RandomValue(f"x{number}", NormalAround(0.0, 1.0)) for number in range(6)))


def test_a_mean_that_a_few_draws_carry_is_not_believed_and_drawn_on() -> None:
    def heavy(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        values = np.exp(2.0 * sum(columns[path] for path in NORMALS.paths) / math.sqrt(6.0))
        return {METRIC: values}

    rule = StoppingRule(0.5, is_relative=True, first=64, maximum=4096)
    found = [drawn_until(heavy, NORMALS, THE_MEAN, rule, seed) for seed in range(60)]
    wrong = [not item.interval.low <= math.exp(2.0) <= item.interval.high for item in found]
    narrow = [any(look.interval.width <= 0.5 * look.interval.value for look in item.looks) for item in found]
    assert np.mean(narrow) > 0.3, "an interval that is narrow enough comes often"
    assert np.mean([item.is_met and is_wrong for item, is_wrong in zip(found, wrong, strict=True)]) <= 0.05
    warned = [item for item in found if not item.looks[-1].is_carried]
    assert len(warned) > 50
    assert "do not trust this interval" in warned[0].remarks[0]
    quiet = drawn_until(value, UNCERTAIN, THE_MEAN, StoppingRule(0.05, False, first=512), 1)
    assert quiet.is_met
    (unseen,) = quiet.remarks
    assert "outcomes with a probability below 0.018 % may be missing" in unseen
    assert "up to 100 standard deviations" in unseen


def test_equal_values_are_no_known_mean_before_a_rare_one_could_have_come() -> None:
    rare = Uncertainty((RandomValue("x0", UniformBetween(0.0, 1.0)),))

    def outcomes(share: float) -> Model:
        def run(columns: Mapping[str, Floats]) -> dict[str, Floats]:
            values = 100.0 * (columns["x0"] < share)
            return {METRIC: values}

        return run

    rule = StoppingRule(0.2, is_relative=False, first=64, maximum=2**14)
    found = [drawn_until(outcomes(0.0003), rare, THE_MEAN, rule, seed) for seed in range(20)]
    wrong = [not item.interval.low <= 0.03 <= item.interval.high for item in found]
    # Each of these was met at its first look, with an interval from 0 to 0.
    assert np.mean([item.is_met and is_wrong for item, is_wrong in zip(found, wrong, strict=True)]) <= 0.05
    few = drawn_until(outcomes(0.0), rare, THE_MEAN, StoppingRule(0.2, False, 64, 1024), 1)
    assert not few.is_met
    assert "all 1,024 values are equal" in few.remarks[0]
    many = drawn_until(outcomes(0.0), rare, THE_MEAN, rule, 1)
    assert many.is_met
    (unseen,) = many.remarks
    assert "would shift the mean by up to 0.00018 d" in unseen


def test_a_mean_is_not_met_before_a_rare_jump_could_have_come() -> None:
    """Of the smooth part 256 draws know the mean; a jump of probability 0.0019 is missing among most such sets."""
    truth = 3.5 + 10.0 * 0.0019

    def jumps(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        return {METRIC: 3.0 + columns["x0"] + 10.0 * (columns["x1"] < 0.0019)}

    uncertain = Uncertainty(tuple(RandomValue(f"x{place}", UniformBetween(0.0, 1.0)) for place in range(2)))
    rule = StoppingRule(0.1, is_relative=False, first=256, maximum=2**16)
    for seed in range(20):
        found = drawn_until(jumps, uncertain, THE_MEAN, rule, seed)
        assert found.is_met
        assert float(np.max(found.values)) > 10.0
        assert found.interval.low <= truth <= found.interval.high


@pytest.mark.parametrize(("share", "size"), [(0.0003, 100.0), (0.0003, 1000.0), (0.0001, 25.0)])
def test_a_mean_that_is_met_holds_beside_a_jump_that_hardly_ever_comes(share: float, size: float) -> None:
    """A jump that is missing among the draws lies further than the width says, or moves the mean by less."""

    def jumps(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        return {METRIC: 3.0 + columns["x0"] + size * (columns["x1"] < share)}

    uncertain = Uncertainty(tuple(RandomValue(f"x{place}", UniformBetween(0.0, 1.0)) for place in range(2)))
    rule, truth = StoppingRule(0.01, is_relative=True, first=256, maximum=2**15), 3.5 + size * share
    found = [drawn_until(jumps, uncertain, THE_MEAN, rule, seed) for seed in range(20)]
    wrong = [item for item in found if item.is_met and not abs(item.interval.value - truth) < 0.01 * truth]
    assert len(wrong) <= 1


def test_a_mean_of_fewer_draws_than_would_show_a_rare_value_is_not_met_and_says_so() -> None:
    rule = StoppingRule(0.5, is_relative=True, first=64, maximum=1024)
    finding = draw_until(model_runs(value, [METRIC]), UNCERTAIN, METRIC, THE_MEAN, rule, 1)
    assert not finding.found.is_met
    assert "a mean needs at least 10,000 draws, and the maximum is 1,024" in finding.said[0]


def test_replicates_know_the_mean_of_a_smooth_function_far_better_than_independent_draws() -> None:
    def smooth(columns: Mapping[str, Floats]) -> Floats:
        return 3.0 + columns["x0"] + 2.0 * columns["x1"] + 3.0 * columns["x2"] + 0.1 * columns["x0"] * columns["x1"]

    seeds = range(200)
    drawn = [smooth(NORMALS.replicated_columns(0, 1024, seed)) for seed in seeds]
    independent = [np.mean(smooth(NORMALS.random_columns(0, 1024, seed))) for seed in seeds]
    assert np.var(independent) > 100.0 * np.var([np.mean(values) for values in drawn])
    intervals = [replicates_interval(values, REPLICATES, 0.9) for values in drawn]
    held = np.mean([interval.low <= 3.0 <= interval.high for interval in intervals])
    assert 0.85 <= held <= 0.95


def test_a_mean_that_rare_values_decide_is_not_met_by_replicates_that_count_them_alike() -> None:
    uniform = Uncertainty((RandomValue("x0", UniformBetween(0.0, 1.0)), RandomValue("x1", NormalAround(0.0, 1.0))))

    def rare(columns: Mapping[str, Floats]) -> Floats:
        return 1.0 + 0.1 * columns["x1"] + 100.0 * (columns["x0"] < 0.003)

    drawn = [rare(uniform.replicated_columns(0, 8192, seed)) for seed in range(60)]
    narrower = [replicates_interval(values, REPLICATES, 0.95) for values in drawn]
    floored = [THE_MEAN.estimate(values, 0.95) for values in drawn]
    assert np.mean([one.width < 0.6 * other.width for one, other in zip(narrower, floored, strict=True)]) > 0.3
    assert np.mean([interval.low <= 1.3 <= interval.high for interval in floored]) >= 0.93


def test_replicates_in_pieces_are_those_of_the_whole() -> None:
    whole = NORMALS.replicated_columns(0, 100, 3)
    pieces = [NORMALS.replicated_columns(first, count, 3) for first, count in ((0, 5), (5, 40), (45, 55))]
    for path, values in whole.items():
        assert np.array_equal(values, np.concatenate([piece[path] for piece in pieces]))


def test_failed_draws_are_left_out_and_counted_or_refused() -> None:
    rule = StoppingRule(0.1, is_relative=False, first=1024, maximum=2048, maximum_failed=0.02)
    found = drawn_until(failing(0.005), UNCERTAIN, THE_MEAN, rule, 1)
    assert 0 < found.looks[-1].missing <= 0.02 * found.draws
    assert found.values.size == found.draws - found.looks[-1].missing
    with pytest.raises(StudyError, match=r"runs failed .* more than the 2 % .*diverged"):
        drawn_until(failing(0.1), UNCERTAIN, THE_MEAN, rule, 1)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: StoppingRule(0.0, False), "width = 0.0"),
        (lambda: StoppingRule(math.nan, False), "width = nan"),
        (lambda: StoppingRule(1.0, False, first=4), "must be from 32"),
        (lambda: StoppingRule(1.0, False, first=512, maximum=256), "first must not exceed maximum"),
        (lambda: StoppingRule(1.0, False, confidence=0.2), "confidence = 0.2"),
        (lambda: parse_statistic("median", METRIC, None), "statistic 'median': must be 'mean'"),
        (lambda: parse_statistic("quantile 1.5", METRIC, None), "a fraction above 0 and below 1"),
        (lambda: parse_statistic("probability above 3 g", METRIC, None), "statistic 'probability above 3 g'"),
        (lambda: target_width(THE_MEAN, METRIC, "3 g"), "width = '3 g'"),
        (
            lambda: target_width(parse_statistic("probability above 1 N m", METRIC, None), METRIC, "1 %"),
            "plain number for a probability, for example 0.01",
        ),
    ],
)
def test_rules_and_words_that_make_no_sense_are_one_line(make: Callable[[], object], text: str) -> None:
    with pytest.raises(StudyError) as caught:
        make()
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_widths_are_read_in_the_unit_of_the_metric() -> None:
    assert target_width(THE_MEAN, "gas_supplied", "2 g") == (pytest.approx(0.002), False)
    assert target_width(THE_MEAN, "largest_pressure", "1 psi_d") == (pytest.approx(6894.757), False)
    assert target_width(THE_MEAN, "gas_supplied", "5 %") == (pytest.approx(0.05), True)


def test_a_scenario_is_drawn_until_its_error_is_known() -> None:
    def asked() -> StatisticEstimate:
        return estimate(
            STUDY,
            metric=METRIC,
            statistic="quantile 0.5",
            width="10 %",
            configuration="proportional",
            first_draws=64,
            draws=1024,
        ).found

    found = asked()
    assert found.is_met
    assert found.interval.low < 0.875 < found.interval.high
    assert asked() == found


def test_further_metrics_are_means_over_the_same_draws_that_have_a_value() -> None:
    def model(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        x = columns["x"]
        return {METRIC: x, "final_error": np.where(x > 1.0, 2.0 * x, np.nan)}

    rule = StoppingRule(10.0, is_relative=False, first=256, maximum=256)
    runs = model_runs(model, [METRIC, "final_error"])
    finding = draw_until(runs, UNCERTAIN, METRIC, THE_MEAN, rule, 1, ["final_error"])
    found, mean = finding.found, finding.found.also["final_error"]
    above = found.values[found.values > 1.0]
    assert mean.draws == above.size < 256
    assert mean.value == pytest.approx(2.0 * above.mean())
    truth = 2.0 * MEAN * NORMAL.cdf(SIGMA**2) / 0.5
    assert mean.low < truth < mean.high
    assert finding.to_dict()["also"]["final_error"]["draws"] == mean.draws
    assert "Further metrics" in [part.heading for part in finding.parts]
