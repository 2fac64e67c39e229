"""Leak across the vane from two closed chambers: which law the decay follows, and A_leak where it is an orifice's.

An area is reported only where the orifice law describes the decay; a smooth curve without physics shows how closely a
law could come. A chamber whose pressure stands still is taken for a room, the atmosphere for example.
"""

from dataclasses import replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CLEARLY_WORSE, effective_samples, fit_curve, solve_curve
from ppafo.identification.bench.flow_laws import LAMINAR, LINEAR, decay_times
from ppafo.identification.bench.inputs import check_sources, kind_of
from ppafo.identification.bench.leak_fits import (
    Decay,
    FittedLaw,
    Judgement,
    OffsetLeak,
    best_law,
    condition_of,
    fit_law,
    fit_relaxation,
    judge,
    law_checks,
    leak_or_relaxation,
    opening_estimates,
    smooth_curve,
)
from ppafo.identification.bench.leak_samples import (
    CHANNELS,
    MINIMUM_SAMPLES,
    PROCEDURE,
    ClosedChambers,
    VaneLeakSettings,
    closed_chambers,
    decay_in,
    falling_decays,
    volume_ratio,
)
from ppafo.identification.bench.leak_steady import CHANNELS as STEADY
from ppafo.identification.bench.leak_steady import steady_leak
from ppafo.identification.bench.result import (
    IDENTIFIED_WITHIN,
    BenchResult,
    Evidence,
    Number,
    Panel,
    Series,
    count_of,
)
from ppafo.identification.estimate import Check, Prospect
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

_LOST_ALLOWED = 0.05


def vane_leak(sources: tuple[Source, ...], settings: VaneLeakSettings) -> BenchResult:
    """Return A_leak [m^2] where the orifice law (6), (7) describes the decay, else the law that does, and no area.

    Recordings with a ``mass_flow`` are steady: the flow that keeps up the pressure, at several pressures.
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    if sources and all("mass_flow" in source.recording for source in sources):
        return steady_leak(sources, settings.opening, settings.confidence, settings.calibration)
    if settings.calibration:
        raise IdentificationError(
            f"{PROCEDURE}: calibration = {settings.calibration:g}: it does not apply to a decay, because a gain common "
            f"to both sensors does not change its rate; what matters is the volume. Leave it out"
        )
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    closed = tuple(closed_chambers(source, settings) for source in sources)
    tight = [not item.falls for item in closed]
    if all(tight):
        return _tight_leak(sources, closed, settings)
    if any(tight):
        raise IdentificationError(_no_leak_text(sources[tight.index(True)], closed[tight.index(True)]))
    return _decaying_leak(sources, tuple(decay_in(item, settings) for item in closed), settings)


def leak_prospects(sources: tuple[Source, ...], settings: VaneLeakSettings) -> tuple[Prospect, ...]:
    """Return whether an area can be found, and whether the laws of a leak can be distinguished over these pressures."""
    if all("mass_flow" in source.recording for source in sources):
        check_sources(sources, PROCEDURE, STEADY, 1)
        pressures = np.concatenate([source.recording["pressure_1"] for source in sources])
        span = float(np.ptp(pressures) / pressures.max())
        return (Prospect("law of the leak", span > IDENTIFIED_WITHIN, f"steady flow over {span:.0%} of the pressure"),)
    decays, noise = falling_decays(sources, settings)
    known = (settings.volume_1 if not decays or decays[0].emptying == 1 else settings.volume_2) is not None
    volume = "the volume is known" if known else "the volume is not known: only its ratio to the volume"
    listed = [Prospect("area of the leak", known, volume)]
    if not decays:
        return (
            *listed,
            Prospect("leak", False, "no pressure difference falls by more than the noise: an upper bound only"),
        )
    gain = min(_least_gain(decay, level, settings) for decay, level in zip(decays, noise, strict=True))
    fell = max(1.0 - float(decay.difference[-1] / decay.difference[0]) for decay in decays)
    text = f"the difference falls by {fell:.1%}; AIC between the laws is expected at {gain:.3g}, "
    text += f"{CLEARLY_WORSE:g} is clear"
    several = len(decays) > 1
    more = "several decays" if several else "one decay: a sensor offset gives a linear leak the same curve"
    return (
        *listed,
        Prospect("law of the leak", gain >= CLEARLY_WORSE, text),
        Prospect("plateau or leak", several, more),
    )


def _least_gain(decay: Decay, noise: float, settings: VaneLeakSettings) -> float:
    """Return the least AIC expected between the opening's law and others, with start and rate free."""
    start, end = float(decay.difference[0]), float(np.mean(decay.difference[-20:]))
    curves = []
    for law in (settings.opening.law(), LAMINAR, LINEAR):
        lasting, difference = decay_times(law, decay.chambers, start, 0.9 * end)
        whole = float(np.interp(-end, -difference, lasting))
        curves.append(np.interp(decay.time / decay.time[-1] * whole, lasting, difference))
    free = np.stack([np.ones_like(decay.time), decay.time], axis=1)
    gains = []
    for other in curves[1:]:
        apart = other - curves[0]
        left = apart - free @ np.linalg.lstsq(free, apart, rcond=None)[0]
        gains.append(left.size * float(np.log1p(np.mean(left**2) / max(noise, 1e-9) ** 2)))
    return float(min(gains))


