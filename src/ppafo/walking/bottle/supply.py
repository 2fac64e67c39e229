"""Gas bottle of a walk file: parameters, gas downstream of the regulator, and settings that conflict with a bottle."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.constants import GRAMS_PER_KILOGRAM, UNIVERSAL_GAS_CONSTANT
from ppafo.errors import Faults, ParameterError, ScenarioError, refused_as
from ppafo.model.cold_gas import Isobar, SupplyNow, SupplyState, following_rates, isobar, supply_now
from ppafo.model.declaration import Quantity
from ppafo.model.gas import specific_gas_constant
from ppafo.model.source import content_energy, densest_gas, has_liquid, liquid_density
from ppafo.parameters.bottles.bottle import PATHS, Bottle, load_bottle
from ppafo.parameters.declared import kind_at, value_at
from ppafo.parameters.device import Device
from ppafo.parameters.parameter_set import Entry
from ppafo.simulation.declaration import SUPPLY_LINE, THERMAL
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.scenario import SupplyLine
from ppafo.units import format_quantity, to_si
from ppafo.units.shown import shown_text

BOTTLE = "bottle"
BOTTLE_NAME = f"{BOTTLE}.name"
FILL = Quantity(
    "fill", "1", "initial gas in the bottle, as a fraction of a full bottle", 1.0, 0.0, 1.0, minimum_allowed=False
)
TEMPERATURE = Quantity("temperature", "K", "temperature of bottle, regulator and hose at the start", None, 200.0, 400.0)
LEAST_TORQUE = Quantity(
    "least_torque", "1", "torque below which the walk ends, as a fraction of the torque at set pressure", 0.9, 0.0, 1.0
)
COUPLING = Quantity("coupling", "s", "time between two exchanges of bottle and device", 0.1, 1.0e-3, 1.0)
SET_PRESSURE = "regulator.set_pressure"
BOTTLE_OVERRIDES = {path if path.startswith(f"{BOTTLE}.") else f"{BOTTLE}.{path}": path for path in PATHS}
"""Values of the bottle file that overrides may set, such as ``bottle.volume`` or ``bottle.regulator.area``, by path."""

BOTTLE_NUMBERS = (FILL, TEMPERATURE, LEAST_TORQUE, COUPLING)

_OWN = tuple(f"{SUPPLY_LINE}.plantarflexion.{name}" for name in ("droop", "largest_flow"))
"""Settings of the supply line that are replaced by the bottle's regulator."""

_SAME_GAS = 1.0e-2
"""Relative difference up to which the gas constants of bottle and device count as equal: same species, two sources."""
_SAME_PRESSURE = 2.0e-3
"""Relative difference up to which two pressures count as equal, for rounding in unit conversion."""
_FASTEST = 1.0e3
"""Largest thermal rate [1/s] that a walk can resolve: a time constant of a millisecond, the step of the simulation."""


