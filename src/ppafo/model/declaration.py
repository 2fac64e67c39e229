"""How a component declares its parameters: name, unit, range and meaning; what its functions are. No physics.

A number is declared once, as a field of a frozen dataclass or of a NamedTuple:
``area: Annotated[float, Number("m^2", "area of the opening")]``.
"""

import collections
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from types import CodeType
from typing import Annotated, Any, ClassVar, Protocol, get_args, get_origin, get_type_hints

VALVE_LAG, VALVE_DELAY = "lag of the valve", "dead time of the valve"
PRESSURE_LAG, FORCE_LAG = "lag of the pressure sensors", "lag of the force sensors"
"""What a default may follow."""

NOMINAL = {
    name: f"nominal {name.replace('_', ' ')}"
    for name in (
        "flow",
        "gas_product",
        "valve_conductance",
        "leak_conductance",
        "critical_ratio",
        "supply_pressure",
        "dorsiflexion_pressure",
        "atmospheric_pressure",
        "relieving",
        "torque_constant",
        "displacement_per_radian",
        "dead_volume_1",
        "dead_volume_2",
        "chamber_growth",
        "chamber_rest_1",
        "chamber_rest_2",
        "angle_min",
        "angle_max",
        "pair",
        "opening_delay",
        "closing_delay",
        "switching_interval",
        "delay",
        "lag",
        "dead_band",
        "joining_time",
        "line_droop_1",
        "line_largest_flow_1",
        "line_volume_1",
        "line_droop_2",
        "line_largest_flow_2",
        "line_volume_2",
        "line_relieving",
    )
}
"""What a default may follow of the device itself, for a controller that knows it."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """One parameter of a component: name, unit, meaning, default and range, in SI. ``default`` None: it must be given.

    What the default ``follows`` is added to it: some of those above, or of ``control.torque_loop``.
    """

    name: str
    unit: str
    summary: str
    default: float | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    minimum_allowed: bool = True
    follows: tuple[str, ...] = ()


Number = partial(Quantity, "")
"""The quantity that is declared of a field, which has its name."""


@cache
def quantities_of(section: type) -> tuple[Quantity, ...]:
    """Return the numbers that a dataclass or a NamedTuple declares, those of nested NamedTuples in their place.

    They are in the order of its fields; a field without a ``Number`` is none.
    """
    found: list[Quantity] = []
    for name, hint in get_type_hints(section, include_extras=True).items():
        if isinstance(hint, type) and issubclass(hint, tuple):
            found += quantities_of(hint)
        elif (number := number_of(hint)) is not None:
            found.append(replace(number, name=name))
    return tuple(found)


def row_with(name: str, row: Any, **hints: Any) -> Any:
    """Return a NamedTuple class like ``row``, whose named fields have other types; new ones stand behind its own."""
    namedtuple: Any = collections.namedtuple
    annotations = {**row.__annotations__, **hints}
    made = namedtuple(name, annotations, module=row.__module__)
    made.__annotations__ = annotations
    return made


def number_of(hint: Any) -> Quantity | None:
    """Return what the type of a field declares of a number, None where it declares none."""
    declared = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((item for item in declared if isinstance(item, Quantity)), None)


class Holding(Protocol):
    """A section of a scenario or device that has numbers of its fields ``HELD``, mappings or objects, as its own."""

    HELD: ClassVar[tuple[str, ...]]


def held_in(section: Holding, name: str) -> str | None:
    """Return which field of ``HELD`` has a number; None where none has it."""
    for field in section.HELD:
        inner = getattr(section, field)
        if name in inner if isinstance(inner, Mapping) else hasattr(inner, name):
            return field
    return None


def held(section: Holding, name: str) -> Any:
    """Return a number of one of the fields of ``HELD``, for ``__getattr__``; AttributeError where none has it."""
    # A copy asks for names that begin so, and for the fields themselves, before there are any.
    if not name.startswith("_") and name not in section.HELD:
        field = held_in(section, name)
        if field is not None:
            inner = getattr(section, field)
            return inner[name] if isinstance(inner, Mapping) else getattr(inner, name)
    raise AttributeError(f"{type(section).__name__} has no '{name}'")


def range_rule(quantity: Quantity, limits: str) -> str:
    """Return what a value out of range must be, such as "must be at least 0 m^2 (open area)"."""
    return f"must be {limits}" + (f" ({quantity.summary})" if quantity.summary else "")


class PlainFunction(Protocol):
    """A function as ``def`` makes it, of whatever parameters: its source, its code and the names that it sees are read.

    A partial function, a method or an object that can be called is none.
    """

    __name__: str
    __qualname__: str
    __module__: str
    __code__: CodeType

    @property
    def __globals__(self) -> Mapping[str, Any]:
        """Names of its module."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call it as Python does."""

    def __hash__(self) -> int:
        """Every function is itself alone: what was made of it is kept by it."""
