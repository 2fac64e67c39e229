"""Free decay after an impulse: viscous damping and Coulomb friction, separated; figure 3, bottom, of the paper.

With no pressure and no gravity, equation (1) is I w' = -beta w - T_c sign(w). With b = beta/I and d = T_c/I it has the
solution w(t) = (w_0 + d/b) exp(-b t) - d/b until w reaches zero, and then rest. Viscous damping bends the curve from
the start, Coulomb friction ends it: that is what tells the two apart. Both follow over the inertia only.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CurveFit, fit_curve, quantile
from ppafo.identification.bench.result import BenchResult, Evidence, Number, Panel, Series, count_of, prospect_of
from ppafo.identification.estimate import Check, Estimate, Prospect
from ppafo.identification.linear_systems import inverse_of
from ppafo.identification.source import Source, check_moves, check_no_gap, check_sources, kind_of, traces, window
from ppafo.signals.faults import is_at_limit, plateaus
from ppafo.signals.recording import Floats

PROCEDURE = "free-decay"
ANGLE = "angle"
VELOCITY = "angular_velocity"
"""Fitted besides the angle where it was recorded."""

MINIMUM_SAMPLES = 20
_GOOD_FRACTION = 0.0025
_SLOW = 1.0e-9
_FEWEST_SMOOTHED, _SMOOTHED_FRACTION = 5, 0.04
_VELOCITY_MAY_DIFFER = 0.1
_SMALLEST_NOISE = 1.0e-6
_MINIMUM_OVER_NOISE = 20.0


@dataclass(frozen=True, slots=True)
class FreeDecaySettings:
    """Times between which the vane turns freely [s], inertia [kg m^2] with half width of its interval and its source.

    ``calibration`` is the relative uncertainty of the sensor's gain [-].
    Without a start the decay begins where the speed is largest; without an inertia only ratios over it are known.
    """

    start: float | None = None
    end: float | None = None
    inertia: float | None = None
    inertia_half_width: float = 0.0
    inertia_source: str = "given"
    confidence: float = 0.95
    calibration: float = 0.0


def free_decay(sources: tuple[Source, ...], settings: FreeDecaySettings | None = None) -> BenchResult:
    """Return viscous damping [N m s/rad] and dynamic friction [N m], or both over the inertia [1/s, rad/s^2]; (1).

    The angular velocity is fitted with the angle where a recording has it, each weighted by its noise.
    Several recordings are several impulses to the same device: the ratios are common, each has its own start.
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    chosen = settings or FreeDecaySettings()
    check_sources(sources, PROCEDURE, (ANGLE,), MINIMUM_SAMPLES)
    decays = tuple(decay_of(source, chosen.start, chosen.end) for source in sources)
    fit = _fit(decays, chosen.confidence)
    owns = [fit.values[2 + 2 * number : 4 + 2 * number] for number in range(len(decays))]
    rate, deceleration = map(float, fit.values[:2])
    known = "" if chosen.inertia is not None else "; the inertia is not known, so only ratios to it follow"
    both = " of angle and angular velocity" if any(decay.velocity is not None for decay in decays) else ""
    at_rest = sum(
        stop_time(float(own[1]), rate, deceleration) <= decay.time[-1] for decay, own in zip(decays, owns, strict=True)
    )
    likeness = float(fit.correlation[0, 1])
    separate = abs(likeness) < 0.995
    word = "can" if separate else "cannot"
    separation = f"damping and Coulomb friction {word} be distinguished (correlation {likeness:+.3f})"
    return BenchResult(
        PROCEDURE,
        f"{count_of(len(decays), 'decay')}{both}; beta/I = {rate:.4g} 1/s, T_c/I = {deceleration:.4g} rad/s^2{known}",
        _estimates(Evidence(traces(sources), chosen.confidence, chosen.calibration), fit, chosen),
        (_residual_check(decays, owns, fit), Check("two frictions", separate, separation)),
        _panels(decays, owns, fit),
        kind_of(sources),
        (f"{at_rest} of {len(decays)} decays reach rest within the recording",),
    )


