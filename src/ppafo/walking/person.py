"""One person of the population by a number: build, strides, and how the controller was fitted to him or her.

Number 0 is the wearer of the file with the gait as it is. Every other whole number draws a person as the wearers of
``ppafo walk --wearers`` are drawn, so that a study may vary who walks as it varies any number.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.gait import Gait
from ppafo.model.columns import larger, over_runs, smaller
from ppafo.model.fourier import Harmonic, Series
from ppafo.model.gait import GaitSeries, GaitTiming
from ppafo.model.leg import LegParameters
from ppafo.walking.anthropometry import Build, draw_bounded_normal, draw_builds, segment_values
from ppafo.walking.gait_series import gait_series, gait_timing, strike_angle
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


def person_of(gait: Gait, number: Any) -> Person:
    """The person with a number, a gait as the others have it; for an array (runs,) every number of it is one too."""
    person: Person = over_runs(lambda one: _person(gait, one), number)
    return person


def _person(gait: Gait, number: float) -> Person:
    if number == 0.0:
        return Person(1.0, 1.0, gait_series(gait), gait_timing(gait), strike_angle(gait), 1.0, 0.0)
    build, gaits, thresholds, start = _drawn(gait, number)
    series = GaitSeries(**{name: _series(curves) for name, curves in gaits.series.items()})
    timing = GaitTiming(start=0.0, **{name: float(values[1]) for name, values in gaits.timing.items()})
    foot = float(_at_strike(gaits.series["shank"]) - _at_strike(gaits.series["ankle"])) + 0.5 * np.pi
    mass, stature = float(build.mass[1]), float(build.stature[1])
    return Person(mass, stature, series, timing, foot - timing.ground_angle, thresholds, start)


def _drawn(gait: Gait, number: float) -> tuple[Build, VariedGaits, float, float]:
    """Build and gait of two, the second of whom is the person, with factor on thresholds and shift of the push-off."""
    generator = np.random.default_rng(int(number))
    build = draw_builds(2, generator)
    gaits = draw_gaits(gait, build.stature, generator)
    scale, shift = (float(draw_bounded_normal(generator, (2,))[1]) for _ in range(2))
    return build, gaits, 1.0 + THRESHOLD_VARIATION * scale, START_VARIATION * shift


def _series(curves: SeriesOfMany) -> Series:
    pairs = zip(curves.cosines[1].tolist(), curves.sines[1].tolist(), strict=True)
    return Series(mean=float(curves.mean[1]), harmonics=tuple(Harmonic(*pair) for pair in pairs))


def _at_strike(curves: SeriesOfMany) -> Any:
    return curves.mean[1] + curves.cosines[1].sum()


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
    build, gaits, _, _ = _drawn(gait, number)
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
