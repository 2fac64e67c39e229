"""Laws of flow that the bench fits, on arrays: orifice, ISO 6358, laminar and linear; all antisymmetric.

With r the downstream over the upstream pressure and k the heat capacity ratio, mass flow [kg/s] is

    orifice    Cd A C1 P_up psi(r),   C1 = sqrt(k / (R T) (2 / (k + 1))^((k + 1) / (k - 1)))       equations (6), (7)
               psi = 1 up to the critical ratio, then sqrt(2 k / (k - 1) r^(2/k) (1 - r^((k - 1)/k))) over C1 sqrt(R T)
    ISO 6358   C rho_0 sqrt(T_0 / T) P_up phi(r),   phi = 1 up to b, then sqrt(1 - ((r - b) / (1 - b))^2)

A leak between two closed chambers at constant temperature: dP1/dt = -k g(P1, P2) and dP2/dt = (V1/V2) k g, so that
D = P1 - P2 falls by D' = -(1 + V1/V2) k g, and the time to fall from one D to another is an integral over D. It is
computed once for a law; the rate k only stretches the time.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.identification.bench.result import Number
from ppafo.model.gas import choked_flow_constant, specific_gas_constant
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function, sonic_conductance_mass
from ppafo.signals.recording import Floats

LINEAR_RATIO = 0.999


@dataclass(frozen=True, slots=True)
class GasAt:
    """A gas at one temperature: molar mass [kg/mol], heat capacity ratio [-], temperature [K], its uncertainty [K]."""

    molar_mass: float
    heat_capacity_ratio: float
    temperature: float
    temperature_half_width: float = 0.0

    @property
    def specific_gas_constant(self) -> float:
        """Specific gas constant R/M [J/(kg K)]; equation (3)."""
        return specific_gas_constant(UNIVERSAL_GAS_CONSTANT, self.molar_mass)

    @property
    def choked_flow_constant(self) -> float:
        """C1 [s/m] of equation (6)."""
        return choked_flow_constant(self.heat_capacity_ratio, self.specific_gas_constant, self.temperature)

    @property
    def flow_per_sonic_conductance(self) -> float:
        """Choked mass flow over C times upstream pressure [kg/m^3], rho_0 sqrt(T_0 / T) of ISO 6358-1:2013."""
        return sonic_conductance_mass(1.0, self.specific_gas_constant, self.temperature)

    def flow_uncertainty(self, calibration: float = 0.0) -> float:
        """Return the relative uncertainty [-] of an area or a conductance from a flow, with that of the sensors' gain.

        Mass flow goes with 1/sqrt(T), so an error of the temperature counts half; no residual shows it.
        """
        return math.hypot(calibration, 0.5 * self.temperature_half_width / self.temperature)

    @property
    def temperature_text(self) -> str:
        """The statement about the temperature, a sentence without its end."""
        known = f"known to {self.temperature_half_width:.3g} K" if self.temperature_half_width else "taken as exact"
        return f"Gas at {self.temperature:.4g} K, {known}"


def orifice_shape(pressure_a: Floats, pressure_b: Floats, heat_capacity_ratio: float) -> Floats:
    """Return upstream pressure times flow function [Pa], positive from a to b; equations (6), (7) over Cd A C1."""
    return _shape(pressure_a, pressure_b, lambda ratio: isentropic_flow_function(ratio, heat_capacity_ratio))


def iso6358_shape(pressure_a: Floats, pressure_b: Floats, critical_ratio: float) -> Floats:
    """Return upstream pressure times flow function [Pa], positive from a to b; ISO 6358-1:2013 over C rho_0."""
    return _shape(pressure_a, pressure_b, lambda ratio: iso6358_flow_function(ratio, critical_ratio))


def _shape(pressure_a: Floats, pressure_b: Floats, flow_function: Callable[[float], float]) -> Floats:
    """Return the antisymmetric flow of a flow function; a straight line to zero near equal pressures."""
    upstream = np.maximum(pressure_a, pressure_b)
    ratio = np.minimum(pressure_a, pressure_b) / upstream
    inside = np.minimum(ratio, LINEAR_RATIO)
    values = np.array([flow_function(item) for item in inside.tolist()])
    values *= np.minimum((1.0 - ratio) / (1.0 - LINEAR_RATIO), 1.0)
    return np.asarray(np.sign(pressure_a - pressure_b) * upstream * values)


Shape = Callable[[Floats, Floats], Floats]
_POINTS = 1200
_MAXIMUM_DECADES = 14.0


@dataclass(frozen=True, slots=True)
class Law:
    """A law of flow: its name, its formula, the unit of its rate k, and g [Pa times the rest of that unit]."""

    name: str
    formula: str
    rate_unit: str
    shape: Shape


LAMINAR = Law("laminar", "k (P1^2 - P2^2)", "1/(s Pa)", lambda first, second: first**2 - second**2)
LINEAR = Law("linear", "k (P1 - P2), an exponential decay", "1/s", lambda first, second: first - second)
"""Laws of flow that an opening's is compared with."""


