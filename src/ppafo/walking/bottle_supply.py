"""The bottle that a walking device hangs on: what a walk file says of it, in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import ParameterError, ScenarioError
from ppafo.model.cold_gas import Isobar, SupplyNow, SupplyState, following_rates, isobar, supply_now
from ppafo.model.declaration import Quantity
from ppafo.model.fluid_table import densest_gas, has_liquid, liquid_density
from ppafo.model.regulator import SupplyLines
from ppafo.model.source import content_energy
from ppafo.parameters.bottles.bottle import PATHS, Bottle, load_bottle
from ppafo.parameters.device import Device
from ppafo.parameters.provenance import Entry
from ppafo.simulation.declaration import SUPPLY_LINE, THERMAL, kind_at, value_at
from ppafo.simulation.reading import Reading, quantity_text
from ppafo.units import format_quantity

SECTION = "bottle"
NAME = f"{SECTION}.name"
FILL = Quantity("fill", "1", "gas in the bottle over that of a full one", 1.0, 0.0, 1.0, minimum_allowed=False)
TEMPERATURE = Quantity("temperature", "K", "temperature of bottle, regulator and hose at the start", None, 200.0, 400.0)
LEAST_TORQUE = Quantity("least_torque", "1", "torque that ends the walk, over that at the set pressure", 0.9, 0.0, 1.0)
COUPLING = Quantity("coupling", "s", "how often bottle and device tell each other", 0.1, 1.0e-3, 1.0)
_SET_PRESSURE = "regulator.set_pressure"
OVERRIDES = {path if path.startswith(f"{SECTION}.") else f"{SECTION}.{path}": path for path in PATHS}
"""What an override may set of the bottle's own file, ``bottle.volume`` and ``bottle.regulator.area``, by its path."""

NUMBERS = (FILL, TEMPERATURE, LEAST_TORQUE, COUPLING)

_FOLLOWS = {
    "content": f"set {SECTION}.gas_mass higher, or {SECTION}.content_heat_transfer lower",
    "wall": f"set {SECTION}.wall_heat_capacity higher",
    "regulator": f"set {SECTION}.regulator.heat_capacity higher",
    "hose": f"set {SECTION}.hose.heat_capacity higher",
}
"""What makes a part of the supply follow more slowly."""

_OWN = tuple(f"{SUPPLY_LINE}.plantarflexion.{name}" for name in ("droop", "largest_flow"))
"""What the bottle's own regulator says instead."""

_SAME_GAS, _SAME_PRESSURE = 1.0e-2, 2.0e-3
_FASTEST = 1.0e3
"""Rate [1/s] up to which a walk follows what warms and cools: within a millisecond, the step of the lanes."""


