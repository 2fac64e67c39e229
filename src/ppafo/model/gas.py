"""Gases: constants of orifice flow, and energy balance of a gas that is not isothermal.

The energy of a chamber changes by the enthalpy of the inflow and outflow, the work of the moving wall and the heat
through the wall: ``dE/dt = sum of m_dot h_up - P dV/dt + h A (T_wall - T)``.
"""

from dataclasses import dataclass

from ppafo.constants import MOLAR_MASSES
from ppafo.model.columns import over_runs, root
from ppafo.model.elementary import power

_WEBBOOK = "NIST Chemistry WebBook, SRD 69, at 298 K and 1 bar"


@dataclass(frozen=True, slots=True)
class _Species:
    """A gas as data: molar mass [kg/mol] and heat capacity ratio [-] near room temperature."""

    name: str
    molar_mass: float
    heat_capacity_ratio: float
    source: str


SPECIES: dict[str, _Species] = {
    species.name: species
    for species in (
        _Species(
            "CO2", MOLAR_MASSES["CO2"], 1.3, "the paper, p. 3, after equation (3); WebBook: 0.04401 kg/mol, 1.294"
        ),
        _Species("air", MOLAR_MASSES["air"], 1.4, _WEBBOOK),
        _Species("N2", MOLAR_MASSES["N2"], 1.401, _WEBBOOK),
        _Species("He", MOLAR_MASSES["He"], 1.667, _WEBBOOK),
    )
}

SECOND_VIRIAL = {"CO2": -123.0e-6, "air": -7.4e-6, "N2": -4.5e-6, "He": 11.8e-6}
"""Second virial coefficient [m^3/mol] at 298 K of every gas that a set can name; J. H. Dymond and E. B. Smith, 1980."""


def specific_gas_constant(universal_gas_constant: float, molar_mass: float) -> float:
    """Specific gas constant R/M [J/(kg K)]; equation (3)."""
    return universal_gas_constant / molar_mass


def critical_pressure_ratio(heat_capacity_ratio: float) -> float:
    """Largest ratio of downstream to upstream pressure [-] with choked flow; the inverse of the paper's 1.832."""
    k = heat_capacity_ratio
    return over_runs(power, 2.0 / (k + 1.0), k / (k - 1.0))


def choked_flow_constant(heat_capacity_ratio: float, gas_constant: float, temperature: float) -> float:
    """Constant C1 [s/m] of equation (6), with the exponent (k + 1)/(k - 1); ``gas_constant`` is R/M [J/(kg K)]."""
    # With this exponent the paper's own value, 0.00281 s/m, comes out.
    k = heat_capacity_ratio
    choked = over_runs(power, 2.0 / (k + 1.0), (k + 1.0) / (k - 1.0))
    return root(k / (gas_constant * temperature) * choked)


def wall_exchange(
    heat_transfer_coefficient: float, area_per_volume: float, heat_capacity_ratio: float, gas_constant: float
) -> float:
    """Wall heat transfer per volume and kelvin divided by c_v, h a/c_v [kg/(s m^3)]; ``gas_constant`` is R/M."""
    return heat_transfer_coefficient * area_per_volume * (heat_capacity_ratio - 1.0) / gas_constant


def mass_flow_ratio(root: float) -> float:
    """Mass flow relative to the flow at the reference temperature [-]; ``root`` is sqrt(T_up/T_ref). Equation (6)."""
    return 1.0 / root


def enthalpy_flow_ratio(root: float, heat_capacity_ratio: float) -> float:
    """Enthalpy flow divided by c_v T_ref and by the mass flow at the reference temperature [-].

    ``root`` is sqrt(T_up/T_ref) [-], so that its square is the specific enthalpy relative to that at the reference
    temperature.
    """
    specific_enthalpy = heat_capacity_ratio * root * root
    return specific_enthalpy * mass_flow_ratio(root)


def energy_per_content(gas_product: float, heat_capacity_ratio: float) -> float:
    """Internal energy divided by gas content [J/kg], ``R T_ref / (M (k - 1))``, from ``R T_ref / M`` [J/kg].

    The gas content of a chamber is the mass of gas at the reference temperature that has the pressure of the chamber.
    """
    return gas_product / (heat_capacity_ratio - 1.0)
