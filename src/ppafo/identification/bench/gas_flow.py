"""Laws of flow that the bench fits, on arrays: orifice, ISO 6358, laminar and linear; all antisymmetric.

``GasAt`` is what they need to know of the gas.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.model.gas import choked_flow_constant, specific_gas_constant
from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.model.orifice_curves import sonic_conductance_mass
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

    def share_of_flow(self, calibration: float = 0.0) -> float:
        """Return the relative uncertainty [-] of an area or a conductance from a flow, with that of the sensors' gain.

        Mass flow goes with 1/sqrt(T), so an error of the temperature counts half; no residual shows it.
        """
        return math.hypot(calibration, 0.5 * self.temperature_half_width / self.temperature)

    @property
    def temperature_told(self) -> str:
        """What is to be said of the temperature, as a sentence without its end."""
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
