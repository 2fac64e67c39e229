"""The laws of a leak fitted to decays: of flow, a relaxation that no leak makes, and a curve without physics."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.bench.curve_fit import CurveFit, fit_curve
from ppafo.identification.bench.evidence import Evidence, Number
from ppafo.identification.bench.leak_laws import Chambers, Law, decay_times, difference_in_time
from ppafo.identification.bench.leak_opening import Opening
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.signals.recording import Floats

EDGE = 20
"""Samples at either end that are averaged for a first guess."""

CLEARLY_WORSE = 10.0
"""Difference in AIC from which a law is refused."""

DESCRIBES = 1.25
"""Misfit of a law over that of the smooth curve, up to which it describes the data."""

_CLOSE = 0.01
_DEGREE = 5
_RELAXATION = "relaxation"


@dataclass(frozen=True, slots=True)
class Decay:
    """Times from the start [s], falling pressure difference [Pa], the chambers, and how well gas is kept."""

    time: Floats
    difference: Floats
    chambers: Chambers
    lost_share: float
    floor: float


@dataclass(frozen=True, slots=True)
class FittedLaw:
    """A law fitted to all decays: its rate first, misfit [Pa], Akaike's criterion, and the curves."""

    name: str
    formula: str
    rate: float
    half_width: float
    rate_unit: str
    rms: float
    criterion: float
    curves: tuple[Floats, ...]
    widened: float


def smooth_curve(decay: Decay) -> Floats:
    """Return a polynomial through the decay: what any smooth law could reach."""
    curve = np.polynomial.Chebyshev.fit(decay.time, decay.difference, _DEGREE)
    return np.asarray(curve(decay.time))


def fit_law(law: Law, decays: tuple[Decay, ...], count: float, confidence: float) -> FittedLaw:
    """Return a law of flow fitted to all decays with one rate; each decay has a start of its own."""
    starts = [float(np.mean(decay.difference[:EDGE])) for decay in decays]
    guesses = []
    for decay, start in zip(decays, starts, strict=True):
        lasting, difference = decay_times(law, decay.chambers, start, decay.floor)
        end = float(np.mean(decay.difference[-EDGE:]))
        guesses.append(float(np.interp(-end, -difference, lasting)) / float(decay.time[-1]))
    rate = float(np.mean(guesses))

    def curves(values: Floats) -> list[Floats]:
        return [
            difference_in_time(law, decay.chambers, start * own, rate * values[0], decay.time, decay.floor)
            for decay, start, own in zip(decays, starts, values[1:], strict=True)
        ]

    scale = max(starts)
    ones = np.ones(1 + len(decays))
    fit = fit_curve(lambda values: _misfits(decays, curves(values)) / scale, ones, 1e-3 * ones, 1e3 * ones, confidence)
    wide = float(fit.half_widths[0]) * rate
    return _fitted(
        law.name, law.formula, law.rate_unit, float(fit.values[0]) * rate, wide, fit, scale, count, curves(fit.values)
    )


def fit_relaxation(decays: tuple[Decay, ...], count: float, confidence: float) -> FittedLaw:
    """Fit an exponential towards a difference of its own: gas that cools, a wall that creeps, a seal that closes."""
    starts = [float(np.mean(decay.difference[:EDGE])) for decay in decays]
    drops = [start - decay.floor for start, decay in zip(starts, decays, strict=True)]
    longest = max(float(decay.time[-1]) for decay in decays)

    def curves(values: Floats) -> list[Floats]:
        listed = []
        for number, (decay, start, drop) in enumerate(zip(decays, starts, drops, strict=True)):
            top, fall = values[1 + 2 * number : 3 + 2 * number]
            listed.append(start + drop * (top - fall * -np.expm1(-values[0] * decay.time / longest)))
        return listed

    scale = max(starts)
    guess = np.array([2.0, *(item for _ in decays for item in (0.0, 1.0))])
    lower = np.array([1e-2, *(item for _ in decays for item in (-10.0, 0.0))])
    upper = np.array([1e3, *(item for _ in decays for item in (10.0, 1e3))])
    fit = fit_curve(lambda values: _misfits(decays, curves(values)) / scale, guess, lower, upper, confidence)
    rate, wide = float(fit.values[0]) / longest, float(fit.half_widths[0]) / longest
    formula = "exponential towards a difference above zero"
    return _fitted(_RELAXATION, formula, "1/s", rate, wide, fit, scale, count, curves(fit.values))


