"""Free decay after an impulse: viscous damping and Coulomb friction, separated; figure 3, bottom, of the paper.

With no pressure and no gravity, equation (1) is I w' = -beta w - T_c sign(w). With b = beta/I and d = T_c/I it has the
solution w(t) = (w_0 + d/b) exp(-b t) - d/b until w reaches zero, and then rest. Viscous damping bends the curve from
the start, Coulomb friction ends it: that is what tells the two apart. Both follow over the inertia only.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.bench.curve_fit import CurveFit, fit_curve, quantile
from ppafo.identification.bench.decay import (
    ANGLE,
    FEWEST_SMOOTHED,
    MINIMUM_SAMPLES,
    PROCEDURE,
    Decay,
    angle_of_decay,
    decay_of,
    noise_of,
    smoothed_rates,
    smoothing_width,
    stop_time,
    velocity_of_decay,
)
from ppafo.identification.bench.inputs import check_sources, kind_of
from ppafo.identification.bench.result import (
    BenchResult,
    Evidence,
    Number,
    Panel,
    Series,
    count_of,
    prospect_of,
)
from ppafo.identification.estimate import Check, Estimate, Prospect
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

_GOOD_FRACTION = 0.0025


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
    estimates = _estimates(Evidence(traces(sources), chosen.confidence, chosen.calibration), fit, chosen)
    checks = (_residual_check(decays, fit), _separation_check(fit))
    text, panels = _summary(decays, fit, chosen), _panels(decays, fit)
    return BenchResult(PROCEDURE, text, estimates, checks, panels, kind_of(sources), (_rest_remark(decays, fit),))


def decay_prospects(sources: tuple[Source, ...], settings: FreeDecaySettings) -> tuple[Prospect, ...]:
    """Return how well damping and Coulomb friction can be had, and whether as more than ratios to the inertia."""
    check_sources(sources, PROCEDURE, (ANGLE,), MINIMUM_SAMPLES)
    decays = [decay_of(source, settings.start, settings.end) for source in sources]
    information = np.zeros((2, 2))
    rate, deceleration = _rough_rates(decays[0])
    for decay in decays:
        speed = float(np.abs(smoothed_rates(decay.time, decay.angle)[0][:5]).max())
        information += _information(decay, speed, rate, deceleration)
    covariance = np.linalg.pinv(information)
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


def _rough_rates(decay: Decay) -> tuple[float, float]:
    """Return damping rate [1/s] and deceleration [rad/s^2] from the slope of acceleration over velocity."""
    velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
    moving = velocity > 0.1 * velocity.max()
    slope, level = np.polyfit(velocity[moving], acceleration[moving], 1)
    longest = 1.0 / float(decay.time[-1])
    return max(-float(slope), 0.1 * longest), max(-float(level), 0.01 * longest * float(velocity.max()))


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


def _model_angle(decay: Decay, own: Floats, rates: Floats) -> Floats:
    swept = angle_of_decay(decay.time, 0.0, max(float(own[1]), 0.0), float(rates[0]), float(rates[1]))
    return np.asarray(own[0] + decay.sign * swept)


def _misses(decay: Decay, own: Floats, rates: Floats) -> Floats:
    """Return measured less modelled [rad]: of the angle, and of the velocity where it was measured, weighted."""
    of_angle = decay.angle - _model_angle(decay, own, rates)
    if decay.velocity is None:
        return np.asarray(of_angle)
    speed = velocity_of_decay(decay.time, max(float(own[1]), 0.0), float(rates[0]), float(rates[1]))
    return np.concatenate([of_angle, decay.velocity_weight * (decay.velocity - decay.sign * speed)])


def _fit(decays: tuple[Decay, ...], confidence: float) -> CurveFit:
    """Fit b and d in common, start angle and speed each: values are b, d, then two for each decay."""
    starts, velocities, rates = [], [], []
    for decay in decays:
        velocity, _ = smoothed_rates(decay.time, decay.angle)
        speed = max(float(np.abs(velocity[:FEWEST_SMOOTHED]).max()), 1e-6)
        starts += [float(decay.angle[0]), speed]
        swept = abs(float(decay.angle[-1] - decay.angle[0]))
        rates.append(speed / max(swept, 1e-9))
        velocities.append(speed)
    rate = float(np.median(rates))
    guesses = [(rate, 0.1 * rate * velocities[0]), (0.3 * rate, 0.5 * rate * velocities[0])]

    def residuals(values: Floats) -> Floats:
        return np.concatenate(
            [_misses(decay, values[2 + 2 * number : 4 + 2 * number], values[:2]) for number, decay in enumerate(decays)]
        )

    lower = np.array([0.0, 0.0, *(limit for _ in decays for limit in (-np.inf, 0.0))])
    upper = np.full(lower.size, np.inf)
    fits = [fit_curve(residuals, np.array([*guess, *starts]), lower, upper, confidence) for guess in guesses]
    return min(fits, key=lambda fit: fit.rms)


def _estimates(evidence: Evidence, fit: CurveFit, settings: FreeDecaySettings) -> tuple[Estimate, ...]:
    """Return both ratios and, with an inertia, both values; the gain of the sensor scales T_c/I and not beta/I."""
    damping, friction = _ratios(fit, evidence)
    inertia = settings.inertia
    if inertia is None:
        return tuple(evidence.at_or_above_zero(_without_inertia(item)) for item in (damping, friction))
    fraction = settings.inertia_half_width / inertia
    known = f"with an inertia of {inertia:.4g} kg m^2 ({settings.inertia_source}), "
    known += "whose uncertainty is in the interval" if fraction else "taken as exact"
    absolute = (
        _times_inertia(damping, inertia, fraction, "friction.viscous_damping", "N m s/rad", f"beta {known}"),
        _times_inertia(friction, inertia, fraction, "friction.dynamic_torque", "N m", f"T_c {known}"),
    )
    return tuple(evidence.at_or_above_zero(item) for item in (*absolute, damping, friction))


def _ratios(fit: CurveFit, evidence: Evidence) -> tuple[Number, Number]:
    trade = f"errors of damping and Coulomb friction are correlated by {fit.correlation[0, 1]:+.2f}"
    gain = f"; {evidence.calibration_text}" if evidence.calibration else ""
    friction = math.hypot(float(fit.half_widths[1]), evidence.calibration * float(fit.values[1]))
    return (
        Number(
            "free_decay.damping_over_inertia",
            "1/s",
            fit.values[0],
            fit.half_widths[0],
            f"beta/I; {trade}.",
            widened=fit.widened[0],
        ),
        Number(
            "free_decay.friction_over_inertia",
            "rad/s^2",
            fit.values[1],
            friction,
            f"T_c/I; {trade}{gain}.",
            widened=fit.widened[1],
        ),
    )


def _times_inertia(ratio: Number, inertia: float, fraction: float, path: str, unit: str, known: str) -> Number:
    """Return a ratio times the inertia [kg m^2], whose relative uncertainty is ``fraction``."""
    half_width = inertia * math.hypot(ratio.half_width, fraction * ratio.value)
    description = f"{known}; {ratio.explanation.partition('; ')[2]}"
    value = inertia * ratio.value
    return replace(ratio, path=path, unit=unit, value=value, half_width=half_width, explanation=description)


def _without_inertia(ratio: Number) -> Number:
    text = f"{ratio.explanation} The inertia is not known, so there is no absolute value: give 'inertia'."
    return replace(ratio, explanation=text)


def _residual_check(decays: tuple[Decay, ...], fit: CurveFit) -> Check:
    swept = max(float(np.ptp(decay.angle)) for decay in decays)
    noise = max(noise_of(decay.angle) for decay in decays)
    misses = [
        decay.angle - _model_angle(decay, fit.values[2 + 2 * number : 4 + 2 * number], fit.values[:2])
        for number, decay in enumerate(decays)
    ]
    missed = float(np.sqrt(np.mean(np.concatenate(misses) ** 2)))
    fraction = missed / swept
    holds = missed <= 3.0 * noise or fraction <= _GOOD_FRACTION
    text = f"the fitted decay misses the angle by {math.degrees(missed):.3g} deg rms, {fraction:.2%} of the swept range"
    return Check("residuals", holds, text if holds else f"{text}: another torque acts, such as gravity or an end stop")


def _separation_check(fit: CurveFit) -> Check:
    likeness = float(fit.correlation[0, 1])
    holds = abs(likeness) < 0.995
    word = "can" if holds else "cannot"
    return Check(
        "two frictions", holds, f"damping and Coulomb friction {word} be distinguished (correlation {likeness:+.3f})"
    )


def _rest_remark(decays: tuple[Decay, ...], fit: CurveFit) -> str:
    """Say whether the vane came to rest within the recording, where Coulomb friction shows best."""
    count = sum(
        stop_time(float(fit.values[3 + 2 * number]), *map(float, fit.values[:2])) <= decay.time[-1]
        for number, decay in enumerate(decays)
    )
    return f"{count} of {len(decays)} decays reach rest within the recording"


def _summary(decays: tuple[Decay, ...], fit: CurveFit, settings: FreeDecaySettings) -> str:
    known = "" if settings.inertia is not None else "; the inertia is not known, so only ratios to it follow"
    both = any(decay.velocity is not None for decay in decays)
    what = f"{count_of(len(decays), 'decay')}{' of angle and angular velocity' if both else ''}"
    return f"{what}; beta/I = {fit.values[0]:.4g} 1/s, T_c/I = {fit.values[1]:.4g} rad/s^2{known}"


def _panels(decays: tuple[Decay, ...], fit: CurveFit) -> tuple[Panel, ...]:
    angles: list[Series] = []
    rates: list[Series] = []
    for number, decay in enumerate(decays):
        own = fit.values[2 + 2 * number : 4 + 2 * number]
        named = number == 0
        modelled = _model_angle(decay, own, fit.values[:2])
        angles += [Series("measured" if named else "", decay.time, decay.angle, "measured")]
        angles += [Series("fitted" if named else "", decay.time, modelled, "law")]
        velocity, acceleration = smoothed_rates(decay.time, decay.sign * decay.angle)
        moving = velocity > 0.03 * velocity.max()
        inner = slice(smoothing_width(decay.time.size), None, max(1, decay.time.size // 200))
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
