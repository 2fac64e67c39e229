"""Person of the population, by number: build, strides, and individual fitting of the controller.

Number 0 is the wearer of the file with the gait unchanged. Any other whole number is the seed with which a person is
drawn, by the same distributions as the wearers of ``ppafo walk --wearers``; a study can therefore vary the person like
any other number. Gaits of persons vary as much as strides do between each other: in series coefficients, stride times
and events.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.rows import leaves, rebuilt
from ppafo.gait import Gait
from ppafo.gait.gait import KNEE, GaitCurve
from ppafo.model.columns import larger, over_runs, smaller
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import HARMONICS, GaitSeries, GaitTiming, Harmonic, Series
from ppafo.model.leg import LegParameters
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario
from ppafo.walking.declaration import LARGEST_SEED
from ppafo.walking.gait_series import EVENT_PHASES, SERIES, gait_events, gait_series, gait_timing, strike_angle
from ppafo.walking.motion import walk_of
from ppafo.walking.wearer import BodyScale, Wearer, draw_bounded_normal, draw_builds, scaled

LEVEL_FRACTION = 0.5
"""Fraction of a curve's variance that shifts its mean; the rest is distributed over the harmonics by their power.
Assumed: a gait file has a single deviation for each curve."""

_AT_ONCE = 1000
"""Number of people whose events are computed in a batch, to limit memory."""

THRESHOLD_VARIATION = 0.15
"""Relative standard deviation of the thresholds between fitters and sensor positions [-]. Assumed."""

START_VARIATION = 0.03
"""Standard deviation of the start of the push-off [strides]. Assumed."""


@dataclass(frozen=True, slots=True, eq=False)
class SeriesOfMany:
    """Fourier coefficients of a curve for many people: mean (people,), cosines and sines (people, 8)."""

    mean: Floats
    cosines: Floats
    sines: Floats


@dataclass(frozen=True, slots=True, eq=False)
class VariedGaits:
    """Series and timing (people,) of many gaits, by field of ``GaitSeries`` and ``GaitTiming``; stride time [s]."""

    series: dict[str, SeriesOfMany]
    timing: dict[str, Floats]
    stride_time: Floats


def draw_gaits(gait: Gait, stature: Floats, generator: np.random.Generator) -> VariedGaits:
    """Draw the gaits of many people; the first person has the given gait unchanged.

    ``stature`` (people,) is relative to the first person [-]. A curve that was not measured stays 0. The acceleration
    of the knee scales with stature divided by stride time squared.
    """
    count = stature.size
    series = {field: _draw_series(gait.curves.get(name), count, generator) for field, name in SERIES.items()}
    time = gait.stride_time + gait.stride_time_deviation * draw_bounded_normal(generator, (count,))
    fraction = gait.stance_share + gait.stance_share_deviation * draw_bounded_normal(generator, (count,))
    time[0], fraction[0] = gait.stride_time, gait.stance_share
    # The knee goes through a way that is larger by the stature, in another time.
    hurry = stature * (gait.stride_time / time) ** 2
    for name in KNEE:
        knee, each = series[name], hurry[:, None]
        series[name] = SeriesOfMany(knee.mean * hurry, knee.cosines * each, knee.sines * each)
    timing = {"frequency": 1.0 / time, **_events(series["shank"], series["ankle"], fraction)}
    return VariedGaits(series, timing, time)


def _draw_series(curve: GaitCurve | None, count: int, generator: np.random.Generator) -> SeriesOfMany:
    if curve is None:
        return SeriesOfMany(np.zeros(count), np.zeros((count, HARMONICS)), np.zeros((count, HARMONICS)))
    missing = (0.0,) * HARMONICS
    cosines, sines = (np.array((*values, *missing)[:HARMONICS]) for values in (curve.cosines, curve.sines))
    power = 0.5 * (cosines**2 + sines**2)
    # A curve that stays constant has no harmonics to vary.
    fraction = power / max(float(power.sum()), 1.0e-30)
    spread = curve.deviation * np.sqrt((1.0 - LEVEL_FRACTION) * fraction)
    normal = draw_bounded_normal(generator, (2, count, HARMONICS))
    level = curve.deviation * np.sqrt(LEVEL_FRACTION) * draw_bounded_normal(generator, (count,))
    normal[:, 0], level[0] = 0.0, 0.0
    return SeriesOfMany(curve.mean + level, cosines + spread * normal[0], sines + spread * normal[1])


def _events(shank: SeriesOfMany, ankle: SeriesOfMany, stance_share: Floats) -> dict[str, Floats]:
    """Return ``gait_events`` for many people, by field of ``GaitTiming``; computed in batches to limit memory."""
    sine, cosine = sine_and_cosine(np.outer(np.arange(1, HARMONICS + 1), EVENT_PHASES))
    events = []
    for first in range(0, stance_share.size, _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        level = shank.mean[part] - ankle.mean[part] + 0.5 * np.pi
        cosines, sines = (shank.cosines - ankle.cosines)[part], (shank.sines - ankle.sines)[part]
        foot = np.repeat(level[:, None], EVENT_PHASES.size, axis=1)
        for order in range(HARMONICS):
            foot += cosines[:, order, None] * cosine[order] + sines[:, order, None] * sine[order]
        events.append(gait_events(foot, stance_share[part]))
    return {name: np.concatenate([part[name] for part in events]) for name in events[0]}


class Person(NamedTuple):
    """Person drawn from the population: build, strides, and adjustment of the controller.

    ``mass`` and ``stature`` are relative to the wearer [-]. ``strike_angle`` is the foot angle at heel strike relative
    to the flat foot [rad]. ``thresholds`` is a factor on the thresholds of the force sensors [-], ``start`` is added to
    the start of the push-off [strides].
    """

    mass: float
    stature: float
    series: GaitSeries
    timing: GaitTiming
    strike_angle: float
    thresholds: float
    start: float


def person_of(gait: Gait, who: Any) -> Person:
    """Return a person of the population by number, a scalar or array (runs,); a ``Person`` is returned as is."""
    if isinstance(who, Person):
        return who

    def numbered(number: float) -> Person:
        if number == 0.0:
            return Person(
                mass=1.0,
                stature=1.0,
                series=gait_series(gait),
                timing=gait_timing(gait),
                strike_angle=strike_angle(gait),
                thresholds=1.0,
                start=0.0,
            )
        person: Person = rebuilt(Person, [float(each[1]) for each in leaves(drawn_people(*_drawn(gait, number)))])
        return person

    person: Person = over_runs(numbered, who)
    return person


def _drawn(gait: Gait, number: float) -> tuple[BodyScale, VariedGaits, np.random.Generator]:
    """Return build and gait of the wearer and of the person drawn, and the random generator for further draws."""
    generator = np.random.default_rng(int(number))
    build = draw_builds(2, generator)
    return build, draw_gaits(gait, build.stature, generator), generator


def drawn_people(build: BodyScale, gaits: VariedGaits, generator: np.random.Generator) -> Person:
    """Return people with these builds and gaits, as arrays (people,); the first keeps the controller settings."""
    count = build.mass.size
    scale, shift = (draw_bounded_normal(generator, (count,)) for _ in range(2))
    scale[0], shift[0] = 0.0, 0.0
    timing: Any = {"start": np.zeros(count), **gaits.timing}
    # At phase 0 a curve is its mean and the sum of its cosines.
    shank, ankle = (of.mean + of.cosines.sum(axis=1) for of in (gaits.series["shank"], gaits.series["ankle"]))
    strike: Any = shank - ankle + 0.5 * np.pi - gaits.timing["ground_angle"]
    thresholds: Any = 1.0 + THRESHOLD_VARIATION * scale
    # Numbers of many people are arrays where a person has floats.
    many: tuple[Any, Any, Any] = (build.mass, build.stature, START_VARIATION * shift)
    mass, stature, start = many
    series: dict[str, Any] = {}
    for name, curves in gaits.series.items():
        pairs: Any = zip(curves.cosines.T, curves.sines.T, strict=True)
        mean: Any = curves.mean
        series[name] = Series(mean=mean, harmonics=tuple(Harmonic(*pair) for pair in pairs))
    return Person(
        mass=mass,
        stature=stature,
        series=GaitSeries(**series),
        timing=GaitTiming(**timing),
        strike_angle=strike,
        thresholds=thresholds,
        start=start,
    )


def crowd_of(scenario: Scenario, build: BodyScale, gaits: VariedGaits, generator: np.random.Generator) -> Scenario:
    """Return a walk of many wearers whose numbers are arrays (people,); each wearer has independent sensor noise."""
    people = drawn_people(build, gaits, generator)
    # A seed of everybody: one noise for all would make their outcomes alike.
    seeds: Any = (scenario.sensors.seed + np.arange(build.mass.size, dtype=np.float64)) % LARGEST_SEED
    sensors = replace(scenario.sensors, seed=seeds)
    return replace(scenario, sensors=sensors, motion=replace(walk_of(scenario), person=people))


def leg_of_person(leg: LegParameters, person: Person) -> LegParameters:
    """Return the leg scaled to a person's mass and stature; the shape of the heel is unchanged."""
    # The heel of a gait has two levers, of which a wearer's file gives one.
    flat = leg.flat_heel_lever * person.stature
    return leg._replace(**scaled(leg, person.mass, person.stature), flat_heel_lever=flat)


