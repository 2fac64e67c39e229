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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow import (
    CRITICAL_RATIOS,
    GAS_LAW,
    LAW_NAMES,
    PRODUCT_ONLY,
    TEMPERATURE,
    FlowLaw,
    Law,
    Opening,
    OpeningSizes,
    check_both_regimes,
    gas_tolerances,
    has_both_regimes,
    is_same_gas,
    size_of,
    solve_flow,
)
from ppafo.identification.bench.law import (
    BenchContext,
    BenchResult,
    PooledReadings,
    TimedLaw,
    Values,
    halved_readings,
    recordings_of,
    reported,
    result_of,
    solve,
    sought,
    tolerance,
    within,
)
from ppafo.identification.bench.readings import (
    check_moves,
    check_no_gap,
    check_no_wrong_reading,
    check_not_clipped,
    check_sources,
    meter_readings,
    without_wrong_samples,
)
from ppafo.identification.estimate import in_shown_unit, interval_texts
from ppafo.identification.fit import Fit
from ppafo.identification.least_squares import FitNumber
from ppafo.identification.source import RecordingSource, pool, window
from ppafo.identification.tolerances import Tolerances
from ppafo.model.declaration import Number
from ppafo.parameters.device import VANE
from ppafo.parameters.records import keyed
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.faults import plateaus, stands_out
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

CHANNELS = ("pressure_1", "pressure_2")
MINIMUM_SAMPLES = 20
"""Least number of samples of a decay."""
EDGE = 20
"""Largest number of samples averaged at an end of a record for a start value, at most a tenth of the record."""
STANDS_STILL = 0.02
"""Largest ratio of the pressure changes of both chambers [-] at which the steadier chamber counts as a room."""
_EQUAL = 0.01
"""Pressure difference relative to the initial difference [-] below which a decay ends."""
_POINTS = 400
"""Number of pressure differences at which the time of a fall is computed."""
_LOWEST = 1.0e-3
"""Final pressure difference of a computed fall, relative to the initial difference [-]."""
_LEAST_DIFFERENCE = 1.0
"""Least initial pressure difference of a computed fall [Pa]."""
_LEAST_RATE = 1.0e-300
"""Least rate of a computed fall [Pa/s], so that the pressures of tight chambers stay finite."""
RIVALS: Mapping[Law, tuple[Law, ...]] = {"both": ("iso6358",), "iso6358": ("both",)}
"""Law that a fitted law is compared with, by law."""
_CLEAR = math.log(100.0)
"""Difference of log-likelihoods [-] from which one law explains readings clearly better.

Both laws have equally many unknowns, so that no penalty differs. With the right law fitted, another law is 100 times as
likely in at most 1 of 100 recordings (Markov's inequality), as a conflict is at the level of its tests.
"""
_AT_BOUND = 1.0e-3
"""Distance of a critical ratio from its bounds [-] up to which it is at its bound."""
_SYMBOLS = {"sonic_conductance": "C", "critical_ratio": "b", "coefficient": "c"}
"""Symbols of the quantities that a sentence states, by last part of the path."""
_FEWEST_STEADY = 8
"""Least number of readings of steady flow."""
GAP = "effects.laminar_leak.coefficient"
"""Path of the coefficient of a laminar gap beside the orifice in a set."""
_GAP = reported(GAP, "kg/(s Pa^2)", "Laminar coefficient of a gap beside the orifice")
_TRIAL_RATIOS = tuple(np.linspace(*CRITICAL_RATIOS[1:], 20).tolist())
"""Critical ratios [-], the best of which starts the search for steady flow.

From the usual one, a search may end at a wrong minimum, with zeros of the sensors for the bend of the curve."""
_SHARP = 0.6
"""Discharge coefficient of a sharp-edged hole [-]."""
_NEITHER = "neither ISO 6358 nor an orifice beside a laminar gap explains the readings"
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


class ChamberDecay(NamedTuple):
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
        fall, rise = (float(np.mean(each[-edge:]) - np.mean(each[:edge])) for each in (self.first, self.second))
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


