"""Flow through the fully open valve: Cd A of equations (6), (7), or C and b of ISO 6358 from several ratios.

    flow = Cd A C1 P_up psi(P_down / P_up)    or    flow = C rho_0 sqrt(T_0 / T) P_up phi(P_down / P_up; b)

The first is linear in Cd A. Of the second C is the choked flow, and b shows only where there is choked and subsonic
flow.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CLEARLY_WORSE, CurveFit, fit_curve
from ppafo.identification.bench.flow_laws import GasAt, iso6358_shape, orifice_shape
from ppafo.identification.bench.result import BenchResult, Evidence, Panel, Series
from ppafo.identification.estimate import Check, Estimate, Prospect
from ppafo.identification.source import (
    Source,
    check_absolute,
    check_moves,
    check_not_clipped,
    check_sources,
    kind_of,
    pauses,
    pool,
    traces,
)
from ppafo.model.gas import critical_pressure_ratio
from ppafo.signals.recording import Floats

PROCEDURE = "open-valve-flow"
CHANNELS = ("upstream_pressure", "downstream_pressure", "mass_flow")
MINIMUM_SAMPLES = 5
_FULLY_OPEN = 0.99
_LARGEST_CRITICAL_RATIO = 0.95
_SPREAD_OF_RATIOS = 0.15
_GOOD_FRACTION = 0.05
_RATIO_STEP = 0.02

Law = Literal["orifice", "iso6358"]


@dataclass(frozen=True, slots=True)
class OpenValveFlowSettings:
    """The gas, the law to report, the valve's path in a set (``valves.main``) and its area [m^2] where it is known.

    With an area, Cd follows from Cd A; without one only the product is known. ``calibration`` is the relative
    uncertainty of the sensors' gain [-].
    """

    gas: GasAt
    law: Law = "orifice"
    area: float | None = None
    path: str = "valve"
    confidence: float = 0.95
    calibration: float = 0.0


@dataclass(frozen=True, slots=True)
class OpenReadings:
    """Readings with the valve fully open: absolute pressures [Pa], flow [kg/s]."""

    upstream: Floats
    downstream: Floats
    flow: Floats

    @property
    def ratio(self) -> Floats:
        """Downstream over upstream pressure [-]."""
        return self.downstream / self.upstream

    @property
    def steps(self) -> Floats:
        """The ratio [-] in coarse steps: sorted by its own noise, residuals would follow it though the law is right."""
        return np.round(self.ratio / _RATIO_STEP)

    def spans_enough(self, gas: GasAt) -> bool:
        """Return whether flow is both nearly choked and clearly subsonic, so that the critical ratio can be fitted."""
        choked = critical_pressure_ratio(gas.heat_capacity_ratio)
        return bool(np.ptp(self.ratio) >= _SPREAD_OF_RATIOS and self.ratio.max() > choked + 0.5 * _SPREAD_OF_RATIOS)


def open_valve_flow(sources: tuple[Source, ...], settings: OpenValveFlowSettings) -> BenchResult:
    """Return Cd A [m^2] and Cd [-], and C [m^3/(s Pa)] and b [-] where the pressure ratios span enough; (6), (7).

    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    gas = settings.gas
    for source in sources:
        check_absolute(source, PROCEDURE, CHANNELS[:2])
        upstream, downstream = (source.recording[name] for name in CHANNELS[:2])
        # A meter that is saturated stays where these pressures would have the flow change.
        driving = orifice_shape(upstream, downstream, gas.heat_capacity_ratio)
        check_not_clipped(source, PROCEDURE, "mass_flow", "orifice flow at these pressures", driving)
    points = open_readings(sources)
    scale = float(np.abs(points.flow).max())
    # Equation (6): flow = Cd A C1 P_up psi(P_down / P_up), linear in Cd A.
    per_area = gas.choked_flow_constant * orifice_shape(points.upstream, points.downstream, gas.heat_capacity_ratio)
    orifice = fit_curve(
        lambda values: (points.flow - values[0] * per_area) / scale,
        np.array([per_area @ points.flow / (per_area @ per_area)]),
        np.array([0.0]),
        np.array([np.inf]),
        settings.confidence,
        (points.steps,),
    )
    sonic = _sonic_fit(points, settings, scale) if points.spans_enough(gas) else None
    if settings.law == "iso6358" and sonic is None:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: C and b need choked and subsonic flow, pressure ratios that span "
            f"{_SPREAD_OF_RATIOS:g} or more; these go from {points.ratio.min():.3g} to {points.ratio.max():.3g}"
        )
    reported = sonic if settings.law == "iso6358" and sonic is not None else orifice
    evidence = Evidence(traces(sources), settings.confidence, gas.flow_uncertainty(settings.calibration))
    one_ratio = "one pressure ratio, or choked flow alone: the orifice law and C with b cannot be distinguished"
    remarks = (*(() if sonic is not None else (one_ratio,)), *pauses(sources))
    text = f"{points.flow.size} readings, pressure ratios {points.ratio.min():.3g} to {points.ratio.max():.3g}; "
    text += f"Cd A = {orifice.values[0] * 1e6:.4g} mm^2"
    text += "" if sonic is None else f"; C = {sonic.values[0]:.4g} m^3/(s Pa), b = {sonic.values[1]:.3g}"
    estimates, checks = _estimates(evidence, settings, orifice, sonic), _checks(settings, reported, orifice, sonic)
    panels = _panels(points, settings, reported, orifice, sonic)
    return BenchResult(PROCEDURE, text, estimates, checks, panels, kind_of(sources), remarks)