@dataclass(frozen=True, slots=True)
class BottleSupply:
    """The bottle that a walk hangs on, in SI: gas [kg] and temperature [K] at the start, ``coupling`` [s].

    ``line`` are the properties of the gas behind its regulator, which is set to the supply pressure of the device.
    ``least_torque`` is the torque over that at the set pressure [-] below which the walk ends.
    """

    bottle: Bottle
    line: Isobar
    mass: float
    temperature: float
    least_torque: float
    coupling: float

    def start(self) -> SupplyState:
        """Return the state at the start: all parts at one temperature, no ice."""
        energy = content_energy(self.bottle.fluid.table, self.mass, self.bottle.volume, self.temperature)
        return SupplyState(
            mass=self.mass,
            energy=energy,
            wall_temperature=self.temperature,
            body_temperature=self.temperature,
            hose_temperature=self.temperature,
            ice=0.0,
            outflow=0.0,
            delivered=0.0,
            room_heat=0.0,
        )

    def offers(self, state: SupplyState, near: float, mass: float) -> SupplyNow:
        """Return what the supply offers in a state whose content is ``near`` a temperature [K].

        ``mass`` [kg] is what the device drew in the last coupling.
        """
        return supply_now(self.bottle.fluid.table, self.line, self.bottle.supply, state, near, mass)

    def offers_first(self) -> SupplyNow:
        """Return what the supply offers the device at the start."""
        return self.offers(self.start(), self.temperature, 0.0)

    def device_at_start(self, device: Device) -> Device:
        """Return the device with gas of the temperature that the supply has at the start."""
        return replace(device, gas=replace(device.gas, temperature=self.offers_first().gas_temperature))

    def lines(self, lines: SupplyLines) -> SupplyLines:
        """Return the lines with the droop of the bottle's regulator, and with what it passes at the start."""
        most = self.offers_first().largest_flow
        return lines._replace(droop_1=self.bottle.regulator.droop, largest_flow_1=most)

    @property
    def assumed(self) -> dict[str, str]:
        """Return the values of the bottle that no source gives, by path, with the reason for each."""
        return {
            f"{SECTION}.{path}": f"{format_quantity(entry.value, entry.unit)}, assumed: {entry.source}"
            for path, entry in self.bottle.entries.items()
            if entry.origin == "assumed"
        }

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data in SI units, with the source of each value."""
        return {
            "name": self.bottle.name,
            "title": self.bottle.title,
            "gas_mass": self.mass,
            "temperature": self.temperature,
            "least_torque": self.least_torque,
            "coupling": self.coupling,
            "values": {path: entry.model_dump() for path, entry in self.bottle.entries.items()},
        }


def read_bottle(reading: Reading, device: Device, folder: Path) -> BottleSupply | None:
    """Return the bottle of a walk file, None where it has none; ScenarioError or ParameterError for a mistake."""
    section = value_at(reading.document, SECTION)
    if section is None:
        return None
    if not isinstance(section.get("name"), str):
        raise ScenarioError(f"{reading.file}: '{NAME}' is missing: the name of a bottle, or the path of its file")
    own = section.get("overrides", ())
    if any(text.partition("=")[0].strip() == _SET_PRESSURE for text in own):
        raise ScenarioError(
            f"{reading.file}: {SECTION}.{_SET_PRESSURE}: in a walk the bottle's regulator is set to supply.pressure; "
            f"set that"
        )
    try:
        bottle = load_bottle(_place(section["name"], folder), own)
    except ParameterError as error:
        raise ParameterError(f"{reading.file}: [{SECTION}]: {error}") from error
    _check_set_pressure(reading, bottle, device, section["name"])
    bottle = _set_to_supply(bottle, device)
    numbers = _numbers(reading, section, bottle)
    line = isobar(bottle.fluid.table, bottle.regulator.set_pressure)
    supply = BottleSupply(
        bottle, line, numbers["fill"] * bottle.mass, *(numbers[item.name] for item in NUMBERS if item is not FILL)
    )
    _check(reading, device, supply)
    return supply


def _check_set_pressure(reading: Reading, bottle: Bottle, device: Device, name: str) -> None:
    """Refuse a file that sets its regulator to another pressure; bottles of the package have the paper's pressure."""
    own, given = bottle.regulator.set_pressure, device.supply.pressure
    if Path(name).suffix != ".toml" or abs(own - given) <= _SAME_PRESSURE * given:
        return
    atmosphere = device.supply.atmospheric_pressure
    raise ScenarioError(
        f"{reading.file}: {NAME}: {name} sets {_SET_PRESSURE} to {quantity_text(own, 'Pa_a', atmosphere)}, and "
        f"supply.pressure is {quantity_text(given, 'Pa_a', atmosphere)}: give both the same"
    )


def _set_to_supply(bottle: Bottle, device: Device) -> Bottle:
    """Return the bottle with its regulator set to the supply pressure of the device, in its entries too."""
    pressure = device.supply.pressure
    entry = Entry(value=pressure, unit="Pa_a", origin="derived", source="supply.pressure of the walk")
    regulator = bottle.regulator._replace(set_pressure=pressure)
    return replace(bottle, regulator=regulator, entries={**bottle.entries, _SET_PRESSURE: entry})


