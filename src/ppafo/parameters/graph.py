"""Links between settings: default numbers computed from other numbers unless given explicitly.

Overrides, study columns, tuned and fitted values, exported libraries and FMUs all resolve their settings
here, so that a setting has the same meaning in all of them.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.model.binding import by_recipe, recipe_of
from ppafo.model.columns import gather, over_combinations, over_runs
from ppafo.model.declaration import PlainFunction, quantities_of
from ppafo.units import to_si

ATMOSPHERE_PATH = "supply.atmospheric_pressure"
PRESSURE_PATH, SECOND_PRESSURE_PATH = "supply.pressure", "supply.dorsiflexion_pressure"
TORQUE_CONSTANT_PATH, DISPLACEMENT_PATH = "actuator.torque_constant", "actuator.displacement_per_radian"
SAME_PRESSURE = 1.0e-6
"""Relative difference [-] below which two pressures in different units count as equal."""
_LEVEL, _GAUGE = "Pa_a", "_g"
_COUNTS_FROM_ATMOSPHERE = ("supply.", "initial.", "reference.")


def itself(number: Any) -> Any:
    """Return a number unchanged, the link function of equality."""
    return number


def fill(row: type, numbers: Sequence[Any]) -> Any:
    """Create a row of a NamedTuple class from numbers."""
    return row(*numbers)


@dataclass(frozen=True, slots=True)
class LinkFunction:
    """Function from which the default of a number is computed; takes floats or arrays (runs,).

    The first sources fill ``rows``, NamedTuple classes that declare their numbers, and each row is one argument. The
    remaining sources are single arguments. The scalar form can be translated to C. ``stages``, if any, are two
    functions that give the same number: the first takes the same arguments and is common to several links, its results
    are arguments of the second.
    """

    sources: tuple[str, ...]
    function: PlainFunction = itself
    rows: tuple[type, ...] = ()
    stages: tuple[PlainFunction, PlainFunction] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the function by its recipe, since it may not be defined in a module."""
        return _term, (self.sources, recipe_of(self.function), self.rows, recipe_of(self.stages))

    def number(self, present: Callable[[str], Any], computed: dict[Any, Any] | None = None) -> Any:
        """Return the function value, with sources read by ``present``.

        ``computed`` keeps results of first stages, which links with the same sources use again.
        """
        numbers = [present(source) for source in self.sources]
        if self.function is itself:
            return numbers[0]
        if self.stages is None:
            return over_runs(lambda *numbers: self.function(*self.arguments(numbers)), *numbers)
        first, second = self.stages
        computed, key = {} if computed is None else computed, (first, self.sources)
        if key not in computed:
            computed[key] = over_combinations(lambda *numbers: first(*self.arguments(numbers)), *numbers)
        results, combination_of_run = computed[key]
        return gather([float(second(*result)) for result in results], combination_of_run)

    def arguments(self, numbers: Sequence[Any], filled: Callable[[type, Sequence[Any]], Any] = fill) -> list[Any]:
        """Convert source numbers to function arguments; ``filled`` builds a row from its numbers."""
        arguments: list[Any] = []
        rest = list(numbers)
        for row in self.rows:
            size = len(quantities_of(row))
            arguments.append(filled(row, rest[:size]))
            rest = rest[size:]
        return arguments + rest


def _term(sources: tuple[str, ...], recipe: Any, rows: Any, stages: Any) -> LinkFunction:
    return LinkFunction(sources, by_recipe(recipe), rows, by_recipe(stages))


@dataclass(frozen=True, slots=True)
class LinkedDefault:
    """Default of a number [SI]: sum of functions of other numbers, and an offset ``gap``.

    With ``when_set`` the link acts only if its first source is given directly, not if that source follows another
    number.
    """

    terms: tuple[LinkFunction, ...]
    gap: float = 0.0
    when_set: bool = False

    @property
    def sources(self) -> tuple[str, ...]:
        """Paths of the source numbers."""
        return tuple(source for term in self.terms for source in term.sources)

    @property
    def is_same(self) -> bool:
        """True if the number equals its single source."""
        return not self.gap and [term.function for term in self.terms] == [itself]

    def number(self, present: Callable[[str], Any], computed: dict[Any, Any] | None = None) -> Any:
        """Return the default computed from its sources, read by ``present``; ``computed`` as in LinkFunction."""
        first, *others = (term.number(present, computed) for term in self.terms)
        total = sum(others, first)
        return total + self.gap if self.gap else total


