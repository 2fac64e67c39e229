"""The estimator on an analytic law, where truth and noise are known."""

import math

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.fit import Fit, FitNumber, ResidualBlock, fit
from ppafo.identification.noise import Noise, burg, noise_of, whiten
from ppafo.signals.recording import Floats

_COUNT = 300
_TIME = np.linspace(0.0, 1.0, _COUNT)
_TRUTH = {"rate": 4.0, "level": 2.0, "zero_1": 0.01, "gain_2": -0.01, "start of rise": 0.3, "start of fall": 1.2}
_BLOCKS = tuple(
    ResidualBlock(label, channel, slice(place * _COUNT, (place + 1) * _COUNT))
    for place, (label, channel) in enumerate(
        [("rise", "first"), ("rise", "second"), ("fall", "first"), ("fall", "second")]
    )
)
_NUMBERS = (
    FitNumber("rate", 2.0, 0.1, 50.0, 2.0),
    FitNumber("level", 1.0, 0.1, 10.0, 1.0),
    FitNumber("zero_1", 0.0, -1.0, 1.0, 0.02, 0.02),
    FitNumber("gain_2", 0.0, -0.5, 0.5, 0.02, 0.02),
    FitNumber("start of rise", 0.32, -1.0, 3.0, 0.05, 0.05),
    FitNumber("start of fall", 1.15, -1.0, 3.0, 0.05, 0.05),
)


def _law(rate: Floats, level: Floats, zero: Floats, gain: Floats, *starts: Floats, slower: float = 1.0) -> Floats:
    """An exponential from its start to half the level and back, seen by one sensor, and its rate by another."""
    rows = []
    for start, end, own in zip(starts, (level, 0.5 * level), (rate, slower * rate), strict=True):
        away = (start - end) * np.exp(-own * _TIME[:, None])
        rows += [end + away + zero, (1.0 + gain) * own * away]
    return np.concatenate(rows)


def _noise(kind: str, generator: np.random.Generator) -> Floats:
    white = generator.normal(size=_COUNT)
    if kind == "AR(1)":
        found = np.empty(_COUNT)
        found[0] = white[0]
        for place in range(1, _COUNT):
            found[place] = 0.9 * found[place - 1] + math.sqrt(1.0 - 0.81) * white[place]
        return found
    if kind == "random walk":
        return white + np.cumsum(generator.normal(size=_COUNT)) / math.sqrt(_COUNT)
    if kind == "Student t":
        return generator.standard_t(3.0, _COUNT) / math.sqrt(3.0)
    if kind == "hum":
        return white + math.sqrt(2.0) * np.sin(2.0 * math.pi * (23.0 * _TIME + generator.random()))
    return white


def _fit(kind: str, generator: np.random.Generator, size: float = 0.02, slower: float = 1.0) -> Fit:
    truth = dict(_TRUTH)
    for one in _NUMBERS:
        if math.isfinite(one.deviation):
            truth[one.name] = one.start + one.deviation * generator.normal()
    clean = _law(*(np.array([one]) for one in truth.values()), slower=slower)[:, 0]
    measured = clean + size * np.concatenate([_noise(kind, generator) for _ in _BLOCKS])
    return fit(lambda points: measured[:, None] - _law(*points), _NUMBERS, _BLOCKS, is_motion=True)


def _coverage(kind: str, fits: int, seed: int) -> tuple[float, int]:
    """Fraction of intervals of the two numbers that are sought which hold, and how many fits are flagged."""
    generator, held, flagged = np.random.default_rng(seed), 0, 0
    for _ in range(fits):
        found = _fit(kind, generator)
        held += sum(found.low[at] <= _TRUTH[_NUMBERS[at].name] <= found.high[at] for at in (0, 1))
        flagged += found.conflict is not None
    return held / (2.0 * fits), flagged


@pytest.mark.parametrize(
    ("kind", "least", "most_flagged"),
    # Of a drift, the zero and the start of a recording absorb a part that the noise then does not show.
    [("white", 0.9, 1), ("AR(1)", 0.9, 1), ("random walk", 0.85, 2), ("Student t", 0.9, 1), ("hum", 0.85, 1)],
)
def test_intervals_hold_in_five_kinds_of_noise_and_a_model_that_is_right_is_not_called_wrong(
    kind: str, least: float, most_flagged: int
) -> None:
    held, flagged = _coverage(kind, 20, seed=7)

    assert held >= least
    assert flagged <= most_flagged


def test_a_model_whose_two_recordings_want_two_rates_holds_for_itself_only() -> None:
    found = _fit("white", np.random.default_rng(3), slower=0.9)

    assert found.conflict is not None
    assert found.conflict.number == "rate"
    assert found.conflict.p < 0.01


