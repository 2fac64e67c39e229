"""Leak across the vane in steady flow: the flow that keeps up the pressure, at several pressures."""

from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CurveFit, fit_curve
from ppafo.identification.bench.flow_laws import LAMINAR, LINEAR, Law, Opening
from ppafo.identification.bench.inputs import (
    check_absolute,
    check_moves,
    check_not_clipped,
    check_sources,
    kind_of,
    pauses,
    pool,
)
from ppafo.identification.bench.leak_fits import (
    FittedLaw,
    Judgement,
    best_law,
    condition_of,
    judge,
    law_checks,
    opening_estimates,
    weaken,
)
from ppafo.identification.bench.result import BenchResult, Evidence, Number, Panel, Series
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

PROCEDURE = "vane-leak"
CHANNELS = ("pressure_1", "pressure_2", "mass_flow")
MINIMUM_SAMPLES = 8
_DEGREE = 3
_UNITS = {"orifice": "kg/(s Pa)", "laminar": "kg/(s Pa^2)", "linear": "kg/(s Pa)"}
_SPREAD_FOR_A_ZERO = 0.3
"""Range of the law's course over its largest value, from which the zero of the meter can be separated from the leak."""


class _Readings(NamedTuple):
    """Steady readings: absolute pressures [Pa] in both chambers, flow [kg/s] from 1 to 2."""

    first: Floats
    second: Floats
    flow: Floats

    @property
    def difference(self) -> Floats:
        return self.first - self.second


def steady_leak(
    sources: tuple[Source, ...], opening: Opening, confidence: float, calibration: float = 0.0
) -> BenchResult:
    """Return the leak's size [SI] where the law of an opening describes flow over pressures, else the law that does.

    Where the pressures differ enough, the zero of the flow meter is fitted with the law and reported.
    """
    readings = _readings(sources)
    fitted = [_fit(law, readings, confidence) for law in (opening.law(), LAMINAR, LINEAR)]
    laws = [item.law for item in fitted]
    best, noise = best_law(laws), _noise(readings)
    judged = judge(laws, best, noise, float(np.ptp(readings.flow)), "kg/s")
    evidence = Evidence(traces(sources), confidence, opening.gas.flow_uncertainty(calibration))
    checks = law_checks(laws, best, judged, "kg/s")
    return BenchResult(
        PROCEDURE,
        f"{readings.flow.size} steady readings; best law: {best.name} ({best.formula}); orifice: {judged.verdict}",
        _estimates(evidence, opening, fitted, best, judged, condition_of(best, checks[1])),
        checks,
        _panels(readings.difference, readings.flow, laws[0], best),
        kind_of(sources),
        pauses(sources),
    )


def _readings(sources: tuple[Source, ...]) -> _Readings:
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    for source in sources:
        check_moves(source, PROCEDURE, "mass_flow")
        check_not_clipped(source, PROCEDURE, "mass_flow", "pressure_1", source.recording["pressure_1"])
    readings = _Readings(
        first=pool(sources, "pressure_1"), second=pool(sources, "pressure_2"), flow=pool(sources, "mass_flow")
    )
    for source in sources:
        check_absolute(source, PROCEDURE, CHANNELS[:2])
    if float(readings.difference @ readings.flow) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the flow runs from the lower to the higher pressure; reverse its sign"
        )
    return readings


def _noise(readings: _Readings) -> float:
    """Return the scatter of the flow [kg/s] about a smooth curve without physics."""
    curve = np.polynomial.Chebyshev.fit(readings.difference, readings.flow, _DEGREE)(readings.difference)
    count = readings.flow.size
    return float(np.sqrt(np.mean((readings.flow - curve) ** 2) * count / (count - _DEGREE)))


class _SteadyFit(NamedTuple):
    """A law fitted to steady readings, and the zero of the flow meter, None where it cannot be separated."""

    law: FittedLaw
    zero: Number | None


def _fit(law: Law, readings: _Readings, confidence: float) -> _SteadyFit:
    """Fit the law's coefficient and, where the pressures differ enough to tell them apart, the meter's zero."""
    shape, flow = law.shape(readings.first, readings.second), readings.flow
    guess, scale = float(shape @ flow / (shape @ shape)), float(np.abs(flow).max())
    has_zero = float(np.ptp(shape)) > _SPREAD_FOR_A_ZERO * float(np.abs(shape).max())
    count = 2 if has_zero else 1

    def residuals(values: Floats) -> Floats:
        zero = values[1] if has_zero else 0.0
        return np.asarray((flow - guess * values[0] * shape) / scale - zero)

    lower, upper = np.array([0.0, -1.0])[:count], np.array([1e3, 1.0])[:count]
    fit = fit_curve(residuals, np.array([1.0, 0.0])[:count], lower, upper, confidence, (readings.difference,))
    zero = _zero(fit, scale) if has_zero else None
    rms = fit.rms * scale
    criterion = 2.0 * flow.size * float(np.log(max(rms, 1e-300))) + 2.0 * count
    value, half = float(fit.values[0]) * guess, float(fit.half_widths[0]) * guess
    curve = flow - fit.residuals * scale
    unit, widened = _UNITS[law.name], float(fit.widened[0])
    return _SteadyFit(FittedLaw(law.name, law.formula, value, half, unit, rms, criterion, (curve,), widened), zero)


def _zero(fit: CurveFit, scale: float) -> Number:
    value, half = float(fit.values[1]) * scale, float(fit.half_widths[1]) * scale
    text = "Reading of the flow meter without flow, from the shape of the law over pressure."
    return Number("vane_leak.flow_zero", "kg/s", value, half, text, scale=scale, widened=float(fit.widened[1]))


def _estimates(
    evidence: Evidence, opening: Opening, fitted: list[_SteadyFit], best: FittedLaw, judged: Judgement, where: str
) -> tuple[Estimate, ...]:
    orifice, zero = fitted[0]
    text = f"In steady flow. {opening.gas.temperature_text}; {evidence.calibration_text}. {judged.sentence}"
    numbers = opening.numbers(orifice.rate, orifice.half_width, text, orifice.widened)
    listed = list(opening_estimates(evidence, opening, numbers, judged))
    listed += [] if zero is None else [evidence.without_calibration(zero)]
    if best is not orifice:
        text = f"Coefficient of the law that fits best: {best.formula}."
        path = f"vane_leak.{best.name}_coefficient"
        number = Number(path, best.rate_unit, best.rate, best.half_width, text, None, 0.0, best.widened, where)
        listed.append(weaken(evidence.with_calibration(number), judged))
    return tuple(listed)


def _panels(difference: Floats, flow: Floats, orifice: FittedLaw, best: FittedLaw) -> tuple[Panel, ...]:
    order = np.argsort(difference)
    shown = [Series("measured", difference, flow, "measured")]
    shown.append(Series("orifice", difference[order], orifice.curves[0][order], "law"))
    rest = [Series("orifice", difference, flow - orifice.curves[0], "measured")]
    if best is not orifice:
        shown.append(Series(best.name, difference[order], best.curves[0][order], "other law"))
        rest.append(Series(best.name, difference, flow - best.curves[0], "second"))
    axis = ("Pressure difference", "Pa_d")
    return (
        Panel("Steady leak", *axis, "Flow", "kg/s", tuple(shown)),
        Panel("Residuals", *axis, "Measured minus fitted", "kg/s", tuple(rest)),
    )
