"""How wearers differ: a person scaled in mass and length, and the variation between people.

A segment keeps its fraction of the body mass, its fraction of the body's length, and where its mass lies in it (as in
table 4.1 of Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009). So masses go with body mass,
lengths with stature, and inertias with mass times length squared; the fractions are those of the wearer that is scaled.
"""

from dataclasses import dataclass

import numpy as np

from ppafo.signals.recording import Floats
from ppafo.walking.wearer import Wearer

MASS_VARIATION = 0.166
STATURE_VARIATION = 0.039
"""Standard deviation over mean of body mass and stature: 85.5 +- 14.2 kg and 1756 +- 69 mm for men in ANSUR II (Gordon
et al. 2014, NATICK/TR-15/007)."""

CORRELATION = 0.5
"""Between body mass and stature. Assumed: the survey's table of means does not give it."""

MAXIMUM_DEVIATIONS = 2.5
"""Draws further from the mean than this are taken at this distance."""

_LENGTHS = ("shank_length", "shank_mass_centre", "foot_mass_centre", "heel_lever", "toe_lever")
_MASSES = ("shank_mass", "foot_mass")
_INERTIAS = ("shank_inertia", "foot_inertia")


@dataclass(frozen=True, slots=True, eq=False)
class Build:
    """Body mass and stature of many people over those of one, each (people,)."""

    mass: Floats
    stature: Floats


def draw_builds(count: int, generator: np.random.Generator) -> Build:
    """Draw the build of ``count`` people; the first is the wearer that is scaled."""
    normal = draw_bounded_normal(generator, (2, count))
    stature = normal[0]
    mass = CORRELATION * normal[0] + np.sqrt(1.0 - CORRELATION**2) * normal[1]
    scaled = 1.0 + MASS_VARIATION * mass, 1.0 + STATURE_VARIATION * stature
    for values in scaled:
        values[0] = 1.0
    return Build(*scaled)


def draw_bounded_normal(generator: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Standard normal draws [-] of this shape, those beyond ``MAXIMUM_DEVIATIONS`` set to that limit."""
    return np.clip(generator.standard_normal(shape), -MAXIMUM_DEVIATIONS, MAXIMUM_DEVIATIONS)


def segment_values(wearer: Wearer, build: Build) -> dict[str, Floats]:
    """Values of the leg (people,) by field of ``LegParameters``, in SI units."""
    found = {name: getattr(wearer, name) * build.stature for name in _LENGTHS}
    found |= {name: getattr(wearer, name) * build.mass for name in _MASSES}
    found |= {name: getattr(wearer, name) * build.mass * build.stature**2 for name in _INERTIAS}
    return {"body_mass": wearer.body_mass * build.mass, **found}