def test_numbers_that_act_only_as_their_product_are_not_identifiable() -> None:
    measured = 6.0 * _TIME + 0.01 * np.random.default_rng(1).normal(size=_COUNT)
    numbers = (FitNumber("one", 2.0, 0.1, 10.0, 2.0), FitNumber("other", 3.0, 0.1, 10.0, 3.0))

    found = fit(
        lambda points: measured[:, None] - points[0] * points[1] * _TIME[:, None],
        numbers,
        (ResidualBlock("only", "first", slice(0, _COUNT)),),
    )

    assert len(found.unidentified) == 1
    assert found.unidentified[0]["one"] == pytest.approx(-found.unidentified[0]["other"], rel=0.2)
    assert found.values[0] * found.values[1] == pytest.approx(6.0, rel=0.01)


def test_the_tolerance_that_widens_an_interval_is_named_with_its_share_of_the_variance() -> None:
    measured = 2.0 + 0.001 * np.random.default_rng(1).normal(size=_COUNT)
    numbers = (FitNumber("value", 1.0, 0.1, 10.0, 1.0), FitNumber("zero", 0.0, -1.0, 1.0, 0.1, 0.1))

    found = fit(
        lambda points: measured[:, None] - (points[0] + points[1]) * np.ones((_COUNT, 1)),
        numbers,
        (ResidualBlock("only", "first", slice(0, _COUNT)),),
    )

    (name, share), *_ = found.shares["value"]
    assert name == "zero"
    assert share > 0.99
    assert found.high[0] - found.low[0] == pytest.approx(2.0 * 1.96 * 0.1, rel=0.02)


def test_whitening_by_the_autoregression_that_was_found_leaves_white_noise() -> None:
    series = _noise("AR(1)", np.random.default_rng(5))
    reflection = burg([series])

    white = whiten(series[:, None], Noise(1.0, reflection))[:, 0]

    assert reflection[0] == pytest.approx(0.9, abs=0.06)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.12


def test_a_slow_drift_beside_white_noise_is_whitened_as_a_level_and_white_noise_is_left_alone() -> None:
    generator = np.random.default_rng(5)
    white = generator.normal(size=1000)
    drifting = white + 0.1 * np.cumsum(generator.normal(size=1000))
    size = math.sqrt(np.mean(drifting**2))

    assert noise_of([white]).gain == 0.0
    found = noise_of([drifting / size])

    assert found.gain == pytest.approx(0.1, abs=0.05)
    assert found.innovation * size == pytest.approx(1.05, rel=0.05)
    assert np.std(whiten(drifting / size, found)) == pytest.approx(1.0, rel=0.01)


def test_a_sample_that_alone_decides_a_number_is_left_out() -> None:
    slope = np.zeros((_COUNT, 1))
    slope[150] = 100.0
    slope[:150] = 1.0
    measured = 2.0 * slope + 0.1 * np.random.default_rng(1).normal(size=(_COUNT, 1))
    measured[150] -= 5.0

    found = fit(
        lambda points: measured - slope * points[:1],
        (FitNumber("value", 1.0, -10.0, 10.0, 1.0),),
        [ResidualBlock("only", "first", slice(0, _COUNT))],
        memory=0,
        is_motion=True,
    )

    assert found.low[0] <= 2.0 <= found.high[0]
    assert found.high[0] - found.low[0] == pytest.approx(2.0 * 1.96 * 0.1 / math.sqrt(150.0), rel=0.3)


def test_residuals_that_are_too_smooth_for_noise_are_a_conflict() -> None:
    measured = np.sin(9.0 * _TIME) + 0.01 * np.random.default_rng(1).normal(size=_COUNT)

    found = fit(
        lambda points: measured[:, None] - points[:1],
        (FitNumber("level", 1.0, -10.0, 10.0, 1.0),),
        [ResidualBlock("only", "first", slice(0, _COUNT))],
    )

    assert found.conflict is not None
    assert (found.conflict.group, found.conflict.number) == ("first", "")
    assert "too smooth to be noise" in found.conflict.words
    assert found.conflict.standard_errors > 5.0


def test_a_law_that_fits_exactly_leaves_numbers_and_a_channel_of_small_units_keeps_its_weight() -> None:
    one = (FitNumber("level", 1.0, -10.0, 10.0, 1.0),)
    exact = fit(lambda points: 2.0 - np.ones((50, 1)) * points[:1], one, [ResidualBlock("a", "first", slice(0, 50))])
    assert exact.values[0] == pytest.approx(2.0)
    measured = 2.0 + np.random.default_rng(1).normal(size=100)[:, None] * 0.1
    blocks = [ResidualBlock("a", "first", slice(0, 50)), ResidualBlock("a", "second", slice(50, 100))]
    large, small = (
        fit(lambda points, unit=unit: unit * (measured - points[:1]), one, blocks)
        for unit in (np.ones((100, 1)), np.repeat([[1.0], [1.0e-13]], 50, axis=0))
    )
    assert small.values[0] == pytest.approx(large.values[0], abs=1.0e-6)
    assert small.high[0] == pytest.approx(large.high[0], abs=1.0e-6)


