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
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench import flow, readings
from ppafo.identification.bench import law as bench
from ppafo.identification.bench.flow import CRITICAL_RATIOS, GAP, GAS_LAW, LAW_NAMES, TEMPERATURE, Law, Opening
from ppafo.identification.estimate import shown_text
from ppafo.identification.fit import Fit, FitNumber, tolerance
from ppafo.identification.source import RecordingSource, Sources
from ppafo.model.declaration import Number
from ppafo.model.plant import chamber_1_volume, chamber_2_volume
from ppafo.parameters.device import VANE
from ppafo.parameters.records import keyed
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import curve_mark, with_residuals
from ppafo.signals.faults import plateaus, stands_out
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

_CHAMBERS = ("pressure_1", "pressure_2")
# Least number of readings of steady flow, and of samples of a decay.
_FEWEST_STEADY = 8
_MINIMUM_SAMPLES = 20
_EDGE = 20
"""Largest number of samples averaged at an end of a record for a start value, at most a tenth of the record."""
_STANDS_STILL = 0.02
"""Largest ratio of the pressure changes of both chambers [-] at which the steadier chamber counts as a room."""
_EQUAL = 0.01
"""Pressure difference relative to the initial difference [-] below which a decay ends."""
# Number of pressure differences of a computed fall, and the last one relative to the first [-].
_POINTS = 400
_LOWEST = 1.0e-3
# Least initial pressure difference [Pa] and rate [Pa/s] of a computed fall, finite for tight chambers.
_LEAST_DIFFERENCE = 1.0
_LEAST_RATE = 1.0e-300
_RIVALS: Mapping[Law, tuple[Law, ...]] = {"both": ("iso6358",), "iso6358": ("both",)}
"""Law that a fitted law is compared with, by law."""
_CLEAR = math.log(100.0)
"""Difference of log-likelihoods [-] from which one law explains readings clearly better.

Both laws have equally many unknowns, so that no penalty differs. With the right law fitted, another law is 100 times as
likely in at most 1 of 100 recordings (Markov's inequality), as a conflict is at the level of its tests.
"""
_AT_BOUND = 1.0e-3
"""Distance of a critical ratio from its bounds [-] up to which it is at its bound."""
_TRIAL_RATIOS = tuple(np.linspace(*CRITICAL_RATIOS[1:], 20).tolist())
"""Critical ratios [-], the best of which starts the search for steady flow.

From the usual one, a search may end at a wrong minimum, with zeros of the sensors for the bend of the curve."""
_SHARP = 0.6
"""Discharge coefficient of a sharp-edged hole [-]."""
# Names of the variables for V_1/V_2 [-], relative error of the volume [-], and logarithm of tau, scaled [-].
_RATIO = "ratio of the volumes"
_VOLUME = "volume"
_RELAXATION = "time of the relaxation"
# Names of the variables for initial pressure [Pa] and relative error r after filling [-], by channel and decay.
_START = "start of {}, decay {}"
_RELAXED_BY = "relaxation of {}, decay {}"
# Usual ratio of recording length to relaxation time [-], and largest relative pressure error from relaxation [-].
_RELAXED = 5.0
_MOST_RELAXED = 0.02
_LEAST_PRESSURE = 1.0
"""Least initial pressure, least scale and least standard deviation of an initial pressure [Pa]."""
# Least pressure change for a start value: as a fraction of the noise of a tight chamber [-], and absolute [Pa].
_SCATTER_OF_CHANGE = 0.01
_LEAST_CHANGE = 1.0e-9

_Fitted = tuple[list[Fit], bool, str, tuple[Panel, ...], tuple[str, ...], float]
"""Fits, True if readings cover choked and subsonic flow, summary, panels, remarks and scatter of a leak."""


