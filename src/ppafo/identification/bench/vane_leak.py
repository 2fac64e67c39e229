"""Leak across the vane from two closed chambers: which law the decay follows, and A_leak where it is an orifice's.

An area is reported only where the orifice law describes the decay; a smooth curve without physics shows how closely a
law could come. A chamber whose pressure stands still is taken for a room, the atmosphere for example.
"""

from dataclasses import dataclass

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import effective_samples
from ppafo.identification.bench.evidence import Evidence, Number
from ppafo.identification.bench.gas_flow import GasAt
from ppafo.identification.bench.inputs import check_absolute, check_moves, check_sources, kind_of, window
from ppafo.identification.bench.leak_fits import (
    EDGE,
    Decay,
    FittedLaw,
    Judgement,
    best_law,
    fit_law,
    fit_relaxation,
    judge,
    law_checks,
    opening_estimates,
    smooth_curve,
)
from ppafo.identification.bench.leak_laws import LAMINAR, LINEAR, Chambers
from ppafo.identification.bench.leak_opening import Opening
from ppafo.identification.bench.leak_steady import steady_leak
from ppafo.identification.bench.picture import Panel, Series
from ppafo.identification.bench.result import BenchResult, counted
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source, traces
from ppafo.signals import Recording
from ppafo.signals.faults import longest_gap, plateaus, stands_out
from ppafo.signals.recording import Floats

PROCEDURE = "vane_leak"
CHANNELS = ("pressure_1", "pressure_2")
FEWEST_SAMPLES = 20
STANDS_STILL = 0.02
"""Change of a pressure over that of the other, up to which a chamber counts as a room."""

_LOST_ALLOWED = 0.05
_NEARLY_EQUAL = 0.01


@dataclass(frozen=True, slots=True)
class VaneLeakSettings:
    """The gas, chamber volumes [m^3] where known, the leak's discharge coefficient [-], and the times to use [s].

    Without ``volume_1`` there is no area, only a rate. A ``critical_ratio`` [-] asks for a sonic conductance.
    ``calibration`` is the relative uncertainty of the flow meter's gain [-], for steady readings.
    """

    gas: GasAt
    volume_1: float | None = None
    volume_2: float | None = None
    discharge_coefficient: float | None = None
    start: float | None = None
    end: float | None = None
    confidence: float = 0.95
    calibration: float = 0.0
    critical_ratio: float | None = None

    @property
    def opening(self) -> Opening:
        """The leak in the form in which the set has it."""
        return Opening(self.gas, self.discharge_coefficient, self.critical_ratio)


def vane_leak(sources: tuple[Source, ...], settings: VaneLeakSettings) -> BenchResult:
    """Return A_leak [m^2] where the orifice law (6), (7) describes the decay, else the law that does, and no area.

    Recordings with a ``mass_flow`` are steady: the flow that keeps up the pressure, at several pressures.
    """
    if sources and all("mass_flow" in source.recording for source in sources):
        return steady_leak(sources, settings.opening, settings.confidence, settings.calibration)
    if settings.calibration:
        raise IdentificationError(
            f"{PROCEDURE}: calibration = {settings.calibration:g}: a decay has no use for it, for a gain that both "
            f"sensors share leaves its rate as it is; what counts is the volume. Leave it out"
        )
    check_sources(sources, PROCEDURE, CHANNELS, FEWEST_SAMPLES)
    decays = tuple(_decay(source, settings) for source in sources)
    smooth = tuple(smooth_curve(decay) for decay in decays)
    residuals = np.concatenate([decay.difference - curve for decay, curve in zip(decays, smooth, strict=True)])
    noise, count = float(np.sqrt(np.mean(residuals**2))), effective_samples(residuals)
    fitted = [fit_law(law, decays, count, settings.confidence) for law in (settings.opening.law(), LAMINAR, LINEAR)]
    fitted.append(fit_relaxation(decays, count, settings.confidence))
    best = best_law(fitted)
    orifice = fitted[0]
    drop = max(float(np.ptp(decay.difference)) for decay in decays)
    judged = judge(fitted, best, noise, drop, "Pa")
    evidence = Evidence(traces(sources), settings.confidence, settings.gas.share_of_flow())
    estimates = _estimates(evidence, settings, orifice, best, judged)
    return BenchResult(
        PROCEDURE,
        f"{counted(len(decays), 'decay')}; best law: {best.name} ({best.formula}); orifice: {judged.verdict}",
        estimates,
        (*law_checks(fitted, best, noise, judged, "Pa"), _kept(decays)),
        _panels(decays, orifice, best),
        kind_of(sources),
    )


def _decay(source: Source, settings: VaneLeakSettings) -> Decay:
    check_moves(source, PROCEDURE, "pressure_1")
    part = window(source.recording, settings.start, settings.end)
    _check_samples(source, part)
    first, second = part["pressure_1"], part["pressure_2"]
    for name in CHANNELS:
        check_absolute(source, PROCEDURE, name)
    difference = first - second
    sign = 1.0 if np.mean(difference[:EDGE]) > 0.0 else -1.0
    if sign < 0.0:
        first, second = second, first
    difference = sign * difference
    start = float(np.mean(difference[:EDGE]))
    low = np.flatnonzero(difference < _NEARLY_EQUAL * start)
    last = int(low[0]) if low.size else difference.size
    if last < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last} samples lie between start and equal pressures, "
            f"{FEWEST_SAMPLES} are needed; record faster, or give start"
        )
    _check_falls(source, difference[:last])
    ratio = _volume_ratio(first[:last], second[:last], settings, sign)
    total = ratio * first[:last] + second[:last]
    lost = abs(float(np.mean(total[-EDGE:]) - np.mean(total[:EDGE]))) / (1.0 + ratio)
    drop = float(np.mean(difference[:EDGE]) - np.mean(difference[last - EDGE : last]))
    chambers = Chambers(ratio, float(np.mean(total)))
    times = part.time[:last] - part.time[0]
    return Decay(times, difference[:last], chambers, lost / drop, float(difference[:last].min()))