def settings_of_person(settings: dict[str, Any], person: Person) -> dict[str, Any]:
    """Return the controller settings fitted to a person: force thresholds and start of the push-off."""
    fitted: dict[str, Any] = {
        name: settings[name] * person.thresholds for name in ("load_threshold", "unload_threshold") if name in settings
    }
    if "push_off_start" in settings:
        fitted["push_off_start"] = smaller(larger(settings["push_off_start"] + person.start, 0.0), 1.0)
    return settings | fitted


def as_drawn(gait: Gait, wearer: Wearer, number: float) -> tuple[Gait, Wearer]:
    """Return gait and wearer for the person with this number; results compare the person with these healthy curves."""
    if number == 0.0:
        return gait, wearer
    build, gaits, _ = _drawn(gait, number)
    curves = {}
    for field, name in SERIES.items():
        curve = gait.curves.get(name)
        if curve is not None:
            own = gaits.series[field]
            cosines, sines = tuple(own.cosines[1].tolist()), tuple(own.sines[1].tolist())
            curves[name] = replace(curve, mean=float(own.mean[1]), cosines=cosines, sines=sines)
    drawn = replace(
        gait,
        stride_time=float(gaits.stride_time[1]),
        stance_share=float(gaits.timing["toe_off"][1]),
        **curves,  # type: ignore[arg-type]
    )
    segments = scaled(wearer, float(build.mass[1]), float(build.stature[1]))
    return drawn, replace(wearer, **segments)
