"""Leak across the vane, of two closed chambers or in steady flow: which law it follows, and A_leak where an orifice's.

An area is reported only where the orifice law describes the readings; a smooth curve without physics shows how closely
a law could come. A chamber whose pressure stands still is taken for a room, the atmosphere for example.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CLEARLY_WORSE, effective_samples, fit_curve, solve_curve
from ppafo.identification.bench.flow_laws import LAMINAR, LINEAR, Chambers, GasAt, Law, Opening, decay_times
from ppafo.identification.bench.leak_fits import (
    EDGE,
    NOT_DESCRIBED,
    Decay,
    FittedLaw,
    best_law,
    condition_of,
    fit_law,
    fit_relaxation,
    judge,
    law_checks,
    leak_or_relaxation,
)
from ppafo.identification.bench.result import IDENTIFIED_WITHIN, BenchResult, Evidence, Number, Panel, Series, count_of
from ppafo.identification.estimate import Check, Prospect
from ppafo.identification.source import (
    Source,
    check_absolute,
    check_moves,
    check_no_gap,
    check_not_clipped,
    check_sources,
    kind_of,
    pauses,
    pool,
    traces,
    window,
)
from ppafo.signals.faults import plateaus, stands_out
from ppafo.signals.recording import Floats

PROCEDURE = "vane-leak"
CHANNELS = ("pressure_1", "pressure_2")
STEADY = (*CHANNELS, "mass_flow")
MINIMUM_SAMPLES, _FEWEST_STEADY = 20, 8
_DEGREE, _STEADY_DEGREE = 5, 3
"""Of the polynomials without physics through a decay, and through steady readings: what any smooth law could reach."""

STANDS_STILL = 0.02
"""Change of a pressure over that of the other, up to which a chamber counts as a room."""
_NEARLY_EQUAL = 0.01
_LOST_ALLOWED = 0.05

_STEADY_UNITS = {"orifice": "kg/(s Pa)", "laminar": "kg/(s Pa^2)", "linear": "kg/(s Pa)"}
_SPREAD_FOR_A_ZERO = 0.3
"""Range of the law's course over its largest value, from which the zero of the meter can be separated from the leak."""


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

    @property
    def laws(self) -> tuple[Law, Law, Law]:
        """The law of the opening, and those that it is compared with."""
        return self.opening.law(), LAMINAR, LINEAR

    def volume_of(self, chamber: int) -> float | None:
        """Return the volume [m^3] of chamber 1 or 2, None where it is not known."""
        return self.volume_1 if chamber == 1 else self.volume_2


