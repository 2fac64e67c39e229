"""Flow laws on arrays (orifice, ISO 6358, laminar; all antisymmetric), and tolerances of gas and sensors.

With r the ratio of downstream to upstream pressure and k the heat capacity ratio, the mass flow [kg/s] is

    orifice    Cd A C1 P_up psi(r),   C1 = sqrt(k / (R T) (2 / (k + 1))^((k + 1) / (k - 1)))       equations (6), (7)
               psi = 1 up to the critical ratio, then sqrt(2 k / (k - 1) r^(2/k) (1 - r^((k - 1)/k))) / (C1 sqrt(R T))
    ISO 6358   C rho_0 sqrt(T_0 / T) P_up phi(r),   phi = 1 up to b, then sqrt(1 - ((r - b) / (1 - b))^2)
    laminar    c (P_a^2 - P_b^2)
    both       a laminar gap in parallel with an orifice, or with ISO 6358 of known critical ratio

Of ISO 6358, C is the choked flow, and b is observable only from both choked and subsonic flow.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import nnls

from ppafo.constants import STANDARD_ATMOSPHERE, UNIVERSAL_GAS_CONSTANT
from ppafo.errors import IdentificationError
from ppafo.identification.bench.law import PooledReadings, ReportedNumber, Values, solve, sought, tolerance, within
from ppafo.identification.fit import Fit
from ppafo.identification.least_squares import FitVariable
from ppafo.identification.tolerances import GAS_LAW as LIMIT_OF_GAS_LAW
from ppafo.identification.tolerances import Tolerances
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio, specific_gas_constant
from ppafo.model.orifice import sonic_conductance_mass
from ppafo.signals.recording import Floats

Law = Literal["orifice", "iso6358", "laminar", "both"]

LINEAR_RATIO = 0.99999
"""Pressure ratio [-] above which the flow falls linearly to zero; at the atmosphere a difference of about 1 Pa.

