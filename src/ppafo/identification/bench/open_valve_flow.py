"""Flow through the fully open valve: Cd of equations (6), (7), C and b of ISO 6358, or a laminar coefficient.

    m = Cd A C1 P_up psi(r)  or  C rho_0 sqrt(T_0 / T) P_up phi(r; b)  or  c (P_up^2 - P_down^2),   r = P_down / P_up

m is the mass flow [kg/s], P_up and P_down the absolute pressures upstream and downstream of the valve [Pa]; flow
functions and constants as in ``flow``. Temperature and law of the gas, and gains and zeros of the sensors are
tolerances.
"""

from collections import defaultdict
from dataclasses import replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow import (
    LAW_NAMES,
    NEXT_LAW,
    PRODUCT_ONLY,
    GasAt,
    Law,
    Opening,
    check_both_regimes,
    orifice_shape,
    reported_parts,
    shown_flow,
    solve_flow,
)
from ppafo.identification.bench.law import BenchResult, PooledReadings, ReportedNumber, recordings_of, result_of
from ppafo.identification.bench.readings import (
    check_moves,
    check_no_wrong_reading,
    check_not_clipped,
    check_sources,
    meter_readings,
)
from ppafo.identification.source import RecordingSource, pool
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.model.gas import critical_pressure_ratio
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals

PROCEDURE = "open-valve-flow"
CHANNELS = ("upstream_pressure", "downstream_pressure", "mass_flow")
MINIMUM_SAMPLES = 5
"""Least number of readings at the open valve to separate the unknowns."""
_FULLY_OPEN = 0.99
"""Magnitude of the command [-] from which a valve is fully open."""
_FEW = 10
"""Reciprocal of the largest fraction of readings without flow or with crossed pressures that counts as noise."""
_NEARLY_EQUAL = 0.9
"""Pressure ratio [-] above which the pressures are nearly equal."""
_REGIMES = "choked flow", "subsonic flow", "flow at nearly equal pressures"
"""Names of the flow regimes, by pressure ratio."""
_LARGEST_COEFFICIENT = 1.0
"""Largest possible discharge coefficient [-]: the flow of a loss-free nozzle."""
_GRAMS_PER_BAR = 1.0e8
"""Conversion factor from kg/(s Pa) to g/s per bar."""
_GAP = ReportedNumber("open_valve_flow.laminar_coefficient", "kg/(s Pa^2)", "Laminar coefficient of a gap beside it")


