"""Flow through the fully open valve: Cd of equations (6), (7), C and b of ISO 6358, or a laminar coefficient.

    m = Cd A C1 P_up psi(r)  or  C rho_0 sqrt(T_0 / T) P_up phi(r; b)  or  c (P_up^2 - P_down^2),   r = P_down / P_up

m is the mass flow [kg/s], P_up and P_down the absolute pressures upstream and downstream of the valve [Pa]; flow
functions and constants as in ``flow``. Temperature and law of the gas, and gains and zeros of the sensors are
tolerances. Of ISO 6358, C is the choked flow, and b is observable only from both choked and subsonic flow.
"""

from dataclasses import replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow import NEXT_LAW, GasAt, Law, Opening, Paths, orifice_shape, solve_flow
from ppafo.identification.bench.law import PooledReadings, recordings_of
from ppafo.identification.bench.result import BenchResult, ReportedNumber, result_of
from ppafo.identification.source import (
    RecordingSource,
    check_moves,
    check_no_wrong_reading,
    check_not_clipped,
    check_sources,
    meter_readings,
    pool,
)
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.model.gas import critical_pressure_ratio
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats

PROCEDURE = "open-valve-flow"
CHANNELS = ("upstream_pressure", "downstream_pressure", "mass_flow")
MINIMUM_SAMPLES = 5
"""Least number of readings at the open valve that separates the unknowns."""
_FULLY_OPEN = 0.99
"""Magnitude of the command [-] from which a valve is fully open."""
_NEARLY_EQUAL = 0.9
"""Pressure ratio [-] above which the pressures are nearly equal."""
_LEVELS = "choked flow", "subsonic flow", "flow at nearly equal pressures"
"""Names of the flow regimes, by pressure ratio."""
_SPAN, _SUBSONIC = 0.15, 0.6
"""Least span and least maximum of the pressure ratios [-] needed to fit both parameters of ISO 6358."""
_LARGEST_COEFFICIENT = 1.0
"""Largest possible discharge coefficient [-]: the flow of a loss-free nozzle."""


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
    """Return the estimated Cd [-] or Cd A [m^2], C [m^3/(s Pa)] and b [-], or c [kg/(s Pa^2)] of the open valve.

    The laws are equations (6) and (7), ISO 6358, and a laminar gap. With an ``area`` [m^2] the orifice law gives Cd,
    without one the product Cd A. The law ``both`` gives Cd, Cd A or, with a ``critical_ratio`` [-], C, together with c
    of a parallel laminar gap. ``path`` is the path of the valve in a set (``valves.main``). Raises IdentificationError,
    with file, sample and remedy, for recordings from which the flow law cannot be estimated.
    """
    upstream, downstream, flow, labels, remarks = open_readings(sources, gas, tolerances)
    # Beside a laminar gap the critical ratio decides whether the opening is an orifice.
    known_ratio = critical_ratio if law == "both" else None
    opening = Opening(gas, law, area or 1.0, known_ratio)
    size, ratio, largest = _size(opening, area, path), downstream / upstream, float(flow.max())
    is_standard = law == "iso6358"
    if is_standard and (np.ptp(ratio) < _SPAN or ratio.max() < _SUBSONIC):
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: C and b need choked and subsonic flow, pressure ratios that span "
            f"{_SPAN:g} or more and go beyond {_SUBSONIC:g}; these go from {ratio.min():.3g} to {ratio.max():.3g}"
        )
    reported = [size]
    if is_standard:
        reported.append(ReportedNumber(f"{path}.critical_ratio", "", "Critical ratio b of ISO 6358"))
    paths = Paths(size.path, critical_ratio=reported[-1].path if is_standard else "")
    if law == "both":
        paths = Paths(size.path, beside=_BESIDE.path)
        _, alone = opening.rough_sizes(upstream, downstream, flow)
        # Either part may be zero, which is an answer.
        reported = [replace(size, size=alone.size), replace(_BESIDE, size=alone.beside)]
    choked = critical_pressure_ratio(gas.heat_capacity_ratio)
    # The noise of the pressures shows the more in the flow the nearer they are to each other.
    levels = [_LEVELS[place] for place in np.digitize(ratio, (choked, _NEARLY_EQUAL)).tolist()]
    found, model = solve_flow(
        opening,
        paths,
        dict(zip(CHANNELS, (upstream, downstream), strict=False)),
        PooledReadings(flow, levels, labels),
        tolerances,
        confidence,
    )
    shown, fitted = (1.0e8 * one / upstream for one in (flow, model))
    marks = readings_mark("measured", ratio, shown), curve_mark(law, ratio, fitted)
    axes = Kind("Pressure ratio"), Kind("Flow over upstream pressure", "g/s per bar")
    result = result_of(
        PROCEDURE,
        sources,
        found,
        reported,
        f"{flow.size} readings at pressure ratios from {ratio.min():.2f} to {ratio.max():.2f}; "
        f"scatter {np.std(flow - model) / largest:.2%} of the largest flow",
        with_residuals("Open-valve flow", *axes, marks, ratio, shown - fitted),
        f"{NEXT_LAW[law]}, or leave those readings out",
        remarks,
    )
    # The size is the first of the estimates; without a unit it is a discharge coefficient.
    coefficient, *others = result.estimates
    if area is None or coefficient.unit or coefficient.low <= _LARGEST_COEFFICIENT:
        return result
    doubt = (
        f"Cd = {coefficient.value:.3g} is above 1, which no opening has: the unit of mass_flow or of a pressure is "
        f"another one (a flow per minute is 60 times one per second), or the valve is larger than the set's "
        f"{area * 1e6:.4g} mm^2; Cd A is {coefficient.value * area * 1e6:.4g} mm^2"
    )
    doubted = replace(coefficient, verdict="holds for this model only")
    return replace(result, estimates=(doubted, *others), remarks=(doubt, *result.remarks))