def _misfits(decays: tuple[Decay, ...], curves: list[Floats]) -> Floats:
    return np.concatenate([decay.difference - curve for decay, curve in zip(decays, curves, strict=True)])


def _fitted(
    name: str,
    formula: str,
    unit: str,
    rate: float,
    wide: float,
    fit: CurveFit,
    scale: float,
    count: float,
    curves: list[Floats],
) -> FittedLaw:
    rms = fit.rms * scale
    criterion = 2.0 * count * float(np.log(max(rms, 1e-12))) + 2.0 * fit.values.size
    return FittedLaw(name, formula, rate, wide, unit, rms, criterion, tuple(curves), float(fit.widened[0]))


def best_law(fitted: list[FittedLaw]) -> FittedLaw:
    """Return the law with the least criterion; a law of flow where one comes near: relaxation imitates them."""
    least = min(item.criterion for item in fitted)
    near = [item for item in fitted if item.criterion - least <= CLEARLY_WORSE]
    return min(near, key=lambda item: (item.name == _RELAXATION, item.criterion))


@dataclass(frozen=True, slots=True)
class Judgement:
    """Whether an area may be told, and why."""

    verdict: Verdict
    reason: str

    @property
    def sentence(self) -> str:
        """The reason, as a sentence of its own."""
        return f"{self.reason[:1].upper()}{self.reason[1:]}."


def judge(fitted: list[FittedLaw], best: FittedLaw, noise: float, span: float, unit: str) -> Judgement:
    """Return whether the orifice law, the first, describes the data: it must come close to what a smooth curve reaches.

    Where it is clearly the best law and misses by less than a hundredth of ``span``, the value is told as a weak one.
    """
    orifice = fitted[0]
    rivals = [item.name for item in fitted[1:] if item.criterion - orifice.criterion < CLEARLY_WORSE]
    behind = orifice.criterion - best.criterion
    misses = f"the orifice law misses the data by {orifice.rms:.3g} {unit} rms, a smooth curve by {noise:.3g} {unit}"
    is_close = orifice.rms <= DESCRIBES * noise and behind <= CLEARLY_WORSE
    if not is_close and not rivals and orifice.rms <= _CLOSE * span:
        return Judgement(
            "weak",
            f"{misses}: it is by far the best law, but something else takes part, such as the gas's temperature; "
            f"the interval covers what of that shows in the residuals",
        )
    if not is_close:
        compared = f"the {best.name} law by {best.rms:.3g} {unit} (AIC {behind:.3g} better)"
        compared = f"{misses}, {compared}" if best is not orifice else misses
        return Judgement("law does not describe the data", f"{compared}; an area would be a pretence")
    if rivals:
        return Judgement(
            "weak",
            f"{misses}; but {' and '.join(rivals)} fit as well: over so small a range of pressure the laws cannot be "
            f"told apart, and the value holds at these pressures only",
        )
    return Judgement("identified", misses)


def law_checks(
    fitted: list[FittedLaw], best: FittedLaw, noise: float, judged: Judgement, unit: str
) -> tuple[Check, Check]:
    """Return what the comparison of the laws says: whether an orifice will do, and how the laws rank."""
    ranking = sorted(fitted, key=lambda item: item.criterion)
    listed = ", ".join(
        f"{item.name} {item.rms:.3g} {unit} ({item.criterion - best.criterion:+.3g})" for item in ranking
    )
    text = f"misfit {fitted[0].rms / noise:.2f} times that of a smooth curve; {DESCRIBES:g} is good"
    return (
        Check("orifice law", judged.verdict != "law does not describe the data", text),
        Check("which law", True, f"misfit (AIC above the best): {listed}"),
    )


def opening_estimates(
    evidence: Evidence, opening: Opening, numbers: list[Number], judged: Judgement
) -> tuple[Estimate, ...]:
    """Return the estimates of an opening; none but the reason where the law does not describe the data."""
    if judged.verdict == "law does not describe the data":
        nothing = math.nan
        missing = Number(opening.path, opening.unit, nothing, nothing, judged.sentence)
        return (evidence.estimate(missing, nothing, judged.verdict),)
    return tuple(weakened(evidence.calibrated(number), judged) for number in numbers)


def weakened(estimate: Estimate, judged: Judgement) -> Estimate:
    """Return the estimate, called weak where its law is."""
    is_too_sure = estimate.verdict == "identified" and judged.verdict == "weak"
    return replace(estimate, verdict="weak") if is_too_sure else estimate