def chamber_decay(source: RecordingSource, start: float | None, end: float | None, number: int) -> ChamberDecay:
    """Return the decay between two times [s] of a recording, until the pressures are nearly equal.

    ``number`` is the number of the decay. Raises IdentificationError for a saturated sensor or too few samples.
    """
    part = window(source.recording, start, end)
    skipped = check_no_gap(source, part)
    for name in CHANNELS:
        for plateau in plateaus(part[name]):
            # Later plateaus may be the resolution of the sensor, as the pressure hardly falls any more.
            if plateau.first < EDGE and stands_out(part[name], plateau):
                source.refuse(
                    f"channel '{name}' stays at exactly {1e-3 * plateau.value:g} kPa for "
                    f"{plateau.count} samples, up to sample {skipped + plateau.last + 1}: it is saturated, or the "
                    "chamber was not yet closed"
                )
    decay = ChamberDecay(part.time, part["pressure_1"], part["pressure_2"], fuller=1, number=number)
    if not np.mean((decay.first - decay.second)[: decay.edge]) > 0.0:
        decay = decay._replace(first=decay.second, second=decay.first, fuller=2)
    difference = decay.first - decay.second
    # Between nearly equal pressures, the zero errors of the sensors outweigh the difference.
    low = np.flatnonzero(difference < _EQUAL * float(np.mean(difference[: decay.edge])))
    count = int(low[0]) if low.size else difference.size
    if count < MINIMUM_SAMPLES:
        source.refuse(
            f"only {count} samples lie between the start and equal pressures, but {MINIMUM_SAMPLES} are needed"
        )
    time = decay.time[:count] - decay.time[0]
    return decay._replace(time=time, first=decay.first[:count], second=decay.second[:count])


def pressures_of_fall(
    opening: Opening, sizes: OpeningSizes, first: float, second: float, ratio: float, rate: float, times: Floats
) -> tuple[Floats, Floats]:
    """Return both pressures [Pa] at times [s] while gas leaks between closed chambers.

        D' = -(1 + r) k g(P_1, P_2),   P_2 = P_2(0) + (D(0) - D) r / (1 + r),   P_1 = P_2 + D

    follows from the mass balance of both chambers with equation (3) at constant temperature. The time at which D is
    reached is the integral of D / D' over ln D, by the trapezoidal rule.

    Arguments:
        opening, sizes: law g [kg/s] of the leak, equations (6), (7), and its sizes
        first, second: initial absolute pressures P_1(0), P_2(0) [Pa] of the fuller chamber and the other
        ratio: r = V_1 / V_2 [-], 0 if the second chamber is a room, infinite if the first one is
        rate: k = R T / V_1 [Pa/kg], or R T / V_2 if the first chamber is a room
        times: times since the start [s]
    """
    start = max(first - second, _LEAST_DIFFERENCE)
    share_of_rise, both_chambers = (1.0, 1.0) if math.isinf(ratio) else (ratio / (1.0 + ratio), 1.0 + ratio)
    # A laminar leak falls exponentially, so that equal steps of ln D are equal steps of time.
    logs = np.linspace(0.0, -math.log(_LOWEST), _POINTS)
    difference = start * np.exp(-logs)
    lower = second + share_of_rise * (start - difference)
    flow = opening.flow(sizes, lower + difference, lower)
    time_per_log = difference / np.maximum(both_chambers * rate * flow, _LEAST_RATE)
    steps = 0.5 * (time_per_log[1:] + time_per_log[:-1]) * np.diff(logs)
    fall_times = np.concatenate(([0.0], np.cumsum(steps)))
    remaining = np.exp(np.interp(times, fall_times, np.log(difference)))
    lower = second + share_of_rise * (start - remaining)
    return lower + remaining, lower