def flow_prospects(sources: tuple[Source, ...], settings: OpenValveFlowSettings) -> tuple[Prospect, ...]:
    """Return whether Cd A, Cd, and C with b can be had from the pressure ratios that were recorded."""
    check_sources(sources, PROCEDURE, CHANNELS, 1)
    readings = open_readings(sources)
    ratio = readings.ratio
    spread = f"{ratio.size} readings with the valve open, pressure ratios {ratio.min():.3g} to {ratio.max():.3g}"
    has_area = bool(settings.area)
    area = "over the area of the set" if has_area else "the set has no area of the valve: only the product Cd A"
    both = readings.spans_enough(settings.gas)
    needed = spread if both else f"{spread}: choked and subsonic flow are needed"
    return (
        Prospect("effective area", True, spread),
        Prospect("discharge coefficient", has_area, area),
        Prospect("C and b of ISO 6358", both, needed),
    )


def open_readings(sources: tuple[Source, ...]) -> OpenReadings:
    """Return the readings with the valve fully open; exchanged pressures and a valve that never was are refused.

    IdentificationError says which.
    """
    upstream, downstream, flow = (pool(sources, name) for name in CHANNELS)
    commands = [
        source.recording["command"] if "command" in source.recording else np.ones(len(source.recording))
        for source in sources
    ]
    is_open = np.abs(np.concatenate(commands)) >= _FULLY_OPEN
    if is_open.sum() < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs {MINIMUM_SAMPLES} readings with the valve fully open, "
            f"command 1 or -1; there are {int(is_open.sum())}"
        )
    points = OpenReadings(upstream[is_open], downstream[is_open], np.abs(flow[is_open]))
    wrong = np.flatnonzero(points.downstream >= points.upstream)
    if wrong.size > points.flow.size // 10:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: downstream_pressure is at or above upstream_pressure in {wrong.size} of "
            f"{points.flow.size} readings; are the two columns swapped?"
        )
    if points.flow.max() <= 0.0:
        check_moves(sources[0], PROCEDURE, "mass_flow")
    return points


def _sonic_fit(points: OpenReadings, settings: OpenValveFlowSettings, scale: float) -> CurveFit:
    """Fit C (as a multiple of a first guess, so that both unknowns are of order one) and b."""
    per_conductance = settings.gas.flow_per_sonic_conductance
    guess = float(points.flow.max()) / (per_conductance * float(points.upstream[np.argmax(points.flow)]))

    def residuals(values: Floats) -> Floats:
        shape = iso6358_shape(points.upstream, points.downstream, float(values[1]))
        return np.asarray((points.flow - values[0] * guess * per_conductance * shape) / scale)

    upper = np.array([100.0, _LARGEST_CRITICAL_RATIO])
    fits = [
        fit_curve(residuals, np.array([1.0, start]), np.zeros(2), upper, settings.confidence, (points.steps,))
        for start in (0.2, 0.5)
    ]
    best = min(fits, key=lambda fit: fit.rms)
    units = np.array([guess, 1.0])
    return replace(best, values=best.values * units, half_widths=best.half_widths * units)