def follows(source: str, gap: float = 0.0, when_set: bool = False) -> LinkedDefault:
    """Return a link to a single source number plus an offset ``gap``."""
    return LinkedDefault((LinkFunction((source,)),), gap, when_set)


Graph = Mapping[str, tuple[LinkedDefault, ...]]
"""Links by path of the dependent number; the first link with a changed source acts. Sources come first."""


def counts_from(path: str, atmosphere: float) -> float:
    """Return the zero [Pa absolute] of a gauge pressure at a path.

    Pressures of supply, start and reference are relative to the atmosphere of the device. Pressures of controllers and
    sensors are relative to the standard atmosphere, whatever the weather.
    """
    fixed = fixed_zero(path)
    return atmosphere if fixed is None else fixed


def fixed_zero(path: str) -> float | None:
    """Return the standard atmosphere [Pa] if it is the gauge zero of a path, None for the device's atmosphere."""
    return None if path.startswith(_COUNTS_FROM_ATMOSPHERE) else STANDARD_ATMOSPHERE


def gauge_link(path: str, value: float, unit: str) -> tuple[LinkedDefault, ...]:
    """Return the link of a gauge pressure to the atmosphere; empty for any other number."""
    if not unit.endswith(_GAUGE) or path == ATMOSPHERE_PATH or not path.startswith(_COUNTS_FROM_ATMOSPHERE):
        return ()
    return (follows(ATMOSPHERE_PATH, to_si(value, unit, _LEVEL, 0.0)),)


def acting(graph: Graph, set_paths: Collection[str], turned: Collection[str] = ()) -> dict[str, LinkedDefault]:
    """Return the links that change a number when the numbers at ``set_paths`` are given, in evaluation order.

    Numbers at the paths of ``turned`` have new terms and are recomputed in any case.
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
    graph: Graph, replaced: Mapping[str, Any], present: Mapping[str, Any], anew: Graph | None = None
) -> dict[str, Any]:
    """Return the given numbers and all numbers computed from them by the links that hold in ``present``.

    Links in ``anew`` take the place of those that hold, as where an orifice is given in its other form.
    """
    held = holding(graph, present)
    links = held | {path: link for path, link in (anew or {}).items() if path in held}
    turned = [path for path in held if links[path] != held[path]]
    moved = dict(replaced)
    # Sources precede their followers: a number that was a source of a first stage does not change after it.
    computed: dict[Any, Any] = {}
    for path, link in acting(links, replaced, turned).items():
        moved[path] = link.number(lambda source: moved[source] if source in moved else present[source], computed)
    return moved


def left(graph: Graph, replaced: Collection[str]) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links that remain after numbers are given; an acting link with ``when_set`` replaces the others."""
    changed = acting(graph, replaced)
    return {
        path: (changed[path],) if path in changed and changed[path].when_set else links
        for path, links in graph.items()
        if path not in replaced
    }


def outside(graph: Graph, *sections: str) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links of all numbers outside the given sections, such as ``controller``."""
    return {path: links for path, links in graph.items() if path.partition(".")[0] not in sections}


def holding(graph: Graph, present: Mapping[str, Any]) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links satisfied by the numbers ``present``, which may have been changed independently."""
    links_held: dict[str, tuple[LinkedDefault, ...]] = {}
    computed: dict[Any, Any] = {}
    for path, links in graph.items():
        for link in links:
            number, followed = present[path], link.number(present.__getitem__, computed)
            # Exactly, unless two pressures were given: what follows was computed by this same link.
            is_held = (
                np.isclose(number, followed, rtol=SAME_PRESSURE, atol=0.0) if link.when_set else number == followed
            )
            if np.all(is_held):
                links_held[path] = (*links_held.get(path, ()), link)
    return links_held