def decay_prospects(sources: tuple[Source, ...], settings: FreeDecaySettings) -> tuple[Prospect, ...]:
    """Return how well damping and Coulomb friction can be had, and whether as more than ratios to the inertia."""
    check_sources(sources, PROCEDURE, (ANGLE,), MINIMUM_SAMPLES)
    decays = [decay_of(source, settings.start, settings.end) for source in sources]
    # Rough values, from the slope of acceleration over velocity: w' = -b w - d.
    velocity, acceleration = smoothed_rates(decays[0].time, decays[0].sign * decays[0].angle)
    moving = velocity > 0.1 * velocity.max()
    slope, level = np.polyfit(velocity[moving], acceleration[moving], 1)
    longest = 1.0 / float(decays[0].time[-1])
    rate = max(-float(slope), 0.1 * longest)
    deceleration = max(-float(level), 0.01 * longest * float(velocity.max()))
    information = np.zeros((2, 2))
    for decay in decays:
        speed = float(np.abs(smoothed_rates(decay.time, decay.angle)[0][:5]).max())
        information += _information(decay, speed, rate, deceleration)
    covariance = inverse_of(information)
    half = quantile(settings.confidence, sum(decay.time.size for decay in decays)) * np.sqrt(np.diag(covariance))
    likeness = float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]))
    where = f"{decays[0].time[-1]:.3g} s of decay; errors of both are correlated by {likeness:+.2f}"
    known = settings.inertia is not None
    text = f"with an inertia of {settings.inertia:.4g} kg m^2" if known else "no inertia is known: only ratios to it"
    return (
        prospect_of("damping", half[0], rate, where),
        prospect_of("dynamic friction", half[1], deceleration, where),
        Prospect("absolute values", known, text),
    )


def angle_of_decay(
    times: Floats, start_angle: float, start_velocity: float, damping_rate: float, deceleration: float
) -> Floats:
    """Return the angle [rad] after times [s] for beta/I [1/s] and T_c/I [rad/s^2]; start velocity above 0; eq. (1)."""
    run, creep = _decay_integrals(times, start_velocity, damping_rate, deceleration)
    return np.asarray(start_angle + start_velocity * run - deceleration * creep)


def velocity_of_decay(times: Floats, start_velocity: float, damping_rate: float, deceleration: float) -> Floats:
    """Return the angular velocity [rad/s] after times [s], 0 from the stop on; arguments as for the angle; eq. (1)."""
    run, _ = _decay_integrals(times, start_velocity, damping_rate, deceleration)
    return np.asarray(start_velocity * (1.0 - damping_rate * run) - deceleration * run)


def stop_time(start_velocity: float, damping_rate: float, deceleration: float) -> float:
    """Return when the decay ends [s], infinite without Coulomb friction: ln(1 + w_0 b / d) / b."""
    if deceleration <= 0.0:
        return math.inf
    if damping_rate < _SLOW:
        return start_velocity / deceleration
    return math.log1p(start_velocity * damping_rate / deceleration) / damping_rate


def _decay_integrals(times: Floats, start_velocity: float, rate: float, deceleration: float) -> tuple[Floats, Floats]:
    """Return the integral of exp(-b t) up to the stop, and the integral of that; series where b t is small."""
    moving = np.minimum(times, stop_time(start_velocity, rate, deceleration))
    product = rate * moving
    small = product < 1.0e-4
    safe_rate = max(rate, _SLOW)
    run = np.where(small, moving * (1.0 - product / 2.0 + product**2 / 6.0), -np.expm1(-product) / safe_rate)
    creep = np.where(small, moving**2 * (0.5 - product / 6.0 + product**2 / 24.0), (moving - run) / safe_rate)
    return run, creep


class Decay(NamedTuple):
    """One decay: times from its start [s], angle [rad] measured, its direction (1 or -1), and its velocity [rad/s].

    Without a measured angular velocity it is None. ``velocity_weight`` [s] makes its errors worth those of the angle.
    """

    time: Floats
    angle: Floats
    sign: float
    velocity: Floats | None
    velocity_weight: float

    def model(self, own: Floats, rates: Floats) -> Floats:
        """Return the angle [rad] for start angle and speed (``own``), and beta/I and T_c/I (``rates``)."""
        swept = angle_of_decay(self.time, 0.0, max(float(own[1]), 0.0), float(rates[0]), float(rates[1]))
        return np.asarray(own[0] + self.sign * swept)


def _information(decay: Decay, speed: float, rate: float, deceleration: float) -> Floats:
    """Return the information of one decay on rate and deceleration, with start angle and speed unknown."""
    values = np.array([rate, deceleration, speed, 0.0])
    steps = np.array([1e-4 * rate, 1e-4 * deceleration, 1e-4 * speed, 1.0])

    def course(at: Floats) -> Floats:
        return angle_of_decay(decay.time, at[3], at[2], at[0], at[1])

    columns = [(course(values + step) - course(values - step)) / (2.0 * step.sum()) for step in np.diag(steps)]
    jacobian = np.stack(columns, axis=1) / noise_of(decay.angle)
    own, common = jacobian[:, 2:], jacobian[:, :2]
    kept = common - own @ np.linalg.lstsq(own, common, rcond=None)[0]
    return np.asarray(kept.T @ kept)