@dataclass(frozen=True, slots=True)
class BottleSupply:
    """Gas bottle that supplies a walk, in SI units.

    - ``bottle``: the bottle with its fluid and regulator
    - ``line``: gas properties at the regulator's set pressure, which is the supply pressure of the device
    - ``mass``: gas in the bottle at the start [kg]
    - ``temperature``: temperature of all parts at the start [K]
    - ``least_torque``: fraction of the torque at the set pressure below which the walk ends [-]
    - ``coupling``: interval between two exchanges of data with the device [s]
    """

    bottle: Bottle
    line: Isobar
    mass: float
    temperature: float
    least_torque: float
    coupling: float

    def start(self) -> SupplyState:
        """Return the initial state: all parts at the same temperature, no ice."""
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
        """Return pressures, temperatures and largest flow of the supply in a given state.

        ``near`` is an estimate of the temperature of the content [K], ``mass`` the mass that the device drew in the
        last coupling interval [kg].
        """
        return supply_now(self.bottle.fluid.table, self.line, self.bottle.supply, state, near, mass)

    def offers_first(self) -> SupplyNow:
        """Return pressures, temperatures and largest flow of the supply in the initial state."""
        return self.offers(self.start(), self.temperature, 0.0)

    def fed(self, line: SupplyLine) -> SupplyLine:
        """Return the supply lines with droop and initial largest flow of the bottle's regulator."""
        droop = self.bottle.regulator.droop
        most = self.offers_first().largest_flow
        return replace(line, plantarflexion=replace(line.plantarflexion, droop=droop, largest_flow=most))

    def unresolved(self, flow: float, fastest: float) -> str:
        """Return which part follows a flow [kg/s] at a rate above ``fastest`` [1/s]; empty if none does.

        A bottle of little gas, or a part of little heat capacity, follows within no time.
        """
        bottle = self.bottle
        rates = following_rates(bottle.fluid.table, self.line, bottle.supply, self.mass, flow)
        part = max(rates, key=rates.__getitem__)
        if rates[part] <= fastest:
            return ""
        constant = f"{1.0e3 / rates[part]:.3g} ms"
        return (
            f"the temperature of the {part} has a time constant of {constant}: must be at least {1.0e3 / fastest:g} ms"
        )

    @property
    def assumed(self) -> dict[str, str]:
        """Values of the bottle that are assumed, not taken from a source, by path, each with the reason."""
        return {
            f"{BOTTLE}.{path}": f"{format_quantity(entry.value, entry.unit)}, assumed: {entry.source}"
            for path, entry in self.bottle.entries.items()
            if entry.origin == "assumed"
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the bottle as plain data in SI units, with the source of each value."""
        return {
            "name": self.bottle.name,
            "title": self.bottle.title,
            "gas_mass": self.mass,
            "temperature": self.temperature,
            "least_torque": self.least_torque,
            "coupling": self.coupling,
            "values": {path: asdict(entry) for path, entry in self.bottle.entries.items()},
        }


def read_bottle(reading: DocumentReader, device: Device) -> BottleSupply | None:
    """Return the bottle of a walk file, or None if it names no bottle.

    Raises ScenarioError or ParameterError for a value that cannot be used.
    """
    section = value_at(reading.document, BOTTLE)
    if section is None:
        return None
    if not isinstance(section.get("name"), str):
        raise ScenarioError(
            f"{reading.file}: '{BOTTLE_NAME}' is missing: give the name of a bottle, or the path of its file"
        )
    own = section.get("overrides", ())
    if any(text.partition("=")[0].strip() == SET_PRESSURE for text in own):
        raise ScenarioError(f"{reading.file}: {BOTTLE}.{SET_PRESSURE}: in a walk, set supply.pressure instead")
    with refused_as(ParameterError, f"{reading.file}: [{BOTTLE}]", ParameterError):
        name = section["name"]
        path = Path(name)
        is_file = path.suffix == ".toml" and not path.is_absolute()
        bottle = load_bottle(reading.folder / path if is_file else name, own)
    pressure = device.supply.pressure
    room = device.supply.atmospheric_pressure
    # Gauge is the same at both: a bottle's file knows no atmosphere, and stands in that of the device.
    own_pressure = to_si(bottle.entries[SET_PRESSURE].value, bottle.entries[SET_PRESSURE].unit, "Pa_a", room)
    wrong = Faults()
    if not is_of_bottle(device.gas.molar_mass, bottle):
        species = bottle.fluid.name
        fed = device.gas.species
        choice = f"set gas.species={species}, or choose a bottle of {fed}"
        wrong.append(reading.refusal(BOTTLE_NAME, f"contains {species}, but the device uses {fed}: {choice}"))
    # A bottle of the package is set to the paper's pressure, which does not apply to other devices.
    if path.suffix == ".toml" and abs(own_pressure - pressure) > _SAME_PRESSURE * pressure:
        own_text = shown_text(own_pressure, "Pa_a", atmosphere=room, unit=bottle.entries[SET_PRESSURE].unit)
        problem = f"{name} sets {SET_PRESSURE} to {own_text}, but supply.pressure is"
        problem += f" {shown_text(pressure, 'Pa_a', atmosphere=room)}: set supply.pressure={own_text}"
        wrong.append(ScenarioError(f"{reading.file}: {BOTTLE_NAME}: {problem}"))
    wrong.raise_all()
    # The bottle with its regulator set to the supply pressure of the device, in its entries too.
    entry = Entry(value=pressure, unit="Pa_a", origin="derived", source="supply.pressure of the walk")
    regulator = bottle.regulator._replace(set_pressure=pressure)
    bottle = replace(bottle, regulator=regulator, entries={**bottle.entries, SET_PRESSURE: entry})
    # The default temperature at the start is the one of the room.
    at_room = replace(TEMPERATURE, default=bottle.room_temperature)
    items = (at_room if quantity is TEMPERATURE else quantity for quantity in BOTTLE_NUMBERS)
    numbers = {quantity.name: reading.number(f"{BOTTLE}.{quantity.name}", quantity) for quantity in items}
    nodes = bottle.fluid.table.temperatures
    if not nodes[0] < numbers["temperature"] <= nodes[-1]:
        known = f"must be above {nodes[0]:g} K and at most {nodes[-1]:g} K, the data range of {bottle.fluid.name}"
        raise reading.refusal(f"{BOTTLE}.temperature", known)
    mass = numbers["fill"] * bottle.mass
    table = bottle.fluid.table
    most = bottle.volume * (liquid_density if has_liquid(table) else densest_gas)(table, numbers["temperature"])
    if mass >= most:
        fits = f"only {GRAMS_PER_KILOGRAM * most:.4g} g fit into the bottle at {numbers['temperature']:g} K"
        given = f"{GRAMS_PER_KILOGRAM * mass:.4g} g of {bottle.fluid.name}"
        raise ScenarioError(f"{reading.file}: [{BOTTLE}]: {BOTTLE}.fill is {given}, but {fits}")
    line = isobar(bottle.fluid.table, bottle.regulator.set_pressure)
    supply = BottleSupply(
        bottle,
        line,
        mass,
        # The order of BOTTLE_NUMBERS is that of the fields after the mass.
        *(numbers[quantity.name] for quantity in BOTTLE_NUMBERS if quantity is not FILL),
    )
    if device.supply.relieving:
        raise ScenarioError(f"{reading.file}: supply.relieving: must be false with a bottle, which takes no gas back")
    if kind_at(reading.document, "gas_model") == THERMAL:
        raise reading.refusal("gas_model.kind", "assumes gas at room temperature; omit gas_model.kind, or the bottle")
    for key in _OWN:
        if value_at(reading.document, key) is not None:
            raise reading.refusal(
                key, f"must be omitted for a walk with a bottle; set {BOTTLE}.regulator.droop or .area"
            )
    if unresolved := supply.unresolved(supply.offers_first().largest_flow, _FASTEST):
        raise reading.refusal(BOTTLE_NAME, unresolved)
    filled = supply.offers_first().content.pressure
    needed = regulator.set_pressure + regulator.pressure_margin
    if filled < needed:
        has, needs = (shown_text(each, "Pa_a", atmosphere=room) for each in (filled, needed))
        raise reading.refusal(BOTTLE_NAME, f"has {has} at the start, but its regulator needs {needs}")
    return supply


def is_of_bottle(molar_mass: float, bottle: Bottle) -> bool:
    """Tell whether a molar mass [kg/mol] agrees with the gas of a bottle."""
    ratio = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) / bottle.fluid.table.gas_constant
    return abs(ratio - 1.0) <= _SAME_GAS
