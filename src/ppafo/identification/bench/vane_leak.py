"""Leak across the vane or the piston, from closed chambers or steady flow: area, conductance or laminar coefficient.

    steady     m = g(P_1, P_2)
    closed     D' = -(1 + V_1/V_2) (R T / V_1) g(P_1, P_2),   D = P_1 - P_2,   V_1 P_1 + V_2 P_2 = constant

g is the mass flow [kg/s] of a law of ``flow``, equations (6), (7): Cd A_leak of an orifice, C of ISO 6358 or a laminar
coefficient; P_1 and P_2 are the absolute pressures [Pa] of the fuller chamber and the other, V_1 and V_2 their volumes
[m^3], equation (3) at constant temperature. A chamber with constant pressure is treated as the surrounding room. Just
after filling, gas and walls are not yet in equilibrium: each pressure has an initial error P r exp(-t / tau). Volumes,
temperature and law of the gas, r and tau, and zeros of the sensors are tolerances; for steady flow also the gains. A
gain common to both sensors does not change the rate at which D falls.
"""

import math
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.chamber_decay import (
    CHANNELS,
    MINIMUM_SAMPLES,
    PROCEDURE,
    ChamberDecay,
    chamber_decay,
    pressures_of_fall,
)
from ppafo.identification.bench.checks import check_moves, check_not_clipped, check_sources
from ppafo.identification.bench.flow import (
    CRITICAL_RATIOS,
    GAS_LAW,
    LAW_NAMES,
    PRODUCT_ONLY,
    TEMPERATURE,
    GasAt,
    Law,
    Opening,
    OpeningSizes,
    Paths,
    check_both_regimes,
    gas_tolerances,
    has_both_regimes,
    reported_parts,
    solve_flow,
)
from ppafo.identification.bench.law import PooledReadings, Values, recordings_of, solve, sought, tolerance, within
from ppafo.identification.bench.leak_laws import RIVALS, LawFit, next_law, with_rival
from ppafo.identification.bench.result import BenchResult, ReportedNumber, result_of
from ppafo.identification.bench.wrong_readings import check_no_wrong_reading, meter_readings, without_wrong_samples
from ppafo.identification.residuals import FitVariable
from ppafo.identification.source import RecordingSource, pool
from ppafo.identification.tolerances import DEFAULTS, HELD, Tolerances
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.wording import count_of

_FEWEST_STEADY = 8
"""Least number of readings of steady flow."""
GAP = "effects.laminar_leak.coefficient"
"""Path of the coefficient of a laminar gap beside the orifice in a set."""
_GAP = ReportedNumber(GAP, "kg/(s Pa^2)", "Laminar coefficient of a gap beside the orifice")
_TRIAL_RATIOS = tuple(np.linspace(*CRITICAL_RATIOS[1:], 20).tolist())
"""Critical ratios [-], the best of which starts the search for steady flow.

From the usual one, a search may end at a wrong minimum, with zeros of the sensors for the bend of the curve."""
_SHARP = 0.6
"""Discharge coefficient of a sharp-edged hole [-]."""
_Laws = tuple[tuple[Opening, ReportedNumber], ...]
"""Chosen law and its rival, if it has one, each with its reported size."""
_REMEDY = "{}, or give a start and an end; gas may leak elsewhere, or exchange heat with the walls"