@dataclass(frozen=True, kw_only=True)
class LeakLaw(flow.FlowLaw):
    """Keys of a law of the leak: the flow law, compared with its rival where it has one."""

    law: Law = keyed(
        "flow law; an orifice in the form of the set; 'iso6358': C and b; 'both': orifice and laminar gap", "orifice"
    )

    def run(self, sources: Sources, context: bench.BenchContext) -> bench.BenchResult:
        """Identify the leak: A_leak [m^2], C [m^3/(s Pa)] or a laminar coefficient [kg/(s Pa^2)]; equations (6), (7).

        The laws ``iso6358`` and ``both`` are compared with each other: the values of one hold for this model only if
        the other one explains the readings clearly better. If neither does, a remark says so, and values that depend on
        whether there is a gap hold for this model only. Raises IdentificationError for recordings that do not
        determine it.
        """
        gas = self.gas_of(sources, context)
        of_set = None
        coefficient = context.number("actuator.leak.discharge_coefficient")
        critical_ratio = context.number("actuator.leak.critical_ratio")
        own = context.number("gas.molar_mass")
        if coefficient:
            text = (
                f"Area of the leak with Cd = {coefficient:g} of the set; only the product Cd A is identified: a "
                f"sharp-edged hole, of Cd = {_SHARP:g}, would have {coefficient / _SHARP:.3g} times this area"
            )
            of_set = FitNumber("actuator.leak.area", unit="m^2", text=text), coefficient
        openings = []
        for each in (self.law, *_RIVALS.get(self.law, ())):
            # An orifice has the form of the set; the law ``iso6358`` seeks b.
            form: Law = "iso6358" if each == "orifice" and critical_ratio is not None else each
            known_ratio = None if each == "iso6358" else critical_ratio
            openings.append(flow.opening_of("leak", "actuator.leak", gas, form, known_ratio, of_set))
        fits, has_both, summary, panels, remarks, scatter = self.leak(sources, context, openings)
        opening = openings[0]
        chosen = fits[0]
        other = openings[-1]
        rival = fits[-1]
        reason = ""
        # A critical ratio that is sought must be determined too: one of both laws seeks it.
        _, low, high = CRITICAL_RATIOS
        is_sound = rival.conflict is None and (
            not other.has_sought_ratio
            or (has_both and low + _AT_BOUND < rival.by_name[other.ratio_path] < high - _AT_BOUND)
        )
        advantage = rival.log_likelihood - chosen.log_likelihood
        if rival is not chosen and not (is_sound and advantage > -_CLEAR):
            reason = "neither ISO 6358 nor an orifice beside a laminar gap explains the readings"
        result = bench.result_of(sources, chosen, summary, panels, reason, remarks, scatter)
        if rival is not chosen:
            with_gap, fit_with_gap = (other, rival) if opening.has_sought_ratio else (opening, chosen)
            has_gap = fit_with_gap.low[1] > 0.0
            quantities = []
            for number in (number for number in rival.numbers if number.text):
                is_none = number.path == with_gap.gap.path and not has_gap
                size = shown_text(0.0 if is_none else rival.by_name[number.path], number.unit, digits=3)
                quantities.append(f"{number.path.rpartition('.')[2]} = {size}")
            named = f"law = '{other.law}' ({', '.join(quantities)})"
            if advantage >= _CLEAR:
                better = (
                    f"{named} explains the readings better than law = '{opening.law}' (log-likelihood higher by "
                    f"{advantage:.1f})"
                )
                unexplained = result.conflict or f"{better}, but not all of them"
                result = result.for_this_model_only(better if is_sound else unexplained)
            elif (
                advantage > -_CLEAR
                and any(estimate.is_usable and estimate.value > 0.0 for estimate in result.estimates)
                and not result.conflict
                and rival.conflict is None
                # Without a gap, an orifice with the set's b is ISO 6358 with another b.
                and (with_gap.critical_ratio is None or has_gap)
            ):
                remark = (
                    f"the readings do not tell law = '{opening.law}' from {named}: the log-likelihoods differ by "
                    f"{abs(advantage):.1f}, less than {_CLEAR:.1f}"
                )
                result = replace(result, remarks=(*result.remarks, remark))
                # Without a gap, both laws are an orifice.
                result = result.for_this_model_only("") if has_gap else result
        gap = next((each for each in result.estimates if each.path == GAP and each.is_usable and each.value), None)
        if gap is None or own is None or flow.is_same_gas(own, gas.molar_mass):
            return result
        # The flow of a laminar gap goes with 1 / (R T viscosity), that of an orifice needs no viscosity.
        remark = f"{GAP} is not written to the set, whose gas is not that of the bench and has another viscosity"
        of_bench = replace(gap, path="vane_leak.laminar_coefficient")
        estimates = tuple(of_bench if item is gap else item for item in result.estimates)
        return replace(result, estimates=estimates, remarks=(*result.remarks, remark))

    @abstractmethod
    def leak(self, sources: Sources, context: bench.BenchContext, openings: Sequence[Opening]) -> _Fitted:
        """Return fits of all openings, and of the first one what is reported of it."""