def vane_leak(sources: tuple[Source, ...], settings: VaneLeakSettings) -> BenchResult:
    """Return A_leak [m^2] where the orifice law (6), (7) describes the decay, else the law that does, and no area.

    With D = P1 - P2 the difference falls by D' = -(1 + V1/V2) k g(P1, P2); for the orifice k = Cd A_leak C1 R T / V1.
    Recordings with a ``mass_flow`` are steady: the flow that keeps up the pressure, at several pressures.
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    if sources and all("mass_flow" in source.recording for source in sources):
        return _steady_leak(sources, settings)
    if settings.calibration:
        raise IdentificationError(
            f"{PROCEDURE}: calibration = {settings.calibration:g}: it does not apply to a decay, because a gain common "
            f"to both sensors does not change its rate; what matters is the volume. Leave it out"
        )
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    closed = tuple(closed_chambers(source, settings) for source in sources)
    if not any(item.falls for item in closed):
        return _tight_leak(sources, closed, settings)
    for source, item in zip(sources, closed, strict=True):
        if not item.falls:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: no leak is visible: the pressure difference falls by {item.drop:.3g} Pa "
                f"with a noise of {item.noise:.3g} Pa, while it falls in the other recordings; give it a procedure of "
                f"its own, which finds an upper bound of the leak"
            )
    return _decaying_leak(sources, tuple(item.decay(settings) for item in closed), settings)


def leak_prospects(sources: tuple[Source, ...], settings: VaneLeakSettings) -> tuple[Prospect, ...]:
    """Return whether an area can be found, and whether the laws of a leak can be distinguished over these pressures."""
    if all("mass_flow" in source.recording for source in sources):
        check_sources(sources, PROCEDURE, STEADY, 1)
        pressures = pool(sources, "pressure_1")
        span = float(np.ptp(pressures) / pressures.max())
        return (Prospect("law of the leak", span > IDENTIFIED_WITHIN, f"steady flow over {span:.0%} of the pressure"),)
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    closed = [item for item in (closed_chambers(source, settings) for source in sources) if item.falls]
    decays = [item.decay(settings) for item in closed]
    known = settings.volume_of(decays[0].emptying if decays else 1) is not None
    volume = "the volume is known" if known else "the volume is not known: only its ratio to the volume"
    area = Prospect("area of the leak", known, volume)
    if not decays:
        none = "no pressure difference falls by more than the noise: an upper bound only"
        return (area, Prospect("leak", False, none))
    gain = min(_least_gain(decay, item.noise, settings) for decay, item in zip(decays, closed, strict=True))
    fell = max(1.0 - float(decay.difference[-1] / decay.difference[0]) for decay in decays)
    text = f"the difference falls by {fell:.1%}; AIC between the laws is expected at {gain:.3g}, "
    text += f"{CLEARLY_WORSE:g} is clear"
    several = len(decays) > 1
    more = "several decays" if several else "one decay: a sensor offset gives a linear leak the same curve"
    return (area, Prospect("law of the leak", gain >= CLEARLY_WORSE, text), Prospect("plateau or leak", several, more))


def _least_gain(decay: Decay, noise: float, settings: VaneLeakSettings) -> float:
    """Return the least AIC expected between the opening's law and others, with start and rate free."""
    start, end = float(decay.difference[0]), decay.ends[1]
    curves = []
    for law in settings.laws:
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


class ClosedChambers(NamedTuple):
    """Two closed chambers: time [s], pressures [Pa] of the fuller and the other, which is the fuller, noise [Pa]."""

    time: Floats
    first: Floats
    second: Floats
    fuller: int
    noise: float

    @property
    def difference(self) -> Floats:
        """Pressure of the fuller chamber less that of the other [Pa]."""
        return self.first - self.second

    @property
    def drop(self) -> float:
        """How far the difference falls from start to end [Pa]."""
        return float(np.mean(self.difference[:EDGE]) - np.mean(self.difference[-EDGE:]))

    @property
    def falls(self) -> bool:
        """Whether the difference falls by more than the noise of the samples at both ends."""
        return self.drop > 3.0 * self.noise / math.sqrt(EDGE)

    def volume_ratio(self, settings: VaneLeakSettings) -> float:
        """Return the volume of the fuller chamber over that of the other [-]; 0 where one of them is not known."""
        if settings.volume_1 is None or settings.volume_2 is None:
            return 0.0
        ratio = settings.volume_1 / settings.volume_2
        return ratio if self.fuller == 1 else 1.0 / ratio

    def decay(self, settings: VaneLeakSettings) -> Decay:
        """Return the decay of the pressure difference."""
        change = float(np.mean(self.first[:EDGE]) - np.mean(self.first[-EDGE:]))
        rise = float(np.mean(self.second[-EDGE:]) - np.mean(self.second[:EDGE]))
        is_room = abs(rise) <= STANDS_STILL * abs(change)
        ratio = 0.0 if is_room else self.volume_ratio(settings) or max(rise / change, 0.0)
        total = ratio * self.first + self.second
        lost = abs(float(np.mean(total[-EDGE:]) - np.mean(total[:EDGE]))) / (1.0 + ratio)
        chambers, difference = Chambers(ratio, float(np.mean(total))), self.difference
        return Decay(self.time, difference, chambers, lost / self.drop, float(difference.min()), self.fuller)