_BESIDE = ReportedNumber("open_valve_flow.laminar_coefficient", "kg/(s Pa^2)", "Laminar coefficient of a gap beside it")


def _size(opening: Opening, area: float | None, path: str) -> ReportedNumber:
    """Return the reported size of the opening: path in a set, unit and description."""
    if opening.law == "laminar":
        return ReportedNumber(
            "open_valve_flow.laminar_coefficient", "kg/(s Pa^2)", "Laminar coefficient of the open valve"
        )
    if opening.law == "iso6358" or opening.critical_ratio is not None:
        return ReportedNumber(f"{path}.sonic_conductance", "m^3/(s Pa)", "Sonic conductance C of ISO 6358")
    if area:
        text = f"Discharge coefficient with the set's area of {area * 1e6:.4g} mm^2; only Cd A sets the flow"
        return ReportedNumber(f"{path}.discharge_coefficient", "", text)
    return ReportedNumber("open_valve_flow.effective_area", "m^2", "Effective area Cd A")


def open_readings(
    sources: tuple[RecordingSource, ...], gas: GasAt, tolerances: Tolerances
) -> tuple[Floats, Floats, Floats, list[str], tuple[str, ...]]:
    """Return upstream and downstream pressure [Pa], flow [kg/s], and recording label of open-valve readings; remarks.

    Remarks name the readings left out. Raises IdentificationError for exchanged pressures and a valve that is never
    open.
    """
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES, absolute=CHANNELS[:2])
    for source in sources:
        upstream, downstream = (source.recording[name] for name in CHANNELS[:2])
        # A meter that is saturated stays where these pressures would have the flow change.
        driving = orifice_shape(upstream, downstream, gas.heat_capacity_ratio)
        check_not_clipped(source, PROCEDURE, "mass_flow", "orifice flow at these pressures", driving)
    recordings = [source.recording for source in sources]
    commands = [one["command"] if "command" in one else np.ones(len(one)) for one in recordings]
    # A recording without commands is taken for one of an open valve.
    is_open = np.abs(np.concatenate(commands)) >= _FULLY_OPEN
    if is_open.sum() < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs {MINIMUM_SAMPLES} readings with the valve fully open, "
            f"command 1 or -1; there are {int(is_open.sum())}"
        )
    upstream, downstream, flow = (pool(sources, name) for name in CHANNELS)
    # A log that begins before the air is on says nothing there, and no column of it is wrong.
    limit = tolerances.zero_of_flow * float(np.abs(flow[is_open]).max())
    rests = is_open & (downstream >= upstream) & (np.abs(flow) <= limit)
    remarks: tuple[str, ...] = ()
    if rests.sum() > is_open.sum() // 10 and (is_open & ~rests).sum() >= MINIMUM_SAMPLES:
        remarks = (f"left out: {rests.sum()} of {is_open.sum()} readings without flow and pressure difference",)
        is_open = is_open & ~rests
    upstream, downstream, flow = upstream[is_open], downstream[is_open], flow[is_open]
    wrong = np.flatnonzero(downstream >= upstream)
    # A few readings may cross by noise where both pressures are nearly equal.
    if wrong.size > flow.size // 10:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: downstream_pressure is at or above upstream_pressure in {wrong.size} of "
            f"{flow.size} readings; are the two columns swapped?"
        )
    if np.ptp(flow) <= 0.0:
        check_moves(sources[0], PROCEDURE, "mass_flow")
    pressures = [pool(sources, name) for name in CHANNELS[:2]]
    check_no_wrong_reading(sources, PROCEDURE, "mass_flow", pressures, is_open)
    direction = pressures[0] - pressures[1]
    _, is_kept, meter_remarks = meter_readings(sources, PROCEDURE, direction, tolerances.zero_of_flow, is_open)
    possible = is_kept[is_open]
    labels = [label for label, is_one in zip(recordings_of(sources), is_kept.tolist(), strict=True) if is_one]
    return upstream[possible], downstream[possible], np.abs(flow[possible]), labels, (*remarks, *meter_remarks)