def _place(name: str, folder: Path) -> str | Path:
    path = Path(name)
    return folder / path if path.suffix == ".toml" and not path.is_absolute() else name


def _numbers(reading: Reading, section: Mapping[str, Any], bottle: Bottle) -> dict[str, float]:
    """Return the numbers of the section; the bottle starts at the temperature of the room unless one is given."""
    room = replace(TEMPERATURE, default=bottle.room_temperature)
    items = (room if item is TEMPERATURE and TEMPERATURE.name not in section else item for item in NUMBERS)
    found = {item.name: reading.number(f"{SECTION}.{item.name}", item) for item in items}
    nodes = bottle.fluid.table.temperatures
    if not nodes[0] < found["temperature"] <= nodes[-1]:
        known = f"must be above {nodes[0]:g} K and at most {nodes[-1]:g} K, where {bottle.fluid.name} is known"
        raise reading.refusal(f"{SECTION}.temperature", known)
    mass, table = found["fill"] * bottle.mass, bottle.fluid.table
    most = bottle.volume * (liquid_density if has_liquid(table) else densest_gas)(table, found["temperature"])
    if mass >= most:
        fits = f"{GRAMS_PER_KILOGRAM * most:.4g} g fit into it at {found['temperature']:g} K"
        raise ScenarioError(
            f"{reading.file}: [{SECTION}]: {GRAMS_PER_KILOGRAM * mass:.4g} g of {bottle.fluid.name}, and {fits}: set "
            f"{SECTION}.fill or {SECTION}.temperature lower"
        )
    return found


def _check(reading: Reading, device: Device, supply: BottleSupply) -> None:
    """Refuse what does not go with a bottle."""
    fluid, regulator = supply.bottle.fluid, supply.bottle.regulator
    if abs(device.gas.specific_gas_constant / fluid.table.gas_constant - 1.0) > _SAME_GAS:
        raise reading.refusal(NAME, f"holds {fluid.name}, and the device is fed with {device.gas.species}: gas.species")
    if device.supply.relieving:
        raise ScenarioError(f"{reading.file}: supply.relieving: no gas goes back into a bottle; set it to false")
    if kind_at(reading.document, "gas_model") == THERMAL:
        raise reading.refusal("gas_model.kind", "goes with gas that arrives at room temperature, not with a bottle")
    for path in _OWN:
        if value_at(reading.document, path) is not None:
            raise reading.refusal(path, f"the bottle's regulator has its own: set {SECTION}.regulator.droop or .area")
    _check_rates(reading, supply)
    pressure = supply.offers_first().content.pressure
    if pressure < regulator.set_pressure + regulator.pressure_margin:
        has = quantity_text(pressure, "Pa_a", device.supply.atmospheric_pressure)
        needs = quantity_text(
            regulator.set_pressure + regulator.pressure_margin, "Pa_a", device.supply.atmospheric_pressure
        )
        raise reading.refusal(NAME, f"has {has} at the start, and its regulator needs {needs}")


def _check_rates(reading: Reading, supply: BottleSupply) -> None:
    """Refuse a bottle of so little gas, or parts of so little heat capacity, that they follow within no time."""
    flow = supply.offers_first().largest_flow
    rates = following_rates(supply.bottle.fluid.table, supply.line, supply.bottle.supply, supply.mass, flow)
    fastest = max(rates, key=rates.__getitem__)
    if rates[fastest] > _FASTEST:
        raise reading.refusal(
            NAME,
            f"the temperature of its {fastest} follows within {1.0e3 / rates[fastest]:.3g} ms, and a walk follows what "
            f"takes {1.0e3 / _FASTEST:g} ms or more: {_FOLLOWS[fastest]}",
        )
