"""The laws of a leak fitted to decays: of flow, a relaxation that no leak makes; which of them the readings prefer."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.identification.bench.curve_fit import CHANCE, CLEARLY_WORSE, CurveFit, exceeds_chance, fit_curve
from ppafo.identification.bench.flow_laws import Chambers, Law, Opening, decay_times, difference_in_time
from ppafo.identification.bench.result import Evidence, Number
from ppafo.identification.estimate import Check, Estimate, Verdict
from ppafo.signals.recording import Floats

EDGE = 20
"""Samples at either end that are averaged for a first guess."""

DESCRIBES = 1.25
"""Misfit of a law over that of the smooth curve, up to which it describes the data."""

NOT_DESCRIBED: Verdict = "law does not describe the data"
RELAXATION = "relaxation"
_CLOSE = 0.01

Solve = Callable[[Callable[[Floats], Floats], Floats, Floats, Floats, float], CurveFit]


@dataclass(frozen=True, slots=True)
class Decay:
    """Times from the start [s], falling pressure difference [Pa], the chambers, and how well gas is kept.

    ``floor`` [Pa] is the least of the differences, ``emptying`` the number of the chamber that loses gas, 1 or 2.
    """

    time: Floats
    difference: Floats
    chambers: Chambers
    lost_share: float
    floor: float
    emptying: int = 1

    @property
    def ends(self) -> tuple[float, float]:
        """The difference [Pa] at the start and at the end."""
        return float(np.mean(self.difference[:EDGE])), float(np.mean(self.difference[-EDGE:]))


@dataclass(frozen=True, slots=True)
class FittedLaw:
    """A law fitted to all readings: its rate first, misfit [Pa] or [kg/s], Akaike's criterion, and the curves.

    ``plateaus`` are the differences [Pa] towards which a relaxation goes, each with half the width of its interval.
    """

    name: str
    formula: str
    rate: float
    half_width: float
    rate_unit: str
    rms: float
    criterion: float
    curves: tuple[Floats, ...]
    widened: float
    plateaus: tuple[tuple[float, float], ...] = ()


def fit_law(
    law: Law, decays: tuple[Decay, ...], count: float, confidence: float, solve: Solve = fit_curve
) -> FittedLaw:
    """Return a law of flow fitted to all decays with one rate [SI]; each decay has a start of its own."""
    starts = [decay.ends[0] for decay in decays]
    guesses = []
    for decay in decays:
        start, end = decay.ends
        lasting, difference = decay_times(law, decay.chambers, start, decay.floor)
        guesses.append(float(np.interp(-end, -difference, lasting)) / float(decay.time[-1]))
    rate = float(np.mean(guesses))

    def curves(values: Floats) -> list[Floats]:
        return [
            difference_in_time(law, decay.chambers, start * own, rate * values[0], decay.time, decay.floor)
            for decay, start, own in zip(decays, starts, values[1:], strict=True)
        ]

    scale = max(starts)
    ones = np.ones(1 + len(decays))
    fit = solve(lambda values: _misfits(decays, curves(values)) / scale, ones, 1e-3 * ones, 1e3 * ones, confidence)
    found = float(fit.values[0]) * rate, float(fit.half_widths[0]) * rate, law.rate_unit
    return FittedLaw(
        law.name, law.formula, *found, *_merit(fit, scale, count), tuple(curves(fit.values)), float(fit.widened[0])
    )


def fit_relaxation(decays: tuple[Decay, ...], count: float, confidence: float) -> FittedLaw:
    """Return exponentials towards a difference [Pa] of their own: cooling gas, a wall that creeps, a seal that closes.

    Values are the rate, then for each decay its start and its plateau, over how far it fell.
    """
    starts = [decay.ends[0] for decay in decays]
    drops = [start - decay.floor for start, decay in zip(starts, decays, strict=True)]
    longest = max(float(decay.time[-1]) for decay in decays)

    def curves(values: Floats) -> list[Floats]:
        listed = []
        for number, (decay, start, drop) in enumerate(zip(decays, starts, drops, strict=True)):
            top, end = values[1 + 2 * number : 3 + 2 * number]
            listed.append(start + drop * (end + (top - end) * np.exp(-values[0] * decay.time / longest)))
        return listed

    scale = max(starts)
    guess = np.array([2.0, *(item for _ in decays for item in (0.0, -1.0))])
    lower = np.array([1e-2, *(item for _ in decays for item in (-10.0, -1e3))])
    upper = np.array([1e3, *(item for _ in decays for item in (10.0, 10.0))])
    fit = fit_curve(lambda values: _misfits(decays, curves(values)) / scale, guess, lower, upper, confidence)
    plateaus = tuple(
        (start + drop * float(fit.values[place]), drop * float(fit.half_widths[place]))
        for place, start, drop in zip(range(2, fit.values.size, 2), starts, drops, strict=True)
    )
    found = float(fit.values[0]) / longest, float(fit.half_widths[0]) / longest, "1/s"
    formula, shown = "exponential towards a difference above zero", tuple(curves(fit.values))
    return FittedLaw(RELAXATION, formula, *found, *_merit(fit, scale, count), shown, float(fit.widened[0]), plateaus)


def _misfits(decays: tuple[Decay, ...], curves: list[Floats]) -> Floats:
    return np.concatenate([decay.difference - curve for decay, curve in zip(decays, curves, strict=True)])


def _merit(fit: CurveFit, scale: float, count: float) -> tuple[float, float]:
    """Return the rms misfit and Akaike's criterion [-] for the number of independent samples."""
    rms = fit.rms * scale
    return rms, 2.0 * count * float(np.log(max(rms, 1e-12))) + 2.0 * fit.values.size


