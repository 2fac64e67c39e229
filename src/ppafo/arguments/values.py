"""Conversion of Python arguments, by the annotations that also define the arguments of a command."""

import builtins
import collections.abc
import dataclasses
import inspect
import os
import re
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from ppafo.arguments.conversion import shown, taken_document, taken_flag, taken_number, taken_text, taken_whole
from ppafo.arguments.words import Word
from ppafo.errors import ArgumentError, PpafoError


class _KnownByName(type):
    """Type of a class named in an annotation whose module is not imported; its objects are recognised by name.

    The help of a command needs no import of the class; a caller that passes an object has imported it already.
    """

    def __instancecheck__(cls, value: object) -> bool:
        """Return True for an object of a class of the same name, or of one derived from such a class."""
        return cls.__name__ in [base.__name__ for base in type(value).__mro__]

    def __getitem__(cls, _parameters: Any) -> type:
        """Return the class itself: type parameters are ignored."""
        return cls


class _AnnotationNames(dict[str, Any]):
    """Namespace of an annotation: names of its module and of Python, and placeholders for classes not imported."""

    def __contains__(self, name: object) -> bool:
        """Return True: an unknown name stands for a class not imported."""
        return True

    def __missing__(self, name: str) -> Any:
        """Return a Python builtin, or a placeholder for a class not imported."""
        return getattr(builtins, name) if hasattr(builtins, name) else _KnownByName(name, (), {})


def _annotations(function: Callable[..., Any], with_words: bool) -> Mapping[str, Any]:
    """Return the evaluated annotations of a function by name; a class not imported becomes a ``_KnownByName``."""
    names = _AnnotationNames(vars(sys.modules[function.__module__]))
    return typing.get_type_hints(function, localns=names, include_extras=with_words)


