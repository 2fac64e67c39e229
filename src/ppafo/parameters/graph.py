"""Settings are a graph: a number that nobody gives follows others. Links are declared once, one function resolves them.

Every door takes its settings through here: overrides, columns of studies, tuned and fitted values, exported libraries
and units, episodes of agents. So a setting means the same at all of them.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.model.binding import by_recipe, recipe_of
from ppafo.model.columns import over_runs
from ppafo.model.declaration import PlainFunction, quantities_of
from ppafo.units import to_si

ATMOSPHERE_PATH = "supply.atmospheric_pressure"
PRESSURE_PATH, SECOND_PRESSURE_PATH = "supply.pressure", "supply.dorsiflexion_pressure"
TORQUE_CONSTANT_PATH, DISPLACEMENT_PATH = "actuator.torque_constant", "actuator.displacement_per_radian"
SAME_PRESSURE = 1.0e-6
"""Relative difference below which two pressures are one that was written in two units."""
_LEVEL, _GAUGE = "Pa_a", "_g"
_COUNTS_FROM_ATMOSPHERE = ("supply.", "initial.", "reference.")


def itself(number: Any) -> Any:
    """Return the number that is followed, unchanged."""
    return number


def fill(row: type, numbers: Sequence[Any]) -> Any:
    """A NamedTuple of a class with these numbers."""
    return row(*numbers)


@dataclass(frozen=True, slots=True)
class LinkFunction:
    """A function of other numbers, floats or arrays (runs,), which is one of floats that can be translated to C.

    The first sources fill ``rows``, NamedTuple classes that declare their numbers, one after the other, and are given
    to it as these; the sources after them one by one. ``orifice`` is the section of the orifice, if
    any, whose form decides what is followed, and ``in_other_form`` the term of its other form.
    """

    sources: tuple[str, ...]
    function: PlainFunction = itself
    rows: tuple[type, ...] = ()
    orifice: str = ""
    in_other_form: "LinkFunction | None" = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle with the recipe of the function, which may be one that no module has."""
        return _term, (self.sources, recipe_of(self.function), self.rows, self.orifice, self.in_other_form)

    def number(self, present: Callable[[str], Any]) -> Any:
        """Return what the function makes of what the sources are at ``present``."""
        numbers = [present(source) for source in self.sources]
        if self.function is itself:
            return numbers[0]
        return over_runs(lambda *numbers: self.function(*self.arguments(numbers)), *numbers)

    def arguments(self, numbers: Sequence[Any], filled: Callable[[type, Sequence[Any]], Any] = fill) -> list[Any]:
        """Return the function's arguments from a number for each source; ``filled`` makes a row of its numbers."""
        arguments: list[Any] = []
        rest = list(numbers)
        for row in self.rows:
            size = len(quantities_of(row))
            arguments.append(filled(row, rest[:size]))
            rest = rest[size:]
        return arguments + rest


def _term(sources: tuple[str, ...], recipe: Any, *others: Any) -> LinkFunction:
    return LinkFunction(sources, by_recipe(recipe), *others)


@dataclass(frozen=True, slots=True)
class LinkedDefault:
    """Default of a number as a function of others, in SI units: the sum of terms and a gap.

    ``when_set``: only where the first source is given itself, not where that one only follows another in its turn.
    """

    terms: tuple[LinkFunction, ...]
    gap: float = 0.0
    when_set: bool = False

    @property
    def sources(self) -> tuple[str, ...]:
        """Paths of the numbers that it follows."""
        return tuple(source for term in self.terms for source in term.sources)

    @property
    def is_same(self) -> bool:
        """Tell whether the number equals its source."""
        return not self.gap and [term.function for term in self.terms] == [itself]

    def number(self, present: Callable[[str], Any]) -> Any:
        """Return what follows from what the sources are at ``present``."""
        first, *others = (term.number(present) for term in self.terms)
        total = sum(others, first)
        return total + self.gap if self.gap else total


def follows(source: str, gap: float = 0.0, when_set: bool = False) -> LinkedDefault:
    """Return the link to one number, with what is added to it."""
    return LinkedDefault((LinkFunction((source,)),), gap, when_set)


Graph = Mapping[str, tuple[LinkedDefault, ...]]
"""Links by the path of what follows; of several the first whose sources change counts. Sources stand before those."""


