"""Sections that scenario and walk files have in common: energy balance of the gas, and the lines of the supply."""

from ppafo.errors import ScenarioError
from ppafo.model.regulator import SupplyLines
from ppafo.parameters.device import Device
from ppafo.simulation.declaration import THERMAL, THERMAL_GAS, kind_at, value_at
from ppafo.simulation.reading import Reading, quantity_text
from ppafo.simulation.scenario import Assumption, Thermal
from ppafo.simulation.supply_line import LINES, SECTION, entries, line_quantities
from ppafo.units import format_quantity


def read_thermal(reading: Reading) -> Thermal | None:
    """Return how the gas takes up heat in SI, None where it keeps its temperature."""
    if kind_at(reading.document, "gas_model") != THERMAL:
        return None
    values = reading.section("gas_model", THERMAL_GAS)
    return Thermal(
        heat_transfer_coefficient=values["heat_transfer_coefficient"], area_per_volume=values["wall_area_per_volume"]
    )


def read_supply_lines(reading: Reading, device: Device) -> SupplyLines | None:
    """Return the lines of a file in SI, None where it has no such section: then supply pressures are constant.

    ScenarioError where dorsiflexion is set to more than the line has that feeds its regulator.
    """
    if value_at(reading.document, SECTION) is None:
        return None
    supply = device.supply
    if supply.dorsiflexion_pressure > supply.pressure:
        first, second = (
            quantity_text(pressure, "Pa_a", supply.atmospheric_pressure)
            for pressure in (supply.pressure, supply.dorsiflexion_pressure)
        )
        raise ScenarioError(
            f"{reading.file}: [{SECTION}]: its second regulator is fed by the first, so "
            f"supply.dorsiflexion_pressure, {second}, cannot be above supply.pressure, {first}"
        )
    first_line, second_line = (reading.section(f"{SECTION}.{line}", line_quantities(line)) for line in LINES)
    return SupplyLines(
        droop_1=first_line["droop"],
        largest_flow_1=first_line["largest_flow"],
        volume_1=first_line["volume"],
        droop_2=second_line["droop"],
        largest_flow_2=second_line["largest_flow"],
        volume_2=second_line["volume"],
        relieving=float(supply.relieving),
    )


def assumed_lines(reading: Reading) -> tuple[Assumption, ...]:
    """Return the values of the lines that the file leaves to their defaults, with the reason for each."""
    if value_at(reading.document, SECTION) is None:
        return ()
    return tuple(
        Assumption(f"{SECTION}.{path}", format_quantity(entry.value, entry.unit), f"{entry.origin}: {entry.source}")
        for path, entry in entries().items()
        if value_at(reading.document, f"{SECTION}.{path}") is None
    )