class LawFit(NamedTuple):
    """Fit of a flow law to the readings of a leak.

    ``opening`` is the law, ``fitted`` is the fit and ``model`` the fitted readings [unit of the readings].
    ``has_both_regimes`` is True for readings with choked and subsonic flow.
    """

    opening: Opening
    fitted: Fit
    model: Floats
    has_both_regimes: bool

    @property
    def is_sound(self) -> bool:
        """True if no readings contradict the law and they determine the critical ratio, if it is sought."""
        if not self.opening.has_sought_ratio:
            return self.fitted.conflict is None
        ratio, (_, low, high) = self.fitted.by_name[self.opening.ratio_path], CRITICAL_RATIOS
        return self.fitted.conflict is None and self.has_both_regimes and low + _AT_BOUND < ratio < high - _AT_BOUND

    @property
    def has_gap(self) -> bool:
        """True for a laminar gap whose interval does not begin at zero."""
        return self.opening.law == "both" and float(self.fitted.low[1]) > 0.0

    @property
    def text(self) -> str:
        """Law with its quantities, ``law = 'iso6358' (C = 4.0e-03 L/(s bar), b = 0.40)``."""
        quantities = list[str]()
        for row, number in enumerate(self.fitted.numbers):
            name = number.path.rpartition(".")[2]
            symbol = _SYMBOLS.get(name.removesuffix("_over_volume"))
            if number.text and symbol is not None:
                ends = (float(values[row]) for values in (self.fitted.values, self.fitted.low, self.fitted.high))
                (value, unit), (low, _), (high, _) = (in_shown_unit(each, number.unit) for each in ends)
                symbol = f"{symbol}/V" if name.endswith("_over_volume") else symbol
                text = "0" if symbol[0] == "c" and not self.has_gap else interval_texts(value, low, high)[0]
                quantities.append(f"{symbol} = {text} {unit}".rstrip(" -"))
        return f"law = '{self.opening.law}' ({', '.join(quantities)})"


@dataclass(frozen=True, kw_only=True)
class VaneLeakProblem(FlowLaw, TimedLaw):
    """Table of procedure vane-leak: area, conductance or laminar coefficient from decaying pressure or steady flow.

    Of ``vane-leak-steady`` the recordings are of steady flow, as those of the experiment of the bench.
    """

    needed = CHANNELS
    steady = ("vane-leak-steady",)
    kind: Literal["vane-leak", "vane-leak-steady"]
    angle: float | None = keyed(Number("rad", "vane angle, from which the set's volumes follow"), None)
    law: Law = keyed(
        "flow law; an orifice in the form of the set; 'iso6358': C and b; 'both': orifice and laminar gap", "orifice"
    )
    volume_1: float | None = keyed(
        Number(
            "m^3",
            "volume of chamber 1 with its line, '40 cm^3'; known to 5 %, or to bench.held",
            minimum=0.0,
            minimum_allowed=False,
        ),
        None,
    )
    volume_2: float | None = keyed(
        Number("m^3", "volume of chamber 2 with its line", minimum=0.0, minimum_allowed=False), None
    )

    def volumes_of(self, context: BenchContext) -> tuple[float | None, float | None, float]:
        """Return both chamber volumes [m^3], stated or from the angle, and their relative standard deviation [-].

        Equations (4), (5): V1 = V_dead1 + v (theta - theta_min) and V2 = V_dead2 + v (theta_max - theta), with v the
        displacement per radian [m^3/rad].
        """
        first, second, angle = self.volume_1, self.volume_2, self.angle
        deviation = context.tolerances.deviation_of("actuator.dead_volume_1", 1.0, 0.0)
        if angle is not None:
            if context.parameter_set.actuator_kind != VANE:
                raise IdentificationError(f"{context.label}: angle is for a vane; allowed: volume_1, volume_2")
            names = ("angle_min", "angle_max", "displacement_per_radian", "dead_volume_1", "dead_volume_2")
            lower, upper, per_angle, dead_1, dead_2 = context.numbers(*(f"actuator.{name}" for name in names))
            if not lower <= angle <= upper:
                raise IdentificationError(
                    f"{context.label}: angle = {angle:.4g} rad lies beyond the stops, {lower:.4g} to {upper:.4g} rad"
                )
            # A volume that is given counts before one from the angle: its line may be another one.
            first = first or dead_1 + per_angle * (angle - lower)
            second = second or dead_2 + per_angle * (upper - angle)
            of_volume = context.deviation("actuator.dead_volume_1", dead_1, "m^3")
            of_angle = (angle - lower) * context.deviation("actuator.displacement_per_radian", per_angle, "m^3/rad")
            deviation = math.hypot(of_volume, of_angle) / (dead_1 + per_angle * (angle - lower))
        return first, second, deviation

    def run(self, sources: tuple[RecordingSource, ...], context: BenchContext) -> BenchResult:
        """Identify the leak: A_leak [m^2], C [m^3/(s Pa)] or a laminar coefficient [kg/(s Pa^2)]; equations (6), (7).

        Recordings with a ``mass_flow`` are steady: the flow that maintains the pressure, at several pressures. The laws
        ``iso6358`` and ``both`` are compared with each other: the values of one hold for this model only if the other
        one explains the readings clearly better. Raises IdentificationError for recordings that do not determine it.
        """
        volumes, gas = self.volumes_of(context), self.gas_of(sources, context)
        discharge_coefficient, critical_ratio = (
            context.number(f"actuator.leak.{name}") for name in ("discharge_coefficient", "critical_ratio")
        )
        laws, of_set = list[Opening](), None
        if discharge_coefficient:
            text = (
                f"Area of the leak with Cd = {discharge_coefficient:g} of the set; only the product Cd A is "
                f"identified: a sharp-edged hole, of Cd = {_SHARP:g}, would have {discharge_coefficient / _SHARP:.3g} "
                "times this area"
            )
            of_set = reported("actuator.leak.area", "m^2", text)
        for each in (self.law, *RIVALS.get(self.law, ())):
            # An orifice has the form of the set; the law ``iso6358`` seeks b.
            form: Law = "iso6358" if each == "orifice" and critical_ratio is not None else each
            known_ratio = None if each == "iso6358" else critical_ratio
            size = size_of("leak", "actuator.leak", form, known_ratio, of_set)
            laws.append(Opening(gas, form, discharge_coefficient or PRODUCT_ONLY, known_ratio, size, _GAP))
        if self.kind in self.steady or all("mass_flow" in source.recording for source in sources):
            result = _steady_leak(sources, laws, context.tolerances, self.confidence)
        else:
            window = self.start, self.end
            result = _closed_leak(sources, window, laws, volumes, context.tolerances, self.confidence)
        own = context.number("gas.molar_mass")
        gap = next((each for each in result.estimates if each.path == GAP and each.is_usable and each.value), None)
        if gap is None or own is None or is_same_gas(own, gas.molar_mass):
            return result
        # The flow of a laminar gap goes with 1 / (R T viscosity), that of an orifice needs no viscosity.
        remark = f"{GAP} is not written to the set, whose gas is not that of the bench and has another viscosity"
        of_bench = replace(gap, path="vane_leak.laminar_coefficient")
        estimates = tuple(of_bench if item is gap else item for item in result.estimates)
        return replace(result, estimates=estimates, remarks=(*result.remarks, remark))