def best_law(fitted: list[FittedLaw]) -> FittedLaw:
    """Return the law with the least criterion; a law of flow where one comes near: relaxation imitates them."""
    least = min(item.criterion for item in fitted)
    near = [item for item in fitted if item.criterion - least <= CLEARLY_WORSE]
    return min(near, key=lambda item: (item.name == RELAXATION, item.criterion))


@dataclass(frozen=True, slots=True)
class Judgement:
    """Whether an area may be reported, and why."""

    verdict: Verdict
    reason: str

    @property
    def sentence(self) -> str:
        """The reason, as a sentence of its own."""
        return f"{self.reason[:1].upper()}{self.reason[1:]}."

    def estimates(self, evidence: Evidence, opening: Opening, numbers: list[Number]) -> tuple[Estimate, ...]:
        """Return the estimates of an opening; none but the reason where the law does not describe the data."""
        if self.verdict == NOT_DESCRIBED:
            missing = Number(opening.path, opening.unit, math.nan, math.nan, self.sentence)
            return (evidence.estimate(missing, math.nan, self.verdict),)
        return tuple(self.weaken(evidence.with_calibration(number)) for number in numbers)

    def weaken(self, estimate: Estimate) -> Estimate:
        """Return the estimate, called weak where its law is."""
        is_too_sure = estimate.verdict in ("identified", "holds for this model only") and self.verdict == "weak"
        return replace(estimate, verdict="weak") if is_too_sure else estimate


def judge(fitted: list[FittedLaw], best: FittedLaw, noise: float, span: float, unit: str) -> Judgement:
    """Return whether the orifice law, the first, describes the data: it must come close to what a smooth curve reaches.

    Where it is clearly the best law and misses by less than a hundredth of ``span``, the value is reported as weak.
    ``noise`` and ``span`` are in ``unit``.
    """
    orifice = fitted[0]
    rivals = [item.name for item in fitted[1:] if item.criterion - orifice.criterion < CLEARLY_WORSE]
    behind = orifice.criterion - best.criterion
    times = f"{orifice.rms / noise:.2f} times as much ({DESCRIBES:g} is good)"
    misses = f"the orifice law misses the data by {orifice.rms:.3g} {unit} rms, "
    misses += f"a smooth curve by {noise:.3g} {unit}: {times}"
    is_close = orifice.rms <= DESCRIBES * noise and behind <= CLEARLY_WORSE
    if not is_close and not rivals and orifice.rms <= _CLOSE * span:
        return Judgement(
            "weak",
            f"{misses}; it is by far the best law, but something else contributes, such as the gas temperature; the "
            f"interval covers what of that appears in the residuals",
        )
    if not is_close:
        if behind > CLEARLY_WORSE:
            misses += f", and the {best.name} law misses by {best.rms:.3g} {unit}, which is clearly better "
            misses += f"(AIC by {behind:.3g}; {CLEARLY_WORSE:g} is clear)"
        return Judgement(NOT_DESCRIBED, f"{misses}; an area would be meaningless")
    if rivals:
        return Judgement(
            "weak",
            f"{misses}; but {' and '.join(rivals)} fit as well: the laws cannot be distinguished over so small a range "
            f"of pressure, and the value holds at these pressures only",
        )
    return Judgement("identified", misses)


