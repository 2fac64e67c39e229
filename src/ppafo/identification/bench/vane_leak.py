"""Leak across the vane from two closed chambers: which law the decay follows, and A_leak where it is an orifice's.

An area is reported only where the orifice law describes the decay; a smooth curve without physics shows how closely a
law could come. A chamber whose pressure stands still is taken for a room, the atmosphere for example.
"""

from dataclasses import dataclass

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import effective_samples
from ppafo.identification.bench.gas_flow import GasAt
from ppafo.identification.bench.inputs import check_moves, check_sources, kind_of, window
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
    no_area,
    smooth_curve,
)
from ppafo.identification.bench.leak_laws import Chambers, laws_of
from ppafo.identification.bench.leak_steady import steady_leak
from ppafo.identification.bench.picture import Panel, Series
from ppafo.identification.bench.result import BenchResult, counted, verdict_of
from ppafo.identification.check import Check
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.source import Source, traces
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

    Without ``volume_1`` there is no area, only a rate.
    """

    gas: GasAt
    volume_1: float | None = None
    volume_2: float | None = None
    discharge_coefficient: float | None = None
    start: float | None = None
    end: float | None = None
    confidence: float = 0.95


def vane_leak(sources: tuple[Source, ...], settings: VaneLeakSettings) -> BenchResult:
    """Return A_leak [m^2] where the orifice law (6), (7) describes the decay, else the law that does, and no area.

    Recordings with a ``mass_flow`` are steady: the flow that keeps up the pressure, at several pressures.
    """
    if sources and all("mass_flow" in source.recording for source in sources):
        return steady_leak(sources, settings.gas, settings.discharge_coefficient, settings.confidence)
    check_sources(sources, PROCEDURE, CHANNELS, FEWEST_SAMPLES)
    decays = tuple(_decay(source, settings) for source in sources)
    smooth = tuple(smooth_curve(decay) for decay in decays)
    residuals = np.concatenate([decay.difference - curve for decay, curve in zip(decays, smooth, strict=True)])
    noise, count = float(np.sqrt(np.mean(residuals**2))), effective_samples(residuals)
    laws = laws_of(settings.gas.heat_capacity_ratio)
    fitted = [fit_law(law, decays, count, settings.confidence) for law in laws]
    fitted.append(fit_relaxation(decays, count, settings.confidence))
    best = best_law(fitted)
    orifice = fitted[0]
    drop = max(float(np.ptp(decay.difference)) for decay in decays)
    judged = judge(fitted, best, noise, drop, "Pa")
    estimates = _estimates(traces(sources), settings, orifice, best, judged)
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
    first, second = part["pressure_1"], part["pressure_2"]
    for name in CHANNELS:
        if part[name].min() <= 0.0:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: '{name}' is not absolute: it falls to zero or below"
            )
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
    names: tuple[str, ...], settings: VaneLeakSettings, orifice: FittedLaw, best: FittedLaw, judged: Judgement
) -> tuple[Estimate, ...]:
    gas = settings.gas
    per_rate = 1.0 / (gas.choked_flow_constant * gas.specific_gas_constant * gas.temperature)

    def entry(path: str, unit: str, value: float, half: float, text: str, verdict: Verdict | None = None) -> Estimate:
        found = verdict or verdict_of(value, value - half, value + half)
        if found == "identified" and judged.verdict == "weak":
            found = "weak"
        return Estimate(
            path, value, unit, max(0.0, value - half), value + half, found, text, names, settings.confidence
        )

    refused = judged.verdict == "law does not describe the data"
    listed = []
    if refused:
        listed.append(no_area(judged, names, settings.confidence))
    elif settings.volume_1 is None:
        text = f"Cd A over the volume of chamber 1, which is not known: no area. {judged.sentence}."
        listed.append(
            entry("vane_leak.area_over_volume", "1/m", orifice.rate * per_rate, orifice.half_width * per_rate, text)
        )
    else:
        area, half = (item * per_rate * settings.volume_1 for item in (orifice.rate, orifice.half_width))
        text = f"Cd A from a volume of {settings.volume_1 * 1e6:.4g} cm^3, taken as exact; {judged.reason}."
        if settings.discharge_coefficient:
            coefficient = settings.discharge_coefficient
            told = f"With Cd = {coefficient:g}, of which only the product with the area counts. {text}"
            listed.append(entry("actuator.leak.area", "m^2", area / coefficient, half / coefficient, told))
        listed.append(entry("vane_leak.effective_area", "m^2", area, half, text))
    if best.name != orifice.name:
        text = f"Rate of the law that fits best: {best.formula}."
        half = best.half_width
        found = verdict_of(best.rate, best.rate - half, best.rate + half)
        listed.append(entry(f"vane_leak.{best.name}_rate", best.rate_unit, best.rate, half, text, found))
    return tuple(listed)


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