@dataclass(frozen=True, kw_only=True)
class SteadyLeakProblem(LeakLaw):
    """Table of procedure vane-leak-steady: the leak from the flow that maintains a pressure, at several pressures."""

    needed = (*_CHAMBERS, "mass_flow")
    steady = ("vane-leak-steady",)
    kind: Literal["vane-leak-steady"]

    def leak(self, sources: Sources, context: bench.BenchContext, openings: Sequence[Opening]) -> _Fitted:
        """Fit steady flow; several pressures separate the zero of the flow meter."""
        readings.check_sources(sources, _FEWEST_STEADY, moving=("mass_flow",), absolute=_CHAMBERS)
        for source in sources:
            readings.check_not_clipped(source, "mass_flow", "pressure_1", source.recording["pressure_1"])
        is_used = np.ones(sum(len(source.recording) for source in sources), dtype=bool)
        tolerances = context.tolerances
        is_used, zeros, at_rest = flow.readings_in_flow(sources, _CHAMBERS, is_used, tolerances, _FEWEST_STEADY)
        pressures, metered, recorded, remarks = flow.steady_readings(
            sources, _CHAMBERS, tolerances.zero_of_flow, is_used
        )
        first, second = pressures.values()
        # A wrong law gives different sizes at low and at high pressures.
        difference = first - second
        ratio = np.minimum(first, second) / np.maximum(first, second)
        is_high = difference > np.median(difference)
        groups = recorded, "mass_flow", np.where(is_high, "flow at higher pressures", "flow at lower pressures")
        has_both = flow.has_both_regimes(openings[0], ratio, sources[0])
        fits = [
            flow.solve_flow(opening, pressures, metered, groups, tolerances, self.confidence, _TRIAL_RATIOS, zeros)
            for opening in openings
        ]
        model = fits[0][1]
        scatter = float(np.std(metered - model) / np.abs(metered).max())
        series = ("measured", "measured", difference, metered, model)
        curve = LAW_NAMES[openings[0].law]
        axes = Kind("Pressure difference", "Pa_d", "pressure change"), Kind("Flow", "kg/s", "mass flow")
        panels = with_residuals("Steady leak", *axes, [series], [curve_mark(curve, difference, model)])
        summary = f"{metered.size} steady readings; scatter {scatter:.2%} of the largest flow"
        return [fit for fit, _ in fits], has_both, summary, panels, (*at_rest, *remarks), scatter


class ChamberDecay(NamedTuple):
    """Decay of the pressures in two closed chambers.

    ``time`` is in s; ``sensors`` are the pressures [Pa] by channel, that of the fuller chamber first; ``number`` is the
    number of the decay. ``changes`` are the fall of the pressure in the fuller chamber and its rise in the other [Pa],
    by channel; ``room`` is the channel of a constant pressure, empty if both change, ``changing`` that of the pressure
    that determines the leak, and ``fitted`` are the sensors without that of the room. ``edge`` is the number of samples
    averaged at an end, ``half`` the first sample with less than half of the pressure difference, ``fall`` its fall
    relative to the start [-].
    """

    time: Floats
    sensors: dict[str, Floats]
    number: int
    changes: dict[str, float]
    room: str
    changing: str
    fitted: dict[str, Floats]
    edge: int
    half: int
    fall: float