def _decaying_leak(sources: tuple[Source, ...], decays: tuple[Decay, ...], settings: VaneLeakSettings) -> BenchResult:
    smooth = tuple(smooth_curve(decay) for decay in decays)
    residuals = np.concatenate([decay.difference - curve for decay, curve in zip(decays, smooth, strict=True)])
    noise, count = float(np.sqrt(np.mean(residuals**2))), effective_samples(residuals)
    laws = (settings.opening.law(), LAMINAR, LINEAR)
    fitted = [fit_law(law, decays, count, settings.confidence, solve_curve) for law in laws]
    relaxation = fit_relaxation(decays, count, settings.confidence)
    fitted.append(relaxation)
    best, orifice = best_law(fitted), fitted[0]
    drop = max(float(np.ptp(decay.difference)) for decay in decays)
    judged = judge(fitted, best, noise, drop, "Pa")
    checks = [*law_checks(fitted, best, judged, "Pa"), *_conservation_check(decays)]
    # Only what is reported needs the intervals of a law that may miss, which take long.
    reported = {
        law.name: fit_law(law, decays, count, settings.confidence)
        for law in laws
        if law.name in _reported_laws(best, judged)
    }
    orifice, best = reported.get(orifice.name, orifice), reported.get(best.name, best)
    evidence = Evidence(traces(sources), settings.confidence, settings.gas.flow_uncertainty())
    numbers = _numbers(settings, {decay.emptying for decay in decays}, orifice, f"{judged.reason}.")
    estimates = [*opening_estimates(evidence, settings.opening, numbers, judged)]
    if best is relaxation:
        check, leak = leak_or_relaxation(decays, relaxation, count, settings.confidence)
        checks.append(check)
        estimates += [evidence.without_calibration(number) for number in _course(relaxation, leak)]
    elif best.name != orifice.name:
        estimates.append(evidence.without_calibration(replace(_rate(best), condition=condition_of(best, checks[1]))))
    return BenchResult(
        PROCEDURE,
        f"{count_of(len(decays), 'decay')}; best law: {best.name} ({best.formula}); orifice: {judged.verdict}",
        tuple(estimates),
        tuple(checks),
        _panels(decays, orifice, best),
        kind_of(sources),
        () if _conservation_check(decays) else ("the pressure in chamber 2 is constant, so it is treated as a room",),
    )


def _reported_laws(best: FittedLaw, judged: Judgement) -> set[str]:
    """Return the names of the laws whose rates are reported: the best one, and the orifice's where it gives an area."""
    return {best.name, *(() if judged.verdict == "law does not describe the data" else ("orifice",))}


def _no_leak_text(source: Source, closed: ClosedChambers) -> str:
    return (
        f"{source.name}: {PROCEDURE}: no leak is visible: the pressure difference falls by {closed.drop:.3g} Pa with a "
        f"noise of {closed.noise:.3g} Pa, while it falls in the other recordings; give it a procedure of "
        f"its own, which finds an upper bound of the leak"
    )


