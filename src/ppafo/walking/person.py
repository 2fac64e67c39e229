"""Person of the population, by number: build, strides, and individual fitting of the controller.

Number 0 is the wearer of the file with the gait unchanged. Any other whole number is the seed with which a person is
drawn, by the same distributions as the wearers of ``ppafo walk --wearers``; a study can therefore vary the person like
any other number.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.rows import leaves, rebuilt
from ppafo.gait import Gait
from ppafo.model.columns import larger, over_runs, smaller
from ppafo.model.gait import GaitSeries, GaitTiming
from ppafo.model.leg import LegParameters
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.walking.gait_series import SERIES, gait_series, gait_timing, strike_angle
from ppafo.walking.motion import walk_of
from ppafo.walking.variation import draw_builds, draw_fitting, draw_gaits
from ppafo.walking.wearer import Wearer, scaled


class Person(NamedTuple):
    """Person of the population, or many people, with arrays (people,) as numbers.

    - ``mass``, ``stature``: relative to the wearer [-]
    - ``stride_time``: time from one heel strike to the next [s]
    - ``series``, ``timing``: curves and events of the gait
    - ``strike_angle``: foot angle at heel strike relative to the flat foot [rad]
    - ``thresholds``: factor on the thresholds of the force sensors [-]
    - ``start``: added to the start of the push-off [strides]
    """

    mass: float
    stature: float
    stride_time: float
    series: GaitSeries
    timing: GaitTiming
    strike_angle: float
    thresholds: float
    start: float


def draw_people(gait: Gait, count: int, generator: np.random.Generator) -> Person:
    """Draw people around a gait, as arrays (people,); the first is the wearer with the gait unchanged."""
    mass, stature = draw_builds(count, generator)
    series, timing, stride_time = draw_gaits(gait, stature, generator)
    thresholds, start = draw_fitting(count, generator)
    # At phase 0 a curve is its mean and the sum of its cosines.
    shank, ankle = (
        curve.mean + np.stack([harmonic.cosine for harmonic in curve.harmonics], axis=1).sum(axis=1)
        for curve in (series.shank, series.ankle)
    )
    strike = shank - ankle + 0.5 * np.pi - timing.ground_angle
    numbers = mass, stature, stride_time, *leaves(series), *leaves(timing), strike, thresholds, start
    people: Person = rebuilt(Person, numbers)
    return people


def person_of(gait: Gait, person: Person | Floats | float) -> Person:
    """Return a person of the population by number, a float or array (runs,); a ``Person`` is returned as is."""
    if isinstance(person, Person):
        return person

    def numbered(number: float) -> Person:
        if number == 0.0:
            return Person(
                mass=1.0,
                stature=1.0,
                stride_time=gait.stride_time,
                series=gait_series(gait),
                timing=gait_timing(gait),
                strike_angle=strike_angle(gait),
                thresholds=1.0,
                start=0.0,
            )
        # The first of two people is the wearer.
        people = draw_people(gait, 2, np.random.default_rng(int(number)))
        second: Person = rebuilt(Person, [float(values[1]) for values in leaves(people)])
        return second

    return over_runs(numbered, person)


def crowd_of(scenario: Scenario, people: Person) -> Scenario:
    """Return one scenario for many wearers, with arrays (people,) as numbers; sensor noise is independent."""
    # A seed of everybody: one noise for all would make their outcomes alike.
    seed: Any = (scenario.sensors.seed + np.arange(np.size(people.mass), dtype=np.float64)) % LARGEST_SEED
    sensors = replace(scenario.sensors, seed=seed)
    return replace(scenario, sensors=sensors, motion=replace(walk_of(scenario), person=people))


def leg_of_person(leg: LegParameters, person: Person) -> LegParameters:
    """Return the leg scaled to a person's mass and stature; the shape of the heel is unchanged."""
    # The heel of a gait has two levers, of which a wearer's file gives one.
    flat = leg.flat_heel_lever * person.stature
    return leg._replace(**scaled(leg, person.mass, person.stature), flat_heel_lever=flat)


def settings_of_person(settings: Mapping[str, Any], person: Person) -> dict[str, Any]:
    """Return the controller settings fitted to a person: force thresholds and start of the push-off."""
    fitted = dict(settings)
    for name in ("load_threshold", "unload_threshold"):
        if name in fitted:
            fitted[name] = fitted[name] * person.thresholds
    if "push_off_start" in fitted:
        fitted["push_off_start"] = smaller(larger(fitted["push_off_start"] + person.start, 0.0), 1.0)
    return fitted


def as_drawn(gait: Gait, wearer: Wearer, number: float) -> tuple[Gait, Wearer]:
    """Return gait and wearer for the person with this number; results compare the person with these healthy curves."""
    if number == 0.0:
        return gait, wearer
    person = person_of(gait, number)
    curves: dict[str, Any] = {}
    for field, name in SERIES.items():
        curve, series = gait.curves.get(name), getattr(person.series, field)
        if curve is not None:
            cosines, sines = zip(*series.harmonics, strict=True)
            curves[name] = replace(curve, mean=series.mean, cosines=cosines, sines=sines)
    drawn = replace(gait, stride_time=person.stride_time, stance_share=person.timing.toe_off, **curves)
    return drawn, replace(wearer, **scaled(wearer, person.mass, person.stature))