def test_as_many_samples_as_numbers_are_refused() -> None:
    with pytest.raises(IdentificationError, match="1 samples cannot determine 1 parameters"):
        fit(
            lambda points: 2.5 - points[:1],
            (FitNumber("a", 1.0, -9.0, 9.0, 1.0),),
            [ResidualBlock("a", "first", slice(0, 1))],
        )


@pytest.mark.parametrize("deviation", [0.8, 1.5])
def test_an_interval_along_a_product_ends_where_the_prior_of_the_other_number_ends(deviation: float) -> None:
    """Of the two the samples tell the product alone: where one ends, the exponent is at an end of its prior.

    The straight line at the estimate leads far out of the wider valley, and its Jacobian does not lead back.
    """
    measured = 2.0 * np.ones((_COUNT, 1)) + 0.01 * np.random.default_rng(1).normal(size=(_COUNT, 1))
    numbers = (
        FitNumber("size", 1.0, 0.01, 1000.0, 1.0),
        FitNumber("exponent", 0.0, -9.0, 9.0, deviation, deviation),
    )

    found = fit(
        lambda points: measured - points[0] * np.exp(points[1]) * np.ones((_COUNT, 1)),
        numbers,
        (ResidualBlock("only", "first", slice(0, _COUNT)),),
    )

    assert found.high[0] == pytest.approx(2.0 * math.exp(1.96 * deviation), rel=0.1)
    assert found.low[0] <= 2.0 * math.exp(-1.96 * deviation)


def test_samples_that_stand_out_are_left_out_of_a_motion_and_the_others_say_what_they_said() -> None:
    generator = np.random.default_rng(4)
    clean = _law(*(np.array([one]) for one in _TRUTH.values()))[:, 0]
    measured = clean + 0.02 * generator.normal(size=clean.size)
    wrong = np.array([20, 21, 700])
    bad = measured.copy()
    bad[wrong] += 0.02 * np.array([40.0, -50.0, 60.0])

    right, found = (
        fit(lambda points, own=own: own[:, None] - _law(*points), _NUMBERS, _BLOCKS, is_motion=True)
        for own in (measured, bad)
    )

    assert right.outliers == ()
    assert found.outliers == tuple(wrong.tolist())
    for channel, noise in right.sensors.items():
        assert found.sensors[channel].deviation == pytest.approx(noise.deviation, rel=0.02)
    errors = np.sqrt(np.diag(right.covariance))
    assert np.all(np.abs(found.values - right.values) < 0.3 * errors)


@pytest.mark.parametrize("side", [1, -1])
def test_a_search_that_ends_where_no_run_succeeds_has_not_converged_and_names_the_number(side: int) -> None:
    """Runs succeed up to a rate of 1; the samples are of 2."""
    random = np.random.default_rng(3)
    measured = (2.0 * side * _TIME + 1.0 + 0.01 * random.normal(size=_COUNT))[:, None]

    def residuals(points: Floats) -> Floats:
        left = measured - points[0] * _TIME[:, None] - points[1]
        return np.where(side * points[0] > 1.0, np.nan, left)

    block = ResidualBlock("only", "first", slice(0, _COUNT))
    offset = FitNumber("offset", 0.9, -5.0, 5.0, 1.0)
    found = fit(residuals, (FitNumber("rate", 0.2 * side, -5.0, 5.0, 1.0), offset), (block,))
    assert not found.has_converged
    assert found.edge == {"rate": side}
    assert 0.5 < side * found.by_name["rate"] <= 1.0
    # With a bound inside of the edge the search ends at that.
    low, high = sorted((-4.0 * side, 0.9 * side))
    bounded = fit(residuals, (FitNumber("rate", 0.2 * side, low, high, 1.0), offset), (block,))
    assert bounded.has_converged
    assert not bounded.edge
    assert bounded.by_name["rate"] == pytest.approx(0.9 * side, rel=1e-6)


def test_a_number_beside_whose_start_no_run_succeeds_is_refused_by_name() -> None:
    def residuals(points: Floats) -> Floats:
        return np.asarray(np.where(points[1] == 1.0, _TIME[:, None] * points[0] + points[1], np.nan))

    numbers = (FitNumber("slope", 1.0, 0.0, 9.0, 1.0), FitNumber("level", 1.0, 0.0, 9.0, 1.0))
    with pytest.raises(IdentificationError, match=r"^level: every run fails near 1$"):
        fit(residuals, numbers, (ResidualBlock("line", "only", slice(0, _COUNT)),))
