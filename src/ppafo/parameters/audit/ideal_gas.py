"""How much gas does the ideal gas law miscount at supply pressure? Equation (3)."""

from collections.abc import Iterator

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Side

SECOND_VIRIAL_COEFFICIENT = {"CO2": -123e-6, "N2": -4.5e-6, "air": -7.5e-6, "He": 11.8e-6}
"""m^3/mol at 298 K; J. H. Dymond and E. B. Smith, The Virial Coefficients of Pure Gases and Mixtures, 1980."""

_TABULATED_TEMPERATURE = 298.0
_TEMPERATURE_ROOM = 20.0
_WORTH_A_WARNING = 0.05
_SUPPLY = "supply.pressure"


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield a note on the error of the ideal gas law at supply pressure, a warning where it exceeds 5 %."""
    gas, pressure = evidence.gas(), evidence.number(_SUPPLY)
    virial = SECOND_VIRIAL_COEFFICIENT.get(evidence.text("gas.species") or "")
    if gas is None or pressure is None or virial is None:
        return
    if abs(gas.temperature - _TABULATED_TEMPERATURE) > _TEMPERATURE_ROOM:
        return
    compressibility = 1.0 + virial * pressure / (UNIVERSAL_GAS_CONSTANT * gas.temperature)
    if compressibility <= 0.0:
        return
    error = 1.0 - 1.0 / compressibility
    counts = "under-counts" if error < 0.0 else "over-counts"
    yield Finding(
        id="ideal-gas",
        severity="warning" if abs(error) > _WORTH_A_WARNING else "note",
        title=f"the ideal gas law {counts} {gas.species} by {100.0 * abs(error):.2g} % at supply pressure",
        values=evidence.values_of("gas.species", "gas.temperature", _SUPPLY),
        sides=(Side("real-gas factor, ideal", 1.0, ""), Side("real-gas factor, real", compressibility, "")),
        paragraph=(
            f"With the second virial coefficient {1e6 * virial:.3g} cm^3/mol the real-gas factor at "
            f"{evidence.in_set_unit(_SUPPLY, pressure)} is {compressibility:.4f}: the ideal gas law "
            f"{counts} the mass in a "
            f"full chamber by {100.0 * abs(error):.2g} %. Reconciled by a real-gas factor in equation (3), where gas "
            f"use matters to that precision."
        ),
    )