def chamber_decay(source: RecordingSource, start: float | None, end: float | None, number: int) -> ChamberDecay:
    """Return the decay between two times [s] of a recording, until the pressures are nearly equal.

    ``number`` is the number of the decay. Raises IdentificationError for a saturated sensor or too few samples.
    """
    part, skipped = readings.timed_part(source, start, end)
    for name in _CHAMBERS:
        for plateau in plateaus(part[name]):
            # Later plateaus may be the resolution of the sensor, as the pressure hardly falls any more.
            if plateau.first < _EDGE and stands_out(part[name], plateau):
                source.refuse(
                    f"channel '{name}' stays at exactly {1e-3 * plateau.value:g} kPa for {plateau.count} samples, up "
                    f"to sample {skipped + plateau.last + 1}: it is saturated, or the chamber was not yet closed"
                )
    edge = max(1, min(_EDGE, part.time.size // 10))
    is_first = np.mean((part["pressure_1"] - part["pressure_2"])[:edge]) > 0.0
    fuller, emptier = _CHAMBERS if is_first else _CHAMBERS[::-1]
    difference = part[fuller] - part[emptier]
    # Between nearly equal pressures, the zero errors of the sensors outweigh the difference.
    is_low = difference < _EQUAL * np.mean(difference[:edge])
    count = int(np.argmax(is_low)) if is_low.any() else difference.size
    readings.check_enough(source, count, _MINIMUM_SAMPLES, "samples from the start to equal pressures")
    time = part.time[:count] - part.time[0]
    difference = difference[:count]
    sensors = {name: part[name][:count] for name in (fuller, emptier)}
    edge = min(_EDGE, count // 10)
    fall, rise = (float(np.mean(values[-edge:]) - np.mean(values[:edge])) for values in sensors.values())
    room = fuller if abs(fall) <= _STANDS_STILL * abs(rise) else ""
    room = emptier if abs(rise) <= _STANDS_STILL * abs(fall) else room
    changing = emptier if room == fuller else fuller
    # By straight lines through the samples at the edges: a mean over them would underestimate the fall.
    initial = np.polyfit(time[:edge], difference[:edge], 1)[1]
    final = np.polyfit(time[-edge:] - time[-1], difference[-edge:], 1)[1]
    # The constant pressure of a room is not fitted.
    fitted = {name: values for name, values in sensors.items() if name != room}
    half = int(np.argmax(difference < 0.5 * (initial + final)))
    changes = {fuller: -fall, emptier: rise}
    return ChamberDecay(time, sensors, number, changes, room, changing, fitted, edge, half, 1.0 - final / initial)


def pressures_of_fall(
    opening: Opening, sizes: bench.Values, first: float, second: float, ratio: float, rate: float, times: Floats
) -> tuple[Floats, Floats]:
    """Return both pressures [Pa] at times [s] while gas leaks between closed chambers.

        D' = -(1 + r) k g(P_1, P_2),   P_2 = P_2(0) + (D(0) - D) r / (1 + r),   P_1 = P_2 + D

    follows from the mass balance of both chambers with equation (3) at constant temperature. The time at which D is
    reached is the integral of D / D' over ln D, by the trapezoidal rule.

    Arguments:
        opening, sizes: law g [kg/s] of the leak, equations (6), (7), and its sizes by path
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
    mass_flow = opening.flow(sizes, lower + difference, lower)
    time_per_log = difference / np.maximum(both_chambers * rate * mass_flow, _LEAST_RATE)
    steps = 0.5 * (time_per_log[1:] + time_per_log[:-1]) * np.diff(logs)
    fall_times = np.concatenate(([0.0], np.cumsum(steps)))
    remaining = np.exp(np.interp(times, fall_times, np.log(difference)))
    lower = second + share_of_rise * (start - remaining)
    return lower + remaining, lower


@dataclass(frozen=True, kw_only=True)
class VaneLeakProblem(LeakLaw, bench.TimedLaw):
    """Table of procedure vane-leak: area, conductance or laminar coefficient from decaying pressures."""

    needed = _CHAMBERS
    kind: Literal["vane-leak"]
    angle: float | None = keyed(Number("rad", "vane angle, from which the set's volumes follow"), None)
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

    def volumes_of(self, context: bench.BenchContext) -> tuple[float | None, float | None, float]:
        """Return both chamber volumes [m^3], stated or from the angle, and their relative standard deviation [-].

        Equations (4), (5): V1 = V_dead1 + v (theta - theta_min) and V2 = V_dead2 + v (theta_max - theta), with v the
        displacement per radian [m^3/rad].
        """
        first = self.volume_1
        second = self.volume_2
        angle = self.angle
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
            at_angle = chamber_1_volume(angle, lower, per_angle, dead_1)
            # A volume that is given counts before one from the angle: its line may be another one.
            first = first or at_angle
            second = second or chamber_2_volume(angle, upper, per_angle, dead_2)
            of_volume = context.deviation("actuator.dead_volume_1", dead_1)
            of_angle = (angle - lower) * context.deviation("actuator.displacement_per_radian", per_angle)
            deviation = math.hypot(of_volume, of_angle) / at_angle
        return first, second, deviation

    def leak(self, sources: Sources, context: bench.BenchContext, openings: Sequence[Opening]) -> _Fitted:
        """Fit the pressures in closed chambers."""
        if all("mass_flow" in source.recording for source in sources):
            sources[0].refuse("has a 'mass_flow': the flow that maintains a pressure is of procedure vane-leak-steady")
        volume_1, volume_2, volume_deviation = self.volumes_of(context)
        readings.check_sources(sources, _MINIMUM_SAMPLES)
        sources, remarks = readings.without_wrong_samples(sources, _CHAMBERS, self.start, self.end)
        readings.check_sources(sources, _MINIMUM_SAMPLES, absolute=_CHAMBERS)
        for source in sources:
            # A chamber that is open to the room has a constant pressure.
            readings.check_moves(source, max(_CHAMBERS, key=lambda name: np.ptp(source.recording[name])))
        decays = [chamber_decay(source, self.start, self.end, number) for number, source in enumerate(sources, start=1)]
        # The chamber whose pressure determines the leak empties, or fills from a room.
        sides = {(decay.changing, *decay.sensors) for decay in decays}
        if len(sides) > 1:
            raise IdentificationError(
                "chamber 1 empties in some recordings and chamber 2 in others, which are two leaks"
            )
        chamber = 1 + _CHAMBERS.index(decays[0].changing)
        volume, other_volume = (volume_1, volume_2) if chamber == 1 else (volume_2, volume_1)
        ratio = np.concatenate([second / first for first, second in (decay.sensors.values() for decay in decays)])
        has_both = flow.has_both_regimes(openings[0], ratio, sources[0])
        if volume is None:
            # The fitted size is then the size divided by the volume.
            openings = [
                replace(item, known=1.0, size=_over_volume(item.size, chamber), gap=_over_volume(item.gap, chamber))
                for item in openings
            ]
        others = (
            *_unknowns(decays, volume, other_volume, volume_deviation),
            *flow.gas_tolerances(openings[0].gas, context.tolerances),
            *tolerance(_VOLUME, volume_deviation if volume else 0.0),
            *bench.within(context.tolerances.zero_of_pressure, *(f"zero of {name}" for name in decays[0].sensors)),
        )
        # A wrong law gives different sizes early and late in a fall.
        parts = [(decay.half, decay.fitted) for decay in decays]
        measured, groups = bench.halved_readings(sources, parts, ("the early fall", "the late fall"))
        longest = max(decay.time[-1] for decay in decays)

        def shown(at: bench.Values, opening: Opening) -> Floats:
            """Return P (1 + r exp(-t / tau)) + zero, P by ``pressures_of_fall`` with k in place of R T / V [Pa].

            k = R sqrt(T_0 T) (1 + gas law) / (V (1 + volume)): the flow is computed at the nominal temperature T_0 [K],
            and a flow through an opening changes with 1 / sqrt(T).
            """
            gas = opening.gas
            root = gas.specific_gas_constant * np.sqrt(gas.temperature * (gas.temperature + at[TEMPERATURE]))
            rate = root * (1.0 + at[GAS_LAW]) / ((volume or 1.0) * (1.0 + at[_VOLUME]))
            relaxation_time = longest / _RELAXED * math.exp(at[_RELAXATION])
            pressures = []
            for decay in decays:
                fuller, emptier = decay.sensors
                first, second = (at[_START.format(name, decay.number)] for name in decay.sensors)
                of_volumes = {"": at[_RATIO], emptier: 0.0, fuller: math.inf}[decay.room]
                falls = pressures_of_fall(opening, at, first, second, of_volumes, rate, decay.time)
                faded = np.exp(-decay.time / relaxation_time)
                for name, pressure in zip(decay.sensors, falls, strict=True):
                    if name != decay.room:
                        relaxed = 1.0 + at[_RELAXED_BY.format(name, decay.number)] * faded
                        pressures.append(pressure * relaxed + at[f"zero of {name}"])
            return np.concatenate(pressures)

        fits = []
        for opening in openings:
            # As if each part of the leak alone caused the mean rate of the pressure change.
            rate = opening.gas.specific_gas_constant * opening.gas.temperature / (volume or 1.0)
            sizes = []
            for decay in decays:
                scatter = float(np.std(np.diff(decay.sensors[decay.changing])))
                change = max(decay.changes[decay.changing], _SCATTER_OF_CHANGE * scatter, _LEAST_CHANGE)
                first, second = decay.sensors.values()
                flows = [
                    float(np.mean(factor * shape))
                    for _, factor, shape in opening.parts(first, second, CRITICAL_RATIOS[0])
                ]
                sizes.append([change / (rate * each * decay.time[-1]) for each in flows])
            alone = [float(np.mean(of_part)) for of_part in zip(*sizes, strict=True)]
            # The search starts from equal contributions of orifice and gap.
            unknowns = opening.unknowns([size / len(alone) for size in alone], alone, CRITICAL_RATIOS[0])
            of_opening = partial(shown, opening=opening)
            fits.append(bench.solve(of_opening, measured, groups, (*unknowns, *others), self.confidence))
        # The legend names the first curve of each chamber only.
        labels = {name: name.replace("pressure_", "chamber ") for name in _CHAMBERS}
        model = fits[0][1]
        series = []
        for decay in decays:
            for sensor, values in decay.fitted.items():
                series.append((labels.pop(sensor, ""), sensor, decay.time, values, model[: values.size]))
                model = model[values.size :]
        drawn = [
            curve_mark("" if row else LAW_NAMES[openings[0].law], time, model)
            for row, (*_, time, _, model) in enumerate(series)
        ]
        if all(decay.room for decay in decays):
            remarks = (*remarks, f"the pressure in chamber {3 - chamber} is constant, so it is treated as a reservoir")
        fall = max(decay.fall for decay in decays)
        summary = (
            f"{count_of(len(decays), 'decay')} of up to {longest:.3g} s; the pressure difference falls by {fall:.1%}"
        )
        panels = with_residuals("Closed chambers", TIME, Kind("Pressure", "Pa_a", "pressure"), series, drawn)
        return [fit for fit, _ in fits], has_both, summary, panels, remarks, math.nan


def _over_volume(size: FitNumber, chamber: int) -> FitNumber:
    """Return the reported size of the leak divided by the unknown volume of a chamber."""
    text = f"{size.text.partition(' with')[0]} over the volume of chamber {chamber}, which is not known"
    path = f"vane_leak.{size.path.split('.')[-1]}_over_volume"
    unit = f"{size.unit[:-1]} m^3)"
    if size.unit == "m^2":
        path = "vane_leak.area_over_volume"
        unit = "1/m"
    return FitNumber(path, unit=unit, text=text)


def _unknowns(
    decays: Sequence[ChamberDecay], volume: float | None, other_volume: float | None, deviation: float
) -> list[FitNumber]:
    """Return the unknowns of closed chambers: volume ratio, initial pressures, and relaxation after filling.

    The volume ratio is left out if one chamber is a room. It has a prior if both volumes [m^3] are known, each with the
    relative standard ``deviation`` [-]. The initial pressure of a room has a prior from the samples of the room.
    """
    unknowns = list[FitNumber]()
    changes = [decay.changes.values() for decay in decays if not decay.room]
    if changes and volume and other_volume:
        ratio = volume / other_volume
        unknowns += tolerance(_RATIO, math.sqrt(2.0) * deviation * ratio, ratio)
    elif changes:
        ratio = max(float(np.mean([rise / fall for fall, rise in changes])), 1.0e-3)
        unknowns.append(bench.sought(_RATIO, ratio, 1.0e-6))
    for decay in decays:
        for sensor, values in decay.sensors.items():
            scale = max(abs(decay.changes[decay.changing]), float(np.std(np.diff(values))), _LEAST_PRESSURE)
            start = values[: decay.edge].mean()
            spread = math.inf
            if sensor == decay.room:
                start = values.mean()
                spread = max(values.std(), _LEAST_PRESSURE)
            name = _START.format(sensor, decay.number)
            unknowns.append(bench.sought(name, start, _LEAST_PRESSURE, scale=scale, deviation=spread))
        for sensor in decay.fitted:
            unknowns += bench.within(_MOST_RELAXED, _RELAXED_BY.format(sensor, decay.number))
    # Only the order of magnitude of tau is known, so the variable is its logarithm.
    return [*unknowns, FitNumber(_RELAXATION, 0.0, low=-5.0, high=math.log(_RELAXED), scale=1.0, deviation=1.5)]