def counts_from(path: str, atmosphere: float) -> float:
    """Return from which pressure [Pa absolute] a gauge pressure at a path counts.

    Pressures of the supply, of the start and of a reference count from the atmosphere of the device; what a controller
    or a sensor is set to knows no weather and counts from the standard atmosphere.
    """
    fixed = fixed_zero(path)
    return atmosphere if fixed is None else fixed


def fixed_zero(path: str) -> float | None:
    """Return the standard atmosphere [Pa] where a gauge pressure at a path counts from that, None from the device's."""
    return None if path.startswith(_COUNTS_FROM_ATMOSPHERE) else STANDARD_ATMOSPHERE


def gauge_link(path: str, value: float, unit: str) -> tuple[LinkedDefault, ...]:
    """Return the link of a pressure level that is given in gauge to the atmosphere; none for any other number."""
    if not unit.endswith(_GAUGE) or path == ATMOSPHERE_PATH or not path.startswith(_COUNTS_FROM_ATMOSPHERE):
        return ()
    return (follows(ATMOSPHERE_PATH, to_si(value, unit, _LEVEL, 0.0)),)


def acting(graph: Graph, set_paths: Collection[str], turned: Collection[str] = ()) -> dict[str, LinkedDefault]:
    """Return the links by which numbers change where those at some paths are given, in the order to resolve them.

    Those at the paths of ``turned`` follow by other terms than before, whatever is given.
    """
    found: dict[str, LinkedDefault] = {}
    for path, links in graph.items():
        if path in set_paths:
            continue
        for link in links:
            if link.sources[0] in set_paths or (
                not link.when_set
                and (path in turned or any(source in set_paths or source in found for source in link.sources))
            ):
                found[path] = link
                break
    return found


def resolved(
    graph: Graph, replaced: Mapping[str, Any], present: Mapping[str, Any], orifices: Collection[str] = ()
) -> dict[str, Any]:
    """Return all numbers that are given, and all that follow them by links that still hold of those ``present``.

    Some orifices, by their sections, take the form that they have not.
    """
    held = holding(graph, present)
    links = in_other_forms(held, orifices)
    turned = [path for path in held if links[path] != held[path]]
    numbers, moved = {**present, **replaced}, dict(replaced)
    for path, link in acting(links, replaced, turned).items():
        numbers[path] = moved[path] = link.number(numbers.__getitem__)
    return moved


def paths_in(graph: Graph) -> set[str]:
    """Return all paths that links name: what follows, and what is followed in either form of an orifice."""
    terms = [term for links in graph.values() for link in links for term in link.terms]
    turned = [term.in_other_form for term in terms if term.in_other_form is not None]
    return {*graph, *(source for term in (*terms, *turned) for source in term.sources)}


def in_other_forms(graph: Graph, orifices: Collection[str]) -> Graph:
    """Return the links as they are where some orifices, by their sections, take the form that they have not."""
    if not orifices:
        return graph

    def turned(term: LinkFunction) -> LinkFunction:
        other = term.in_other_form if term.orifice in orifices else None
        return term if other is None else replace(other, in_other_form=replace(term, in_other_form=None))

    return {
        path: tuple(replace(link, terms=tuple(map(turned, link.terms))) for link in links)
        for path, links in graph.items()
    }


def left(graph: Graph, replaced: Collection[str]) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links that remain once numbers are given: links of what is given go, as do links that it replaces."""
    changed = acting(graph, replaced)
    return {
        path: (changed[path],) if path in changed and changed[path].when_set else links
        for path, links in graph.items()
        if path not in replaced
    }


def outside(graph: Graph, *sections: str) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links of the numbers that are in none of some sections, such as ``controller``, which are left out."""
    return {path: links for path, links in graph.items() if path.partition(".")[0] not in sections}


def holding(graph: Graph, present: Mapping[str, Any]) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links that are still true of numbers which may have been changed by other means since."""
    links_held = {path: tuple(link for link in links if _holds(path, link, present)) for path, links in graph.items()}
    return {path: links for path, links in links_held.items() if links}


def _holds(path: str, link: LinkedDefault, present: Mapping[str, Any]) -> bool:
    number, followed = present[path], link.number(present.__getitem__)
    if link.when_set:
        return bool(np.all(np.isclose(number, followed, rtol=SAME_PRESSURE, atol=0.0)))
    # Exactly: what follows was computed by this same link.
    return bool(np.all(number == followed))