def closed_chambers(source: Source, settings: VaneLeakSettings) -> ClosedChambers:
    """Return the chambers of a recording between its start and equal pressures.

    IdentificationError where too few samples are left.
    """
    check_moves(source, PROCEDURE, "pressure_1")
    part = window(source.recording, settings.start, settings.end)
    skipped = check_no_gap(source, PROCEDURE, part)
    for name in CHANNELS:
        for plateau in plateaus(part[name]):
            if plateau.first < EDGE and stands_out(part[name], plateau):
                raise IdentificationError(
                    f"{source.name}: {PROCEDURE}: channel '{name}' stays at exactly {plateau.value:g} Pa for "
                    f"{plateau.count} samples, up to sample {skipped + plateau.last + 1}, and changes only then: the "
                    f"sensor is saturated, or the chamber was not yet closed; give start"
                )
    check_absolute(source, PROCEDURE, CHANNELS)
    pair = part["pressure_1"], part["pressure_2"]
    fuller = 1 if np.mean((pair[0] - pair[1])[:EDGE]) > 0.0 else 2
    first, second = pair if fuller == 1 else pair[::-1]
    difference = first - second
    low = np.flatnonzero(difference < _NEARLY_EQUAL * float(np.mean(difference[:EDGE])))
    last = int(low[0]) if low.size else difference.size
    if last < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last} samples lie between start and equal pressures, "
            f"{MINIMUM_SAMPLES} are needed; record faster, or give start"
        )
    noise = float(np.std(np.diff(difference[:last]))) / np.sqrt(2.0)
    time = part.time[:last] - part.time[0]
    return ClosedChambers(time=time, first=first[:last], second=second[:last], fuller=fuller, noise=noise)


def _decaying_leak(sources: tuple[Source, ...], decays: tuple[Decay, ...], settings: VaneLeakSettings) -> BenchResult:
    smooth = (np.polynomial.Chebyshev.fit(decay.time, decay.difference, _DEGREE) for decay in decays)
    residuals = np.concatenate([item.difference - curve(item.time) for item, curve in zip(decays, smooth, strict=True)])
    noise, count = float(np.sqrt(np.mean(residuals**2))), effective_samples(residuals)
    fitted = [fit_law(law, decays, count, settings.confidence, solve_curve) for law in settings.laws]
    relaxation = fit_relaxation(decays, count, settings.confidence)
    fitted.append(relaxation)
    best, orifice = best_law(fitted), fitted[0]
    drop = max(float(np.ptp(decay.difference)) for decay in decays)
    judged = judge(fitted, best, noise, drop, "Pa")
    checks = [*law_checks(fitted, best, judged, "Pa")]
    is_a_room = all(decay.chambers.volume_ratio == 0.0 for decay in decays)
    if not is_a_room:
        # What one chamber loses the other gains.
        lost = max(decay.lost_share for decay in decays)
        text = f"{lost:.1%} of the change in pressure difference is not passed from chamber to chamber"
        is_kept = lost <= _LOST_ALLOWED
        checks.append(Check("gas is kept", is_kept, text if is_kept else f"{text}: it leaks outside"))
    # Only what is reported needs the intervals of a law that may miss, which take long.
    wanted = {best.name, *(() if judged.verdict == NOT_DESCRIBED else ("orifice",))}
    reported = {
        law.name: fit_law(law, decays, count, settings.confidence) for law in settings.laws if law.name in wanted
    }
    orifice, best = reported.get(orifice.name, orifice), reported.get(best.name, best)
    evidence = Evidence(traces(sources), settings.confidence, settings.gas.flow_uncertainty())
    numbers = _numbers(settings, {decay.emptying for decay in decays}, orifice, f"{judged.reason}.")
    estimates = [*judged.estimates(evidence, settings.opening, numbers)]
    path, text = f"vane_leak.{best.name}_rate", f"Rate of the law that fits best: {best.formula}."
    rate = Number(path, best.rate_unit, best.rate, best.half_width, text, lowest=0.0, widened=best.widened)
    if best is relaxation:
        check, leak = leak_or_relaxation(decays, relaxation, count, settings.confidence)
        checks.append(check)
        if leak is not None:
            text = f"Rate of a linear leak: {LINEAR.formula}."
            linear = Number("vane_leak.linear_rate", "1/s", *leak.rate, text, lowest=0.0)
            text = "Difference that the sensors show at equal pressures, from several decays."
            course = [linear, Number("vane_leak.sensor_offset", "Pa", *leak.offset, text)]
        else:
            text = "Pressure difference towards which the decay goes."
            ends = (
                ["vane_leak.plateau"]
                if len(decays) == 1
                else [f"vane_leak.plateau_{i + 1}" for i in range(len(decays))]
            )
            plateaus_found = zip(ends, relaxation.plateaus, strict=True)
            course = [rate, *(Number(end, "Pa", *at, text, widened=relaxation.widened) for end, at in plateaus_found)]
        estimates += [evidence.without_calibration(number) for number in course]
    elif best.name != orifice.name:
        estimates.append(evidence.without_calibration(replace(rate, condition=condition_of(best, checks[1]))))
    return BenchResult(
        PROCEDURE,
        f"{count_of(len(decays), 'decay')}; best law: {best.name} ({best.formula}); orifice: {judged.verdict}",
        tuple(estimates),
        tuple(checks),
        _panels(decays, orifice, best),
        kind_of(sources),
        ("the pressure in chamber 2 is constant, so it is treated as a room",) if is_a_room else (),
    )


