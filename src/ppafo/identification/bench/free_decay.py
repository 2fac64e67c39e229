"""Free decay after an impulse: viscous damping and Coulomb friction, told apart; figure 3, bottom, of the paper.

With no pressure and no gravity, equation (1) is I w' = -beta w - T_c sign(w). With b = beta/I and d = T_c/I it has the
solution w(t) = (w_0 + d/b) exp(-b t) - d/b until w reaches zero, and then rest. Viscous damping bends the curve from
the start, Coulomb friction ends it: that is what tells the two apart. Both follow over the inertia only.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CurveFit, fit_curve
from ppafo.identification.bench.inputs import check_moves, check_sources, kind_of, window
from ppafo.identification.bench.picture import Panel, Series
from ppafo.identification.bench.result import BenchResult, counted, verdict_of
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

PROCEDURE = "free_decay"
CHANNELS = ("angle",)
FEWEST_SAMPLES = 20
_SMOOTHED_SHARE = 0.04
_FEWEST_SMOOTHED = 5
_SLOW = 1.0e-9
_GOOD_SHARE = 0.0025


@dataclass(frozen=True, slots=True)
class FreeDecaySettings:
    """Times between which the vane turns freely [s], inertia [kg m^2] with half width of its interval and its source.

    Without a start the decay begins where the speed is largest; without an inertia only ratios over it are known.
    """

    start: float | None = None
    end: float | None = None
    inertia: float | None = None
    inertia_half_width: float = 0.0
    inertia_source: str = "given"
    confidence: float = 0.95


class Decay(NamedTuple):
    """One decay: times from its start [s], angle [rad] measured, and its direction, 1 or -1."""

    time: Floats
    angle: Floats
    sign: float


def free_decay(sources: tuple[Source, ...], settings: FreeDecaySettings | None = None) -> BenchResult:
    """Return viscous damping [N m s/rad] and dynamic friction [N m], or both over the inertia [1/s, rad/s^2]; (1).

    Several recordings are several impulses to the same device: the ratios are common, each has its own start.
    """
    chosen = settings or FreeDecaySettings()
    check_sources(sources, PROCEDURE, CHANNELS, FEWEST_SAMPLES)
    decays = tuple(_decay(source, chosen) for source in sources)
    fit = _fit(decays, chosen.confidence)
    estimates = _estimates(traces(sources), fit, chosen)
    checks = (_residual_check(decays, fit), _separated(fit), _stopped(decays, fit))
    return BenchResult(
        PROCEDURE, _summary(decays, fit, chosen), estimates, checks, _panels(decays, fit), kind_of(sources)
    )


def angle_of_decay(
    times: Floats, start_angle: float, start_velocity: float, damping_rate: float, deceleration: float
) -> Floats:
    """Return the angle [rad] after times [s] for beta/I [1/s] and T_c/I [rad/s^2]; start velocity above 0; eq. (1)."""
    stop = stop_time(start_velocity, damping_rate, deceleration)
    moving = np.minimum(times, stop)
    run, creep = _decay_integrals(moving, damping_rate)
    return np.asarray(start_angle + start_velocity * run - deceleration * creep)


def stop_time(start_velocity: float, damping_rate: float, deceleration: float) -> float:
    """Return when the decay ends [s], infinite without Coulomb friction: ln(1 + w_0 b / d) / b."""
    if deceleration <= 0.0:
        return math.inf
    if damping_rate < _SLOW:
        return start_velocity / deceleration
    return math.log1p(start_velocity * damping_rate / deceleration) / damping_rate


def _decay_integrals(times: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return the integral of exp(-b t), and the integral of that; series where b t is small."""
    product = rate * times
    small = product < 1.0e-4
    safe_rate = max(rate, _SLOW)
    run = np.where(small, times * (1.0 - product / 2.0 + product**2 / 6.0), -np.expm1(-product) / safe_rate)
    creep = np.where(small, times**2 * (0.5 - product / 6.0 + product**2 / 24.0), (times - run) / safe_rate)
    return run, creep


