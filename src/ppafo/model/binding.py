"""Functions with bound parts: one formula for many devices, with the device-dependent functions as an argument.

Such a function takes ``*, parts: P``, where ``P`` is a NamedTuple of functions, of row classes, of constants or
of further parts, and calls ``parts.NAME(...)``. ``made_of`` binds the parts; the engine compiles each of them in.
"""

import types
from functools import lru_cache
from typing import Any

from ppafo.model.declaration import PlainFunction


def is_made_of(value: object) -> bool:
    """Tell whether a value can be bound as ``parts``: a NamedTuple with a function, a class or further parts."""
    if not isinstance(value, tuple) or not hasattr(value, "_fields"):
        return False
    return any(isinstance(part, types.FunctionType | type) or is_made_of(part) for part in value)


def frame_of(function: PlainFunction) -> PlainFunction | None:
    """Return the original function of a function made by ``made_of``; None for any other function."""
    found: PlainFunction | None = vars(function).get("frame")
    return found


def parts_of(function: PlainFunction) -> Any:
    """Return the parts of a function with ``*, parts``, from its default or from ``made_of``; None if it has none."""
    return (getattr(function, "__kwdefaults__", None) or {}).get("parts")


# Far more than the laws, valves and actuators of a process; a table is among the parts of its actuator.
@lru_cache(maxsize=1024)
def made_of(frame: PlainFunction, name: str, parts: tuple[Any, ...]) -> PlainFunction:
    """Return a function whose last parameter is ``*, parts``, with the given parts as default, under another name.

    Equal parts give the same function object, so that values containing it compare equal: a scenario that is loaded
    twice, or with its overrides in another order, equals the first one.
    """
    function: Any = frame
    # The name and module decide the name in the composed text, where two laws must not share one.
    made = types.FunctionType(function.__code__, function.__globals__, name, function.__defaults__)
    made.__kwdefaults__ = {**(function.__kwdefaults__ or {}), "parts": parts}
    made.__qualname__ = name
    made.__module__ = frame.__module__
    made.__annotations__ = function.__annotations__
    vars(made)["frame"] = frame
    return made