def annotated_parameters(function: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """Return the parameters by name with evaluated annotations.

    A parameter of a user function without annotation keeps the empty one of ``inspect``.
    """
    annotations = _annotations(function, with_words=True)
    # Of the function as written, since help displays another signature.
    parameters = inspect.signature(inspect.unwrap(function)).parameters
    return {
        name: parameter.replace(annotation=annotations.get(name, parameter.annotation))
        for name, parameter in parameters.items()
    }


class _Shown(str):
    """Type or default as displayed by help: a text without quotation marks."""

    __slots__ = ()
    __repr__ = str.__str__


def show_plainly(value: Any) -> None:
    """Set the signature displayed by help for a function or a dataclass: plain types, and functions by name.

    The annotations themselves, from which argument checks and command lines are built, remain unchanged.
    """
    function = vars(value)["__init__"] if dataclasses.is_dataclass(value) else value
    if not inspect.isfunction(function):
        return
    types_shown = {name: _type_text(hint) for name, hint in _annotations(function, with_words=False).items()}
    signature = inspect.signature(function)
    parameters = []
    for name, parameter in signature.parameters.items():
        default = parameter.default
        # A function, or the factory of a field, has no text of its own.
        if default is not parameter.empty and repr(default).startswith("<"):
            default = _Shown(getattr(default, "__name__", "..."))
        parameters.append(parameter.replace(annotation=types_shown.get(name, parameter.annotation), default=default))
    function.__signature__ = signature.replace(  # type: ignore[attr-defined]  # of all functions, says inspect
        parameters=parameters, return_annotation=types_shown.get("return", signature.return_annotation)
    )


def _type_text(hint: Any) -> _Shown:
    """Return a type as plain text, ``Scenario | str | Path``, without module names."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return _Shown(" | ".join(dict.fromkeys(map(_type_text, typing.get_args(hint)))))
    return _Shown(re.sub(r"\b([A-Za-z_]\w*\.)+|Type\b(?<=NoneType)", "", inspect.formatannotation(hint)))


class AcceptedValues(NamedTuple):
    """Accepted values of a parameter: their kinds in messages, and their conversion to the function's value.

    ``convert`` is called with the name of the value in messages and the value; whatever it raises refuses the value.
    """

    kinds: tuple[str, ...]
    convert: Callable[[str, Any], Any]
    allows_none: bool = False

    @property
    def what(self) -> str:
        """Description of the accepted values, such as ``a text or a path``."""
        return " or ".join(dict.fromkeys(self.kinds))

    def take(self, name: str, value: Any) -> Any:
        """Return the converted value. Raises ArgumentError for an unsuitable one, and none that the value raises."""
        if value is None and self.allows_none:
            return None
        try:
            return self.convert(name, value)
        except PpafoError as error:
            # An error of one of several values names this value.
            raise ArgumentError(str(error) if str(error).startswith(name) else f"{name}: {error}") from None
        except Exception as error:  # the length of a foreign object may raise anything
            cause = None if isinstance(error, ValueError | TypeError) else error
            raise ArgumentError(f"{name}={shown(value)}: must be {self.what}") from cause


_PLAIN: Mapping[Any, tuple[str, Callable[[Any], Any]]] = {
    str: ("a text", taken_text),
    bool: ("True or False", taken_flag),
    int: ("a whole number", taken_whole(-(2**63))),
    float: ("a finite number", taken_number()),
    # Where a name is accepted too, its converter comes first and takes texts.
    Path: ("a path", lambda value: Path(taken_text(os.fspath(value)))),
    Mapping[str, Any]: ("a dictionary with strings as keys", taken_document),
}
"""Description and converter of each type without a ``Word``."""


def accepted_values(annotation: Any) -> AcceptedValues:
    """Return the accepted values of a parameter with an annotation."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        # Python flattens nested annotations with the outermost last: that one has priority.
        taking = [(item.what, item.take) for item in inner[1:] if isinstance(item, Word) and item.take]
        return _single(*taking[-1]) if taking else accepted_values(inner[0])
    if origin in (typing.Union, types.UnionType):
        options = [accepted_values(item) for item in inner if item is not types.NoneType]
        first = AcceptedValues(tuple(kind for each in options for kind in each.kinds), partial(_first_of, options))
        return (first if len(options) > 1 else options[0])._replace(allows_none=types.NoneType in inner)
    if annotation in _PLAIN:
        return _single(*_PLAIN[annotation])
    kind = origin or annotation
    if issubclass(kind, Mapping):
        return AcceptedValues(("a dictionary with strings as keys",), partial(_items, accepted_values(inner[1])))
    if inner and issubclass(kind, Iterable):
        element = accepted_values(inner[0])
        return AcceptedValues((*element.kinds, "several"), partial(_each, element))
    return _single("a function" if kind is collections.abc.Callable else f"a {kind.__name__}", partial(_of_class, kind))


def _single(what: str, take: Callable[[Any], Any]) -> AcceptedValues:
    return AcceptedValues((what,), lambda _, value: take(value))


def _of_class(kind: type, value: Any) -> Any:
    """Return an object of a class. Raises TypeError for another."""
    if not isinstance(value, kind):
        raise TypeError
    return value


def _first_of(options: list[AcceptedValues], name: str, value: Any) -> Any:
    """Return what the first option that accepts a value makes of it."""
    errors: list[ArgumentError] = []
    for option in options:
        try:
            return option.take(name, value)
        except ArgumentError as error:
            errors.append(error)
    raise next((error for error in reversed(errors) if str(error).startswith(f"{name}[")), TypeError())


def _items(element: AcceptedValues, name: str, value: Any) -> dict[str, Any]:
    """Return a copy of a dictionary with text keys, with each value converted."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise TypeError
    return {key: element.take(f"{name}[{key!r}]", item) for key, item in value.items()}


def _each(element: AcceptedValues, name: str, value: Any) -> tuple[Any, ...]:
    """Return one or several values, converted; a single value counts as a list of one."""
    # A table of pandas or xarray has keys like a dictionary; iterating over it yields the names of its columns.
    if isinstance(value, str | bytes | os.PathLike) or hasattr(value, "keys") or not isinstance(value, Iterable):
        return (element.take(name, value),)
    return tuple(element.take(f"{name}[{index}]", item) for index, item in enumerate(value))