def _steady_leak(
    sources: tuple[RecordingSource, ...],
    laws: Sequence[Opening],
    tolerances: Tolerances,
    confidence: float,
) -> BenchResult:
    """Identify the leak from steady flow at several pressures, which separate the zero of the flow meter."""
    channels = (*CHANNELS, "mass_flow")
    check_sources(sources, channels, _FEWEST_STEADY, moving=("mass_flow",), absolute=CHANNELS)
    for source in sources:
        check_not_clipped(source, "mass_flow", "pressure_1", source.recording["pressure_1"])
    first, second, flow = (pool(sources, name) for name in channels)
    check_no_wrong_reading(sources, "mass_flow", (first, second), np.ones(flow.size, dtype=bool))
    flow, is_possible, remarks = meter_readings(sources, first - second, tolerances.zero_of_flow)
    first, second, flow = first[is_possible], second[is_possible], flow[is_possible]
    labels = np.array(recordings_of(sources))[is_possible].tolist()
    difference = first - second
    # A wrong law gives different sizes at low and at high pressures.
    is_high = difference > np.median(difference)
    halves = np.where(is_high, "flow at higher pressures", "flow at lower pressures").tolist()
    pressures = {"pressure_1": first, "pressure_2": second}
    readings = PooledReadings(flow, ["mass_flow"] * flow.size, labels, (halves,))
    ratio, fits = np.minimum(first, second) / np.maximum(first, second), list[LawFit]()
    if laws[0].has_sought_ratio:
        check_both_regimes(ratio, sources[0])
    for opening in laws:
        fitted, model = solve_flow(opening, pressures, readings, tolerances, confidence, _TRIAL_RATIOS)
        fits.append(LawFit(opening, fitted, model, has_both_regimes(ratio)))
    chosen = fits[0]
    scatter = float(np.std(flow - chosen.model) / np.abs(flow).max())
    curve = curve_mark(LAW_NAMES[chosen.opening.law], difference, chosen.model)
    marks = readings_mark("measured", difference, flow), curve
    axes = Kind("Pressure difference", "Pa_d", "pressure change"), Kind("Flow", "kg/s", "mass flow")
    return _compared(
        sources,
        fits,
        f"{flow.size} steady readings; scatter {scatter:.2%} of the largest flow",
        with_residuals("Steady leak", *axes, marks, difference, flow - chosen.model),
        remarks,
        scatter,
    )