def _check_samples(source: Source, part: Recording) -> None:
    """Refuse a gap, and a sensor that was at its limit when the decay began."""
    skipped = int(np.searchsorted(source.recording.time, part.time[0]))
    gap = longest_gap(part.time)
    if gap is not None:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: there is a gap of {gap.duration:.4g} s after {part.time[gap.index]:.6g} s "
            f"(sample {skipped + gap.index + 1}); give start or end, so that it lies outside"
        )
    for name in CHANNELS:
        for plateau in plateaus(part[name]):
            if plateau.first < EDGE and stands_out(part[name], plateau):
                raise IdentificationError(
                    f"{source.name}: {PROCEDURE}: channel '{name}' stays at exactly {plateau.value:g} Pa for "
                    f"{plateau.count} samples, up to sample {skipped + plateau.last + 1}, and moves only then: the "
                    f"sensor is saturated, or the chamber was not closed yet; give start"
                )


def _check_falls(source: Source, difference: Floats) -> None:
    drop = float(np.mean(difference[:EDGE]) - np.mean(difference[-EDGE:]))
    noise = float(np.std(np.diff(difference))) / np.sqrt(2.0)
    if drop <= 3.0 * noise / np.sqrt(EDGE):
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: no leak shows: the pressure difference falls by {drop:.3g} Pa with a noise "
            f"of {noise:.3g} Pa; record longer, and close both chambers first"
        )


def _volume_ratio(first: Floats, second: Floats, settings: VaneLeakSettings, sign: float) -> float:
    """Return the volume of the emptying chamber over that of the other, 0 where the other is a room."""
    change = float(np.mean(first[:EDGE]) - np.mean(first[-EDGE:]))
    rise = float(np.mean(second[-EDGE:]) - np.mean(second[:EDGE]))
    if abs(rise) <= STANDS_STILL * abs(change):
        return 0.0
    if settings.volume_1 is not None and settings.volume_2 is not None:
        ratio = settings.volume_1 / settings.volume_2
        return ratio if sign > 0.0 else 1.0 / ratio
    return max(rise / change, 0.0)


def _estimates(
    evidence: Evidence, settings: VaneLeakSettings, orifice: FittedLaw, best: FittedLaw, judged: Judgement
) -> tuple[Estimate, ...]:
    numbers = _numbers(settings, orifice, judged)
    listed = opening_estimates(evidence, settings.opening, numbers, judged)
    if best.name == orifice.name:
        return listed
    text = f"Rate of the law that fits best: {best.formula}."
    path = f"vane_leak.{best.name}_rate"
    rate = Number(path, best.rate_unit, best.rate, best.half_width, text, lowest=0.0, widened=best.widened)
    return (*listed, evidence.plain(rate))


def _numbers(settings: VaneLeakSettings, orifice: FittedLaw, judged: Judgement) -> list[Number]:
    """Return the leak's size; its ratio to the volume of chamber 1 where that is not known."""
    gas = settings.gas
    per_volume = 1.0 / (gas.specific_gas_constant * gas.temperature)
    if settings.volume_1 is None:
        per_rate = per_volume / gas.choked_flow_constant
        text = f"Cd A over the volume of chamber 1, which is not known: no area. {judged.sentence}."
        value, half = orifice.rate * per_rate, orifice.half_width * per_rate
        path = "vane_leak.area_over_volume"
        return [Number(path, "1/m", value, half, text, lowest=0.0, widened=orifice.widened)]
    conductance, half = (item * per_volume * settings.volume_1 for item in (orifice.rate, orifice.half_width))
    text = f"From a volume of {settings.volume_1 * 1e6:.4g} cm^3, taken as exact. {gas.temperature_told}; "
    text += f"{judged.reason}."
    return settings.opening.numbers(conductance, half, text, orifice.widened)


def _kept(decays: tuple[Decay, ...]) -> Check:
    lost = max(decay.lost_share for decay in decays)
    if all(decay.chambers.volume_ratio == 0.0 for decay in decays):
        return Check("gas is kept", True, "chamber 2 stands still and counts as a room")
    text = f"{lost:.1%} of the change in pressure difference is not passed from chamber to chamber"
    return Check("gas is kept", lost <= _LOST_ALLOWED, text if lost <= _LOST_ALLOWED else f"{text}: it leaks outside")


def _panels(decays: tuple[Decay, ...], orifice: FittedLaw, best: FittedLaw) -> tuple[Panel, ...]:
    shown: list[Series] = []
    rest: list[Series] = []
    other = best if best.name != orifice.name else None
    for number, decay in enumerate(decays):
        named = number == 0
        thin = slice(None, None, max(1, decay.time.size // 400))
        shown.append(Series("measured" if named else "", decay.time[thin], decay.difference[thin], "measured"))
        shown.append(Series("orifice" if named else "", decay.time, orifice.curves[number], "law"))
        misses = (decay.difference - orifice.curves[number])[thin]
        rest.append(Series("orifice" if named else "", decay.time[thin], misses, "measured"))
        if other is not None:
            shown.append(Series(other.name if named else "", decay.time, other.curves[number], "other law"))
            misses = (decay.difference - other.curves[number])[thin]
            rest.append(Series(other.name if named else "", decay.time[thin], misses, "second"))
    return (
        Panel("Closed chambers", "Time", "s", "Pressure difference", "Pa_d", tuple(shown)),
        Panel("Residuals", "Time", "s", "Measured less fitted", "Pa_d", tuple(rest)),
    )
