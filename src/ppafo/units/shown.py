"""Display units of numbers: the units in which the author of a parameter set wrote them.

Gauge pressures count from the atmosphere of the device of which they are. It stands beside the units, so that text,
tables and axes have one zero, and so do saved results, which keep both as ``shown``. Outside of ``shown_in`` the
package's own choices hold.
"""

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from types import MappingProxyType
from typing import ParamSpec, TypeVar

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.units.spelling import split_pressure_kind

P = ParamSpec("P")
R = TypeVar("R")

GAUGE_ZERO = "gauge_zero"
"""Key, beside units by their unit in SI, of the absolute pressure from which gauge pressures count."""

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
    """Return a decorator: the function writes and draws in the units that ``units`` returns for its arguments."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def inside(*args: P.args, **kwargs: P.kwargs) -> R:
            with shown_in(units(*args, **kwargs)):
                return function(*args, **kwargs)

        return inside

    return decorate


def pressure_units(level: str) -> dict[str, str]:
    """Return the display units of pressure levels and differences, by SI unit, for levels written as ``bar_g``."""
    unit, kind = split_pressure_kind(level)
    return {"Pa_a": f"{unit}_{kind}", "Pa_d": f"{unit}_d"}


def counted_from(units: Mapping[str, str], atmosphere: float) -> dict[str, str]:
    """Return units by unit in SI with the atmosphere [Pa absolute] from which gauge pressures count."""
    return {**units, GAUGE_ZERO: f"{atmosphere!r} Pa_a"}


def gauge_zero() -> float:
    """Return the absolute pressure [Pa] from which displayed gauge pressures count."""
    stated = _chosen.get().get(GAUGE_ZERO)
    return STANDARD_ATMOSPHERE if stated is None else float(stated.removesuffix(" Pa_a"))


def units_in_force() -> dict[str, str]:
    """Return the chosen display units by SI unit; empty for the defaults of the package."""
    return dict(_chosen.get())


def shown_unit(si_unit: str, default: str) -> str:
    """Return the display unit of an SI unit; ``default`` if none was chosen."""
    return _chosen.get().get(si_unit, default)
