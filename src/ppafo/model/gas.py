"""Ideal gases and the constants of orifice flow that follow from them."""

import math
from dataclasses import dataclass

from ppafo.model.columns import over_runs, root
from ppafo.model.elementary import power


@dataclass(frozen=True, slots=True)
class Species:
    """A gas as data: molar mass [kg/mol] and heat capacity ratio [-] near room temperature."""

    name: str
    molar_mass: float
    heat_capacity_ratio: float
    source: str


_WEBBOOK = "NIST Chemistry WebBook, SRD 69, at 298 K and 1 bar"

SPECIES: dict[str, Species] = {
    species.name: species
    for species in (
        Species("CO2", 0.044, 1.3, "the paper, p. 3, after equation (3); WebBook: 0.04401 kg/mol, 1.294"),
        Species("air", 0.028965, 1.4, _WEBBOOK),
        Species("N2", 0.028013, 1.401, _WEBBOOK),
        Species("He", 0.0040026, 1.667, _WEBBOOK),
    )
}


def specific_gas_constant(universal_gas_constant: float, molar_mass: float) -> float:
    """Specific gas constant R/M [J/(kg K)]; equation (3)."""
    return universal_gas_constant / molar_mass


def critical_pressure_ratio(heat_capacity_ratio: float) -> float:
    """Downstream over upstream pressure [-] at and below which flow is choked; the inverse of the paper's 1.832."""
    return over_runs(_critical_ratio, heat_capacity_ratio)


def _critical_ratio(k: float) -> float:
    return power(2.0 / (k + 1.0), k / (k - 1.0))


def choked_flow_constant(heat_capacity_ratio: float, gas_constant: float, temperature: float) -> float:
    """C1 [s/m] of equation (6), with the exponent (k + 1)/(k - 1); ``gas_constant`` is the specific one."""
    choked = over_runs(_choked_power, heat_capacity_ratio)
    return root(heat_capacity_ratio / (gas_constant * temperature) * choked)


def _choked_power(k: float) -> float:
    return power(2.0 / (k + 1.0), (k + 1.0) / (k - 1.0))


def subsonic_flow_constant(heat_capacity_ratio: float, gas_constant: float, temperature: float) -> float:
    """C2 [s/m] of equation (7); ``gas_constant`` is the specific one."""
    k = heat_capacity_ratio
    return math.sqrt(2.0 * k / (gas_constant * temperature * (k - 1.0)))
