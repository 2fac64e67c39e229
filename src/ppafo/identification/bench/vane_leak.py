"""Leak across the vane or the piston, from closed chambers or steady flow: area, conductance or laminar coefficient.

    steady     m = g(P_1, P_2)
    closed     D' = -(1 + V_1/V_2) (R T / V_1) g(P_1, P_2),   D = P_1 - P_2,   V_1 P_1 + V_2 P_2 = constant

g is the mass flow [kg/s] of a law of ``flow``, equations (6), (7): Cd A_leak of an orifice, C of ISO 6358 or a laminar
coefficient; P_1 and P_2 are the absolute pressures [Pa] of the fuller chamber and the other, V_1 and V_2 their volumes
[m^3], equation (3) at constant temperature. The time to fall from one D to another is an integral over D, computed once
per law. A chamber with constant pressure is treated as the surrounding room. Just after filling, gas and walls are not
yet in equilibrium: each pressure has an initial error P r exp(-t / tau). Volumes, temperature and law of the gas, r and
tau, and zeros of the sensors are tolerances; for steady flow also the gains. A gain common to both sensors does not
change the rate at which D falls.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.checks import check_moves, check_no_gap, check_not_clipped, check_sources
from ppafo.identification.bench.flow import (
    GAS_LAW,
    NEXT_LAW,
    TEMPERATURE,
    GasAt,
    Law,
    Opening,
    OpeningSizes,
    Paths,
    gas_tolerances,
    solve_flow,
)
from ppafo.identification.bench.law import PooledReadings, Values, recordings_of, solve, sought, tolerance, within
from ppafo.identification.bench.result import BenchResult, ReportedNumber, result_of
from ppafo.identification.bench.wrong_readings import check_no_wrong_reading, meter_readings, without_wrong_samples
from ppafo.identification.residuals import FitVariable
from ppafo.identification.source import RecordingSource, pool, window
from ppafo.identification.tolerances import DEFAULTS, HELD, Tolerances
from ppafo.report.kind import TIME, Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.faults import plateaus, stands_out
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.wording import count_of

PROCEDURE = "vane-leak"
LAMINAR = "effects.laminar_leak.coefficient"
CHANNELS = ("pressure_1", "pressure_2")
STEADY = (*CHANNELS, "mass_flow")
MINIMUM_SAMPLES, _FEWEST_STEADY = 20, 8
EDGE = 20
"""Largest number of samples averaged at an end of a record for a start value, at most a tenth of the record."""

STANDS_STILL = 0.02
"""Largest ratio of the pressure changes of both chambers [-] at which the steadier chamber counts as a room."""
_NEARLY_EQUAL = 0.01
_RATIO, _VOLUME, _RELAXATION = "ratio of the volumes", "volume", "time of the relaxation"
_START, _RELAXED_BY = "start of {}, decay {}", "relaxation of {}, decay {}"
"""Names of the variables for initial pressure [Pa] and relative error after filling [-], by channel and decay."""
_RELAXED, _MOST_RELAXED = 5.0, 0.02
"""Usual ratio of recording length to relaxation time [-], and largest relative pressure error from relaxation [-]."""
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
    law: Literal["orifice", "laminar", "both"] = "orifice",
    tolerances: Tolerances = DEFAULTS,
    volume_deviation: float = deviation_of_limit(HELD["actuator.dead_volume_1"]),
) -> BenchResult:
    """Identify the leak: A_leak [m^2], C [m^3/(s Pa)] or a laminar coefficient [kg/(s Pa^2)]; equations (6), (7).

    Recordings with a ``mass_flow`` are steady: the flow that maintains the pressure, at several pressures.

    Arguments:
        sources: recordings of both chamber pressures
        gas: gas of the bench
        volume_1, volume_2: chamber volumes [m^3]; without the volume of the emptying chamber, area over volume is found
        discharge_coefficient: Cd [-], with which an orifice gives an area; None for the product Cd A
        start, end: samples used of closed chambers [s]
        confidence: confidence level of the intervals [-]
        critical_ratio: b of ISO 6358 [-], which selects the sonic conductance
        law: ``laminar`` for a laminar coefficient, ``both`` for a laminar gap in parallel with the orifice
        tolerances: limits of the errors of the bench
        volume_deviation: relative standard deviation of a volume [-]

    Returns:
        the estimates with intervals and verdicts, a summary and two panels

    Raises:
        IdentificationError: recordings that do not determine the leak; names file, sample and remedy
    """
    form: Law = law if law != "orifice" or critical_ratio is None else "iso6358"
    opening = Opening(gas, form, discharge_coefficient or 1.0, critical_ratio)
    size = _size(opening, discharge_coefficient)
    if sources and all("mass_flow" in source.recording for source in sources):
        return _steady_leak(sources, opening, size, tolerances, confidence)
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES)
    sources, remarks = without_wrong_samples(sources, PROCEDURE, CHANNELS, start, end)
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES, absolute=CHANNELS)
    for source in sources:
        # One of them may be of a room.
        check_moves(source, PROCEDURE, max(CHANNELS, key=lambda name: float(np.ptp(source.recording[name]))))
    decays = tuple(closed_chambers(source, start, end, number) for number, source in enumerate(sources, start=1))
    if len({(item.fuller, item.changing) for item in decays}) > 1:
        raise IdentificationError(
            "chamber 1 empties in some recordings and chamber 2 in others; give each chamber its own [[procedure]]"
        )
    volumes = volume_1, volume_2
    result = _decaying_leak(sources, decays, opening, size, volumes, volume_deviation, tolerances, confidence)
    return replace(result, remarks=(*remarks, *result.remarks))


def _size(opening: Opening, discharge_coefficient: float | None) -> ReportedNumber:
    """Return the reported size of the leak: path in a set, unit and description."""
    if opening.law == "laminar":
        return ReportedNumber("vane_leak.laminar_coefficient", "kg/(s Pa^2)", "Laminar coefficient of the leak")
    if opening.critical_ratio is not None:
        text = f"Sonic conductance of the leak with the set's b = {opening.critical_ratio:g}"
        return ReportedNumber("actuator.leak.sonic_conductance", "m^3/(s Pa)", text)
    if discharge_coefficient:
        text = f"Area of the leak with Cd = {discharge_coefficient:g}; only the product Cd A is identified"
        return ReportedNumber("actuator.leak.area", "m^2", text)
    return ReportedNumber("vane_leak.effective_area", "m^2", "Effective area Cd A of the leak")


class _ClosedChambers(NamedTuple):
    """Decay of the pressures in two closed chambers.

    ``time`` is in s; ``first`` and ``second`` are the pressures [Pa] of the fuller chamber and the other; ``fuller`` is
    the number of the fuller chamber, 1 or 2; ``number`` is the number of the decay.
    """

    time: Floats
    first: Floats
    second: Floats
    fuller: int
    number: int

    @property
    def edge(self) -> int:
        """Number of samples averaged at an end of the decay."""
        return max(1, min(EDGE, self.time.size // 10))

    @property
    def changes(self) -> tuple[float, float]:
        """Fall of the pressure in the fuller chamber, and rise in the other chamber [Pa]."""
        edge = self.edge
        fall, rise = (
            float(np.mean(pressure[-edge:]) - np.mean(pressure[:edge])) for pressure in (self.first, self.second)
        )
        return -fall, rise

    @property
    def room(self) -> int | None:
        """Index of the constant pressure, 0 for the fuller chamber and 1 for the other; None if both change."""
        fall, rise = (abs(change) for change in self.changes)
        if rise <= STANDS_STILL * fall:
            return 1
        return 0 if fall <= STANDS_STILL * rise else None

    @property
    def changing(self) -> int:
        """Index of the changing pressure that determines the leak: 0 for the fuller chamber, 1 for the other."""
        return 1 if self.room == 0 else 0

    @property
    def sensors(self) -> tuple[tuple[str, Floats], tuple[str, Floats]]:
        """Channels of the fuller and the other chamber, with their pressures [Pa]."""
        return (f"pressure_{self.fuller}", self.first), (f"pressure_{3 - self.fuller}", self.second)

    @property
    def fitted(self) -> list[tuple[str, Floats]]:
        """Fitted channels with their pressures [Pa]; the constant pressure of a room is not fitted."""
        return [sensor for side, sensor in enumerate(self.sensors) if side != self.room]

    @property
    def ends(self) -> tuple[float, float]:
        """Pressure difference at the start and at the end [Pa], each from a straight line through the edge samples.

        A mean over the edge instead would underestimate the fall.
        """
        edge, difference = self.edge, self.first - self.second
        if edge < 2:
            return float(difference[0]), float(difference[-1])
        start = np.polyfit(self.time[:edge] - self.time[0], difference[:edge], 1)[1]
        end = np.polyfit(self.time[-edge:] - self.time[-1], difference[-edge:], 1)[1]
        return float(start), float(end)

    def numbers(self) -> Iterator[FitVariable]:
        """Yield the unknowns: initial pressures, with a prior in a room, and relaxation after filling."""
        for side, (sensor, values) in enumerate(self.sensors):
            size = max(abs(self.changes[self.changing]), float(np.std(np.diff(values))), 1.0)
            initial = sought(_START.format(sensor, self.number), float(values[: self.edge].mean()), 1.0, scale=size)
            if side == self.room:
                initial = replace(initial, start=float(values.mean()), deviation=max(float(values.std()), 1.0))
            yield initial
        for sensor, _ in self.fitted:
            yield from within(_RELAXED_BY.format(sensor, self.number), _MOST_RELAXED)

    def halves(self) -> list[str]:
        """Return for each sample the label of the early or late half of the pressure fall."""
        half = int(np.argmax(self.first - self.second < 0.5 * sum(self.ends)))
        return ["the early fall"] * half + ["the late fall"] * (self.time.size - half)


def closed_chambers(source: RecordingSource, start: float | None, end: float | None, number: int) -> _ClosedChambers:
    """Return the pressure decay of closed chambers in a recording, until the pressures are nearly equal.

    Raises IdentificationError if too few samples are left.
    """
    part = window(source.recording, start, end)
    skipped = check_no_gap(source, PROCEDURE, part)
    for name in CHANNELS:
        for plateau in plateaus(part[name]):
            # Later plateaus may be the resolution of the sensor, as the pressure hardly falls any more.
            if plateau.first < EDGE and stands_out(part[name], plateau):
                raise IdentificationError(
                    f"{source.name}: {PROCEDURE}: channel '{name}' stays at exactly {1e-3 * plateau.value:g} kPa for "
                    f"{plateau.count} samples, up to sample {skipped + plateau.last + 1}, and changes only afterwards: "
                    "the sensor is saturated, or the chamber was not yet closed; give a start after this sample"
                )
    pair = part["pressure_1"], part["pressure_2"]
    edge = max(1, min(EDGE, len(part) // 10))
    fuller = 1 if np.mean((pair[0] - pair[1])[:edge]) > 0.0 else 2
    first, second = pair if fuller == 1 else pair[::-1]
    difference = first - second
    # Near equal pressures the zeros of the sensors are all that is left.
    low = np.flatnonzero(difference < _NEARLY_EQUAL * float(np.mean(difference[:edge])))
    last = int(low[0]) if low.size else difference.size
    if last < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last} samples lie between the start and equal pressures, but "
            f"{MINIMUM_SAMPLES} are needed; record at a higher sample rate, or give a start at which the pressures "
            "differ"
        )
    time = part.time[:last] - part.time[0]
    return _ClosedChambers(time=time, first=first[:last], second=second[:last], fuller=fuller, number=number)


_POINTS = 400
_LOWEST = 1.0e-3
"""Final pressure difference of a computed fall, relative to the initial difference [-]."""


def pressures_of_fall(
    opening: Opening, sizes: OpeningSizes, first: float, second: float, ratio: float, rate: float, times: Floats
) -> tuple[Floats, Floats]:
    """Return both pressures [Pa] at times [s] while gas leaks between closed chambers.

    ``sizes`` are the sizes of the opening, ``first`` and ``second`` the initial pressures [Pa]. ``ratio`` is V1/V2 [-]:
    0 if the second side is a room, infinite if the first is. ``rate`` is R T / V1 [Pa/kg], or R T / V2 if the first
    side is a room.
    """
    start = max(first - second, 1.0)
    # Parts of the difference by which the second pressure rises, and 1 less that by which the first one falls.
    rises = 1.0 if math.isinf(ratio) else ratio / (1.0 + ratio)
    quickened = 1.0 if math.isinf(ratio) else 1.0 + ratio
    # Even in the logarithm, as a laminar fall is in time.
    logs = np.linspace(0.0, -math.log(_LOWEST), _POINTS)
    difference = start * np.exp(-logs)
    lower = second + rises * (start - difference)
    flow = opening.flow(sizes, lower + difference, lower)
    slowness = difference / np.maximum(quickened * rate * flow, 1.0e-300)
    steps = 0.5 * (slowness[1:] + slowness[:-1]) * np.diff(logs)
    fall_times = np.concatenate(([0.0], np.cumsum(steps)))
    remaining = np.exp(np.interp(times, fall_times, np.log(difference)))
    lower = second + rises * (start - remaining)
    return lower + remaining, lower


def _decaying_leak(
    sources: tuple[RecordingSource, ...],
    decays: tuple[_ClosedChambers, ...],
    opening: Opening,
    size: ReportedNumber,
    volumes: tuple[float | None, float | None],
    volume_deviation: float,
    tolerances: Tolerances,
    confidence: float,
) -> BenchResult:
    fuller = decays[0].fuller
    # The chamber whose pressure says how much leaks: the one that empties, or that fills from a room.
    chamber = fuller if decays[0].changing == 0 else 3 - fuller
    volume, other_volume = volumes if chamber == 1 else volumes[::-1]
    if volume is None:
        # Only the ratio of the size to the volume is known.
        size, opening = _over_volume(size, chamber), replace(opening, known=1.0)
    # Without one the chamber is taken to have 1 m^3.
    emptied = volume or 1.0
    paths, reported, start, alone = _sought(size, volume is not None, decays, opening, emptied)
    longest = max(float(decay.time[-1]) for decay in decays)

    def law(at: Values) -> Floats:
        gas, pressures = opening.gas, list[Floats]()
        # Flow goes with 1 / sqrt(T), the pressure that it makes with T.
        warm = gas.specific_gas_constant * np.sqrt(gas.temperature * (gas.temperature + at[TEMPERATURE]))
        rate = warm * (1.0 + at[GAS_LAW]) / (emptied * (1.0 + at[_VOLUME]))
        relaxed = longest / _RELAXED * math.exp(at[_RELAXATION])
        for decay in decays:
            first, second = (at[_START.format(sensor, decay.number)] for sensor, _ in decay.sensors)
            ratio = at[_RATIO] if decay.room is None else 0.0 if decay.room == 1 else math.inf
            falls = pressures_of_fall(opening, paths.sizes(at), first, second, ratio, rate, decay.time)
            faded = np.exp(-decay.time / relaxed)
            for side, ((sensor, _), pressure) in enumerate(zip(decay.sensors, falls, strict=True)):
                if side != decay.room:
                    offset = 1.0 + at[_RELAXED_BY.format(sensor, decay.number)] * faded
                    pressures.append(pressure * offset + at[f"zero of {sensor}"])
        return np.concatenate(pressures)

    numbers = (
        *paths.sought(start, alone),
        *_ratio(decays, volume, other_volume, volume_deviation),
        *(number for decay in decays for number in decay.numbers()),
        # Of the logarithm of a time, for only its order of magnitude is known.
        FitVariable(_RELAXATION, 0.0, -5.0, math.log(_RELAXED), 1.0, 1.5),
        *gas_tolerances(opening.gas, tolerances),
        *tolerance(_VOLUME, volume_deviation if volume else 0.0),
        *(zero for sensor, _ in decays[0].sensors for zero in within(f"zero of {sensor}", tolerances.zero_of_pressure)),
    )
    series = [(sensor, values, decay) for decay in decays for sensor, values in decay.fitted]
    readings = PooledReadings(
        np.concatenate([values for _, values, _ in series]),
        [sensor for sensor, values, _ in series for _ in range(values.size)],
        recordings_of(sources, [decay.time.size * len(decay.fitted) for decay in decays]),
        # A law that is wrong parts early from late falls.
        ([half for _, _, decay in series for half in decay.halves()],),
    )
    fitted, model = solve(law, readings, numbers, confidence)
    times = [decay.time for _, _, decay in series]
    time, models = np.concatenate(times), np.split(model, np.cumsum([values.size for values in times])[:-1])
    marks = [readings_mark("measured", time, readings.measured)]
    # The legend names the first curve only.
    names = [opening.law, *[""] * (len(times) - 1)]
    marks += [curve_mark(*curve) for curve in zip(names, times, models, strict=True)]
    is_room = all(decay.room is not None for decay in decays)
    room = (f"the pressure in chamber {3 - chamber} is constant, so it is treated as a reservoir",) if is_room else ()
    fall = max(1.0 - last / first for first, last in (decay.ends for decay in decays))
    return result_of(
        PROCEDURE,
        sources,
        fitted,
        reported,
        f"{count_of(len(decays), 'decay')} of up to {longest:.3g} s; the pressure difference falls by {fall:.1%}",
        with_residuals(
            "Closed chambers", TIME, Kind("Pressure", "Pa_a", "pressure"), marks, time, readings.measured - model
        ),
        _REMEDY.format(NEXT_LAW[opening.law]),
        room,
    )


def _over_volume(size: ReportedNumber, fuller: int) -> ReportedNumber:
    """Return the reported leak divided by the unknown volume of the chamber it empties."""
    text = f"{size.text.partition(' with')[0]} over the volume of chamber {fuller}, which is not known"
    if size.unit == "m^2":
        return ReportedNumber("vane_leak.area_over_volume", "1/m", text)
    return ReportedNumber(f"vane_leak.{size.path.split('.')[-1]}_over_volume", f"{size.unit[:-1]} m^3)", text)


def _ratio(
    decays: tuple[_ClosedChambers, ...], volume: float | None, other: float | None, deviation: float
) -> tuple[FitVariable, ...]:
    """Return the chamber volume ratio as unknown, or with a prior for known volumes [m^3]; empty with a room."""
    changes = [decay.changes for decay in decays if decay.room is None]
    if not changes:
        return ()
    if volume and other:
        return tolerance(_RATIO, math.sqrt(2.0) * deviation * (volume / other), volume / other)
    return (sought(_RATIO, max(float(np.mean([rise / fall for fall, rise in changes])), 1.0e-3), 1.0e-6),)


def _sought(
    size: ReportedNumber, has_volume: bool, decays: tuple[_ClosedChambers, ...], opening: Opening, emptied: float
) -> tuple[Paths, tuple[ReportedNumber, ...], OpeningSizes, OpeningSizes]:
    """Return paths, reported quantities, start sizes, and sizes of each part alone, for closed chambers."""
    gas = opening.gas
    rate = gas.specific_gas_constant * gas.temperature / emptied
    rough = _rough_size(decays, opening, OpeningSizes(1.0), rate)
    if opening.law != "both":
        return Paths(size.path), (size,), OpeningSizes(rough), OpeningSizes(rough)
    laminar = _rough_size(decays, opening, OpeningSizes(0.0, beside=1.0), rate)
    beside = replace(_beside(has_volume), size=laminar)
    # Half of the fall each: the search finds how much of it is whose.
    start, alone = OpeningSizes(0.5 * rough, beside=0.5 * laminar), OpeningSizes(rough, beside=laminar)
    return Paths(size.path, beside=beside.path), (replace(size, size=rough), beside), start, alone


def _beside(has_volume: bool) -> ReportedNumber:
    """Return the reported laminar gap parallel to an orifice, divided by the chamber volume if that is unknown."""
    text = "Laminar coefficient of a gap beside the orifice"
    if has_volume:
        return ReportedNumber(LAMINAR, "kg/(s Pa^2)", text)
    return ReportedNumber("vane_leak.coefficient_over_volume", "kg/(s Pa^2 m^3)", f"{text}, over the volume")


def _rough_size(decays: tuple[_ClosedChambers, ...], opening: Opening, unit: OpeningSizes, rate: float) -> float:
    """Return the multiple of ``unit`` whose flow gives the mean rate of the pressure change."""
    sizes = []
    for item in decays:
        flow = float(np.mean(opening.flow(unit, item.first, item.second)))
        scatter = float(np.std(np.diff((item.first, item.second)[item.changing])))
        # Of a chamber that holds, what its noise would hide.
        sizes.append(max(item.changes[item.changing], 0.01 * scatter, 1.0e-9) / (rate * flow * float(item.time[-1])))
    return float(np.mean(sizes))


def _steady_leak(
    sources: tuple[RecordingSource, ...],
    opening: Opening,
    size: ReportedNumber,
    tolerances: Tolerances,
    confidence: float,
) -> BenchResult:
    """Identify the leak from steady flow at several pressures, which separate the zero of the flow meter."""
    check_sources(sources, PROCEDURE, STEADY, _FEWEST_STEADY, moving=("mass_flow",), absolute=CHANNELS)
    for source in sources:
        check_not_clipped(source, PROCEDURE, "mass_flow", "pressure_1", source.recording["pressure_1"])
    first, second, flow = (pool(sources, name) for name in STEADY)
    check_no_wrong_reading(sources, PROCEDURE, "mass_flow", (first, second), np.ones(flow.size, dtype=bool))
    flow, is_possible, remarks = meter_readings(sources, PROCEDURE, first - second, tolerances.zero_of_flow)
    first, second, flow = first[is_possible], second[is_possible], flow[is_possible]
    labels = np.array(recordings_of(sources))[is_possible].tolist()
    difference = first - second
    # A leak of another law parts low from high pressures.
    is_high = difference > np.median(difference)
    halves = np.where(is_high, "flow at higher pressures", "flow at lower pressures").tolist()
    paths, reported = Paths(size.path), [size]
    if opening.law == "both":
        _, alone = opening.rough_sizes(first, second, flow)
        reported = [replace(size, size=alone.size), replace(_beside(has_volume=True), size=alone.beside)]
        paths = Paths(size.path, beside=reported[1].path)
    fitted, model = solve_flow(
        opening,
        paths,
        {"pressure_1": first, "pressure_2": second},
        PooledReadings(flow, ["mass_flow"] * flow.size, labels, (halves,)),
        tolerances,
        confidence,
    )
    scatter = float(np.std(flow - model) / np.abs(flow).max())
    marks = readings_mark("measured", difference, flow), curve_mark(opening.law, difference, model)
    axes = Kind("Pressure difference", "Pa_d", "pressure change"), Kind("Flow", "kg/s", "mass flow")
    return result_of(
        PROCEDURE,
        sources,
        fitted,
        reported,
        f"{flow.size} steady readings; scatter {scatter:.2%} of the largest flow",
        with_residuals("Steady leak", *axes, marks, difference, flow - model),
        _REMEDY.format(NEXT_LAW[opening.law]),
        remarks,
        scatter,
    )
