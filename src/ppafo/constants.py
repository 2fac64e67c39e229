"""Physical constants in SI units, and what the units of the field are in SI."""

UNIVERSAL_GAS_CONSTANT = 8.314
"""J/(mol K), as the paper prints it; the exact value is 8.314462618 (CODATA 2018), 0.006 % more."""

MOLAR_GAS_CONSTANT = 8.314462618
"""J/(mol K), CODATA 2018; densities of gas at a reference condition."""

MOLAR_MASSES = {"CO2": 0.044, "air": 0.028965, "N2": 0.028013, "He": 0.0040026}
"""kg/mol; sources are beside the gases in ``model/gas.py``."""

STANDARD_ATMOSPHERE = 101325.0
"""Pa absolute; the zero of gauge pressure unless a parameter set says otherwise."""

STANDARD_REFERENCE_DENSITY_AIR = 1.185
"""kg/m^3 of air at 100 kPa, 293.15 K and 65 % humidity: the reference of ISO 6358 sonic conductance."""

STANDARD_REFERENCE_TEMPERATURE = 293.15
"""K, the reference temperature of ISO 6358."""

PASCALS_PER_PSI = 6894.757293168361
"""Pa in one pound-force per square inch, 4.4482216152605 N on (25.4 mm)^2."""

GRAMS_PER_KILOGRAM = 1.0e3

STANDARD_GRAVITY = 9.80665
"""m/s^2; weight per mass where forces are given in body weights."""