def vane_leak(
    sources: tuple[RecordingSource, ...],
    gas: GasAt,
    volume_1: float | None = None,
    volume_2: float | None = None,
    discharge_coefficient: float | None = None,
    start: float | None = None,
    end: float | None = None,
    confidence: float = 0.95,
    critical_ratio: float | None = None,
    law: Literal["orifice", "iso6358", "laminar", "both"] = "orifice",
    tolerances: Tolerances = DEFAULTS,
    volume_deviation: float = deviation_of_limit(HELD["actuator.dead_volume_1"]),
) -> BenchResult:
    """Identify the leak: A_leak [m^2], C [m^3/(s Pa)] or a laminar coefficient [kg/(s Pa^2)]; equations (6), (7).

    Recordings with a ``mass_flow`` are steady: the flow that maintains the pressure, at several pressures. The laws
    ``iso6358`` and ``both`` are compared with each other: the values of one hold for this model only if the other one
    explains the readings clearly better.

    Arguments:
        sources: recordings of both chamber pressures
        gas: gas of the bench
        volume_1, volume_2: chamber volumes [m^3]; without the volume of the emptying chamber, area over volume is found
        discharge_coefficient: Cd [-], with which an orifice gives an area; None for the product Cd A
        start, end: samples used of closed chambers [s]
        confidence: confidence level of the intervals [-]
        critical_ratio: b of ISO 6358 [-], which selects the sonic conductance for ``orifice`` and ``both``
        law: ``iso6358`` for C and b, ``laminar`` for a laminar coefficient, ``both`` for a laminar gap in parallel with
            the orifice
        tolerances: limits of the errors of the bench
        volume_deviation: relative standard deviation of a volume [-]

    Returns:
        the estimates with intervals and verdicts, a summary and two panels

    Raises:
        IdentificationError: recordings that do not determine the leak; names file, sample and remedy
    """
    laws = tuple(
        _law(gas, each, discharge_coefficient, critical_ratio) for each in (law, RIVALS.get(law)) if each is not None
    )
    if sources and all("mass_flow" in source.recording for source in sources):
        return _steady_leak(sources, laws, tolerances, confidence)
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    sources, remarks = without_wrong_samples(sources, PROCEDURE, CHANNELS, start, end)
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES, absolute=CHANNELS)
    for source in sources:
        # A chamber that is open to the room has a constant pressure.
        check_moves(source, PROCEDURE, max(CHANNELS, key=lambda name: float(np.ptp(source.recording[name]))))
    decays = tuple(chamber_decay(source, start, end, number) for number, source in enumerate(sources, start=1))
    if len({(decay.fuller, decay.changing) for decay in decays}) > 1:
        raise IdentificationError(
            "chamber 1 empties in some recordings and chamber 2 in others; give each chamber its own [[procedure]]"
        )
    volumes = volume_1, volume_2
    result = _closed_leak(sources, decays, laws, volumes, volume_deviation, tolerances, confidence)
    return replace(result, remarks=(*remarks, *result.remarks))


def _law(
    gas: GasAt, law: Law, discharge_coefficient: float | None, critical_ratio: float | None
) -> tuple[Opening, ReportedNumber]:
    """Return the law of the leak and its reported size: path in a set, unit and description."""
    # An orifice has the form of the set; the law ``iso6358`` seeks b.
    is_standard = law == "orifice" and critical_ratio is not None
    known_ratio = None if law == "iso6358" else critical_ratio
    opening = Opening(gas, "iso6358" if is_standard else law, discharge_coefficient or PRODUCT_ONLY, known_ratio)
    return opening, _size(opening, discharge_coefficient)


def _size(opening: Opening, discharge_coefficient: float | None) -> ReportedNumber:
    """Return the reported size of the leak: path in a set, unit and description."""
    if opening.law == "laminar":
        return ReportedNumber("vane_leak.laminar_coefficient", "kg/(s Pa^2)", "Laminar coefficient of the leak")
    if opening.law == "iso6358" or opening.critical_ratio is not None:
        ratio = opening.critical_ratio
        text = "Sonic conductance C of the leak" + ("" if ratio is None else f" with the set's b = {ratio:g}")
        return ReportedNumber("actuator.leak.sonic_conductance", "m^3/(s Pa)", text)
    if discharge_coefficient:
        text = (
            f"Area of the leak with Cd = {discharge_coefficient:g} of the set; only the product Cd A is identified: a "
            f"sharp-edged hole, of Cd = {_SHARP:g}, would have {discharge_coefficient / _SHARP:.3g} times this area"
        )
        return ReportedNumber("actuator.leak.area", "m^2", text)
    return ReportedNumber("vane_leak.effective_area", "m^2", "Effective area Cd A of the leak")


