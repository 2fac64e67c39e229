"""The fluids of the package by name: property tables that were made from CoolProp, read from its data."""

import functools
import json
from dataclasses import dataclass
from importlib import resources

from ppafo.errors import ParameterError, nearest_name
from ppafo.model.source import FluidTable

_FOLDER = resources.files("ppafo.parameters.bottles") / "fluid_tables"
_SUFFIX = ".json"


@dataclass(frozen=True, slots=True)
class Fluid:
    """A fluid: name, table of its properties, and where the numbers come from."""

    name: str
    table: FluidTable
    source: str


def list_fluids() -> tuple[str, ...]:
    """Return the names of the fluids that have a table."""
    return tuple(sorted(item.name.removesuffix(_SUFFIX) for item in _FOLDER.iterdir() if item.name.endswith(_SUFFIX)))


@functools.cache
def load_fluid(name: str) -> Fluid:
    """Return a fluid by name; ParameterError where there is no table of it."""
    known = list_fluids()
    if name not in known:
        raise ParameterError(
            f"there is no property table of '{name}'{nearest_name(name, known)}; available: {', '.join(known)}"
        )
    content = json.loads((_FOLDER / f"{name}{_SUFFIX}").read_text(encoding="utf-8"))
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