@dataclass(frozen=True, slots=True)
class Chambers:
    """Two closed chambers: volume_ratio V1/V2 [-], 0 where chamber 2 is a room; ``conserved`` = P1 V1/V2 + P2 [Pa]."""

    volume_ratio: float
    conserved: float

    def pressures(self, difference: Floats) -> tuple[Floats, Floats]:
        """Return both pressures [Pa] at a pressure difference [Pa]; no gas is lost to the outside."""
        second = (self.conserved - self.volume_ratio * difference) / (1.0 + self.volume_ratio)
        return second + difference, second


def decay_times(law: Law, chambers: Chambers, start: float, lowest: float) -> tuple[Floats, Floats]:
    """Return k t and the difference [Pa] from ``start`` down past ``lowest``: the decay for a rate of 1."""
    reach = min(2.0 * np.log(start / max(lowest, 1e-12 * start)) + 0.05, _MAXIMUM_DECADES)
    logs = np.linspace(0.0, reach, _POINTS)
    difference = start * np.exp(-logs)
    first, second = chambers.pressures(difference)
    slowness = difference / ((1.0 + chambers.volume_ratio) * law.shape(first, second))
    steps = 0.5 * (slowness[1:] + slowness[:-1]) * np.diff(logs)
    return np.concatenate(([0.0], np.cumsum(steps))), difference


def difference_in_time(law: Law, chambers: Chambers, start: float, rate: float, times: Floats, lowest: float) -> Floats:
    """Return the pressure difference [Pa] at times [s] after ``start`` [Pa] with the law's rate k."""
    stretched, difference = decay_times(law, chambers, start, lowest)
    return np.asarray(start * np.exp(np.interp(rate * times, stretched, np.log(difference / start))))


AREA_PATH, SONIC_PATH = "actuator.leak.area", "actuator.leak.sonic_conductance"


@dataclass(frozen=True, slots=True)
class Opening:
    """The gas, and what the set has: Cd [-] for an area, or b [-] for a sonic conductance; neither where it is bare."""

    gas: GasAt
    discharge_coefficient: float | None = None
    critical_ratio: float | None = None

    @property
    def path(self) -> str:
        """Where a set keeps the size of the leak."""
        return AREA_PATH if self.critical_ratio is None else SONIC_PATH

    @property
    def unit(self) -> str:
        """SI unit of that."""
        return "m^2" if self.critical_ratio is None else "m^3/(s Pa)"

    def law(self) -> Law:
        """Return the law of flow through the opening: (6), (7), or ISO 6358-1:2013 with the set's b."""
        ratio, capacities = self.critical_ratio, self.gas.heat_capacity_ratio
        if ratio is None:
            return Law("orifice", "Cd A C1 P psi(P2/P1)", "1/s", lambda a, b: orifice_shape(a, b, capacities))
        formula = f"C rho_0 P phi(P2/P1), b = {ratio:g}"
        return Law("orifice", formula, "1/s", lambda a, b: iso6358_shape(a, b, ratio))

    def numbers(self, conductance: float, half_width: float, text: str, widened: float) -> list[Number]:
        """Return the leak's size from choked flow over upstream pressure [kg/(s Pa)], with half the interval's width.

        An area without a discharge coefficient is the product Cd A only, which no set has.
        """
        if self.critical_ratio is not None:
            per = self.gas.flow_per_sonic_conductance
            description = f"C of ISO 6358 with the set's b = {self.critical_ratio:g}. {text}"
            return [Number(SONIC_PATH, self.unit, conductance / per, half_width / per, description, None, 0.0, widened)]
        area, half = conductance / self.gas.choked_flow_constant, half_width / self.gas.choked_flow_constant
        product = Number("vane_leak.effective_area", "m^2", area, half, f"Cd A. {text}", None, 0.0, widened)
        coefficient = self.discharge_coefficient
        if not coefficient:
            return [product]
        description = f"With Cd = {coefficient:g}, of which only the product with the area counts. {text}"
        return [
            Number(AREA_PATH, "m^2", area / coefficient, half / coefficient, description, None, 0.0, widened),
            product,
        ]
