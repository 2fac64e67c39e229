"""One person of the population by a number: build, strides, and how the controller was fitted to him or her.

Number 0 is the wearer of the file with the gait as it is. Every other whole number draws a person as the wearers of
``ppafo walk --wearers`` are drawn, so that a study may vary who walks as it varies any number.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.rows import leaves, rebuilt
from ppafo.gait import Gait
from ppafo.model.columns import larger, over_runs, smaller
from ppafo.model.fourier import Harmonic, Series
from ppafo.model.gait import GaitSeries, GaitTiming
from ppafo.model.leg import LegParameters
from ppafo.simulation.scenario import Scenario
from ppafo.walking.anthropometry import Build, draw_bounded_normal, draw_builds, segment_values
from ppafo.walking.declaration import LARGEST_SEED
from ppafo.walking.gait_series import gait_series, gait_timing, strike_angle
from ppafo.walking.motion import walk_of
from ppafo.walking.varied_gait import SERIES, SeriesOfMany, VariedGaits, draw_gaits
from ppafo.walking.wearer import Wearer

THRESHOLD_VARIATION = 0.15
"""Standard deviation of thresholds over their values: how a fitter sets them, and how a sensor sits. Assumed."""

START_VARIATION = 0.03
"""Standard deviation of the fraction of the stride at which the push-off begins. Assumed."""

_LENGTHS = ("shank_length", "shank_mass_centre", "foot_mass_centre", "heel_lever", "flat_heel_lever", "toe_lever")
_MASSES = ("body_mass", "shank_mass", "foot_mass")
_INERTIAS = ("shank_inertia", "foot_inertia")


class Person(NamedTuple):
    """Who walks: body mass and stature over the wearer's, strides, and angle [rad] of the foot over flat at its strike.

    ``thresholds`` is a factor on the thresholds of the force sensors, ``start`` is added to that of the push-off.
    """

    mass: float
    stature: float
    series: GaitSeries
    timing: GaitTiming
    strike_angle: float
    thresholds: float
    start: float


def person_of(gait: Gait, who: Any) -> Person:
    """The person with a number, or who is drawn already; for an array (runs,) every number of it is one too."""
    if isinstance(who, Person):
        return who
    person: Person = over_runs(lambda one: _person(gait, one), who)
    return person


def _person(gait: Gait, number: float) -> Person:
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
    build, gaits, generator = _drawn(gait, number)
    person: Person = rebuilt(Person, [float(values[1]) for values in leaves(drawn_people(build, gaits, generator))])
    return person


def _drawn(gait: Gait, number: float) -> tuple[Build, VariedGaits, np.random.Generator]:
    """Build and gait of two, the second of whom is the person, and what draws on."""
    generator = np.random.default_rng(int(number))
    build = draw_builds(2, generator)
    return build, draw_gaits(gait, build.stature, generator), generator


def drawn_people(build: Build, gaits: VariedGaits, generator: np.random.Generator) -> Person:
    """People of some builds and gaits, each number an array (people,); the first is fitted as the settings say."""
    count = build.mass.size
    scale, shift = (draw_bounded_normal(generator, (count,)) for _ in range(2))
    scale[0], shift[0] = 0.0, 0.0
    timing: Any = {"start": np.zeros(count), **gaits.timing}
    strike: Any = gaits.strike_angle() - gaits.timing["ground_angle"]
    thresholds: Any = 1.0 + THRESHOLD_VARIATION * scale
    mass: Any = build.mass
    stature: Any = build.stature
    start: Any = START_VARIATION * shift
    series = GaitSeries(**{name: _series(curves) for name, curves in gaits.series.items()})
    return Person(
        mass=mass,
        stature=stature,
        series=series,
        timing=GaitTiming(**timing),
        strike_angle=strike,
        thresholds=thresholds,
        start=start,
    )


def _series(curves: SeriesOfMany) -> Series:
    pairs: Any = zip(curves.cosines.T, curves.sines.T, strict=True)
    mean: Any = curves.mean
    return Series(mean=mean, harmonics=tuple(Harmonic(*pair) for pair in pairs))


def crowd_of(scenario: Scenario, build: Build, gaits: VariedGaits, generator: np.random.Generator) -> Scenario:
    """Many wearers as one walk whose numbers are arrays (people,); everybody has noise of his or her own."""
    people = drawn_people(build, gaits, generator)
    seeds: Any = (scenario.sensors.seed + np.arange(build.mass.size, dtype=np.float64)) % LARGEST_SEED
    sensors = replace(scenario.sensors, seed=seeds)
    return replace(scenario, sensors=sensors, motion=replace(walk_of(scenario), person=people))


def leg_of_person(leg: LegParameters, person: Person) -> LegParameters:
    """The leg of the wearer at a person's mass and stature; the heel has the same shape."""
    scaled = {name: getattr(leg, name) * person.stature for name in _LENGTHS}
    scaled |= {name: getattr(leg, name) * person.mass for name in _MASSES}
    scaled |= {name: getattr(leg, name) * person.mass * person.stature**2 for name in _INERTIAS}
    return leg._replace(**scaled)


def settings_of_person(settings: dict[str, Any], person: Person) -> dict[str, Any]:
    """Settings of a controller as they were fitted to a person: its thresholds and the start of the push-off."""
    fitted: dict[str, Any] = {
        name: settings[name] * person.thresholds for name in ("load_threshold", "unload_threshold") if name in settings
    }
    if "push_off_start" in settings:
        fitted["push_off_start"] = smaller(larger(settings["push_off_start"] + person.start, 0.0), 1.0)
    return settings | fitted


def as_drawn(gait: Gait, wearer: Wearer, number: float) -> tuple[Gait, Wearer]:
    """Gait and wearer of the person with a number, for results: what is healthy is that of this person."""
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
    segments = {name: float(values[1]) for name, values in segment_values(wearer, build).items()}
    return drawn, replace(wearer, **segments)
