"""Frames: functions in which some names stand for components that are put in their place."""

import types
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from ppafo.model.declaration import PlainFunction


class Frame(NamedTuple):
    """What a function was bound from: the function, and what some names of its module stand for in it, by name."""

    function: PlainFunction
    components: tuple[tuple[str, Any], ...]


class Recipe(NamedTuple):
    """Picklable form of a function that no module has: ``maker`` makes it anew from frame, name and components."""

    maker: Callable[[PlainFunction, str, Any], PlainFunction]
    frame: Any
    name: str
    components: Any


def frame_of(function: PlainFunction) -> Frame | None:
    """Return the frame of a function that ``bind`` made; None for any other."""
    found: Frame | None = vars(function).get("frame")
    return found


def bind(frame: PlainFunction, name: str, components: Mapping[str, Any]) -> PlainFunction:
    """Return the function of a frame in which some names of its module stand for other components.

    The code is the same and only those names differ, so that the engine compiles it as any other function. Equal
    components give the same function, so that what has it is equal too: a scenario that is loaded twice, or in another
    order of its overrides.
    """
    return _bound(frame, name, tuple(sorted(components.items())))


def made_of(frame: PlainFunction, name: str, parts: tuple[Any, ...]) -> PlainFunction:
    """Return the function of a frame whose last parameter ``*, parts`` is a NamedTuple of functions, with these parts.

    The engine compiles it with each ``parts.NAME`` as the function that it is. Equal parts give the same function.
    """
    return _made_of(frame, name, parts)


def recipe_of(value: Any) -> Any:
    """Picklable form of a value: recipes in the place of functions that were bound, also inside of tuples."""
    frame = frame_of(value) if isinstance(value, types.FunctionType) else None
    if frame is None:
        return _item_by_item(recipe_of, value)
    if value.__kwdefaults__ is not None:
        maker, components = made_of, frame.components[0][1]
    else:
        maker, components = _bound, frame.components
    return Recipe(maker, recipe_of(frame.function), value.__name__, recipe_of(components))


def by_recipe(value: Any) -> Any:
    """Value whose picklable form is given: in one process, the same functions as before."""
    if isinstance(value, Recipe):
        return value.maker(by_recipe(value.frame), value.name, by_recipe(value.components))
    return _item_by_item(by_recipe, value)


def _item_by_item(change: Callable[[Any], Any], value: Any) -> Any:
    if not isinstance(value, tuple):
        return value
    items = map(change, value)
    return type(value)(*items) if hasattr(value, "_fields") else tuple(items)


@lru_cache(maxsize=512)
def _made_of(frame: PlainFunction, name: str, parts: tuple[Any, ...]) -> PlainFunction:
    made = types.FunctionType(frame.__code__, dict(frame.__globals__), name)
    made.__kwdefaults__ = {"parts": parts}
    made.__qualname__, made.__module__, made.__annotations__ = name, frame.__module__, frame.__annotations__
    vars(made)["frame"] = Frame(frame, (("parts", parts),))
    return made


# Far more than the laws, valves and actuators of a process; a table is part of what its actuator is bound to.
@lru_cache(maxsize=512)
def _bound(frame: PlainFunction, name: str, components: tuple[tuple[str, Any], ...]) -> PlainFunction:
    made = types.FunctionType(frame.__code__, {**frame.__globals__, **dict(components)}, name)
    made.__qualname__ = name
    # The name and module decide the name in the composed text, where two laws must not share one.
    made.__module__ = frame.__module__
    made.__annotations__ = frame.__annotations__
    vars(made)["frame"] = Frame(frame, components)
    return made