def open_valve_flow(
    sources: tuple[RecordingSource, ...],
    gas: GasAt,
    law: Law = "orifice",
    area: float | None = None,
    path: str = "valve",
    critical_ratio: float | None = None,
    confidence: float = 0.95,
    tolerances: Tolerances = DEFAULTS,
) -> BenchResult:
    """Identify Cd [-] or Cd A [m^2], C [m^3/(s Pa)] and b [-], or c [kg/(s Pa^2)] of the open valve.

    The laws are equations (6) and (7), ISO 6358, and a laminar gap.

    Arguments:
        sources: recordings of mass flow, upstream and downstream pressure
        gas: gas of the bench
        law: flow law; ``both`` adds a laminar gap, c, to Cd, Cd A or, with ``critical_ratio``, C
        area: area of the opening [m^2], with which the orifice law gives Cd; None for the product Cd A
        path: path of the valve in a set, ``valves.main``
        critical_ratio: b of ISO 6358 [-] for the law ``both``
        confidence: confidence level of the intervals [-]
        tolerances: limits of the errors of the bench

    Returns:
        the estimates with intervals and verdicts, a summary and two panels

    Raises:
        IdentificationError: recordings that do not determine the flow law; names file, sample and remedy
    """
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES, absolute=CHANNELS[:2])
    for source in sources:
        upstream, downstream = (source.recording[name] for name in CHANNELS[:2])
        # A saturated meter shows a constant flow although the pressures change the flow.
        driving = orifice_shape(upstream, downstream, gas.heat_capacity_ratio)
        check_not_clipped(source, PROCEDURE, "mass_flow", "orifice flow at these pressures", driving)
    recordings = [source.recording for source in sources]
    # In a recording without commands, the valve is taken to be open.
    commands = [item["command"] if "command" in item else np.ones(len(item)) for item in recordings]
    is_open = np.abs(np.concatenate(commands)) >= _FULLY_OPEN
    if is_open.sum() < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} readings with the valve fully open "
            f"(command 1 or -1), not {int(is_open.sum())}"
        )
    upstream, downstream, flow = (pool(sources, name) for name in CHANNELS)
    is_crossed, zero, remarks = downstream >= upstream, tolerances.zero_of_flow, tuple[str, ...]()
    # A log may begin before the gas supply is on: no flow without pressure difference is then no error of a column.
    is_at_rest = is_open & is_crossed & (np.abs(flow) <= zero * float(np.abs(flow[is_open]).max()))
    if is_at_rest.sum() > is_open.sum() // _FEW and (is_open & ~is_at_rest).sum() >= MINIMUM_SAMPLES:
        remarks = (f"left out: {is_at_rest.sum()} of {is_open.sum()} readings without flow and pressure difference",)
        is_open = is_open & ~is_at_rest
    crossed = np.count_nonzero(is_crossed[is_open])
    # Noise may exchange a few pressures that are nearly equal.
    if crossed > is_open.sum() // _FEW:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: downstream_pressure is at or above upstream_pressure in {crossed} of "
            f"{is_open.sum()} readings; are the two columns swapped?"
        )
    if np.ptp(flow[is_open]) <= 0.0:
        check_moves(sources[0], PROCEDURE, "mass_flow")
    check_no_wrong_reading(sources, PROCEDURE, "mass_flow", (upstream, downstream), is_open)
    _, used, meter_remarks = meter_readings(sources, PROCEDURE, upstream - downstream, zero, is_open)
    upstream, downstream, flow = upstream[used], downstream[used], np.abs(flow[used])
    ratio = downstream / upstream
    if law == "iso6358":
        check_both_regimes(ratio, sources[0].name, PROCEDURE)
    # In parallel with a laminar gap, b selects ISO 6358; the law ``iso6358`` estimates b.
    opening = Opening(gas, law, area or PRODUCT_ONLY, critical_ratio if law == "both" else None)
    _, alone = opening.rough_sizes(upstream, downstream, flow)
    reported, paths = reported_parts(opening, _size(opening, area, path), _GAP, alone)
    # The nearer the pressures are to each other, the more their noise affects the computed flow.
    limits = critical_pressure_ratio(gas.heat_capacity_ratio), _NEARLY_EQUAL
    regimes = [_REGIMES[regime] for regime in np.digitize(ratio, limits).tolist()]
    fitted, model = solve_flow(
        opening,
        paths,
        {"upstream_pressure": upstream, "downstream_pressure": downstream},
        PooledReadings(flow, regimes, np.array(recordings_of(sources))[used].tolist()),
        tolerances,
        confidence,
    )
    scatter = float(np.std(flow - model) / flow.max())
    measured_ordinate, fitted_ordinate = (_GRAMS_PER_BAR * values / upstream for values in (flow, model))
    # Densely, so that the curve has no kinks at the readings; between them the upstream pressure is interpolated.
    dense, order = np.linspace(ratio.min(), ratio.max(), 200), np.argsort(ratio)
    first = np.interp(dense, ratio[order], upstream[order])
    shown = {"upstream_pressure": first, "downstream_pressure": dense * first}
    law_flow = shown_flow(opening, paths, shown, defaultdict(float, fitted.by_name))
    curve = curve_mark(LAW_NAMES[law], dense, _GRAMS_PER_BAR * law_flow / first)
    marks = readings_mark("measured", ratio, measured_ordinate), curve
    axes = Kind("Pressure ratio"), Kind("Flow over upstream pressure", "g/s per bar")
    result = result_of(
        PROCEDURE,
        sources,
        fitted,
        reported,
        f"{flow.size} readings at pressure ratios from {ratio.min():.2f} to {ratio.max():.2f}; "
        f"scatter {scatter:.2%} of the largest flow",
        with_residuals("Open-valve flow", *axes, marks, ratio, measured_ordinate - fitted_ordinate),
        f"{NEXT_LAW[law]}, or leave those readings out",
        (*remarks, *meter_remarks),
        scatter,
    )
    coefficient, *others = result.estimates
    # Other sizes than a discharge coefficient have a unit.
    if area is None or coefficient.unit or coefficient.low <= _LARGEST_COEFFICIENT:
        return result
    doubt = (
        f"Cd = {coefficient.value:.3g} is impossible, above 1: mass_flow or a pressure has a wrong unit, or the valve "
        f"is larger than the set's {area * 1e6:.4g} mm^2"
    )
    doubted = replace(coefficient, verdict="holds for this model only")
    return replace(result, estimates=(doubted, *others), remarks=(doubt, *result.remarks))


def _size(opening: Opening, area: float | None, path: str) -> ReportedNumber:
    """Return the reported size of the opening: path in a set, unit and description."""
    if opening.law == "laminar":
        return replace(_GAP, text="Laminar coefficient of the open valve")
    if opening.law == "iso6358" or opening.critical_ratio is not None:
        return ReportedNumber(f"{path}.sonic_conductance", "m^3/(s Pa)", "Sonic conductance C of ISO 6358")
    if area:
        text = f"Discharge coefficient with the set's area of {area * 1e6:.4g} mm^2; only Cd A is identified"
        return ReportedNumber(f"{path}.discharge_coefficient", "", text)
    return ReportedNumber("open_valve_flow.effective_area", "m^2", "Effective area Cd A")