def _steady_leak(
    sources: tuple[RecordingSource, ...], laws: _Laws, tolerances: Tolerances, confidence: float
) -> BenchResult:
    """Identify the leak from steady flow at several pressures, which separate the zero of the flow meter."""
    channels = (*CHANNELS, "mass_flow")
    check_sources(sources, PROCEDURE, channels, _FEWEST_STEADY, moving=("mass_flow",), absolute=CHANNELS)
    for source in sources:
        check_not_clipped(source, PROCEDURE, "mass_flow", "pressure_1", source.recording["pressure_1"])
    first, second, flow = (pool(sources, name) for name in channels)
    check_no_wrong_reading(sources, PROCEDURE, "mass_flow", (first, second), np.ones(flow.size, dtype=bool))
    flow, is_possible, remarks = meter_readings(sources, PROCEDURE, first - second, tolerances.zero_of_flow)
    first, second, flow = first[is_possible], second[is_possible], flow[is_possible]
    labels = np.array(recordings_of(sources))[is_possible].tolist()
    difference = first - second
    # A wrong law gives different sizes at low and at high pressures.
    is_high = difference > np.median(difference)
    halves = np.where(is_high, "flow at higher pressures", "flow at lower pressures").tolist()
    pressures = {"pressure_1": first, "pressure_2": second}
    readings = PooledReadings(flow, ["mass_flow"] * flow.size, labels, (halves,))
    ratio, fits = np.minimum(first, second) / np.maximum(first, second), list[LawFit]()
    if laws[0][0].has_sought_ratio:
        check_both_regimes(ratio, sources[0].name, PROCEDURE)
    is_wide = has_both_regimes(ratio)
    for opening, size in laws:
        _, alone = opening.rough_sizes(first, second, flow)
        reported, paths = reported_parts(opening, size, _GAP, alone)
        fitted, model = solve_flow(opening, paths, pressures, readings, tolerances, confidence, _TRIAL_RATIOS)
        fits.append(LawFit(opening=opening, reported=reported, fitted=fitted, model=model, has_both_regimes=is_wide))
    chosen = fits[0]
    scatter = float(np.std(flow - chosen.model) / np.abs(flow).max())
    curve = curve_mark(LAW_NAMES[chosen.opening.law], difference, chosen.model)
    marks = readings_mark("measured", difference, flow), curve
    axes = Kind("Pressure difference", "Pa_d", "pressure change"), Kind("Flow", "kg/s", "mass flow")
    return _result(
        sources,
        fits,
        f"{flow.size} steady readings; scatter {scatter:.2%} of the largest flow",
        with_residuals("Steady leak", *axes, marks, difference, flow - chosen.model),
        remarks,
        scatter,
    )


def _result(
    sources: tuple[RecordingSource, ...],
    fits: list[LawFit],
    summary: str,
    panels: tuple[Panel, ...],
    remarks: tuple[str, ...],
    scatter: float = math.nan,
) -> BenchResult:
    """Return the result of the first of ``fits``, compared with its rival if there is one."""
    chosen, rival = fits[0], fits[1] if len(fits) > 1 else None
    remedy = _REMEDY.format(next_law(chosen, rival))
    result = result_of(PROCEDURE, sources, chosen.fitted, chosen.reported, summary, panels, remedy, remarks, scatter)
    return result if rival is None else with_rival(result, chosen, rival, remedy)


# Closed chambers.

_RATIO, _VOLUME, _RELAXATION = "ratio of the volumes", "volume", "time of the relaxation"
"""Names of the variables for V_1/V_2 [-], relative error of the volume [-], and logarithm of tau, scaled [-]."""
_START, _RELAXED_BY = "start of {}, decay {}", "relaxation of {}, decay {}"
"""Names of the variables for initial pressure [Pa] and relative error r after filling [-], by channel and decay."""
_RELAXED, _MOST_RELAXED = 5.0, 0.02
"""Usual ratio of recording length to relaxation time [-], and largest relative pressure error from relaxation [-]."""
_LEAST_PRESSURE = 1.0
"""Least initial pressure, least scale and least standard deviation of an initial pressure [Pa]."""
_UNIT_VOLUME = 1.0
"""Volume [m^3] in place of an unknown one: the fitted size is then the size divided by the volume."""
_SCATTER_OF_CHANGE, _LEAST_CHANGE = 0.01, 1.0e-9
"""Least pressure change for a start value: as a fraction of the noise of a tight chamber [-], and absolute [Pa]."""


