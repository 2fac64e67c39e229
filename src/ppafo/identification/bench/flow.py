"""Flow laws on arrays (orifice, ISO 6358, laminar; all antisymmetric), tolerances of gas and sensors; open valve.

With r the ratio of downstream to upstream pressure and k the heat capacity ratio, the mass flow [kg/s] is

    orifice    Cd A C1 P_up psi(r),   C1 = sqrt(k / (R T) (2 / (k + 1))^((k + 1) / (k - 1)))       equations (6), (7)
               psi = 1 up to the critical ratio, then sqrt(2 k / (k - 1) r^(2/k) (1 - r^((k - 1)/k))) / (C1 sqrt(R T))
    ISO 6358   C rho_0 sqrt(T_0 / T) P_up phi(r),   phi = 1 up to b, then sqrt(1 - ((r - b) / (1 - b))^2)
    laminar    c (P_a^2 - P_b^2)
    both       a laminar gap in parallel with an orifice, or with ISO 6358 of known critical ratio

Of ISO 6358, C is the choked flow, and b is observable only from both choked and subsonic flow. Procedure
open-valve-flow fits a law to the flow through the fully open valve; temperature and law of the gas, gains and zeros of
the sensors are tolerances.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from ppafo.constants import STANDARD_ATMOSPHERE, UNIVERSAL_GAS_CONSTANT
from ppafo.errors import IdentificationError
from ppafo.identification.bench import law as bench
from ppafo.identification.bench import readings
from ppafo.identification.fit import Fit, FitNumber, Flags, tolerance
from ppafo.identification.source import RecordingSource, Sources, pool
from ppafo.identification.tolerances import GAS_LAW as LIMIT_OF_GAS_LAW
from ppafo.identification.tolerances import Tolerances
from ppafo.model.declaration import Number
from ppafo.model.gas import SPECIES, choked_flow_constant, critical_pressure_ratio, specific_gas_constant
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function, sonic_conductance_mass
from ppafo.parameters.records import keyed
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.units import from_si
from ppafo.units.spelling import molar_mass_in
from ppafo.wording import known_names

VALVE_PRESSURES = ("upstream_pressure", "downstream_pressure")
_MINIMUM_SAMPLES = 5
_FULLY_OPEN = 0.99
_FEW = 10
"""Reciprocal of the largest fraction of readings without flow or with crossed pressures that counts as noise."""
# Largest flow about the zero and pressure difference of readings at rest, and finest zero [-]. All are fractions of
# the largest readings: at a tenth of the pressure difference any law has a tenth of the flow.
_FLOW_AT_REST = 5.0e-3
_APART_AT_REST = 0.1
_FINEST = 1.0e-5
_FEWEST_AT_REST = 2
_NEARLY_EQUAL = 0.9
_REGIMES = "choked flow", "subsonic flow", "flow at nearly equal pressures"
LARGEST_COEFFICIENT = 1.0
"""Largest possible discharge coefficient [-], of a jet as wide as its opening: above it the area or a unit is wrong."""
_GRAMS_PER_BAR = 1.0e8
"""Conversion factor from kg/(s Pa) to g/s per bar."""
# Sizes of an opening that is not reported.
_SIZE = FitNumber("size")
_GAP = FitNumber("gap")
Law = Literal["orifice", "iso6358", "laminar", "both"]

VALVE = "name of a valve of the set; default: the chosen one"
# Lowest and highest gas temperature [K] of a bench.
_COLDEST = 150.0
_HOTTEST = 600.0
_SAME_GAS = 0.01
_THERMOMETER = 1.0
"""Error limit [K] of a gas temperature stated in the problem file."""
LINEAR_RATIO = 0.99999
"""Pressure ratio [-] above which the flow falls linearly to zero; at the atmosphere a difference of about 1 Pa.

