"""Real gas by the virial equation of state truncated after its second term, ``P = rho R T (1 + b rho)``.

With a constant ``b`` the internal energy equals the ideal gas's, so that energy and state are consistent; with
``b = 0`` the gas is ideal. The engine, the reference solver and the simulated test bench share these functions.
"""

import math
from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.ports import gas_density, ideal_density

SECOND_VIRIAL = {"CO2": -123.0e-6, "air": -7.4e-6, "N2": -4.5e-6, "He": 11.8e-6}
"""Second virial coefficient [m^3/mol] at 298 K of every gas that a set can name; J. H. Dymond and E. B. Smith, 1980."""


class SecondVirial(NamedTuple):
    """Second virial coefficient divided by the molar mass, b [m^3/kg], below 0 for CO2."""

    per_mass: float


class _VirialSettings(NamedTuple):
    """Settings of a real gas: the second virial coefficient, and the fraction of it that applies."""

    share: Annotated[
        float, Number("", "share of the second virial coefficient that the gas has, 0 for ideal", 0.0, 0.0, 5.0)
    ]
    coefficient: Annotated[
        float,
        Number(
            "m^3/mol",
            "second virial coefficient, by default of gas.species at 298 K",
            SECOND_VIRIAL["CO2"],
            -1.0e-3,
            1.0e-3,
        ),
    ]


def prepare(settings: _VirialSettings, device: Any) -> SecondVirial:
    """Parameters from a fraction of a molar coefficient, with the molar mass of the device's gas."""
    return SecondVirial(settings.share * settings.coefficient / device.gas.molar_mass)


def real_gas_factor(density: float, virial: float) -> float:
    """Compressibility Z = 1 + b rho [-] at a density [kg/m^3]; ``virial`` is b [m^3/kg]."""
    return 1.0 + virial * density


def real_pressure(mass: float, volume: float, temperature: float, gas_constant: float, virial: float) -> float:
    """Absolute pressure [Pa] of ``mass`` [kg] in ``volume`` [m^3]; equation (3) times the real-gas factor."""
    density = mass / volume
    return density * gas_constant * temperature * real_gas_factor(density, virial)


def real_density(pressure: float, temperature: float, gas_constant: float, virial: float) -> float:
    """Density [kg/m^3] at an absolute pressure [Pa]; the inverse of ``real_pressure``, by its smaller root.

    For 4 b rho_ideal below -1, where the gas would condense first, twice the density of the ideal gas.
    """
    # 2 c / (1 + sqrt(1 + 4 b c)) instead of the textbook root, which cancels where b c is small, as it is here.
    product = gas_constant * temperature
    return 2.0 * pressure / (product * (1.0 + math.sqrt(max(1.0 + 4.0 * virial * pressure / product, 0.0))))


def gas_enthalpy(temperature: float, density: float, gas_constant: float, heat_capacity: float, virial: float) -> float:
    """Specific enthalpy [J/kg]: internal energy + P/rho, c_p T for ideal gas. ``heat_capacity`` is c_v [J/(kg K)]."""
    return temperature * (heat_capacity + gas_constant * real_gas_factor(density, virial))


def real_gas_density(density: float, second_virial: SecondVirial) -> float:
    """Density [kg/m^3] of the real gas, given the density of an ideal gas at the same pressure and temperature."""
    return real_density(density, 1.0, 1.0, second_virial.per_mass)


def ideal_gas_density(density: float, second_virial: SecondVirial) -> tuple[float, float]:
    """Density [kg/m^3] of an ideal gas at the same pressure, ``rho Z``, and its derivative with respect to rho [-]."""
    virial = second_virial.per_mass
    return density * real_gas_factor(density, virial), 1.0 + 2.0 * virial * density


EFFECT = Effect(
    name="second_virial",
    summary="Gas that is not ideal, by its second virial coefficient.",
    settings=_VirialSettings,
    parameters=SecondVirial,
    prepare=prepare,
    switch=("share",),
    of_gas={"coefficient": SECOND_VIRIAL},
    laws={gas_density: real_gas_density, ideal_density: ideal_gas_density},
    source="J. H. Dymond and E. B. Smith, The Virial Coefficients of Pure Gases and Mixtures, 1980",
    equation="P = rho (R/M) T (1 + b rho), b = share B / M",
    symbols=(("b", "per_mass", "m^3/kg", "second virial coefficient over the molar mass"),),
)