def _closed_leak(
    sources: tuple[RecordingSource, ...],
    decays: tuple[ChamberDecay, ...],
    laws: _Laws,
    volumes: tuple[float | None, float | None],
    volume_deviation: float,
    tolerances: Tolerances,
    confidence: float,
) -> BenchResult:
    """Identify the leak from the pressures in closed chambers; ``volumes`` are V of chambers 1 and 2 [m^3]."""
    # The chamber whose pressure determines the leak empties, or fills from a room.
    chamber = decays[0].fuller if decays[0].changing == 0 else 3 - decays[0].fuller
    volume, other_volume = volumes if chamber == 1 else volumes[::-1]
    ratio = np.concatenate([decay.second / decay.first for decay in decays])
    if laws[0][0].has_sought_ratio:
        check_both_regimes(ratio, sources[0].name, PROCEDURE)
    is_wide = has_both_regimes(ratio)
    assumed_volume, gap = volume or _UNIT_VOLUME, _GAP
    if volume is None:
        laws = tuple((replace(opening, known=PRODUCT_ONLY), _over_volume(size, chamber)) for opening, size in laws)
        gap = _over_volume(gap, chamber)
    others = (
        *_unknowns(decays, volume, other_volume, volume_deviation),
        *gas_tolerances(laws[0][0].gas, tolerances),
        *tolerance(_VOLUME, volume_deviation if volume else 0.0),
        *(zero for sensor, _ in decays[0].sensors for zero in within(f"zero of {sensor}", tolerances.zero_of_pressure)),
    )
    readings, fits = _readings(sources, decays), list[LawFit]()
    for opening, size in laws:
        start, alone = _rough_sizes(decays, opening, assumed_volume)
        reported, paths = reported_parts(opening, size, gap, alone)
        shown = partial(_shown_pressures, decays=decays, opening=opening, paths=paths, volume=assumed_volume)
        fitted, model = solve(shown, readings, (*paths.sought(start, alone), *others), confidence)
        fits.append(LawFit(opening=opening, reported=reported, fitted=fitted, model=model, has_both_regimes=is_wide))
    model = fits[0].model
    times = [decay.time for decay in decays for _ in decay.fitted]
    time, models = np.concatenate(times), np.split(model, np.cumsum([values.size for values in times])[:-1])
    # The legend names the first curve only.
    names = [LAW_NAMES[laws[0][0].law], *[""] * (len(times) - 1)]
    marks = [readings_mark("measured", time, readings.measured)]
    marks += [curve_mark(*curve) for curve in zip(names, times, models, strict=True)]
    is_room = all(decay.room is not None for decay in decays)
    room = (f"the pressure in chamber {3 - chamber} is constant, so it is treated as a reservoir",) if is_room else ()
    longest = max(float(decay.time[-1]) for decay in decays)
    fall = max(1.0 - last / first for first, last in (decay.ends for decay in decays))
    return _result(
        sources,
        fits,
        f"{count_of(len(decays), 'decay')} of up to {longest:.3g} s; the pressure difference falls by {fall:.1%}",
        with_residuals(
            "Closed chambers", TIME, Kind("Pressure", "Pa_a", "pressure"), marks, time, readings.measured - model
        ),
        room,
    )


def _over_volume(size: ReportedNumber, chamber: int) -> ReportedNumber:
    """Return the reported size of the leak divided by the unknown volume of a chamber."""
    text = f"{size.text.partition(' with')[0]} over the volume of chamber {chamber}, which is not known"
    if size.unit == "m^2":
        return ReportedNumber("vane_leak.area_over_volume", "1/m", text)
    return ReportedNumber(f"vane_leak.{size.path.split('.')[-1]}_over_volume", f"{size.unit[:-1]} m^3)", text)


def _rough_sizes(
    decays: tuple[ChamberDecay, ...], opening: Opening, volume: float
) -> tuple[OpeningSizes, OpeningSizes]:
    """Return start sizes, and the sizes if each part of the leak alone caused the mean rate of the pressure change."""
    rate = opening.gas.specific_gas_constant * opening.gas.temperature / volume
    orifice, gap_alone, alone = OpeningSizes(1.0, CRITICAL_RATIOS[0]), OpeningSizes(0.0, beside=1.0), []
    for unit in (orifice, gap_alone) if opening.law == "both" else (orifice,):
        sizes = []
        for decay in decays:
            flow = float(np.mean(opening.flow(unit, decay.first, decay.second)))
            scatter = float(np.std(np.diff((decay.first, decay.second)[decay.changing])))
            change = max(decay.changes[decay.changing], _SCATTER_OF_CHANGE * scatter, _LEAST_CHANGE)
            sizes.append(change / (rate * flow * float(decay.time[-1])))
        alone.append(float(np.mean(sizes)))
    if opening.law != "both":
        return OpeningSizes(alone[0], CRITICAL_RATIOS[0]), OpeningSizes(alone[0])
    size, gap = alone
    # The search starts from equal contributions of orifice and gap.
    return OpeningSizes(0.5 * size, beside=0.5 * gap), OpeningSizes(size, beside=gap)