The parameter ``flow.linear_ratio`` of a set belongs to the numerics of the engine, not to a measured opening.
"""
CRITICAL_RATIOS = 0.2, 0.01, 0.95
"""Critical ratio of ISO 6358 [-] in an estimation: start, lowest and highest value."""
# Least span and least maximum of the pressure ratios [-] needed to fit both parameters of ISO 6358.
_SPAN = 0.15
_SUBSONIC = 0.6
LAW_NAMES: Mapping[Law, str] = {
    "orifice": "orifice",
    "laminar": "laminar gap",
    "iso6358": "ISO 6358",
    "both": "orifice and laminar gap",
}

GAP = "effects.laminar_leak.coefficient"
"""Path of the coefficient of a laminar gap beside the orifice in a set."""
TEMPERATURE = "gas temperature"
GAS_LAW = "gas law"
METER = "gain of the flow meter"
SENSORS = "gain of the pressures"
ZERO = "zero of the flow meter"
_COMMON_ZERO = "zero of both pressures"
_APPARENT = "laminar gap equivalent to a gain error of the flow meter"
"""Names of the tolerances of a flow bench."""


@dataclass(frozen=True, slots=True)
class GasAt:
    """Gas: molar mass [kg/mol], heat capacity ratio [-], temperature and its standard deviation [K]."""

    molar_mass: float
    heat_capacity_ratio: float
    temperature: float
    temperature_deviation: float = 0.0

    @property
    def specific_gas_constant(self) -> float:
        """Specific gas constant R/M [J/(kg K)]; equation (3)."""
        return specific_gas_constant(UNIVERSAL_GAS_CONSTANT, self.molar_mass)

    @property
    def choked_flow_constant(self) -> float:
        """Choked-flow constant C1 [s/m] of equation (6)."""
        return choked_flow_constant(self.heat_capacity_ratio, self.specific_gas_constant, self.temperature)

    @property
    def flow_per_sonic_conductance(self) -> float:
        """Choked mass flow divided by C and upstream pressure [kg/m^3], rho_0 sqrt(T_0 / T) of ISO 6358-1:2013."""
        return sonic_conductance_mass(1.0, self.specific_gas_constant, self.temperature)


@dataclass(frozen=True, kw_only=True)
class FlowLaw(bench.BenchLaw):
    """Keys of a law in which gas flows."""

    gas: str | None = keyed("species of the gas on the bench; default: the set's", None)
    temperature: float | None = keyed(
        Number("K", "of the gas on the bench, '17 degC'; default: the set's", None, _COLDEST, _HOTTEST), None
    )

    def gas_of(self, sources: Sources, context: bench.BenchContext) -> GasAt:
        """Return the gas of the bench; species and temperature default to the values of the set.

        Raises IdentificationError for an unknown species, and for a flow recorded as one of another gas.
        """
        limit = context.tolerances.gas_temperature
        temperature = self.temperature
        deviation = deviation_of_limit(_THERMOMETER if limit is None else limit)
        if temperature is None:
            (temperature,) = context.numbers("gas.temperature")
            deviation = context.deviation("gas.temperature", temperature)
        if self.gas is None:
            molar_mass, heat_capacity_ratio = context.numbers("gas.molar_mass", "gas.heat_capacity_ratio")
        elif (species := SPECIES.get(self.gas)) is None:
            raise IdentificationError(f"{context.label}: gas = {self.gas!r} is unknown{known_names(self.gas, SPECIES)}")
        else:
            molar_mass = species.molar_mass
            heat_capacity_ratio = species.heat_capacity_ratio
        for source in (source for source in sources if "mass_flow" in source.recording):
            stated = source.recording.channels["mass_flow"].stated
            metered = molar_mass_in(stated)
            if metered is not None and not is_same_gas(metered, molar_mass):
                used = self.gas or f"the set's, {molar_mass:.4g} kg/mol"
                raise IdentificationError(
                    f"{source.name}: mass_flow in '{stated}' is a flow of {species_of(metered) or 'another gas'}, "
                    f"{metered:.4g} kg/mol, but the gas of {context.label} is {used}"
                )
        return GasAt(molar_mass, heat_capacity_ratio, temperature, deviation)

    def gas_used(self, gas: GasAt) -> str:
        """Return the gas of the bench in words."""
        name = species_of(gas.molar_mass) or f"{gas.molar_mass:.4g} kg/mol"
        origin = " of the set" if self.gas is None else ""
        return f"; gas: {name}{origin}, {from_si(gas.temperature, 'degC', 'K'):.4g} degC"


def species_of(molar_mass: float) -> str:
    """Return the name of the species of a molar mass [kg/mol], empty if it is of none."""
    return next((name for name, gas in SPECIES.items() if is_same_gas(gas.molar_mass, molar_mass)), "")


def is_same_gas(molar_mass: float, other: float) -> bool:
    """Return whether two molar masses [kg/mol] are of one gas."""
    return abs(molar_mass / other - 1.0) < _SAME_GAS


def gas_tolerances(gas: GasAt, tolerances: Tolerances) -> tuple[FitNumber, ...]:
    """Return the uncertain quantities of the gas: temperature [K] and relative departure from the ideal gas law [-]."""
    departure = LIMIT_OF_GAS_LAW if tolerances.gas_law is None else tolerances.gas_law
    return (*tolerance(TEMPERATURE, gas.temperature_deviation), *bench.within(departure, GAS_LAW))


def readings_in_flow(
    sources: Sources, names: tuple[str, str], used: Flags, tolerances: Tolerances, fewest: int
) -> tuple[Flags, tuple[FitNumber, ...], tuple[str, ...]]:
    """Return flags of the ``used`` readings that are not at rest, and the zeros that those at rest show, with a remark.

    At rest both pressures [Pa] are equal to their noise, which crosses some of them, while the meter shows hardly any
    flow [kg/s]. Then the meter reads its zero, and the pressures by how much their zeros differ. A
    single one shows nothing, and at least ``fewest`` others must be left.
    """
    first, second, flow = (pool(sources, name) for name in (*names, "mass_flow"))
    difference = first - second
    size = np.abs(flow)
    widest, largest = (float(np.abs(each[used]).max(initial=0.0)) for each in (difference, flow))
    is_small = used & (size <= max(_FLOW_AT_REST, tolerances.zero_of_flow) * largest)
    is_small &= np.abs(difference) <= _APART_AT_REST * widest
    is_crossed = is_small & (difference * np.sign(difference[used] @ flow[used]) <= 0.0)
    # Of a small flow noise may cross the pressures too, but at rest the meter shows one reading.
    shown = float(np.quantile(flow[is_crossed], 0.25)) if is_crossed.any() else 0.0
    is_at_rest = is_small & (np.abs(flow - shown) <= _FLOW_AT_REST * largest)
    count = np.count_nonzero(is_at_rest)
    total = np.count_nonzero(used)
    if count < _FEWEST_AT_REST or total - count < fewest:
        return used, (), ()
    zeros = list[FitNumber]()
    for path, values, span in ((ZERO, flow, largest), (f"zero of {names[0]}", difference, widest)):
        deviation = float(np.std(values[is_at_rest]))
        mean = float(np.mean(values[is_at_rest]))
        # A zero may drift from reading to reading, so that more of them tell no more.
        zeros += tolerance(path, max(deviation, _FINEST * span), mean)
    zeros += bench.within(tolerances.zero_of_pressure, _COMMON_ZERO)
    remark = f"{count} of {total} readings are without flow and show the zeros of flow meter and pressures"
    return used & ~is_at_rest, tuple(zeros), (remark,)


def flow_tolerances(
    gas: GasAt,
    tolerances: Tolerances,
    pressures: Mapping[str, Floats],
    flow: Floats,
    zeros: tuple[FitNumber, ...] = (),
) -> tuple[FitNumber, ...]:
    """Return the uncertain quantities of a flow bench: gas, gains and zeros of the sensors of pressures and flow.

    ``zeros`` that readings at rest have shown take the place of those of any bench.
    """
    return (
        *gas_tolerances(gas, tolerances),
        *bench.within(tolerances.gain_of("mass_flow"), METER),
        *bench.within(tolerances.gain_of("pressure"), SENSORS),
        *(
            zeros
            or (
                *bench.within(tolerances.zero_of_flow * float(np.abs(flow).max()), ZERO),
                *bench.within(tolerances.zero_of_pressure, *(f"zero of {name}" for name in pressures)),
            )
        ),
    )


def shown_flow(
    at: bench.Values, gas: GasAt, pressures: Mapping[str, Floats], flow: Callable[[Floats, Floats], Floats]
) -> Floats:
    """Return the flow meter reading [kg/s] at two shown pressures [Pa], by channel, with the errors ``at``.

    ``flow`` is the flow at the nominal gas state [kg/s] by true pressures [Pa]; a gain error acts on gauge pressures.
    """
    first, second = (
        np.asarray(shown - at[f"zero of {name}"] - at[_COMMON_ZERO] - at[SENSORS] * (shown - STANDARD_ATMOSPHERE))
        for name, shown in pressures.items()
    )
    # Flow through an opening goes with one over the root of the temperature.
    warm = np.sqrt(gas.temperature / (gas.temperature + at[TEMPERATURE]))
    return np.asarray((1.0 + at[GAS_LAW]) * (1.0 + at[METER]) * warm * flow(first, second) + at[ZERO])


def orifice_shape(first: Floats, second: Floats, heat_capacity_ratio: float) -> Floats:
    """Return upstream pressure times flow function [Pa], positive from first to second: (6), (7) divided by Cd A C1."""
    return _shape(first, second, lambda ratio: isentropic_flow_function(ratio, heat_capacity_ratio))


def iso6358_shape(first: Floats, second: Floats, critical_ratio: float) -> Floats:
    """Return upstream pressure times flow function [Pa], positive from first to second: ISO 6358 divided by C rho_0."""
    return _shape(first, second, lambda ratio: iso6358_flow_function(ratio, critical_ratio))


def _shape(first: Floats, second: Floats, curve: Callable[[Floats], Floats]) -> Floats:
    """Return upstream pressure times a function of the pressure ratio [Pa], with the sign of the flow."""
    upstream = np.maximum(np.maximum(first, second), 1.0)
    ratio = np.maximum(np.minimum(first, second), 0.0) / upstream
    flow = upstream * curve(np.minimum(ratio, LINEAR_RATIO))
    # Near equal pressures the root has no slope that a search could follow: a straight line goes to zero there.
    return np.asarray(np.sign(first - second) * flow * np.minimum((1.0 - ratio) / (1.0 - LINEAR_RATIO), 1.0))


@dataclass(frozen=True, slots=True)
class Opening:
    """Flow law of an opening: gas, law, and its sizes as they are reported, the unknowns of a flow fit.

    ``size`` is Cd [-], A [m^2] or Cd A [m^2] of an orifice, C [m^3/(s Pa)] of ISO 6358, or c [kg/(s Pa^2)] of a laminar
    gap. Of an orifice, ``known`` is the area [m^2] or discharge coefficient [-] that multiplies it. A
    ``critical_ratio`` [-] of None is estimated. The law ``both`` is a laminar ``gap``, c [kg/(s Pa^2)], in parallel
    with ISO 6358 if the critical ratio is given, or else with an orifice.
    """

    gas: GasAt
    law: Law
    size: FitNumber = _SIZE
    known: float = 1.0
    critical_ratio: float | None = None
    gap: FitNumber = _GAP

    @property
    def has_sought_ratio(self) -> bool:
        """True if the critical ratio b of ISO 6358 is estimated."""
        return self.law == "iso6358" and self.critical_ratio is None

    @property
    def ratio_path(self) -> str:
        """Path of the critical ratio, in the section of the size."""
        return f"{self.size.path.rpartition('.')[0]}.critical_ratio"

    def parts(self, first: Floats, second: Floats, ratio: float) -> list[tuple[str, float, Floats]]:
        """Return path, factor and shape of each part, whose product with its size is its flow [kg/s].

        ``first`` and ``second`` are the pressures [Pa] from and to which a positive flow runs, ``ratio`` is a sought
        critical ratio [-].
        """
        laminar = np.asarray(first**2 - second**2)
        if self.law == "laminar":
            return [(self.size.path, 1.0, laminar)]
        has_gap = self.law == "both"
        factor = self.known * self.gas.choked_flow_constant
        if self.law == "iso6358" or (has_gap and self.critical_ratio is not None):
            factor = self.gas.flow_per_sonic_conductance
            shape = iso6358_shape(first, second, ratio if self.critical_ratio is None else self.critical_ratio)
        else:
            shape = orifice_shape(first, second, self.gas.heat_capacity_ratio)
        return [(self.size.path, factor, shape), (self.gap.path, 1.0, laminar)][: 1 + has_gap]

    def flow(self, sizes: bench.Values, first: Floats, second: Floats) -> Floats:
        """Return the mass flow [kg/s] for pressures [Pa] and sizes by path, positive from first to second."""
        parts = self.parts(first, second, sizes.get(self.ratio_path, 0.0))
        return np.asarray(sum(sizes[path] * factor * shape for path, factor, shape in parts))

    def unknowns(self, starts: Sequence[float], alone: Sequence[float], ratio: float) -> tuple[FitNumber, ...]:
        """Return the unknowns with start values of the parts and of the critical ratio.

        Parallel parts have the magnitude of the sizes ``alone``, as if each carried the whole flow: either may be zero,
        which is a valid result.
        """
        if self.law == "both":
            parts = zip((self.size, self.gap), starts, alone, strict=True)
            return tuple(bench.sought(part, start, 0.0, scale=whole, size=whole) for part, start, whole in parts)
        numbers = [bench.sought(self.size, starts[0], 0.0)]
        if self.has_sought_ratio:
            text = "Critical ratio b of ISO 6358"
            numbers.append(bench.sought(self.ratio_path, ratio, *CRITICAL_RATIOS[1:], text=text))
        return tuple(numbers)


def opening_of(
    noun: Literal["open valve", "leak"],
    section: str,
    gas: GasAt,
    law: Law,
    critical_ratio: float | None,
    of_set: tuple[FitNumber, float] | None = None,
) -> Opening:
    """Return an opening; ``of_set`` is the size of an orifice of which the set knows a factor, and this factor.

    ``section`` is that of the opening in a set; a size that a set has not is of the ``noun``.
    """
    own = "open_valve_flow"
    laminar = "open_valve_flow.laminar_coefficient"
    unit = "kg/(s Pa^2)"
    if noun == "leak":
        own = "vane_leak"
        laminar = GAP
    gap = FitNumber(laminar, unit=unit, text="Laminar coefficient of a gap beside the orifice")
    path = f"{own}.effective_area"
    known = 1.0
    size = FitNumber(path, unit="m^2", text=f"Effective area Cd A of the {noun}")
    if law == "laminar":
        size = FitNumber(f"{own}.laminar_coefficient", unit=unit, text=f"Laminar coefficient of the {noun}")
    elif law == "iso6358" or critical_ratio is not None:
        of_ratio = "" if critical_ratio is None else f" with the set's b = {critical_ratio:g}"
        path = f"{section}.sonic_conductance"
        text = f"Sonic conductance C of the {noun}{of_ratio}"
        size = FitNumber(path, unit="m^3/(s Pa)", text=text)
    elif of_set is not None:
        size, known = of_set
    return Opening(gas, law, size, known, critical_ratio, gap)


def has_both_regimes(opening: Opening, ratio: Floats, source: RecordingSource) -> bool:
    """Return True if the pressure ratios [-] cover choked and subsonic flow, which C and b of ISO 6358 need.

    Raises IdentificationError if they do not, but the opening seeks both.
    """
    covers = bool(np.ptp(ratio) >= _SPAN and ratio.max() >= _SUBSONIC)
    if opening.has_sought_ratio and not covers:
        source.refuse(
            f"C and b need readings with choked and with subsonic flow: pressure ratios over {_SPAN:g} or more, up to "
            f"{_SUBSONIC:g}, not from {ratio.min():.3g} to {ratio.max():.3g}"
        )
    return covers


def steady_readings(
    sources: Sources, names: tuple[str, str], zero: float, used: Flags
) -> tuple[dict[str, Floats], Floats, bench.Names, tuple[str, ...]]:
    """Return pressures [Pa] by name, flow [kg/s] and recording of the possible readings, and remarks on the others.

    ``zero`` is the limit of the zero of the meter, as a fraction of its largest reading [-]; ``used`` marks the
    readings that count.
    """
    pressures = {name: pool(sources, name) for name in names}
    first, second = pressures.values()
    readings.check_no_wrong_reading(sources, "mass_flow", (first, second), used)
    flow, used, remarks = readings.meter_readings(sources, first - second, zero, used)
    used_pressures = {name: values[used] for name, values in pressures.items()}
    return used_pressures, flow[used], bench.recordings_of(sources)[used], remarks


def flow_through(at: bench.Values, opening: Opening, pressures: Mapping[str, Floats]) -> Floats:
    """Return the flow meter reading [kg/s] through an opening at two shown pressures [Pa], by channel."""
    gap = opening.gap.path
    sizes = {**at, gap: at[gap] + at[_APPARENT]}
    return shown_flow(at, opening.gas, pressures, lambda first, second: opening.flow(sizes, first, second))


def solve_flow(
    opening: Opening,
    pressures: Mapping[str, Floats],
    flow: Floats,
    groups: Sequence[ArrayLike],
    tolerances: Tolerances,
    confidence: float,
    ratios: Sequence[float] = CRITICAL_RATIOS[:1],
    zeros: tuple[FitNumber, ...] = (),
) -> tuple[Fit, Floats]:
    """Fit an opening to a measured ``flow`` with ``groups``. Returns the fit and the fitted flow [kg/s].

    ``pressures`` are two channels [Pa absolute]; a positive flow [kg/s] runs from the first to the second. A sought
    critical ratio starts from the best of ``ratios`` [-], the sizes, in which the flow is linear, from non-negative
    least squares.
    """
    first, second = pressures.values()
    units = {ratio: [factor * shape for _, factor, shape in opening.parts(first, second, ratio)] for ratio in ratios}
    ratio = max(units, key=lambda each: abs(units[each][0] @ flow) / np.linalg.norm(units[each][0]))
    columns = np.stack(units[ratio], axis=1)
    alone = np.linalg.norm(flow) / np.linalg.norm(columns, axis=0)
    starts = (nnls(columns * alone, flow)[0] * alone).tolist()
    numbers = (
        *opening.unknowns(starts, alone.tolist(), ratio),
        *flow_tolerances(opening.gas, tolerances, pressures, flow, zeros),
        # A gain that differs between small and large flows bends the curve of one opening as a gap beside it does.
        *(bench.within(tolerances.gain_of("mass_flow") * alone[1], _APPARENT) if opening.law == "both" else ()),
    )
    return bench.solve(lambda at: flow_through(at, opening, pressures), flow, groups, numbers, confidence)


@dataclass(frozen=True, kw_only=True)
class OpenValveFlowProblem(FlowLaw):
    """Table of procedure open-valve-flow: Cd, or C and b of ISO 6358, of the fully open valve."""

    needed = (*VALVE_PRESSURES, "mass_flow")
    steady = ("open-valve-flow",)
    kind: Literal["open-valve-flow"]
    valve: str | None = keyed(VALVE, None)
    law: Law = keyed("flow law, also the form in which the set gives it", "orifice")

    def run(self, sources: Sources, context: bench.BenchContext) -> bench.BenchResult:
        """Identify Cd [-] or Cd A [m^2], C [m^3/(s Pa)] and b [-], or c [kg/(s Pa^2)] of the open valve.

        The laws are equations (6) and (7), ISO 6358, and a laminar gap; ``both`` adds a gap to an orifice, or to ISO
        6358 where the set has its b. With the area of the set, an orifice is its Cd. Raises IdentificationError for
        recordings that do not determine the law.
        """
        gas = self.gas_of(sources, context)
        path = context.valve_path(self.valve)
        zero = context.tolerances.zero_of_flow
        area, critical_ratio = (context.number(f"{path}.{name}") for name in ("area", "critical_ratio"))
        readings.check_sources(sources, _MINIMUM_SAMPLES, absolute=VALVE_PRESSURES)
        commands = []
        for source in sources:
            # A saturated meter shows a constant flow although the pressures change the flow.
            upstream, downstream = (source.recording[name] for name in VALVE_PRESSURES)
            driving = orifice_shape(upstream, downstream, gas.heat_capacity_ratio)
            readings.check_not_clipped(source, "mass_flow", "orifice flow at these pressures", driving)
            # In a recording without commands, the valve is taken to be open.
            commands.append(source.recording["command"] if "command" in source.recording else np.ones(driving.size))
        is_open = np.abs(np.concatenate(commands)) >= _FULLY_OPEN
        fully_open = "readings with the valve fully open (command 1 or -1)"
        readings.check_enough(sources[0], is_open.sum(), _MINIMUM_SAMPLES, fully_open)
        upstream, downstream, flow = (pool(sources, name) for name in self.needed)
        # A log may begin before the gas supply is on: what is at rest then is no error of a column.
        is_open, zeros, remarks = readings_in_flow(
            sources, VALVE_PRESSURES, is_open, context.tolerances, _MINIMUM_SAMPLES
        )
        apart = {zero.path: zero.start for zero in zeros}.get(f"zero of {VALVE_PRESSURES[0]}", 0.0)
        crossed = np.count_nonzero((downstream + apart >= upstream)[is_open])
        # Noise may exchange a few pressures that are nearly equal.
        if crossed > is_open.sum() // _FEW:
            sources[0].refuse(
                f"downstream_pressure is at or above upstream_pressure in {crossed} of {is_open.sum()} readings; are "
                "the two columns swapped?"
            )
        if np.ptp(flow[is_open]) <= 0.0:
            readings.check_moves(sources[0], "mass_flow")
        pressures, flow, recorded, meter_remarks = steady_readings(sources, VALVE_PRESSURES, zero, is_open)
        upstream, downstream = pressures.values()
        flow = np.abs(flow)
        ratio = downstream / upstream
        text = f"Discharge coefficient with the set's area of {1e6 * (area or 0.0):.4g} mm^2; only Cd A is identified"
        of_set = (FitNumber(f"{path}.discharge_coefficient", text=text), area) if area else None
        # In parallel with a laminar gap, b selects ISO 6358; the law ``iso6358`` estimates b.
        known_ratio = critical_ratio if self.law == "both" else None
        opening = opening_of("open valve", path, gas, self.law, known_ratio, of_set)
        has_both_regimes(opening, ratio, sources[0])
        # The nearer the pressures are to each other, the more their noise affects the computed flow.
        limits = critical_pressure_ratio(gas.heat_capacity_ratio), _NEARLY_EQUAL
        groups = recorded, np.array(_REGIMES)[np.digitize(ratio, limits)]
        fitted, model = solve_flow(opening, pressures, flow, groups, context.tolerances, self.confidence, zeros=zeros)
        scatter = float(np.std(flow - model) / flow.max())
        # Densely, so that the curve has no kinks at the readings; between them the upstream pressure is interpolated.
        dense = np.linspace(ratio.min(), ratio.max(), 200)
        order = np.argsort(ratio)
        first = np.interp(dense, ratio[order], upstream[order])
        shown = dict(zip(pressures, (first, dense * first), strict=True))
        law_flow = flow_through(defaultdict(float, fitted.by_name), opening, shown)
        curve = curve_mark(LAW_NAMES[self.law], dense, _GRAMS_PER_BAR * law_flow / first)
        measured, modelled = (_GRAMS_PER_BAR * values / upstream for values in (flow, model))
        axes = Kind("Pressure ratio"), Kind("Flow over upstream pressure", "g/s per bar")
        series = [("measured", "measured", ratio, measured, modelled)]
        result = bench.result_of(
            sources,
            fitted,
            f"{flow.size} readings at pressure ratios from {ratio.min():.2f} to {ratio.max():.2f}; "
            f"scatter {scatter:.2%} of the largest flow",
            with_residuals("Open-valve flow", *axes, series, [curve]),
            remarks=(*remarks, *meter_remarks),
            scatter=scatter,
        )
        found, *others = result.estimates
        # Other sizes than a discharge coefficient have a unit.
        if area is None or found.unit or found.low <= LARGEST_COEFFICIENT:
            return result
        doubt = (
            f"Cd = {found.value:.3g} is impossible, above 1: mass_flow or a pressure has a wrong unit, or the "
            f"valve is larger than the set's {area * 1e6:.4g} mm^2"
        )
        doubted = replace(found, verdict="holds for this model only")
        return replace(result, estimates=(doubted, *others), remarks=(doubt, *result.remarks))
