"""Links between settings: default numbers computed from other numbers unless given explicitly.

Overrides, study columns, tuned and fitted values, exported libraries and FMUs all resolve their settings
here, so that a setting has the same meaning in all of them.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.model.columns import over_runs
from ppafo.model.declaration import PlainFunction
from ppafo.units import LEVEL, to_si

ATMOSPHERE_PATH = "supply.atmospheric_pressure"
PRESSURE_PATH = "supply.pressure"
SECOND_PRESSURE_PATH = "supply.dorsiflexion_pressure"
GAS_PATHS = ("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature")
TORQUE_CONSTANT_PATH = "actuator.torque_constant"
DISPLACEMENT_PATH = "actuator.displacement_per_radian"
SAME_PRESSURE = 1.0e-6
"""Relative difference [-] below which two pressures in different units count as equal."""
_GAUGE = "_g"
_COUNTS_FROM_STANDARD = ("controller.", "sensors.")


class Asked(dict[str, Any]):
    """Numbers by path, read by ``present`` when they are asked for; the keys are the paths asked for, in order."""

    def __init__(self, present: Callable[[str], Any]) -> None:
        super().__init__()
        self.present = present

    def __missing__(self, path: str) -> Any:
        self[path] = self.present(path)
        return self[path]


@dataclass(frozen=True, slots=True)
class Link:
    """Default of a number [SI]: a function of the numbers at ``direct``, or ``factor`` times their product, plus gap.

    With ``when`` the link acts only if the number at that path is given directly, not if it follows another number.
    Numbers are floats or arrays (runs,).
    """

    direct: tuple[str, ...]
    function: PlainFunction | None = None
    gap: float = 0.0
    when: str = ""
    factor: float = 1.0

    @property
    def sources(self) -> tuple[str, ...]:
        """Paths of all numbers that decide the default."""
        return self.direct

    def number(self, present: Callable[[str], Any], computed: dict[Any, Any] | None = None) -> Any:
        """Return the default, with sources read by ``present``; ``computed`` keeps what several links have in common.

        Such links must see the same numbers: a source does not change after its first follower was computed.
        """
        found = self.without_gap(present, {} if computed is None else computed)
        return found + self.gap if self.gap else found

    def without_gap(self, present: Callable[[str], Any], computed: dict[Any, Any]) -> Any:  # noqa: ARG002
        """Return the default without its gap."""
        numbers = map(present, self.direct)
        return prod(numbers, start=self.factor) if self.function is None else over_runs(self.function, *numbers)


def follows(source: str, gap: float = 0.0, when_set: bool = False) -> Link:
    """Return a link to a single source number plus an offset ``gap``; with ``when_set`` only if that one is given."""
    return Link((source,), gap=gap, when=source if when_set else "")


Graph = Mapping[str, tuple[Link, ...]]
"""Links by path of the dependent number; the first link with a changed source acts. Sources come first."""


def fixed_zero(path: str) -> float | None:
    """Return the standard atmosphere [Pa] if it is the gauge zero of a path, None for the device's atmosphere.

    Pressures of the device, the start and the reference are relative to the atmosphere of the device. Pressures of
    controllers and sensors are relative to the standard atmosphere, whatever the weather.
    """
    return STANDARD_ATMOSPHERE if path.startswith(_COUNTS_FROM_STANDARD) else None


def gauge_link(path: str, value: float, unit: str) -> tuple[Link, ...]:
    """Return the link of a gauge pressure to the atmosphere; empty for any other number."""
    if not unit.endswith(_GAUGE) or path == ATMOSPHERE_PATH or fixed_zero(path):
        return ()
    return (follows(ATMOSPHERE_PATH, to_si(value, unit, LEVEL, 0.0)),)


def acting(graph: Graph, given: Collection[str], turned: Collection[str] = ()) -> dict[str, Link]:
    """Return the links that change a number when the numbers at ``given`` are given, in evaluation order.

    Numbers at the paths of ``turned`` have other sources than before and are recomputed in any case.
    """
    found: dict[str, Link] = {}
    for path, links in graph.items():
        for link in links if path not in given else ():
            moves = path in turned or any(source in given or source in found for source in link.sources)
            if link.when in given if link.when else moves:
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
    turned = [path for path in held if links[path][0].sources != held[path][0].sources]
    moved = dict(replaced)
    computed = dict[Any, Any]()
    for path, link in acting(links, replaced, turned).items():
        moved[path] = link.number(lambda source: moved[source] if source in moved else present[source], computed)
    return moved


def left(graph: Graph, given: Collection[str]) -> dict[str, tuple[Link, ...]]:
    """Return the links that remain after numbers are given; an acting link with ``when`` replaces the others."""
    changed = acting(graph, given)
    return {
        path: (changed[path],) if path in changed and changed[path].when else links
        for path, links in graph.items()
        if path not in given
    }


def outside(graph: Graph, *sections: str) -> dict[str, tuple[Link, ...]]:
    """Return the links of all numbers outside the given sections, such as ``controller``."""
    return {path: links for path, links in graph.items() if path.partition(".")[0] not in sections}


def holding(graph: Graph, present: Mapping[str, Any]) -> dict[str, tuple[Link, ...]]:
    """Return the links satisfied by the numbers ``present``, which may have been changed independently."""
    held: dict[str, tuple[Link, ...]] = {}
    computed: dict[Any, Any] = {}
    for path, links in graph.items():
        for link in links:
            number = present[path]
            followed = link.number(present.__getitem__, computed)
            # Exactly, unless two pressures were given: what follows was computed by this same link.
            is_held = np.isclose(number, followed, rtol=SAME_PRESSURE, atol=0.0) if link.when else number == followed
            if np.all(is_held):
                held[path] = (*held.get(path, ()), link)
    return held
