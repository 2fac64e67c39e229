"""A gait as the engine uses it: eight harmonics of each curve, its events, and how the heel meets the ground."""

import math
from dataclasses import replace

import numpy as np

from ppafo.gait import Gait
from ppafo.gait.gait import Curve
from ppafo.model.contact import NEARLY_FLAT
from ppafo.model.fourier import HARMONICS, Harmonic, Series
from ppafo.model.gait import GaitSeries, GaitTiming
from ppafo.signals.recording import Floats

FLAT_FROM, FLAT_TO = 0.15, 0.35
"""Phases between which every foot stands flat; the angle of the foot is taken from there."""

USUAL_HEEL_RISE, LATEST_HEEL_RISE = 0.6, 0.95
"""Shares of the stance at which the heel rises where the angles do not show it, and at the latest."""

EVENT_PHASES = np.linspace(0.0, 1.0, 1001)[150:]
"""Phases at which events are looked for, from the first flat foot on."""

CLEARANCE_FROM, CLEARANCE_TO = 0.2, 0.9
"""Shares of the swing between which the toes must clear the ground."""

ZERO = Series(mean=0.0, harmonics=(Harmonic(0.0, 0.0),) * HARMONICS)


def gait_series(gait: Gait) -> GaitSeries:
    """The curves of a gait for the engine; a moment, force or knee motion that was not measured is 0."""
    return GaitSeries(
        shank=_series(gait, "shank_angle"),
        ankle=_series(gait, "ankle_angle"),
        moment=_series(gait, "ankle_moment"),
        force=_series(gait, "vertical_force"),
        knee_forward=_series(gait, "knee_forward"),
        knee_up=_series(gait, "knee_up"),
    )


def _series(gait: Gait, name: str) -> Series:
    curve = gait.curves.get(name)
    if curve is None:
        return ZERO
    missing = (0.0,) * HARMONICS
    pairs = zip((*curve.cosines, *missing)[:HARMONICS], (*curve.sines, *missing)[:HARMONICS], strict=True)
    return Series(mean=curve.mean, harmonics=tuple(Harmonic(cosine, sine) for cosine, sine in pairs))


def truncate(curve: Curve) -> Curve:
    """The curve with its first eight harmonics, as the engine has it."""
    return replace(curve, cosines=curve.cosines[:HARMONICS], sines=curve.sines[:HARMONICS])


def landing_phase(gait: Gait) -> float:
    """Phase [strides] at which the measured foot has come down: the first time within ``NEARLY_FLAT`` of flat.

    The last degrees are those of heel pad and shoe, which the foot of the engine has not: it is flat at once.
    """
    phases = np.linspace(0.0, FLAT_FROM, 151)
    down = foot_angles(gait, phases) < gait_timing(gait).ground_angle + NEARLY_FLAT
    return float(phases[np.argmax(down)]) if down.any() else FLAT_FROM


def foot_angles(gait: Gait, phases: Floats) -> Floats:
    """Angles [rad] of the measured foot over the horizontal."""
    shank, ankle = truncate(gait.shank_angle), truncate(gait.ankle_angle)
    return shank.values_at(phases) - ankle.values_at(phases) + 0.5 * math.pi


def strike_angle(gait: Gait) -> float:
    """Angle [rad] of the measured foot over the flat one at the heel strike."""
    return float(foot_angles(gait, np.zeros(1))[0]) - gait_timing(gait).ground_angle


def gait_timing(gait: Gait) -> GaitTiming:
    """Frequency [Hz], events [strides] and the flat foot's angle [rad]; heel rise and angle come from the curves."""
    foot = foot_angles(gait, EVENT_PHASES)
    events = gait_events(foot[None, :], np.array([gait.stance_share]))
    return GaitTiming(
        frequency=1.0 / gait.stride_time, start=0.0, **{name: float(values[0]) for name, values in events.items()}
    )


def gait_events(foot: Floats, stance_share: Floats) -> dict[str, Floats]:
    """The fields (people,) of ``GaitTiming`` after ``start``, for feet that stand at angles [rad] (people, phases).

    ``foot`` is over the horizontal, at ``EVENT_PHASES``; ``stance_share`` is (people,).
    """
    flat = (EVENT_PHASES >= FLAT_FROM) & (EVENT_PHASES <= FLAT_TO)
    ground_angle = np.median(foot[:, flat], axis=1)
    steep = (foot < (ground_angle - NEARLY_FLAT)[:, None]) & (EVENT_PHASES > FLAT_TO)
    usual = USUAL_HEEL_RISE * stance_share
    heel_off = np.where(steep.any(axis=1), EVENT_PHASES[np.argmax(steep, axis=1)], usual)
    swing = 1.0 - stance_share
    return {
        "heel_off": np.minimum(heel_off, LATEST_HEEL_RISE * stance_share),
        "toe_off": stance_share,
        "clearance_from": stance_share + CLEARANCE_FROM * swing,
        "clearance_to": stance_share + CLEARANCE_TO * swing,
        "ground_angle": ground_angle,
    }
