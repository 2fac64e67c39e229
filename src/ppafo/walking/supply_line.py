"""The regulators and lines that feed a walking device: what a walk file may say of them, and what stands in else."""

import functools
import tomllib
from dataclasses import replace
from importlib import resources

from ppafo.errors import ScenarioError
from ppafo.model.declaration import Quantity
from ppafo.model.regulator import SupplyLines
from ppafo.parameters.device import Device
from ppafo.parameters.provenance import Entry
from ppafo.simulation.declaration import value_at
from ppafo.simulation.reading import Reading, written
from ppafo.units import format_quantity, to_si

SECTION = "supply_line"
LINES = ("plantarflexion", "dorsiflexion")
"""Behind the bottle's regulator, and behind the second one on the device, which hangs on the first line."""

_REGULATED = (
    Quantity("droop", "Pa s/kg", "fall of the line pressure per mass flow", None, 1.0, 1.0e10),
    Quantity("largest_flow", "kg/s", "what the regulator passes at most", None, 1.0e-6, 1.0),
    Quantity("volume", "m^3", "room for gas between regulator and valve", None, 1.0e-6, 1.0e-2),
)


@functools.cache
def entries() -> dict[str, Entry]:
    """Return what stands in for a value that a walk file does not give, by path such as ``dorsiflexion.droop``."""
    document = tomllib.loads((resources.files("ppafo.walking") / "supply_line.toml").read_text(encoding="utf-8"))
    return {
        f"{line}.{item.name}": Entry.model_validate(document[line][item.name]) for line in LINES for item in _REGULATED
    }


@functools.cache
def line_quantities(line: str) -> tuple[Quantity, ...]:
    """Return what a walk file may say of one line, with defaults in SI."""
    found = ((item, entries()[f"{line}.{item.name}"]) for item in _REGULATED)
    return tuple(replace(item, default=to_si(entry.value, entry.unit, item.unit)) for item, entry in found)


def supply_lines(reading: Reading, device: Device) -> SupplyLines | None:
    """Return the lines of a walk file in SI, None where it has no such section: then supply pressures are constant.

    ScenarioError where dorsiflexion is set to more than the line has that feeds its regulator.
    """
    if value_at(reading.document, SECTION) is None:
        return None
    supply = device.supply
    if supply.dorsiflexion_pressure > supply.pressure:
        first, second = (
            written(pressure, "Pa_a", supply.atmospheric_pressure)
            for pressure in (supply.pressure, supply.dorsiflexion_pressure)
        )
        raise ScenarioError(
            f"{reading.file}: [{SECTION}]: its second regulator hangs behind the first, so "
            f"supply.dorsiflexion_pressure, {second}, cannot be above supply.pressure, {first}"
        )
    first_line, second_line = (reading.section(f"{SECTION}.{line}", line_quantities(line)) for line in LINES)
    numbers = [values[item.name] for values in (first_line, second_line) for item in _REGULATED]
    return SupplyLines(*[*numbers, float(supply.relieving)])


def assumed_lines(reading: Reading) -> dict[str, str]:
    """Return the values of the lines that the walk file leaves to the package, by path, with the reason for each."""
    if value_at(reading.document, SECTION) is None:
        return {}
    return {
        f"{SECTION}.{path}": f"{format_quantity(entry.value, entry.unit)}, {entry.origin}: {entry.source}"
        for path, entry in entries().items()
        if value_at(reading.document, f"{SECTION}.{path}") is None
    }
