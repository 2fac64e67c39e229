"""Many wearers in one batch: the first is the wearer of the configuration, the others differ as is stated."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import leaf_paths, leaves, rebuilt
from ppafo.engine.run import Run, batch_of, state_row_numbers
from ppafo.gait import load_gait
from ppafo.gait.gait import KNEE, GaitCurve
from ppafo.model.gait import Series
from ppafo.walking import load_walk, walk_population
from ppafo.walking.gait_series import SERIES, gait_timing
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import Person, draw_people
from ppafo.walking.planning import batch_of_many, plan_walk
from ppafo.walking.variation import MASS_VARIATION, STATURE_VARIATION, draw_builds, draw_gaits
from ppafo.walking.wearer import paper_subject, scaled

MINUTES = 0.15


@pytest.mark.parametrize("name", ["solenoid", "proportional", "off"])
def test_the_first_wearer_is_that_of_the_configuration(name: str) -> None:
    configuration = load_walk(name)
    people = walk_population(configuration, minutes=MINUTES, wearers=9, seed=3)
    run = plan_walk(with_duration(configuration, 60.0 * MINUTES))
    rows = state_row_numbers(run)
    alone = run_batch(batch_of(run)).states[:, 0]
    strides = run.step * run.step_count / walk_of(configuration).gait.stride_time
    assert people.outcomes["gas"][0] * strides == pytest.approx(alone[rows["state.supplied_mass"]], rel=1e-9)
    for work in ("positive_push_off_work", "net_push_off_work"):
        assert people.outcomes[work][0] * strides == pytest.approx(alone[rows[f"walk.{work}"]], rel=1e-9)


def coefficients(series: Series) -> tuple[np.ndarray, np.ndarray]:
    """Cosines and sines of many people, each (people, harmonics)."""
    table = np.array(series.harmonics)
    return table[:, 0].T, table[:, 1].T


def varied(curve: GaitCurve | None, series: Series, index: int) -> GaitCurve:
    assert curve is not None
    cosines, sines = (tuple(values[index].tolist()) for values in coefficients(series))
    return replace(curve, mean=float(np.asarray(series.mean)[index]), cosines=cosines, sines=sines)


def with_heel_of(run: Run, shared: Run, stature: float) -> Run:
    """A run whose heel rolls as that of another one, at another size."""
    assert run.walk is not None, "it walks"
    assert shared.walk is not None, "it walks"
    levers = shared.walk.leg.heel_lever * stature, shared.walk.leg.flat_heel_lever * stature
    leg = run.walk.leg._replace(
        heel_lever=levers[0], flat_heel_lever=levers[1], heel_roll_angle=shared.walk.leg.heel_roll_angle
    )
    return replace(run, walk=replace(run.walk, leg=leg))


def test_any_wearer_walks_as_it_would_alone() -> None:
    configuration, index, count = load_walk("solenoid"), 3, 5
    people = walk_population(configuration, minutes=MINUTES, wearers=count, seed=3)
    drawn = draw_people(walk_of(configuration).gait, count, np.random.default_rng(3))
    person = rebuilt(Person, [float(values[index]) for values in leaves(drawn)])
    settings = dict(configuration.controller.settings)
    settings |= {name: settings[name] * person.thresholds for name in ("load_threshold", "unload_threshold")}
    settings["push_off_start"] += person.start
    segments = scaled(walk_of(configuration).wearer, person.mass, person.stature)
    gait = replace(
        walk_of(configuration).gait,
        stride_time=person.stride_time,
        stance_share=person.timing.toe_off,
        **{
            name: varied(walk_of(configuration).gait.curve(name), getattr(drawn.series, field), index)
            for field, name in SERIES.items()
        },
    )
    assert person.timing == pytest.approx(gait_timing(gait), rel=1e-9)
    wearer = replace(walk_of(configuration).wearer, **segments)
    motion = replace(walk_of(configuration), wearer=wearer, gait=gait)
    alone = replace(configuration, motion=motion, controller=replace(configuration.controller, settings=settings))
    shared = plan_walk(with_duration(configuration, 60.0 * MINUTES))
    run = with_heel_of(plan_walk(with_duration(alone, 60.0 * MINUTES)), shared, person.stature)
    many = with_duration(configuration, 60.0 * MINUTES)
    begun = batch_of_many(many, drawn).states[:, index]
    paths = [path for group, row in run.program.state_rows().items() for path in leaf_paths(row, group)]
    for path, value, own in zip(paths, begun.tolist(), batch_of(run).states[:, 0].tolist(), strict=True):
        assert value == pytest.approx(own, rel=1e-9, abs=1e-12), path
    rows, states = state_row_numbers(run), run_batch(batch_of(run)).states[:, 0]
    strides = run.step * run.step_count / gait.stride_time
    for name, row in (("gas", "state.supplied_mass"), ("net_push_off_work", "walk.net_push_off_work")):
        assert people.outcomes[name][index] * strides == pytest.approx(states[rows[row]], rel=1e-5), name
    assert people.traits["body_mass"][index] == wearer.body_mass


def test_the_same_seed_gives_the_same_wearers_and_another_one_others() -> None:
    configuration = load_walk("solenoid")
    first, again, other = (walk_population(configuration, minutes=MINUTES, wearers=40, seed=seed) for seed in (1, 1, 2))
    for name, values in first.outcomes.items():
        np.testing.assert_array_equal(values, again.outcomes[name])
    assert not np.array_equal(first.outcomes["gas"], other.outcomes["gas"])
    assert first.count == 40
    assert first.diverged == 0
    assert np.ptp(first.outcomes["gas"]) > 0.05 * first.outcomes["gas"].mean()


def test_builds_vary_as_stated_and_keep_the_shares_of_segments() -> None:
    mass, stature = draw_builds(20_000, np.random.default_rng(1))
    assert mass.std() == pytest.approx(MASS_VARIATION, rel=0.04)
    assert stature.std() == pytest.approx(STATURE_VARIATION, rel=0.04)
    assert np.corrcoef(mass, stature)[0, 1] == pytest.approx(0.5, abs=0.03)
    wearer = paper_subject()
    leg = scaled(wearer, np.array([1.0, 2.0]), np.array([1.0, 1.5]))
    assert leg["shank_length"].tolist() == pytest.approx([0.46, 0.69])
    assert leg["foot_mass"].tolist() == pytest.approx([1.0, 2.0])
    assert leg["shank_inertia"].tolist() == pytest.approx([0.1, 0.1 * 2.0 * 2.25])


def test_gaits_vary_by_the_deviation_of_each_curve() -> None:
    gait = load_gait()
    drawn, _, stride_time = draw_gaits(gait, np.ones(4000), np.random.default_rng(1))
    phases = 2.0 * np.pi * np.outer(np.arange(1, 9), np.linspace(0.0, 1.0, 200, endpoint=False))
    for field, curve in (("shank", gait.shank_angle), ("ankle", gait.ankle_angle)):
        series = getattr(drawn, field)
        cosines, sines = coefficients(series)
        values = series.mean[:, None] + cosines @ np.cos(phases) + sines @ np.sin(phases)
        spread = float(np.sqrt(np.mean((values - values.mean(axis=0)) ** 2)))
        assert spread == pytest.approx(curve.deviation, rel=0.06)
    assert stride_time.std() == pytest.approx(gait.stride_time_deviation, rel=0.06)


def test_the_way_of_the_knee_is_as_long_as_people_are_tall() -> None:
    gait = load_gait()
    stature = np.linspace(1.0, 1.2, 50)
    drawn, _, stride_time = draw_gaits(gait, stature, np.random.default_rng(1))
    for name in KNEE:
        curve, (cosines, _) = gait.curve(name), coefficients(getattr(drawn, name))
        ways = cosines[:, : curve.harmonics] * (stride_time**2)[:, None]
        assert curve.deviation == 0.0
        np.testing.assert_allclose(ways, np.outer(stature, curve.cosines) * gait.stride_time**2, rtol=1e-12)
    noisy = replace(gait, knee_up=replace(gait.curve("knee_up"), deviation=0.4), stride_time_deviation=0.0)
    series = draw_gaits(noisy, np.ones(4000), np.random.default_rng(1))[0].knee_up
    cosines, sines = coefficients(series)
    power = np.var(series.mean) + 0.5 * (cosines.var(axis=0) + sines.var(axis=0)).sum()
    assert np.sqrt(power) == pytest.approx(0.4, rel=0.06)


def test_wearers_that_diverge_are_counted_and_left_out() -> None:
    configuration = load_walk("solenoid")
    supply = replace(configuration.device.supply, pressure=1.0e18)
    people = walk_population(
        replace(configuration, device=replace(configuration.device, supply=supply)), minutes=MINUTES, wearers=8
    )
    assert people.diverged == 8
    assert people.count == 0
    assert "8 of 8 wearers diverged and are left out; the time step may be too long" in people.message


def test_progress_of_many_wearers_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[walk_population.__module__], "STEPS_AT_ONCE", 1.0)
    told: list[tuple[float, float]] = []
    configuration = load_walk("off")
    grouped = walk_population(
        configuration, minutes=MINUTES, wearers=70, seed=1, progress=lambda done, total: told.append((done, total))
    )
    assert told == [(32.0, 70.0), (64.0, 70.0), (70.0, 70.0)]
    monkeypatch.undo()
    np.testing.assert_array_equal(
        grouped.outcomes["net_push_off_work"],
        walk_population(configuration, minutes=MINUTES, wearers=70, seed=1).outcomes["net_push_off_work"],
    )