def decay_of(source: Source, start: float | None, end: float | None) -> Decay:
    """Return the decay in a recording between two times [s]; without a start it begins where the speed is largest.

    IdentificationError where too few samples are left.
    """
    check_moves(source, PROCEDURE, ANGLE)
    part = window(source.recording, start, end)
    if len(part) < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} samples between start and end, "
            f"there are {len(part)}"
        )
    swept, noise = float(np.ptp(part[ANGLE])), noise_of(part[ANGLE])
    if swept < _MINIMUM_OVER_NOISE * noise:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: nothing moves: the angle changes by {swept:.3g} rad with a noise of "
            f"{noise:.3g} rad; push the vane"
        )
    skipped = check_no_gap(source, PROCEDURE, part)
    velocity, _ = smoothed_rates(part.time, part[ANGLE])
    first = 0 if start is not None else int(np.argmax(np.abs(velocity)))
    sign = 1.0 if velocity[first] > 0.0 else -1.0
    # A push ends a little after the highest speed of the smoothed signal; that much is left out.
    first += 0 if start is not None else _smoothing_width(part.time.size) // 2
    back = np.flatnonzero(sign * velocity[first:] < -0.02 * np.abs(velocity).max())
    last = first + int(back[0]) if back.size else part.time.size
    if last - first < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last - first} samples lie between the highest speed and the end or the "
            f"first reversal, {MINIMUM_SAMPLES} are needed; record longer, or give start and end"
        )
    time, angle = part.time[first:last], part[ANGLE][first:last]
    for plateau in plateaus(angle):
        if is_at_limit(angle, plateau):
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'angle' stays at exactly {plateau.value:g} rad for "
                f"{plateau.count} samples, from sample {skipped + first + plateau.first + 1}, and was still moving "
                f"before: the sensor is saturated or the vane is at a stop; give end"
            )
    if VELOCITY not in part:
        return Decay(time=time - time[0], angle=angle, sign=sign, velocity=None, velocity_weight=0.0)
    measured = part[VELOCITY][first:last]
    # How fast the angle changes, by the area under the velocity: another unit or another sign is no 1.
    moved = np.concatenate(([0.0], np.cumsum(0.5 * (measured[1:] + measured[:-1]) * np.diff(time))))
    away = angle - angle.mean()
    gain = float(away @ moved / (away @ away))
    if abs(gain - 1.0) > _VELOCITY_MAY_DIFFER:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: channel '{VELOCITY}' is {gain:.3g} times as fast as 'angle' changes; "
            f"check unit and sign of both"
        )
    weight = noise_of(angle) / noise_of(measured)
    return Decay(time=time - time[0], angle=angle, sign=sign, velocity=measured, velocity_weight=weight)


def noise_of(values: Floats) -> float:
    """Return the scatter, in the unit of the values, from second differences; never 0, so that it can be a weight."""
    return max(float(np.sqrt(np.mean(np.diff(values, 2) ** 2) / 6.0)), _SMALLEST_NOISE * float(np.ptp(values)))