def law_checks(fitted: list[FittedLaw], best: FittedLaw, judged: Judgement, unit: str) -> tuple[Check, Check]:
    """Return what the comparison of the laws says: whether an orifice will do, and whether one law is the best.

    A relaxation imitates every law of flow, so that it is no rival of one that comes near to it.
    """
    rivals = [
        item.name
        for item in fitted
        if item is not best and item.name != RELAXATION and item.criterion - best.criterion < CLEARLY_WORSE
    ]
    alike = f"{best.name} and {' and '.join(rivals)} fit equally well"
    found = alike if rivals else f"{best.name} is clearly the best"
    ranking = sorted(fitted, key=lambda item: item.criterion)
    listed = ", ".join(
        f"{item.name} {item.rms:.3g} {unit} ({item.criterion - best.criterion:+.3g})" for item in ranking
    )
    return (
        Check("orifice law", judged.verdict != NOT_DESCRIBED, judged.reason),
        Check("which law", not rivals, f"{found}; misfit (AIC above the best): {listed}"),
    )


class OffsetLeak(NamedTuple):
    """A linear leak behind sensors whose difference is off by the same in all decays: rate [1/s] and offset [Pa].

    Both with half the width of their intervals.
    """

    rate: tuple[float, float]
    offset: tuple[float, float]


def leak_or_relaxation(
    decays: tuple[Decay, ...], relaxation: FittedLaw, count: float, confidence: float
) -> tuple[Check, OffsetLeak | None]:
    """Return whether a plateau is the zero of a sensor that a linear leak runs towards, or that of a relaxation.

    One decay cannot say: both are the same curve. Of several from different pressures the zero is the same in all, the
    plateau of a relaxation goes with the pressure. Each is tested against plateaus of their own (F test). The leak has
    its rate [1/s] and the offset [Pa], each with a half width; None where it is none.
    """
    name, (plateau, _) = "leak or relaxation", relaxation.plateaus[0]
    if len(decays) == 1:
        rate = relaxation.rate / (1.0 + decays[0].chambers.volume_ratio)
        text = f"undecided: a linear leak of {rate:.3g} 1/s and a sensor offset of {plateau:.4g} Pa in the difference "
        return Check(name, False, f"{text}give the same curve; a decay from another pressure distinguishes them"), None
    # Curves are fitted in multiples of the largest difference [Pa] and of the longest time [s].
    scale = max(float(decay.difference.max()) for decay in decays)
    longest = max(float(decay.time[-1]) for decay in decays)
    offset = _fit_shared_plateau(decays, scale, longest, confidence, lambda shared, _top: shared)
    share = _fit_shared_plateau(decays, scale, longest, confidence, lambda shared, top: shared * top)
    freedom = max(1, int(count) - 1 - 2 * len(decays))
    own = relaxation.rms**2 * count / freedom

    def explains(fit: CurveFit) -> bool:
        more = max(0.0, (fit.rms * scale) ** 2 - relaxation.rms**2) * count / (len(decays) - 1)
        return not exceeds_chance(more, own, len(decays) - 1, freedom, CHANCE)

    is_offset, is_share = explains(offset), explains(share)
    if is_offset and is_share:
        text = "undecided: a linear leak with a sensor offset and a relaxation explain these decays equally well"
        return Check(name, False, f"{text}; they begin at pressures too close to each other"), None
    if not is_offset:
        return Check(name, True, "a relaxation: no sensor offset common to all decays explains them"), None
    units = np.array([1.0 / longest, scale])
    (rate, zero), wide = (offset.values[:2] * units).tolist(), (offset.half_widths[:2] * units).tolist()
    text = f"a linear leak: a sensor offset of {zero:.4g} Pa explains all decays"
    return Check(name, True, text), OffsetLeak((rate, wide[0]), (zero, wide[1]))


def _fit_shared_plateau(
    decays: tuple[Decay, ...],
    scale: float,
    longest: float,
    confidence: float,
    plateau_of: Callable[[float, float], float],
) -> CurveFit:
    """Return the exponentials whose plateaus follow from one number and their starts; values: rate, number, starts."""

    def residuals(values: Floats) -> Floats:
        curves = []
        for decay, top in zip(decays, values[2:].tolist(), strict=True):
            end = plateau_of(float(values[1]), top)
            speed = values[0] * (1.0 + decay.chambers.volume_ratio) / longest
            curves.append(scale * (end + (top - end) * np.exp(-speed * decay.time)))
        return _misfits(decays, curves) / scale

    tops, ends = (np.array([decay.ends[at] / scale for decay in decays]) for at in (0, 1))
    limits = np.array([1e3, 10.0, *(10.0 for _ in decays)])
    fits = [
        fit_curve(residuals, np.array([2.0, guess, *tops]), np.array([1e-2, *-limits[1:]]), limits, confidence)
        for guess in (float(ends.min()), float(np.mean(ends / tops)))
    ]
    return min(fits, key=lambda fit: fit.rms)


def condition_of(best: FittedLaw, which: Check) -> str:
    """Return where the rate of the best law holds: only if that law does, where the laws cannot be distinguished."""
    return "" if which.holds else f"if the leak is {best.name}"
