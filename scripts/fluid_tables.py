"""Makes the property tables of the package from CoolProp; run again only to change their nodes or CoolProp's version.

    python scripts/fluid_tables.py src/ppafo/parameters/bottles/fluid_tables

writes ``CO2.json``, ``air.json`` and ``N2.json``. Needs the extra ``properties``. No property equation stands here.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.storage.files import write_file

DIGITS = 8
_REFERENCES = {
    "CO2": "IIR: enthalpy 200 kJ/kg of the saturated liquid at 273.15 K",
    "air": "CoolProp's default for Air",
    "N2": "CoolProp's default for Nitrogen",
}


@dataclass(frozen=True, slots=True)
class Plan:
    """Nodes of a table: CoolProp's name, temperatures [K], number of shares, densest gas [kg/m^3] without a liquid."""

    coolprop_name: str
    temperatures: tuple[float, ...]
    share_count: int
    densest: float | None


def _towards_critical(coldest: float, hottest: float, critical: float, count: int) -> tuple[float, ...]:
    """Temperatures [K] that grow denser towards the critical one, where the densities of both phases meet."""
    first, last = (critical - coldest) ** 0.5, (critical - hottest) ** 0.5
    roots = (first + (last - first) * number / (count - 1) for number in range(count))
    return tuple(round(critical - root * root, 6) for root in roots)


PLANS: dict[str, Plan] = {
    "CO2": Plan("CO2", _towards_critical(216.592, 303.9, 304.1282, 240), 17, None),
    "air": Plan("Air", tuple(150.0 + 2.5 * number for number in range(77)), 33, 400.0),
    "N2": Plan("Nitrogen", tuple(150.0 + 2.5 * number for number in range(77)), 33, 400.0),
}


def tables_of(name: str) -> dict[str, Any]:
    """Return the table of a fluid as plain data, with where its numbers come from."""
    import CoolProp
    from CoolProp.CoolProp import get_BibTeXKey, set_reference_state

    plan = PLANS[name]
    if plan.densest is None:
        set_reference_state(plan.coolprop_name, "IIR")
    rows = [row_at(plan, temperature) for temperature in plan.temperatures]
    return {
        "fluid": name,
        "source": f"CoolProp {CoolProp.__version__}, HEOS, equation of state "
        f"{get_BibTeXKey(plan.coolprop_name, 'EOS')}",
        "reference": _REFERENCES[name],
        "made_by": "python scripts/fluid_tables.py",
        "units": "K, kg/m^3, J/kg, J/(kg K); factors P/(rho R T) and shares of the densest gas are plain numbers",
        "gas_constant": _gas_constant(plan.coolprop_name),
        "shares": [number / (plan.share_count - 1) for number in range(plan.share_count)],
        "temperatures": list(plan.temperatures),
        **{column: [row[column] for row in rows] for column in rows[0]},
    }


def row_at(plan: Plan, temperature: float) -> dict[str, Any]:
    """Return every column of a table at one temperature [K]."""
    from CoolProp.CoolProp import PropsSI

    row: dict[str, Any] = {}
    densest = plan.densest
    if densest is None:
        densest = PropsSI("D", "T", temperature, "Q", 1, plan.coolprop_name)
        row["liquid_densities"] = PropsSI("D", "T", temperature, "Q", 0, plan.coolprop_name)
        row["liquid_energies"] = PropsSI("U", "T", temperature, "Q", 0, plan.coolprop_name)
    shares = [number / (plan.share_count - 1) for number in range(plan.share_count)]
    cells = [_cell(plan, temperature, share, densest) for share in shares]
    row |= {"densest": densest, "factors": [cell[0] for cell in cells], "energies": [cell[1] for cell in cells]}
    return row


def _cell(plan: Plan, temperature: float, share: float, densest: float) -> tuple[float, float]:
    """Return the factor P/(rho R T) and the energy [J/kg] of gas; saturated vapour where the fluid has a liquid."""
    from CoolProp.CoolProp import PropsSI

    name = plan.coolprop_name
    if share == 1.0 and plan.densest is None:
        pressure, energy = (PropsSI(key, "T", temperature, "Q", 1, name) for key in "PU")
    else:
        density = max(share, 1e-9) * densest
        pressure, energy = (PropsSI(key, "T|gas", temperature, "D", density, name) for key in "PU")
        densest, share = density, 1.0
    return pressure / (share * densest * _gas_constant(name) * temperature), energy


def _gas_constant(coolprop_name: str) -> float:
    from CoolProp.CoolProp import PropsSI

    return float(PropsSI("gas_constant", coolprop_name) / PropsSI("molar_mass", coolprop_name))


def table_text(document: dict[str, Any]) -> str:
    """Return a table as JSON with one line for each key or row, so that a change can be read."""
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and isinstance(value[0], list):
            rows = ",\n".join(f"  {json.dumps(_rounded(row))}" for row in value)
            lines.append(f"{json.dumps(key)}: [\n{rows}\n ]")
        else:
            lines.append(f"{json.dumps(key)}: {json.dumps(_rounded(value))}")
    return "{\n " + ",\n ".join(lines) + "\n}\n"


def _rounded(value: Any) -> Any:
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def main(folder: Path) -> None:
    """Write the tables of all fluids into a folder."""
    for name in PLANS:
        write_file(folder / f"{name}.json", table_text(tables_of(name)).encode())


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python scripts/fluid_tables.py FOLDER")
    main(Path(sys.argv[1]))
