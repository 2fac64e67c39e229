"""The regulators and lines that feed a device: what a file may state, in SI units, and the defaults."""

import functools
import tomllib
from dataclasses import replace
from importlib import resources

from ppafo.model.declaration import Quantity
from ppafo.parameters.provenance import Entry
from ppafo.units import to_si

SECTION = "supply_line"
LINES = ("plantarflexion", "dorsiflexion")
"""Behind the bottle's regulator, and behind the second one on the device, which the first line feeds."""

_REGULATED = (
    Quantity("droop", "Pa s/kg", "fall of the line pressure per mass flow", None, 1.0, 1.0e10),
    Quantity("largest_flow", "kg/s", "what the regulator passes at most", None, 1.0e-6, 1.0),
    Quantity("volume", "m^3", "room for gas between regulator and valve", None, 1.0e-6, 1.0e-2),
)


@functools.cache
def entries() -> dict[str, Entry]:
    """Return the defaults for what ``[supply_line]`` does not give, by path such as ``dorsiflexion.droop``."""
    document = tomllib.loads((resources.files("ppafo.simulation") / "supply_line.toml").read_text(encoding="utf-8"))
    return {
        f"{line}.{item.name}": Entry.model_validate(document[line][item.name]) for line in LINES for item in _REGULATED
    }


@functools.cache
def line_quantities(line: str) -> tuple[Quantity, ...]:
    """Return what a file may state of one line, with defaults in SI."""
    found = ((item, entries()[f"{line}.{item.name}"]) for item in _REGULATED)
    return tuple(replace(item, default=to_si(entry.value, entry.unit, item.unit)) for item, entry in found)


def paths() -> dict[str, Quantity]:
    """Return the declaration of every number of both lines, by path such as ``supply_line.dorsiflexion.droop``."""
    return {f"{SECTION}.{line}.{item.name}": item for line in LINES for item in line_quantities(line)}