def _numbers(settings: VaneLeakSettings, emptying: set[int], orifice: FittedLaw, reason: str) -> list[Number]:
    """Return the leak's size; its ratio to the volume of the emptying chamber where that is not known."""
    if len(emptying) > 1:
        raise IdentificationError(
            f"{PROCEDURE}: chamber 1 empties in some recordings and chamber 2 in others; give each its own procedure"
        )
    chamber = min(emptying)
    volume, gas = settings.volume_of(chamber), settings.gas
    per_volume = 1.0 / (gas.specific_gas_constant * gas.temperature)
    if volume is None:
        per_rate = per_volume / gas.choked_flow_constant
        text = f"Cd A over the volume of chamber {chamber}, which is not known: no area. "
        text += f"{reason[:1].upper()}{reason[1:]}"
        value, half = orifice.rate * per_rate, orifice.half_width * per_rate
        path = "vane_leak.area_over_volume"
        return [Number(path, "1/m", value, half, text, lowest=0.0, widened=orifice.widened)]
    conductance, half = (item * per_volume * volume for item in (orifice.rate, orifice.half_width))
    text = f"From a volume of {volume * 1e6:.4g} cm^3, taken as exact. {gas.temperature_text}; {reason}"
    return settings.opening.numbers(conductance, half, text, orifice.widened)


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


def _tight_leak(
    sources: tuple[Source, ...], closed: tuple[ClosedChambers, ...], settings: VaneLeakSettings
) -> BenchResult:
    """Return how large a leak may be that does not show: as large as the fall that the samples allow."""
    longest = max(float(item.time[-1]) for item in closed)
    scale = max(float(np.mean(item.difference)) for item in closed)
    shape = settings.opening.law().shape
    falls = [
        (1.0 + item.volume_ratio(settings)) * float(shape(*(np.array([np.mean(p)]) for p in item[1:3]))[0]) / scale
        for item in closed
    ]

    def residuals(values: Floats) -> Floats:
        lines = zip(closed, values[1:], falls, strict=True)
        return np.concatenate(
            [item.difference / scale - start + values[0] * fall * item.time / longest for item, start, fall in lines]
        )

    wide = np.full(1 + len(closed), np.inf)
    start = np.array([0.0, *(float(np.mean(item.difference)) / scale for item in closed)])
    # A bound on one side at this confidence is the end of a two-sided interval at 2 c - 1.
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