def smoothed_rates(time: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return angular velocity [rad/s] and acceleration [rad/s^2] from local parabolas, at the times of the samples."""
    from scipy.signal import savgol_filter

    even = np.linspace(time[0], time[-1], time.size)
    step, width = float(even[1] - even[0]), _smoothing_width(time.size)
    values = np.interp(even, time, angle)
    rates = [savgol_filter(values, width, 2, deriv=order, delta=step) for order in (1, 2)]
    velocity, acceleration = (np.interp(time, even, rate) for rate in rates)
    return velocity, acceleration


def _smoothing_width(count: int) -> int:
    """Return an odd number of samples to smooth over."""
    return max(_FEWEST_SMOOTHED, int(_SMOOTHED_FRACTION * count)) | 1


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
        parts = []
        for number, decay in enumerate(decays):
            own = values[2 + 2 * number : 4 + 2 * number]
            parts.append(decay.angle - decay.model(own, values[:2]))
            if decay.velocity is not None:
                speed = velocity_of_decay(decay.time, max(float(own[1]), 0.0), float(values[0]), float(values[1]))
                parts.append(decay.velocity_weight * (decay.velocity - decay.sign * speed))
        return np.concatenate(parts)

    lower = np.array([0.0, 0.0, *(limit for _ in decays for limit in (-np.inf, 0.0))])
    upper = np.full(lower.size, np.inf)
    fits = [fit_curve(residuals, np.array([*guess, *starts]), lower, upper, confidence) for guess in guesses]
    return min(fits, key=lambda fit: fit.rms)


def _estimates(evidence: Evidence, fit: CurveFit, settings: FreeDecaySettings) -> tuple[Estimate, ...]:
    """Return both ratios and, with an inertia, both values; the gain of the sensor scales T_c/I and not beta/I."""
    trade = f"errors of damping and Coulomb friction are correlated by {fit.correlation[0, 1]:+.2f}"
    gain = f"; {evidence.calibration_text}" if evidence.calibration else ""
    halves = float(fit.half_widths[0]), math.hypot(fit.half_widths[1], evidence.calibration * float(fit.values[1]))
    damping, friction = (
        Number(path, unit, fit.values[index], halves[index], text, widened=fit.widened[index])
        for index, (path, unit, text) in enumerate(
            (
                ("free_decay.damping_over_inertia", "1/s", f"beta/I; {trade}."),
                ("free_decay.friction_over_inertia", "rad/s^2", f"T_c/I; {trade}{gain}."),
            )
        )
    )
    inertia = settings.inertia
    if inertia is None:
        missing = "The inertia is not known, so there is no absolute value: give 'inertia'."
        return tuple(
            evidence.at_or_above_zero(replace(item, explanation=f"{item.explanation} {missing}"))
            for item in (damping, friction)
        )
    fraction = settings.inertia_half_width / inertia
    known = f"with an inertia of {inertia:.4g} kg m^2 ({settings.inertia_source}), "
    known += "whose uncertainty is in the interval" if fraction else "taken as exact"
    absolute = [
        replace(
            ratio,
            path=path,
            unit=unit,
            value=inertia * ratio.value,
            half_width=inertia * math.hypot(ratio.half_width, fraction * ratio.value),
            explanation=f"{symbol} {known}; {ratio.explanation.partition('; ')[2]}",
        )
        for ratio, path, unit, symbol in (
            (damping, "friction.viscous_damping", "N m s/rad", "beta"),
            (friction, "friction.dynamic_torque", "N m", "T_c"),
        )
    ]
    return tuple(evidence.at_or_above_zero(item) for item in (*absolute, damping, friction))


def _residual_check(decays: tuple[Decay, ...], owns: list[Floats], fit: CurveFit) -> Check:
    swept = max(float(np.ptp(decay.angle)) for decay in decays)
    noise = max(noise_of(decay.angle) for decay in decays)
    misses = [decay.angle - decay.model(own, fit.values[:2]) for decay, own in zip(decays, owns, strict=True)]
    missed = float(np.sqrt(np.mean(np.concatenate(misses) ** 2)))
    fraction = missed / swept
    holds = missed <= 3.0 * noise or fraction <= _GOOD_FRACTION
    text = f"the fitted decay misses the angle by {math.degrees(missed):.3g} deg rms, {fraction:.2%} of the swept range"
    return Check("residuals", holds, text if holds else f"{text}: another torque acts, such as gravity or an end stop")


def _panels(decays: tuple[Decay, ...], owns: list[Floats], fit: CurveFit) -> tuple[Panel, ...]:
    angles: list[Series] = []
    rates: list[Series] = []
    measured, fitted = "measured", "fitted"
    for decay, own in zip(decays, owns, strict=True):
        angles += [
            Series(measured, decay.time, decay.angle, "measured"),
            Series(fitted, decay.time, decay.model(own, fit.values[:2]), "law"),
        ]
        velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
        moving = velocity > 0.03 * velocity.max()
        inner = slice(_smoothing_width(decay.time.size), None, max(1, decay.time.size // 200))
        shown = velocity[inner][moving[inner]], acceleration[inner][moving[inner]]
        rates.append(Series(measured, *shown, "measured"))
        measured = fitted = ""  # the legend names the first decay only
    fastest = max(float(series.x.max()) for series in rates if series.x.size)
    line = np.array([0.0, fastest])
    rates.append(Series("$-\\beta\\omega/I - T_c/I$", line, -fit.values[0] * line - fit.values[1], "law"))
    return (
        Panel("Free decay", "Time", "s", "Angle", "rad", tuple(angles)),
        Panel("Damping", "Angular velocity", "rad/s", "Angular acceleration", "rad/s^2", tuple(rates)),
    )