def _decay(source: Source, settings: FreeDecaySettings) -> Decay:
    check_moves(source, PROCEDURE, "angle")
    part = window(source.recording, settings.start, settings.end)
    if len(part) < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE} needs at least {FEWEST_SAMPLES} samples between start and end, "
            f"there are {len(part)}"
        )
    velocity, _ = smoothed_rates(part.time, part["angle"])
    first = 0 if settings.start is not None else int(np.argmax(np.abs(velocity)))
    sign = 1.0 if velocity[first] > 0.0 else -1.0
    # A push ends a little after the highest speed of the smoothed signal; that much is left out.
    first += 0 if settings.start is not None else _width(part.time.size) // 2
    back = np.flatnonzero(sign * velocity[first:] < -0.02 * np.abs(velocity).max())
    last = first + int(back[0]) if back.size else part.time.size
    if last - first < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last - first} samples lie between the highest speed and the end or the "
            f"first reversal, {FEWEST_SAMPLES} are needed; record longer, or give start and end"
        )
    time, angle = part.time[first:last], part["angle"][first:last]
    return Decay(time - time[0], angle, sign)


def smoothed_rates(time: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return angular velocity [rad/s] and acceleration [rad/s^2] from local parabolas, at the times of the samples."""
    from scipy.signal import savgol_filter

    even = np.linspace(time[0], time[-1], time.size)
    step, width = float(even[1] - even[0]), _width(time.size)
    values = np.interp(even, time, angle)
    rates = [savgol_filter(values, width, 2, deriv=order, delta=step) for order in (1, 2)]
    velocity, acceleration = (np.interp(time, even, rate) for rate in rates)
    return velocity, acceleration


def _width(count: int) -> int:
    """Return an odd number of samples to smooth over."""
    return max(_FEWEST_SMOOTHED, int(_SMOOTHED_SHARE * count)) | 1


def _modelled(decay: Decay, own: Floats, rates: Floats) -> Floats:
    swept = angle_of_decay(decay.time, 0.0, max(float(own[1]), 0.0), float(rates[0]), float(rates[1]))
    return np.asarray(own[0] + decay.sign * swept)


def _fit(decays: tuple[Decay, ...], confidence: float) -> CurveFit:
    """Fit b and d in common, start angle and speed each: values are b, d, then two for each decay."""
    starts, velocities, rates = [], [], []
    for decay in decays:
        velocity, _ = smoothed_rates(decay.time, decay.angle)
        speed = max(float(np.abs(velocity[:_FEWEST_SMOOTHED]).max()), 1e-6)
        starts += [float(decay.angle[0]), speed]
        swept = abs(float(decay.angle[-1] - decay.angle[0]))
        rates.append(speed / max(swept, 1e-9))
        velocities.append(speed)
    rate = float(np.median(rates))
    guesses = [(rate, 0.1 * rate * velocities[0]), (0.3 * rate, 0.5 * rate * velocities[0])]

    def residuals(values: Floats) -> Floats:
        parts = [
            decay.angle - _modelled(decay, values[2 + 2 * number : 4 + 2 * number], values[:2])
            for number, decay in enumerate(decays)
        ]
        return np.concatenate(parts)

    lower = np.array([0.0, 0.0, *(limit for _ in decays for limit in (-np.inf, 0.0))])
    upper = np.full(lower.size, np.inf)
    fits = [fit_curve(residuals, np.array([*guess, *starts]), lower, upper, confidence) for guess in guesses]
    return min(fits, key=lambda fit: fit.rms)


def _estimates(names: tuple[str, ...], fit: CurveFit, settings: FreeDecaySettings) -> tuple[Estimate, ...]:
    (damping, friction), (wide_b, wide_d) = fit.values[:2], fit.half_widths[:2]
    trade = f"errors of damping and Coulomb friction go together with {fit.correlation[0, 1]:+.2f}"
    ratios = (
        _estimate("free_decay.damping_over_inertia", "1/s", damping, wide_b, f"beta/I; {trade}.", names, settings),
        _estimate("free_decay.friction_over_inertia", "rad/s^2", friction, wide_d, f"T_c/I; {trade}.", names, settings),
    )
    inertia = settings.inertia
    if inertia is None:
        return tuple(_without_inertia(item) for item in ratios)
    relative = settings.inertia_half_width / inertia
    known = (
        f"with an inertia of {inertia:.4g} kg m^2 ({settings.inertia_source}), "
        f"{'whose uncertainty is in the interval' if relative else 'taken as exact'}; {trade}."
    )
    absolute = (
        ("friction.viscous_damping", "N m s/rad", damping, wide_b, "beta"),
        ("friction.dynamic_torque", "N m", friction, wide_d, "T_c"),
    )
    scaled = (
        _estimate(
            path,
            unit,
            inertia * value,
            inertia * math.hypot(wide, relative * value),
            f"{symbol} {known}",
            names,
            settings,
        )
        for path, unit, value, wide, symbol in absolute
    )
    return (*scaled, *ratios)


def _estimate(
    path: str, unit: str, value: float, wide: float, text: str, names: tuple[str, ...], settings: FreeDecaySettings
) -> Estimate:
    low, high = max(0.0, float(value - wide)), float(value + wide)
    verdict: Verdict = verdict_of(value, float(value - wide), high)
    if value <= 1e-9 * high:
        verdict = "at its bound"
        text = f"The fit would have it below zero, so it is held at zero. {text}"
    return Estimate(path, float(value), unit, low, high, verdict, text, names, settings.confidence)


def _without_inertia(estimate: Estimate) -> Estimate:
    text = f"{estimate.explanation} The inertia is not known, so there is no absolute value: give 'inertia'."
    return replace(estimate, explanation=text)


def _residual_check(decays: tuple[Decay, ...], fit: CurveFit) -> Check:
    swept = max(float(np.ptp(decay.angle)) for decay in decays)
    noise = float(np.sqrt(np.mean(np.concatenate([np.diff(decay.angle, 2) for decay in decays]) ** 2) / 6.0))
    share = fit.rms / swept
    holds = fit.rms <= 3.0 * noise or share <= _GOOD_SHARE
    text = f"the fitted decay misses the angle by {math.degrees(fit.rms):.3g} deg rms, {share:.2%} of what was swept"
    return Check("residuals", holds, text if holds else f"{text}: another torque acts, such as gravity or an end stop")


def _separated(fit: CurveFit) -> Check:
    likeness = float(fit.correlation[0, 1])
    holds = abs(likeness) < 0.995
    word = "can" if holds else "cannot"
    return Check(
        "two frictions", holds, f"damping and Coulomb friction {word} be told apart (correlation {likeness:+.3f})"
    )


def _stopped(decays: tuple[Decay, ...], fit: CurveFit) -> Check:
    """Say whether the vane came to rest within the recording, where Coulomb friction shows best."""
    count = sum(
        stop_time(float(fit.values[3 + 2 * number]), *map(float, fit.values[:2])) <= decay.time[-1]
        for number, decay in enumerate(decays)
    )
    return Check("came to rest", True, f"{count} of {len(decays)} decays reach rest within the recording")


def _summary(decays: tuple[Decay, ...], fit: CurveFit, settings: FreeDecaySettings) -> str:
    known = "" if settings.inertia is not None else "; the inertia is not known, so only ratios over it follow"
    return (
        f"{counted(len(decays), 'decay')}; beta/I = {fit.values[0]:.4g} 1/s, T_c/I = {fit.values[1]:.4g} rad/s^2{known}"
    )


def _panels(decays: tuple[Decay, ...], fit: CurveFit) -> tuple[Panel, ...]:
    angles: list[Series] = []
    rates: list[Series] = []
    for number, decay in enumerate(decays):
        own = fit.values[2 + 2 * number : 4 + 2 * number]
        named = number == 0
        modelled = _modelled(decay, own, fit.values[:2])
        angles += [Series("measured" if named else "", decay.time, decay.angle, "measured")]
        angles += [Series("fitted" if named else "", decay.time, modelled, "law")]
        velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
        moving = velocity > 0.03 * velocity.max()
        inner = slice(_width(decay.time.size), None, max(1, decay.time.size // 200))
        rates += [
            Series(
                "measured" if named else "",
                velocity[inner][moving[inner]],
                acceleration[inner][moving[inner]],
                "measured",
            )
        ]
    fastest = max(float(series.x.max()) for series in rates if series.x.size)
    line = np.array([0.0, fastest])
    rates += [Series("$-\\beta\\omega/I - T_c/I$", line, -fit.values[0] * line - fit.values[1], "law")]
    return (
        Panel("Free decay", "Time", "s", "Angle", "rad", tuple(angles)),
        Panel("Damping", "Angular velocity", "rad/s", "Angular acceleration", "rad/s^2", tuple(rates)),
    )