def _steady_leak(sources: tuple[Source, ...], settings: VaneLeakSettings) -> BenchResult:
    """Return the leak's size [SI] where the law of an opening describes flow over pressures, else the law that does.

    Where the pressures differ enough, the zero of the flow meter is fitted with the law and reported.
    """
    check_sources(sources, PROCEDURE, STEADY, _FEWEST_STEADY)
    for source in sources:
        check_moves(source, PROCEDURE, "mass_flow")
        check_not_clipped(source, PROCEDURE, "mass_flow", "pressure_1", source.recording["pressure_1"])
    for source in sources:
        check_absolute(source, PROCEDURE, CHANNELS)
    first, second, flow = (pool(sources, name) for name in STEADY)
    difference = first - second
    if float(difference @ flow) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the flow runs from the lower to the higher pressure; reverse its sign"
        )
    fitted = [_fit_steady(law, first, second, flow, settings.confidence) for law in settings.laws]
    laws, zero = [law for law, _ in fitted], fitted[0][1]
    orifice, best = laws[0], best_law(laws)
    smooth = np.polynomial.Chebyshev.fit(difference, flow, _STEADY_DEGREE)(difference)
    noise = float(np.sqrt(np.mean((flow - smooth) ** 2) * flow.size / (flow.size - _STEADY_DEGREE)))
    judged = judge(laws, best, noise, float(np.ptp(flow)), "kg/s")
    opening = settings.opening
    evidence = Evidence(traces(sources), settings.confidence, opening.gas.flow_uncertainty(settings.calibration))
    checks = law_checks(laws, best, judged, "kg/s")
    text = f"In steady flow. {opening.gas.temperature_text}; {evidence.calibration_text}. {judged.sentence}"
    numbers = opening.numbers(orifice.rate, orifice.half_width, text, orifice.widened)
    estimates = [*judged.estimates(evidence, opening, numbers)]
    estimates += [] if zero is None else [evidence.without_calibration(zero)]
    order = np.argsort(difference)
    shown = [Series("measured", difference, flow, "measured")]
    shown.append(Series("orifice", difference[order], orifice.curves[0][order], "law"))
    rest = [Series("orifice", difference, flow - orifice.curves[0], "measured")]
    if best is not orifice:
        path, text = f"vane_leak.{best.name}_coefficient", f"Coefficient of the law that fits best: {best.formula}."
        where = condition_of(best, checks[1])
        number = Number(path, best.rate_unit, best.rate, best.half_width, text, None, 0.0, best.widened, where)
        estimates.append(judged.weaken(evidence.with_calibration(number)))
        shown.append(Series(best.name, difference[order], best.curves[0][order], "other law"))
        rest.append(Series(best.name, difference, flow - best.curves[0], "second"))
    axis = ("Pressure difference", "Pa_d")
    return BenchResult(
        PROCEDURE,
        f"{flow.size} steady readings; best law: {best.name} ({best.formula}); orifice: {judged.verdict}",
        tuple(estimates),
        checks,
        (
            Panel("Steady leak", *axis, "Flow", "kg/s", tuple(shown)),
            Panel("Residuals", *axis, "Measured minus fitted", "kg/s", tuple(rest)),
        ),
        kind_of(sources),
        pauses(sources),
    )


def _fit_steady(
    law: Law, first: Floats, second: Floats, flow: Floats, confidence: float
) -> tuple[FittedLaw, Number | None]:
    """Fit the law's coefficient and, where the pressures differ enough to tell them apart, the meter's zero."""
    shape = law.shape(first, second)
    guess, scale = float(shape @ flow / (shape @ shape)), float(np.abs(flow).max())
    has_zero = float(np.ptp(shape)) > _SPREAD_FOR_A_ZERO * float(np.abs(shape).max())
    count = 2 if has_zero else 1

    def residuals(values: Floats) -> Floats:
        zero = values[1] if has_zero else 0.0
        return np.asarray((flow - guess * values[0] * shape) / scale - zero)

    lower, upper = np.array([0.0, -1.0])[:count], np.array([1e3, 1.0])[:count]
    fit = fit_curve(residuals, np.array([1.0, 0.0])[:count], lower, upper, confidence, (first - second,))
    zero = None
    if has_zero:
        value, half = float(fit.values[1]) * scale, float(fit.half_widths[1]) * scale
        text = "Reading of the flow meter without flow, from the shape of the law over pressure."
        path, widened = "vane_leak.flow_zero", float(fit.widened[1])
        zero = Number(path, "kg/s", value, half, text, scale=scale, widened=widened)
    rms = fit.rms * scale
    criterion = 2.0 * flow.size * float(np.log(max(rms, 1e-300))) + 2.0 * count
    value, half = float(fit.values[0]) * guess, float(fit.half_widths[0]) * guess
    curves, unit, widened = (flow - fit.residuals * scale,), _STEADY_UNITS[law.name], float(fit.widened[0])
    return FittedLaw(law.name, law.formula, value, half, unit, rms, criterion, curves, widened), zero
