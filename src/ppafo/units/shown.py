"""Display units of numbers: the units in which the author of a parameter set wrote them.

What says or draws something does so inside ``shown_in``; outside of it, the package's own choices hold.
"""

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from types import MappingProxyType
from typing import ParamSpec, TypeVar

from ppafo.units.spelling import split_pressure_kind

P = ParamSpec("P")
R = TypeVar("R")

_chosen: ContextVar[Mapping[str, str]] = ContextVar("_chosen", default=MappingProxyType({}))


@contextlib.contextmanager
def shown_in(units: Mapping[str, str]) -> Iterator[None]:
    """Show numbers inside in these units, by their unit in SI: ``{"Pa_a": "bar_g", "N m": "N cm"}``."""
    token = _chosen.set(units)
    try:
        yield
    finally:
        _chosen.reset(token)


def in_units(units: Callable[..., Mapping[str, str]]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return what lets a function say and draw in the units that ``units`` returns of its arguments."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def inside(*args: P.args, **kwargs: P.kwargs) -> R:
            with shown_in(units(*args, **kwargs)):
                return function(*args, **kwargs)

        return inside

    return decorate


def pressure_units(level: str) -> dict[str, str]:
    """Return the units of levels and differences of pressure, by unit in SI, of who writes levels as ``bar_g``."""
    unit, kind = split_pressure_kind(level)
    return {"Pa_a": f"{unit}_{kind}", "Pa_d": f"{unit}_d"}


def units_in_force() -> dict[str, str]:
    """Return the chosen units by unit in SI; empty where the package's own choices hold."""
    return dict(_chosen.get())


def shown_unit(si_unit: str, default: str) -> str:
    """Return the unit in which numbers of a unit in SI are shown, ``default`` where none was chosen."""
    return _chosen.get().get(si_unit, default)