def _unknowns(
    decays: tuple[ChamberDecay, ...], volume: float | None, other_volume: float | None, deviation: float
) -> list[FitVariable]:
    """Return the unknowns of closed chambers: volume ratio, initial pressures, and relaxation after filling.

    The volume ratio is left out if one chamber is a room. It has a prior if both volumes [m^3] are known, each with the
    relative standard ``deviation`` [-]. The initial pressure of a room has a prior from the samples of the room.
    """
    unknowns = list[FitVariable]()
    changes = [decay.changes for decay in decays if decay.room is None]
    if changes and volume and other_volume:
        ratio = volume / other_volume
        unknowns += tolerance(_RATIO, math.sqrt(2.0) * deviation * ratio, ratio)
    elif changes:
        unknowns.append(sought(_RATIO, max(float(np.mean([rise / fall for fall, rise in changes])), 1.0e-3), 1.0e-6))
    for decay in decays:
        for side, (sensor, values) in enumerate(decay.sensors):
            scale = max(abs(decay.changes[decay.changing]), float(np.std(np.diff(values))), _LEAST_PRESSURE)
            name = _START.format(sensor, decay.number)
            initial = sought(name, float(values[: decay.edge].mean()), _LEAST_PRESSURE, scale=scale)
            if side == decay.room:
                deviation_in_room = max(float(values.std()), _LEAST_PRESSURE)
                initial = replace(initial, start=float(values.mean()), deviation=deviation_in_room)
            unknowns.append(initial)
        for sensor, _ in decay.fitted:
            unknowns += within(_RELAXED_BY.format(sensor, decay.number), _MOST_RELAXED)
    # Only the order of magnitude of tau is known, so the variable is its logarithm.
    return [*unknowns, FitVariable(_RELAXATION, 0.0, low=-5.0, high=math.log(_RELAXED), scale=1.0, deviation=1.5)]


def _shown_pressures(
    at: Values, decays: tuple[ChamberDecay, ...], opening: Opening, paths: Paths, volume: float
) -> Floats:
    """Return the readings of the fitted sensors [Pa] over all decays, for values ``at`` of the fit variables.

        P_shown = P (1 + r exp(-t / tau)) + zero,   k = R sqrt(T_0 T) (1 + gas law) / (V (1 + volume))

    P follows from ``pressures_of_fall`` with k in place of R T / V: the flow is computed at the nominal temperature T_0
    [K], and a flow through an opening changes with 1 / sqrt(T). ``volume`` is V [m^3], tau the relaxation time [s].
    """
    gas = opening.gas
    root = gas.specific_gas_constant * np.sqrt(gas.temperature * (gas.temperature + at[TEMPERATURE]))
    rate = root * (1.0 + at[GAS_LAW]) / (volume * (1.0 + at[_VOLUME]))
    longest = max(float(decay.time[-1]) for decay in decays)
    relaxation_time = longest / _RELAXED * math.exp(at[_RELAXATION])
    shown = list[Floats]()
    for decay in decays:
        first, second = (at[_START.format(sensor, decay.number)] for sensor, _ in decay.sensors)
        ratio = at[_RATIO] if decay.room is None else 0.0 if decay.room == 1 else math.inf
        falls = pressures_of_fall(opening, paths.sizes(at), first, second, ratio, rate, decay.time)
        faded = np.exp(-decay.time / relaxation_time)
        for side, ((sensor, _), pressure) in enumerate(zip(decay.sensors, falls, strict=True)):
            if side != decay.room:
                relaxed = 1.0 + at[_RELAXED_BY.format(sensor, decay.number)] * faded
                shown.append(pressure * relaxed + at[f"zero of {sensor}"])
    return np.concatenate(shown)


def _readings(sources: tuple[RecordingSource, ...], decays: tuple[ChamberDecay, ...]) -> PooledReadings:
    """Return the samples of all decays, labelled by sensor and by half of the pressure fall."""
    series, sensors, halves = list[Floats](), list[str](), list[str]()
    for decay in decays:
        half = int(np.argmax(decay.first - decay.second < 0.5 * sum(decay.ends)))
        for sensor, values in decay.fitted:
            series.append(values)
            sensors += [sensor] * values.size
            # A wrong law gives different sizes early and late in a fall.
            halves += ["the early fall"] * half + ["the late fall"] * (values.size - half)
    counts = [decay.time.size * len(decay.fitted) for decay in decays]
    return PooledReadings(np.concatenate(series), sensors, recordings_of(sources, counts), (halves,))