def _compared(
    sources: tuple[RecordingSource, ...],
    fits: list[LawFit],
    summary: str,
    panels: tuple[Panel, ...],
    remarks: tuple[str, ...],
    scatter: float = math.nan,
) -> BenchResult:
    """Return the result of the first of ``fits``, with the verdicts that its rival allows if there is one.

    If the rival explains the readings clearly better, that is a conflict. If neither does, a remark says so, and values
    that depend on whether there is a gap hold for this model only.
    """
    chosen, rival = fits[0], fits[-1]
    advantage = rival.fitted.log_likelihood - chosen.fitted.log_likelihood
    reason = "" if rival is chosen or (rival.is_sound and advantage > -_CLEAR) else _NEITHER
    result = result_of(sources, chosen.fitted, summary, panels, reason, remarks, scatter)
    if rival is chosen:
        return result
    if advantage >= _CLEAR:
        better = (
            f"{rival.text} explains the readings better than law = '{chosen.opening.law}' (log-likelihood higher by "
            f"{advantage:.1f})"
        )
        unexplained = result.conflict or f"{better}, but not all of them"
        return result.for_this_model_only(better if rival.is_sound else unexplained)
    with_gap = rival if chosen.opening.has_sought_ratio else chosen
    if (
        advantage <= -_CLEAR
        or not any(estimate.is_usable and estimate.value > 0.0 for estimate in result.estimates)
        or result.conflict
        or rival.fitted.conflict is not None
        # Without a gap, an orifice with the set's b is ISO 6358 with another b.
        or (with_gap.opening.critical_ratio is not None and not with_gap.has_gap)
    ):
        return result
    remark = (
        f"the readings do not tell law = '{chosen.opening.law}' from {rival.text}: the log-likelihoods differ by "
        f"{abs(advantage):.1f}, less than {_CLEAR:.1f}"
    )
    result = replace(result, remarks=(*result.remarks, remark))
    # Without a gap, both laws are an orifice.
    return result.for_this_model_only("") if with_gap.has_gap else result


