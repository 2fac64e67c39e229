"""A bottle of the catalogue of parts as a bottle to be followed: its content and its mass, and the rest in proportion.

A catalogue knows the gas in a bottle and what it weighs empty. The paper's bottle, filled to the same density, stands
in for the rest: volume with the content, heat of the wall with the mass, surfaces with its two thirds power.
"""

import functools
from collections.abc import Mapping

from ppafo.parameters.parts import Part, load_catalogue
from ppafo.parameters.provenance import Entry

_SURFACES = ("bottle.content_heat_transfer", "bottle.room_heat_transfer")
_WALL = 885.0
"""Heat capacity of the paper's bottle over its mass [J/(kg K)]: 400 J/K and 452 g."""


@functools.cache
def bottle_parts() -> Mapping[str, Part]:
    """Return the bottles of the catalogue that comes with the package, by name."""
    return load_catalogue().groups["bottles"]


def scaled_entries(part: Part, paper: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the values of a bottle with the content [kg] and the empty mass [kg] of a part, from the ``paper``'s."""
    content, empty = part.values["content"], part.values["empty_mass"]
    ratio = 1000.0 * content / paper["bottle.gas_mass"].value
    found = {
        "bottle.gas_mass": _entry(1000.0 * content, "g", f"catalogue of parts, {part.name}"),
        "bottle.volume": _entry(paper["bottle.volume"].value * ratio, "cm^3", "filled as densely as the paper's"),
        "bottle.wall_heat_capacity": _entry(_WALL * empty, "J/K", "its empty mass, at 885 J/(kg K) as the paper's"),
    }
    surface = ratio ** (2.0 / 3.0)
    for path in _SURFACES:
        given = paper[path]
        found[path] = _entry(given.value * surface, given.unit, "the paper's bottle, with the surface of its content")
    return dict(paper) | found


def _entry(value: float, unit: str, source: str) -> Entry:
    return Entry(value=value, unit=unit, origin="derived", source=source)
