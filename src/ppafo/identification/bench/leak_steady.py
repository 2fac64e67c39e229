"""Leak across the vane in steady flow: the flow that keeps up the pressure, at several pressures."""

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import fit_curve
from ppafo.identification.bench.gas_flow import GasAt
from ppafo.identification.bench.inputs import check_moves, check_sources, kind_of, pooled
from ppafo.identification.bench.leak_fits import FittedLaw, best_law, judge, law_checks, no_area
from ppafo.identification.bench.leak_laws import Law, laws_of
from ppafo.identification.bench.picture import Panel, Series
from ppafo.identification.bench.result import BenchResult, verdict_of
from ppafo.identification.estimate import Estimate
from ppafo.identification.source import Source, traces
from ppafo.signals.recording import Floats

PROCEDURE = "vane_leak"
CHANNELS = ("pressure_1", "pressure_2", "mass_flow")
FEWEST_SAMPLES = 8
_DEGREE = 3
_UNITS = {"orifice": "kg/(s Pa)", "laminar": "kg/(s Pa^2)", "linear": "kg/(s Pa)"}


def steady_leak(
    sources: tuple[Source, ...], gas: GasAt, discharge_coefficient: float | None, confidence: float
) -> BenchResult:
    """Return A_leak [m^2] where the orifice law (6), (7) describes flow over pressures, else the law that does."""
    check_sources(sources, PROCEDURE, CHANNELS, FEWEST_SAMPLES)
    for source in sources:
        check_moves(source, PROCEDURE, "mass_flow")
    first, second, flow = (pooled(sources, name) for name in CHANNELS)
    if min(first.min(), second.min()) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the pressures are not absolute: one is zero or below"
        )
    difference = first - second
    if float(difference @ flow) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the flow runs from the lower to the higher pressure; turn its sign round"
        )
    fitted = [_fit(law, first, second, flow, confidence) for law in laws_of(gas.heat_capacity_ratio)]
    curve = np.polynomial.Chebyshev.fit(difference, flow, _DEGREE)(difference)
    noise = float(np.sqrt(np.mean((flow - curve) ** 2) * flow.size / (flow.size - _DEGREE)))
    best, span = best_law(fitted), float(np.ptp(flow))
    judged = judge(fitted, best, noise, span, "kg/s")
    listed: list[Estimate] = []
    names = traces(sources)

    def entry(path: str, unit: str, value: float, half: float, text: str) -> None:
        verdict = verdict_of(value, value - half, value + half)
        verdict = "weak" if verdict == "identified" and judged.verdict == "weak" else verdict
        listed.append(
            Estimate(path, value, unit, max(0.0, value - half), value + half, verdict, text, names, confidence)
        )

    if judged.verdict == "law does not describe the data":
        listed.append(no_area(judged, names, confidence))
    else:
        area, half = (item / gas.choked_flow_constant for item in (fitted[0].rate, fitted[0].half_width))
        if discharge_coefficient:
            text = f"With Cd = {discharge_coefficient:g}; only its product with the area counts. {judged.sentence}"
            entry("actuator.leak.area", "m^2", area / discharge_coefficient, half / discharge_coefficient, text)
        entry("vane_leak.effective_area", "m^2", area, half, f"Cd A in steady flow. {judged.sentence}")
    if best is not fitted[0]:
        text = f"Coefficient of the law that fits best: {best.formula}."
        entry(f"vane_leak.{best.name}_coefficient", best.rate_unit, best.rate, best.half_width, text)
    return BenchResult(
        PROCEDURE,
        f"{flow.size} steady readings; best law: {best.name} ({best.formula}); orifice: {judged.verdict}",
        tuple(listed),
        law_checks(fitted, best, noise, judged, "kg/s"),
        _panels(difference, flow, fitted[0], best),
        kind_of(sources),
    )


def _fit(law: Law, first: Floats, second: Floats, flow: Floats, confidence: float) -> FittedLaw:
    shape = law.shape(first, second)
    guess, scale = float(shape @ flow / (shape @ shape)), float(np.abs(flow).max())
    fit = fit_curve(
        lambda values: (flow - guess * values[0] * shape) / scale, np.ones(1), np.zeros(1), np.full(1, 1e3), confidence
    )
    rms = fit.rms * scale
    criterion = 2.0 * flow.size * float(np.log(max(rms, 1e-300))) + 2.0
    value, half = float(fit.values[0]) * guess, float(fit.half_widths[0]) * guess
    return FittedLaw(law.name, law.formula, value, half, _UNITS[law.name], rms, criterion, (value * shape,))


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
        Panel("Residuals", *axis, "Measured less fitted", "kg/s", tuple(rest)),
    )
