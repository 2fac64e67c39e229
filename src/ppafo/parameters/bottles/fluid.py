"""Fluid of a bottle: property table by name, and gas mass from fill pressure and temperature.

The tables are made from CoolProp.
"""

import functools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources

from ppafo.errors import ParameterError
from ppafo.model.source import FluidTable, fluid_pressure, gas_density, has_liquid
from ppafo.parameters.bottles.declaration import FILL_BY_PRESSURE
from ppafo.parameters.parameter_set import Entry
from ppafo.units.shown import shown_text
from ppafo.wording import known_names, said_missing

_TABLES = resources.files("ppafo.parameters.bottles") / "fluid_tables"
_SUFFIX = ".json"


@dataclass(frozen=True, slots=True)
class Fluid:
    """Fluid: name, property table, and source of the numbers."""

    name: str
    table: FluidTable
    source: str


def list_fluids() -> tuple[str, ...]:
    """Return the names of the fluids that have a property table."""
    return tuple(sorted(file.name.removesuffix(_SUFFIX) for file in _TABLES.iterdir() if file.name.endswith(_SUFFIX)))


@functools.cache
def load_fluid(name: str) -> Fluid:
    """Load a fluid by name. Raises ParameterError if it has no property table."""
    available = list_fluids()
    if name not in available:
        raise ParameterError(f"there is no property table for '{name}'{known_names(name, available)}")
    content = json.loads((_TABLES / f"{name}{_SUFFIX}").read_text(encoding="utf-8"))
    table = FluidTable(
        gas_constant=content["gas_constant"],
        temperatures=tuple(content["temperatures"]),
        fractions=tuple(content["shares"]),
        densest=tuple(content["densest"]),
        liquid_densities=tuple(content.get("liquid_densities", ())),
        liquid_energies=tuple(content.get("liquid_energies", ())),
        factors=tuple(map(tuple, content["factors"])),
        energies=tuple(map(tuple, content["energies"])),
    )
    return Fluid(name, table, f"{content['source']}; reference {content['reference']}")


def check_temperature(path: str, temperature: float, fluid: Fluid, file: str) -> None:
    """Raise ParameterError for a temperature [K] that the property table of the fluid does not cover."""
    coldest, hottest = fluid.table.temperatures[0], fluid.table.temperatures[-1]
    if not coldest < temperature <= hottest:
        raise ParameterError(
            f"{file}: {path} = {temperature:g} K: must be above {coldest:g} K and at most {hottest:g} K, the range "
            f"of the properties of {fluid.name}"
        )


def filled_mass(values: Mapping[str, float], entries: Mapping[str, Entry], fluid: Fluid, file: str) -> float:
    """Return the mass of gas in a full bottle [kg], stated directly or by pressure and temperature.

    ``values`` are numbers of a bottle in SI by path, ``entries`` the same as given. Raises ParameterError if none or
    both of the forms are given, or if pressure and temperature do not determine the mass.
    """
    by_pressure = [f"bottle.{quantity.name}" for quantity in FILL_BY_PRESSURE]
    given = [path for path in by_pressure if path in values]
    # Exactly one form: by mass, or by pressure and temperature.
    if ("bottle.gas_mass" in values) == bool(given):
        raise ParameterError(f"{file}: give either bottle.gas_mass or {' and '.join(by_pressure)}")
    if not given:
        return values["bottle.gas_mass"]
    missing = [path for path in by_pressure if path not in values]
    if missing:
        raise ParameterError(f"{file}: {said_missing(missing)}, which {given[0]} requires")
    pressure, temperature = (values[path] for path in by_pressure)
    check_temperature("bottle.fill_temperature", temperature, fluid, file)
    # Above the saturated vapour the rest is liquid: pressure and temperature then leave the mass open.
    highest = fluid_pressure(fluid.table, temperature, math.inf)
    if highest < pressure:
        path = "bottle.fill_pressure"
        limit = f"{shown_text(highest, 'Pa_a', '.4g', unit=entries[path].unit)} at {temperature:g} K"
        raise ParameterError(
            f"{file}: {path}: {fluid.name} is liquid above {limit}; give bottle.gas_mass instead"
            if has_liquid(fluid.table)
            else f"{file}: {path}: the property table of {fluid.name} ends at {limit}; give a lower pressure"
        )
    return values["bottle.volume"] * gas_density(fluid.table, temperature, pressure)