def _estimates(
    evidence: Evidence, settings: OpenValveFlowSettings, orifice: CurveFit, sonic: CurveFit | None
) -> tuple[Estimate, ...]:
    """Return Cd where the set has an area, Cd A, C and b; a gain that both pressures share leaves b as it is."""
    given = f"{settings.gas.temperature_text}; {evidence.calibration_text}"
    text = f"Cd A, the product; it alone sets the flow. {given}."
    product = orifice.number(0, "open_valve_flow.effective_area", "m^2", text)
    estimates = [evidence.with_calibration(product)]
    if settings.law == "orifice" and settings.area:
        text = f"Cd A over the set's area of {settings.area * 1e6:.4g} mm^2, taken as exact. {given}."
        value, half = product.value / settings.area, product.half_width / settings.area
        path = f"{settings.path}.discharge_coefficient"
        coefficient = replace(product, path=path, unit="", value=value, half_width=half, explanation=text)
        estimates.insert(0, evidence.with_calibration(coefficient))
    if sonic is not None:
        section = settings.path if settings.law == "iso6358" else "open_valve_flow"
        trade = f"Errors of C and b are correlated by {sonic.correlation[0, 1]:+.2f}"
        text = f"C of ISO 6358. {trade}. {given}."
        conductance = sonic.number(0, f"{section}.sonic_conductance", "m^3/(s Pa)", text)
        ratio = sonic.number(1, f"{section}.critical_ratio", "", f"b of ISO 6358. {trade}.")
        estimates += [evidence.with_calibration(conductance), evidence.without_calibration(ratio)]
    return tuple(estimates)


def _checks(
    settings: OpenValveFlowSettings, reported: CurveFit, orifice: CurveFit, sonic: CurveFit | None
) -> tuple[Check, ...]:
    noise = "of the largest flow"
    text = f"the law misses the flow by {reported.rms:.2%} {noise} (rms)"
    bias = float(np.mean(reported.residuals))
    is_small = abs(bias) <= max(0.01, 2.0 * reported.rms / np.sqrt(reported.effective))
    listed = [
        Check("residuals", reported.rms <= _GOOD_FRACTION, text),
        Check("bias", bool(is_small), f"mean residual {bias:+.2%} {noise}"),
    ]
    if sonic is None:
        return tuple(listed)
    # Whether the readings clearly prefer the law that was not requested (Akaike's criterion; b is one number more).
    count = min(orifice.effective, sonic.effective)
    gain = count * math.log(max(orifice.rms, 1e-15) / max(sonic.rms, 1e-15)) * 2.0 - 2.0
    better = (
        "ISO 6358" if gain > CLEARLY_WORSE else "the orifice law" if gain < -CLEARLY_WORSE else "neither law clearly"
    )
    requested = "ISO 6358" if settings.law == "iso6358" else "the orifice law"
    text = f"AIC prefers {better} (difference {gain:+.1f}): rms {orifice.rms:.2%} orifice, {sonic.rms:.2%} ISO 6358"
    holds = better in (requested, "neither law clearly")
    other = "iso6358" if settings.law == "orifice" else "orifice"
    return (*listed, Check("which law", holds, text if holds else f"{text}; try law = '{other}'"))


def _panels(
    points: OpenReadings, settings: OpenValveFlowSettings, reported: CurveFit, orifice: CurveFit, sonic: CurveFit | None
) -> tuple[Panel, ...]:
    """Show conductance over ratio: flow over upstream pressure, which both laws make a function of the ratio alone."""
    ratios = np.linspace(0.0, 1.0, 201)
    ones = np.ones_like(ratios)
    gas = settings.gas
    law = orifice.values[0] * gas.choked_flow_constant * orifice_shape(ones, ratios, gas.heat_capacity_ratio)
    shown = [Series("measured", points.ratio, points.flow / points.upstream, "measured")]
    shown.append(Series("orifice", ratios, law, "law" if settings.law == "orifice" else "other law"))
    if sonic is not None:
        curve = sonic.values[0] * gas.flow_per_sonic_conductance * iso6358_shape(ones, ratios, float(sonic.values[1]))
        shown.append(Series("ISO 6358", ratios, curve, "law" if settings.law == "iso6358" else "other law"))
    largest = float(points.flow.max())
    modelled, ends = points.flow - reported.residuals * largest, np.array([0.0, largest])
    compared = (Series("", points.flow, modelled, "measured"), Series("", ends, ends, "law"))
    ratio_axis = ("Downstream over upstream pressure", "-")
    return (
        Panel("Open-valve flow", *ratio_axis, "Flow over upstream pressure", "kg/(s Pa)", tuple(shown)),
        Panel("Fitted against measured", "Measured flow", "kg/s", "Fitted flow", "kg/s", compared),
    )