The parameter ``flow.linear_ratio`` of a set belongs to the numerics of the engine, not to a measured opening.
"""
PRODUCT_ONLY = 1.0
"""Known factor of an orifice if neither Cd [-] nor the area [m^2] is known: the fitted size is the product Cd A."""
CRITICAL_RATIOS = 0.2, 0.01, 0.95
"""Critical ratio of ISO 6358 [-] in an estimation: start, lowest and highest value."""
_SPAN, _SUBSONIC = 0.15, 0.6
"""Least span and least maximum of the pressure ratios [-] needed to fit both parameters of ISO 6358."""
NEXT_LAW: Mapping[Law, str] = {
    "orifice": "try law = 'both' or law = 'iso6358'",
    "laminar": "try law = 'both'",
    "iso6358": "try law = 'both'",
    "both": "neither an orifice nor a laminar gap nor both in parallel explain the readings",
}
"""Remedy by flow law, for readings that the law does not fit; the law ``both`` contains each of its parts."""

LAW_NAMES: Mapping[Law, str] = {
    "orifice": "orifice",
    "laminar": "laminar gap",
    "iso6358": "ISO 6358",
    "both": "orifice and laminar gap",
}
"""Legend by flow law."""

TEMPERATURE, GAS_LAW, METER, SENSORS = "gas temperature", "gas law", "gain of the flow meter", "gain of the pressures"
ZERO = "zero of the flow meter"
APPARENT = "laminar gap equivalent to a gain error of the flow meter"
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


def gas_tolerances(gas: GasAt, tolerances: Tolerances) -> tuple[FitVariable, ...]:
    """Return the uncertain quantities of the gas: temperature [K] and relative departure from the ideal gas law [-]."""
    departure = LIMIT_OF_GAS_LAW if tolerances.gas_law is None else tolerances.gas_law
    return (*tolerance(TEMPERATURE, gas.temperature_deviation), *within(GAS_LAW, departure))


def flow_tolerances(
    gas: GasAt, tolerances: Tolerances, names: tuple[str, str], largest: float
) -> tuple[FitVariable, ...]:
    """Return the uncertain quantities of a flow bench: gas, gains and zeros; ``names`` are the pressure channels.

    ``largest`` is the largest reading of the flow meter [kg/s].
    """
    return (
        *gas_tolerances(gas, tolerances),
        *within(METER, tolerances.gain_of("mass_flow")),
        *within(SENSORS, tolerances.gain_of("pressure")),
        *within(ZERO, tolerances.zero_of_flow * largest),
        *(item for name in names for item in within(f"zero of {name}", tolerances.zero_of_pressure)),
    )


def read_flow(at: Values, gas: GasAt, flow: Floats) -> Floats:
    """Return the flow meter reading [kg/s] for a flow at the nominal gas state [kg/s], with the errors ``at``."""
    # Flow through an opening goes with one over the root of the temperature.
    warm = np.sqrt(gas.temperature / (gas.temperature + at[TEMPERATURE]))
    return np.asarray((1.0 + at[GAS_LAW]) * (1.0 + at[METER]) * warm * flow + at[ZERO])


def true_pressure(at: Values, name: str, shown: Floats) -> Floats:
    """Return the true pressure [Pa] for a sensor reading [Pa]; a gain error acts on the gauge pressure."""
    return np.asarray(shown - at[f"zero of {name}"] - at[SENSORS] * (shown - STANDARD_ATMOSPHERE))


def orifice_shape(first: Floats, second: Floats, heat_capacity_ratio: float) -> Floats:
    """Return upstream pressure times flow function [Pa], positive from first to second: (6), (7) divided by Cd A C1."""
    k = heat_capacity_ratio

    def curve(ratio: Floats) -> Floats:
        inside = np.maximum(ratio, critical_pressure_ratio(k))
        flow = np.sqrt(2.0 * k / (k - 1.0)) * inside ** (1.0 / k) * np.sqrt(1.0 - inside ** ((k - 1.0) / k))
        return np.asarray(flow / np.sqrt(k * (2.0 / (k + 1.0)) ** ((k + 1.0) / (k - 1.0))))

    return _shape(first, second, curve)


def iso6358_shape(first: Floats, second: Floats, critical_ratio: float) -> Floats:
    """Return upstream pressure times flow function [Pa], positive from first to second: ISO 6358 divided by C rho_0."""

    def curve(ratio: Floats) -> Floats:
        position = np.maximum(ratio - critical_ratio, 0.0) / (1.0 - critical_ratio)
        return np.asarray(np.sqrt(1.0 - position**2))

    return _shape(first, second, curve)


def _shape(first: Floats, second: Floats, curve: Callable[[Floats], Floats]) -> Floats:
    """Return upstream pressure times a function of the pressure ratio [Pa], with the sign of the flow."""
    upstream = np.maximum(np.maximum(first, second), 1.0)
    ratio = np.maximum(np.minimum(first, second), 0.0) / upstream
    flow = upstream * curve(np.minimum(ratio, LINEAR_RATIO))
    # Near equal pressures the root has no slope that a search could follow: a straight line goes to zero there.
    return np.asarray(np.sign(first - second) * flow * np.minimum((1.0 - ratio) / (1.0 - LINEAR_RATIO), 1.0))


def has_both_regimes(ratio: Floats) -> bool:
    """Return True if the pressure ratios [-] cover choked and subsonic flow, which C and b of ISO 6358 need."""
    return bool(np.ptp(ratio) >= _SPAN and ratio.max() >= _SUBSONIC)


def check_both_regimes(ratio: Floats, name: str, procedure: str) -> None:
    """Raise IdentificationError if the pressure ratios [-] do not determine both C and b of ISO 6358.

    ``name`` is the recording in the message.
    """
    if not has_both_regimes(ratio):
        raise IdentificationError(
            f"{name}: {procedure}: C and b need readings with choked and with subsonic flow: pressure ratios over "
            f"{_SPAN:g} or more, up to {_SUBSONIC:g}, not from {ratio.min():.3g} to {ratio.max():.3g}"
        )


class OpeningSizes(NamedTuple):
    """Sizes of an opening, the unknowns of a flow fit.

    ``size`` is Cd [-], A [m^2] or Cd A [m^2] of an orifice, C [m^3/(s Pa)] of ISO 6358, or c [kg/(s Pa^2)] of a laminar
    gap. ``critical_ratio`` is b [-]; ``beside`` is c of a parallel laminar gap [kg/(s Pa^2)].
    """

    size: float
    critical_ratio: float = 0.0
    beside: float = 0.0


@dataclass(frozen=True, slots=True)
class Opening:
    """Flow law of an opening: gas, law, and known quantities.

    For an orifice, ``known`` is the area [m^2] or discharge coefficient [-] that multiplies the unknown size; ISO 6358
    does not use it. A ``critical_ratio`` [-] of None is estimated. The law ``both`` is a laminar gap in parallel with
    ISO 6358 if the critical ratio is given, or else with an orifice.
    """

    gas: GasAt
    law: Law
    known: float = PRODUCT_ONLY
    critical_ratio: float | None = None

    @property
    def has_sought_ratio(self) -> bool:
        """True if the critical ratio b of ISO 6358 is estimated."""
        return self.law == "iso6358" and self.critical_ratio is None

    def flow(self, sizes: OpeningSizes, first: Floats, second: Floats) -> Floats:
        """Return the mass flow [kg/s] for pressures [Pa], positive from first to second."""
        laminar = np.asarray(first**2 - second**2)
        if self.law == "laminar":
            return np.asarray(sizes.size * laminar)
        if self.law == "iso6358" or (self.law == "both" and self.critical_ratio is not None):
            ratio = sizes.critical_ratio if self.critical_ratio is None else self.critical_ratio
            through = sizes.size * self.gas.flow_per_sonic_conductance * iso6358_shape(first, second, ratio)
        else:
            per_size = self.known * self.gas.choked_flow_constant
            through = sizes.size * per_size * orifice_shape(first, second, self.gas.heat_capacity_ratio)
        return through + sizes.beside * laminar if self.law == "both" else through

    def rough_sizes(
        self, first: Floats, second: Floats, flow: Floats, ratios: Sequence[float] = CRITICAL_RATIOS[:1]
    ) -> tuple[OpeningSizes, OpeningSizes]:
        """Return start sizes by non-negative least squares, and the sizes if each part alone carried the whole flow.

        The flow is linear in the sizes; the nonlinear critical ratio is the best of ``ratios``, by default its usual
        value.
        """
        units = {ratio: self.flow(OpeningSizes(1.0, ratio), first, second) for ratio in ratios}
        ratio = max(units, key=lambda each: abs(float(units[each] @ flow)) / float(np.linalg.norm(units[each])))
        parts = [units[ratio]]
        parts += [self.flow(OpeningSizes(0.0, ratio, 1.0), first, second)] if self.law == "both" else []
        columns = np.stack(parts, axis=1)
        alone = np.linalg.norm(flow) / np.linalg.norm(columns, axis=0)
        size, *beside = (nnls(columns * alone, flow)[0] * alone).tolist()
        return OpeningSizes(size, ratio, *beside), OpeningSizes(float(alone[0]), ratio, *alone[1:].tolist())


class Paths(NamedTuple):
    """Names of the fit variables of an opening; an empty name for a quantity that is not estimated."""

    size: str
    critical_ratio: str = ""
    beside: str = ""

    def sizes(self, at: Values) -> OpeningSizes:
        """Return the sizes of the opening, given the values of the fit variables."""
        return OpeningSizes(at[self.size], at[self.critical_ratio], at[self.beside])

    def sought(self, start: OpeningSizes, alone: OpeningSizes) -> tuple[FitVariable, ...]:
        """Return the unknowns with start values; parallel parts are scaled as if each carried all of the flow."""
        scale = alone.size if self.beside else 0.0
        return (
            sought(self.size, start.size, 0.0, scale=scale),
            *(sought(name, start.critical_ratio, *CRITICAL_RATIOS[1:]) for name in (self.critical_ratio,) if name),
            *((sought(self.beside, start.beside, 0.0, scale=alone.beside),) if self.beside else ()),
        )


def reported_parts(
    opening: Opening, size: ReportedNumber, gap: ReportedNumber, alone: OpeningSizes
) -> tuple[list[ReportedNumber], Paths]:
    """Return the reported sizes of an opening, with its gap or its sought critical ratio, and their names in the fit.

    The critical ratio has its path in the section of ``size``. The magnitudes of parallel parts are the sizes
    ``alone``, as if each part carried the whole flow: either part may be zero, which is a valid result.
    """
    if opening.has_sought_ratio:
        section = size.path.rpartition(".")[0]
        ratio = ReportedNumber(f"{section}.critical_ratio", "", "Critical ratio b of ISO 6358")
        return [size, ratio], Paths(size.path, ratio.path)
    if opening.law != "both":
        return [size], Paths(size.path)
    return [replace(size, size=alone.size), replace(gap, size=alone.beside)], Paths(size.path, beside=gap.path)


def shown_flow(opening: Opening, paths: Paths, pressures: Mapping[str, Floats], at: Values) -> Floats:
    """Return the flow meter reading [kg/s] through an opening at two shown pressures [Pa], by channel."""
    first, second = (true_pressure(at, name, shown) for name, shown in pressures.items())
    sizes = paths.sizes(at)
    sizes = sizes._replace(beside=sizes.beside + at[APPARENT])
    return read_flow(at, opening.gas, opening.flow(sizes, first, second))


def solve_flow(
    opening: Opening,
    paths: Paths,
    pressures: Mapping[str, Floats],
    readings: PooledReadings,
    tolerances: Tolerances,
    confidence: float,
    ratios: Sequence[float] = CRITICAL_RATIOS[:1],
) -> tuple[Fit, Floats]:
    """Fit an opening to measured flow. Returns the fit and the fitted flow [kg/s].

    ``pressures`` are two channels [Pa absolute]; a positive flow [kg/s] runs from the first to the second. A sought
    critical ratio starts from the best of ``ratios`` [-].
    """
    (first_name, shown_first), (second_name, shown_second) = pressures.items()
    flow = readings.measured
    start, alone = opening.rough_sizes(shown_first, shown_second, flow, ratios)
    numbers = (
        *paths.sought(start, alone),
        *flow_tolerances(opening.gas, tolerances, (first_name, second_name), float(np.abs(flow).max())),
        # A gain that differs between small and large flows bends the curve of one opening as a gap beside it does.
        *(within(APPARENT, tolerances.gain_of("mass_flow") * alone.beside) if opening.law == "both" else ()),
    )
    return solve(partial(shown_flow, opening, paths, pressures), readings, numbers, confidence)
