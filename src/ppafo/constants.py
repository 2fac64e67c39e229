"""Physical constants and conversion factors in SI units."""

UNIVERSAL_GAS_CONSTANT = 8.314
"""Gas constant [J/(mol K)] as printed in the paper; the exact value is 8.314462618 (CODATA 2018), 0.006 % more."""

MOLAR_GAS_CONSTANT = 8.314462618
"""Molar gas constant [J/(mol K)], CODATA 2018, for gas densities at a reference condition."""

MOLAR_MASSES = {"CO2": 0.044, "air": 0.028965, "N2": 0.028013, "He": 0.0040026}
"""Molar masses of gases [kg/mol]; sources are given with the gases in ``model/gas.py``."""

STANDARD_ATMOSPHERE = 101325.0
"""Standard atmosphere [Pa absolute]: zero of gauge pressure unless a parameter set states another."""

STANDARD_REFERENCE_DENSITY_AIR = 1.185
"""Air density [kg/m^3] at 100 kPa, 293.15 K and 65 % humidity: reference of the ISO 6358 sonic conductance."""

STANDARD_REFERENCE_TEMPERATURE = 293.15
"""Reference temperature of ISO 6358 [K]."""

PASCALS_PER_PSI = 6894.757293168361
"""Pascals per psi: one pound-force per square inch, 4.4482216152605 N on (25.4 mm)^2."""

GRAMS_PER_KILOGRAM = 1.0e3

STANDARD_GRAVITY = 9.80665
"""Standard gravity [m/s^2], also for forces given in body weights."""