def _tight_leak(
    sources: tuple[Source, ...], closed: tuple[ClosedChambers, ...], settings: VaneLeakSettings
) -> BenchResult:
    """Return how large a leak may be that does not show: as large as the fall that the samples allow."""
    longest = max(float(item.time[-1]) for item in closed)
    scale = max(float(np.mean(item.difference)) for item in closed)
    shape = settings.opening.law().shape
    falls = [
        (1.0 + volume_ratio(item, settings)) * float(shape(*(np.array([np.mean(p)]) for p in item[1:3]))[0]) / scale
        for item in closed
    ]

    def residuals(values: Floats) -> Floats:
        lines = zip(closed, values[1:], falls, strict=True)
        return np.concatenate(
            [item.difference / scale - start + values[0] * fall * item.time / longest for item, start, fall in lines]
        )

    wide = np.full(1 + len(closed), np.inf)
    start = np.array([0.0, *(float(np.mean(item.difference)) / scale for item in closed)])
    fit = fit_curve(residuals, start, -wide, wide, 2.0 * settings.confidence - 1.0)
    slope, half = float(fit.values[0]) / longest, float(fit.half_widths[0]) / longest
    rate = max(slope, 0.0)
    most = FittedLaw("orifice", "", rate, max(slope + half, 0.0) - rate, "1/s", fit.rms * scale, 0.0, (), 1.0)
    sure = f"with {100.0 * settings.confidence:g}% confidence"
    text = f"No leak is visible in {longest:.4g} s; {sure} it is below the upper end."
    evidence = Evidence(traces(sources), settings.confidence, settings.gas.flow_uncertainty())
    estimates = tuple(
        replace(evidence.estimate(number, number.half_width * (1.0 + evidence.calibration), "upper bound"), low=0.0)
        for number in _numbers(settings, {item.fuller for item in closed}, most, text)
    )
    rises = slope + half < 0.0
    slope_text = "the pressure difference rises" if rises else "the pressure difference does not rise either"
    check = Check("nothing flows in", not rises, f"{slope_text}: {-slope * falls[0] * scale:+.3g} Pa/s at first sight")
    summary = (
        f"{count_of(len(closed), 'recording')} of closed chambers; no leak is visible, so there is only an upper bound"
    )
    shown = tuple(Series("measured", item.time, item.difference, "measured") for item in closed[:1])
    panel = Panel("Closed chambers", "Time", "s", "Pressure difference", "Pa_d", shown)
    return BenchResult(PROCEDURE, summary, estimates, (check,), (panel,), kind_of(sources))


def _course(relaxation: FittedLaw, leak: OffsetLeak | None) -> list[Number]:
    """Return rate and plateau of a relaxation; of a linear leak where the sensors' zero explains the plateau."""
    if leak is not None:
        rate = Number(
            "vane_leak.linear_rate", "1/s", *leak.rate, f"Rate of a linear leak: {LINEAR.formula}.", None, 0.0
        )
        text = "Difference that the sensors show at equal pressures, from several decays."
        return [rate, Number("vane_leak.sensor_offset", "Pa", *leak.offset, text)]
    listed = [_rate(relaxation)]
    for number, (value, half) in enumerate(relaxation.plateaus, start=1):
        path = "vane_leak.plateau" if len(relaxation.plateaus) == 1 else f"vane_leak.plateau_{number}"
        text = "Pressure difference towards which the decay goes."
        listed.append(Number(path, "Pa", value, half, text, widened=relaxation.widened))
    return listed


def _rate(best: FittedLaw) -> Number:
    text = f"Rate of the law that fits best: {best.formula}."
    path = f"vane_leak.{best.name}_rate"
    return Number(path, best.rate_unit, best.rate, best.half_width, text, lowest=0.0, widened=best.widened)


def _numbers(settings: VaneLeakSettings, emptying: set[int], orifice: FittedLaw, reason: str) -> list[Number]:
    """Return the leak's size; its ratio to the volume of the emptying chamber where that is not known."""
    if len(emptying) > 1:
        raise IdentificationError(
            f"{PROCEDURE}: chamber 1 empties in some recordings and chamber 2 in others; give each its own procedure"
        )
    chamber = min(emptying)
    volume = settings.volume_1 if chamber == 1 else settings.volume_2
    gas = settings.gas
    per_volume = 1.0 / (gas.specific_gas_constant * gas.temperature)
    if volume is None:
        per_rate = per_volume / gas.choked_flow_constant
        text = (
            f"Cd A over the volume of chamber {chamber}, which is not known: no area. {reason[:1].upper()}{reason[1:]}"
        )
        value, half = orifice.rate * per_rate, orifice.half_width * per_rate
        path = "vane_leak.area_over_volume"
        return [Number(path, "1/m", value, half, text, lowest=0.0, widened=orifice.widened)]
    conductance, half = (item * per_volume * volume for item in (orifice.rate, orifice.half_width))
    text = f"From a volume of {volume * 1e6:.4g} cm^3, taken as exact. {gas.temperature_text}; {reason}"
    return settings.opening.numbers(conductance, half, text, orifice.widened)


def _conservation_check(decays: tuple[Decay, ...]) -> tuple[Check, ...]:
    """Return whether what one chamber loses the other gains; nothing to ask where the other is a room."""
    if all(decay.chambers.volume_ratio == 0.0 for decay in decays):
        return ()
    lost = max(decay.lost_share for decay in decays)
    text = f"{lost:.1%} of the change in pressure difference is not passed from chamber to chamber"
    return (
        Check("gas is kept", lost <= _LOST_ALLOWED, text if lost <= _LOST_ALLOWED else f"{text}: it leaks outside"),
    )


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
        Panel("Residuals", "Time", "s", "Measured minus fitted", "Pa_d", tuple(rest)),
    )