def _closed_leak(
    sources: tuple[RecordingSource, ...],
    window: tuple[float | None, float | None],
    laws: Sequence[Opening],
    volumes: tuple[float | None, float | None, float],
    tolerances: Tolerances,
    confidence: float,
) -> BenchResult:
    """Identify the leak from the pressures in closed chambers between two times [s], the ``window``.

    ``volumes`` are V of chambers 1 and 2 [m^3], and their relative standard deviation [-].
    """
    check_sources(sources, CHANNELS, MINIMUM_SAMPLES)
    sources, remarks = without_wrong_samples(sources, CHANNELS, *window)
    check_sources(sources, CHANNELS, MINIMUM_SAMPLES, absolute=CHANNELS)
    for source in sources:
        # A chamber that is open to the room has a constant pressure.
        check_moves(source, max(CHANNELS, key=lambda name: float(np.ptp(source.recording[name]))))
    decays = tuple(chamber_decay(source, *window, number) for number, source in enumerate(sources, start=1))
    if len({(decay.fuller, decay.changing) for decay in decays}) > 1:
        raise IdentificationError("chamber 1 empties in some recordings and chamber 2 in others, which are two leaks")
    # The chamber whose pressure determines the leak empties, or fills from a room.
    chamber = decays[0].fuller if decays[0].changing == 0 else 3 - decays[0].fuller
    first, second, volume_deviation = volumes
    volume, other_volume = (first, second) if chamber == 1 else (second, first)
    ratio = np.concatenate([decay.second / decay.first for decay in decays])
    if laws[0].has_sought_ratio:
        check_both_regimes(ratio, sources[0])
    assumed_volume = volume or _UNIT_VOLUME
    if volume is None:
        over = partial(_over_volume, chamber=chamber)
        laws = [replace(item, known=PRODUCT_ONLY, size=over(item.size), gap=over(item.gap)) for item in laws]
    others = (
        *_unknowns(decays, volume, other_volume, volume_deviation),
        *gas_tolerances(laws[0].gas, tolerances),
        *tolerance(_VOLUME, volume_deviation if volume else 0.0),
        *(zero for sensor, _ in decays[0].sensors for zero in within(f"zero of {sensor}", tolerances.zero_of_pressure)),
    )
    # A wrong law gives different sizes early and late in a fall.
    halves = (int(np.argmax(decay.first - decay.second < 0.5 * sum(decay.ends))) for decay in decays)
    parts = zip(halves, (decay.fitted for decay in decays), strict=True)
    readings, fits = halved_readings(sources, parts, ("the early fall", "the late fall")), list[LawFit]()
    for opening in laws:
        shown = partial(_shown_pressures, decays=decays, opening=opening, volume=assumed_volume)
        unknowns = opening.unknowns(*_rough_sizes(decays, opening, assumed_volume))
        fitted, model = solve(shown, readings, (*unknowns, *others), confidence)
        fits.append(LawFit(opening, fitted, model, has_both_regimes(ratio)))
    model = fits[0].model
    times = [decay.time for decay in decays for _ in decay.fitted]
    time, models = np.concatenate(times), np.split(model, np.cumsum([values.size for values in times])[:-1])
    # The legend names the first curve only.
    names = [LAW_NAMES[laws[0].law], *[""] * (len(times) - 1)]
    marks = [readings_mark("measured", time, readings.measured)]
    marks += [curve_mark(*curve) for curve in zip(names, times, models, strict=True)]
    if all(decay.room is not None for decay in decays):
        remarks = (*remarks, f"the pressure in chamber {3 - chamber} is constant, so it is treated as a reservoir")
    longest = max(float(decay.time[-1]) for decay in decays)
    fall = max(1.0 - last / first for first, last in (decay.ends for decay in decays))
    return _compared(
        sources,
        fits,
        f"{count_of(len(decays), 'decay')} of up to {longest:.3g} s; the pressure difference falls by {fall:.1%}",
        with_residuals(
            "Closed chambers", TIME, Kind("Pressure", "Pa_a", "pressure"), marks, time, readings.measured - model
        ),
        remarks,
    )


def _over_volume(size: FitNumber, chamber: int) -> FitNumber:
    """Return the reported size of the leak divided by the unknown volume of a chamber."""
    text = f"{size.text.partition(' with')[0]} over the volume of chamber {chamber}, which is not known"
    if size.unit == "m^2":
        return reported("vane_leak.area_over_volume", "1/m", text)
    return reported(f"vane_leak.{size.path.split('.')[-1]}_over_volume", f"{size.unit[:-1]} m^3)", text)


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
) -> list[FitNumber]:
    """Return the unknowns of closed chambers: volume ratio, initial pressures, and relaxation after filling.

    The volume ratio is left out if one chamber is a room. It has a prior if both volumes [m^3] are known, each with the
    relative standard ``deviation`` [-]. The initial pressure of a room has a prior from the samples of the room.
    """
    unknowns = list[FitNumber]()
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
    return [*unknowns, FitNumber(_RELAXATION, 0.0, low=-5.0, high=math.log(_RELAXED), scale=1.0, deviation=1.5)]


def _shown_pressures(at: Values, decays: tuple[ChamberDecay, ...], opening: Opening, volume: float) -> Floats:
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
        falls = pressures_of_fall(opening, opening.sizes(at), first, second, ratio, rate, decay.time)
        faded = np.exp(-decay.time / relaxation_time)
        for side, ((sensor, _), pressure) in enumerate(zip(decay.sensors, falls, strict=True)):
            if side != decay.room:
                relaxed = 1.0 + at[_RELAXED_BY.format(sensor, decay.number)] * faded
                shown.append(pressure * relaxed + at[f"zero of {sensor}"])
    return np.concatenate(shown)
