"""Conversion of Python arguments, by the annotations that also define the arguments of a command."""

import builtins
import contextlib
import dataclasses
import inspect
import os
import reprlib
import sys
import traceback
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from ppafo.arguments.conversion import taken_document, taken_flag, taken_number, taken_text, taken_whole
from ppafo.arguments.words import Word
from ppafo.errors import ArgumentError, PpafoError
from ppafo.wording import one_line

_LONGEST = 60
_SEVERAL = ", or several"


class _NotLoaded:
    """Placeholder for a class named in an annotation whose module is not imported; its objects are recognised by name.

    The help of a command needs no import of the class; a caller that passes an object has imported it already.
    """

    def __class_getitem__(cls, _parameters: Any) -> type:
        """Return the class itself: type parameters are ignored."""
        return cls


class _AnnotationNames(dict[str, Any]):
    """Namespace of an annotation: names of its module and of Python, and placeholders for classes not imported."""

    def __contains__(self, name: object) -> bool:
        """Return True: an unknown name stands for a class not imported."""
        return True

    def __missing__(self, name: str) -> Any:
        """Return a Python builtin, or a placeholder for a class not imported."""
        return getattr(builtins, name) if hasattr(builtins, name) else type(name, (_NotLoaded,), {})


def annotated_parameters(function: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """Return the parameters by name with evaluated annotations; a class not imported becomes a ``_NotLoaded``.

    A parameter of a user function without annotation keeps the empty one of ``inspect``.
    """
    annotations = _annotations(function)
    # Of the function as written, since help displays another signature.
    parameters = inspect.signature(inspect.unwrap(function)).parameters
    return {
        name: parameter.replace(annotation=annotations.get(name, parameter.annotation))
        for name, parameter in parameters.items()
    }


def _annotations(function: Callable[..., Any]) -> Mapping[str, Any]:
    """Return the evaluated annotations of a function by name; a class not imported becomes a ``_NotLoaded``."""
    names = _AnnotationNames(vars(sys.modules[function.__module__]))
    return typing.get_type_hints(function, localns=names, include_extras=True)


class _Shown(NamedTuple):
    """Type or default as displayed by help: a text without quotation marks."""

    text: str

    def __repr__(self) -> str:
        """Return the text itself."""
        return self.text


def show_plainly(value: Any) -> None:
    """Set the signature displayed by help for a function or a dataclass: plain types, and functions by name.

    The annotations themselves, from which argument checks and command lines are built, remain unchanged.
    """
    function = vars(value)["__init__"] if dataclasses.is_dataclass(value) else value
    if not inspect.isfunction(function):
        return
    types_shown = {name: _Shown(_type_text(annotation)) for name, annotation in _annotations(function).items()}
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


_NAMES: Mapping[Any, str] = {types.NoneType: "None", ...: "..."}
"""Display names of annotations whose Python name differs."""


def _type_text(annotation: Any) -> str:
    """Return an annotation as plain text, ``Scenario | str | Path``, without module names and ``Word``."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        return _type_text(inner[0])
    if origin in (typing.Union, types.UnionType):
        texts = dict.fromkeys(_type_text(item) for item in inner if item is not types.NoneType)
        return " | ".join([*texts, "None"] if types.NoneType in inner else texts)
    if origin is Literal:
        return " | ".join(map(repr, inner))
    if isinstance(annotation, list):
        return f"[{', '.join(map(_type_text, annotation))}]"
    # The type parameters of an array are not displayed.
    parameters = [] if origin is None or origin.__module__ == "numpy" else [_type_text(item) for item in inner]
    name = _NAMES.get(annotation) or getattr(origin or annotation, "__name__", str(annotation))
    return f"{name}[{', '.join(parameters)}]" if parameters else str(name)


class AcceptedValues(NamedTuple):
    """Accepted values of a parameter: their description in messages, and their conversion to the function's value.

    ``convert`` is called with the name of the value in messages and the value.
    """

    what: str
    convert: Callable[[str, Any], Any]
    allows_none: bool = False

    def take(self, name: str, value: Any) -> Any:
        """Return the converted value. Raises ArgumentError for an unsuitable one, and none that the value raises."""
        try:
            return self.convert(name, value)
        except PpafoError:
            raise
        except Exception as error:  # what an object of others does when it is asked for its length is anybody's guess
            raised = shortened(*traceback.format_exception_only(error))
            raise ArgumentError(
                f"{name}={shown(value)}: must be {self.what}; asked for it, it raises {raised}"
            ) from error


def shown(value: Any) -> str:
    """Return a value as quoted in a message: short, on one line."""
    with contextlib.suppress(Exception):  # a subclass of str may have a repr that raises
        if isinstance(value, str | bytes | int | float | complex | Path | list | tuple | dict | set | None):
            return shortened(repr(value) if isinstance(value, str | Path) else reprlib.repr(value))
    return f"<{shortened(type(value).__name__)}>"


def shortened(*parts: str) -> str:
    """Return a text of others on one line, of a long one the begin."""
    text = one_line(" ".join(parts))
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


_PLAIN: Mapping[Any, tuple[str, Callable[[Any], Any]]] = {
    str: ("a text", taken_text),
    bool: ("True or False", taken_flag),
    int: ("a whole number", taken_whole(-(2**63))),
    float: ("a finite number", taken_number()),
    # Where a name is accepted too, its converter comes first and takes texts.
    Path: ("a path", lambda value: Path(taken_text(os.fspath(value)))),
}
"""Description and converter of each type without a ``Word``."""


def accepted_values(annotation: Any) -> AcceptedValues:
    """Return the accepted values of a parameter with an annotation."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        # Python flattens nested annotations with the outermost last: that one has priority.
        word = next((item for item in reversed(inner[1:]) if isinstance(item, Word) and item.take), None)
        if word is None or word.take is None:
            return accepted_values(inner[0])
        values = _single(word.what, word.take)
        is_repeated = _is_iterable(typing.get_origin(inner[0]))
        return values if word.takes_all or not is_repeated else _several(values)
    if origin in (typing.Union, types.UnionType):
        return _either([accepted_values(item) for item in inner if item is not types.NoneType], types.NoneType in inner)
    if origin is Literal:
        return _single(
            " or ".join(map(repr, inner)), lambda value: _accepted(taken_text(value), taken_text(value) in inner)
        )
    if annotation is Any:
        return AcceptedValues("anything", lambda _, value: value)
    return _single(*_PLAIN[annotation]) if annotation in _PLAIN else _of_class(origin or annotation, inner)


def _of_class(kind: type, inner: tuple[Any, ...]) -> AcceptedValues:
    if issubclass(kind, Mapping):
        if inner[1] is Any:
            return _single("a dictionary with strings as keys", taken_document)
        return _mapping(accepted_values(inner[1]))
    if inner and _is_iterable(kind):
        return _several(accepted_values(inner[0]))
    if kind is typing.get_origin(Callable[..., Any]):
        return _single("a function", lambda value: _accepted(value, callable(value)))
    if issubclass(kind, _NotLoaded):
        # An object of a class that is not imported here is recognised by its name.
        return _single(
            f"a {kind.__name__}",
            lambda value: _accepted(value, kind.__name__ in [base.__name__ for base in type(value).__mro__]),
        )
    return _single(f"a {kind.__name__}", lambda value: _accepted(value, isinstance(value, kind)))


def _is_iterable(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Iterable) and not issubclass(kind, str | bytes)


def _accepted(value: Any, is_accepted: bool) -> Any:
    """Return the value if it is accepted; ValueError otherwise."""
    if not is_accepted:
        raise ValueError
    return value


def _single(what: str, take: Callable[[Any], Any]) -> AcceptedValues:
    def named(name: str, value: Any) -> Any:
        try:
            return take(value)
        except ArgumentError as error:
            raise ArgumentError(f"{name}: {error}") from None
        except (ValueError, TypeError, OverflowError):
            raise ArgumentError(f"{name}={shown(value)}: must be {what}{_at_hand(what, value)}") from None

    return AcceptedValues(what, named)


def _several(element: AcceptedValues) -> AcceptedValues:
    """Return the converter of one or several values to a tuple; a single value counts as a list of one."""

    def take(name: str, value: Any) -> Any:
        # A table of pandas or xarray has keys like a dictionary; iterating over it yields the names of its columns.
        if isinstance(value, str | bytes | os.PathLike) or hasattr(value, "keys") or not isinstance(value, Iterable):
            return (element.take(name, value),)
        return tuple(element.take(f"{name}[{index}]", item) for index, item in enumerate(value))

    return AcceptedValues(f"{element.what}{_SEVERAL}", take)


def _mapping(element: AcceptedValues) -> AcceptedValues:
    """Return the converter of a dictionary with text keys; it returns a copy with each value converted."""

    def take(name: str, value: Any) -> dict[str, Any]:
        if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
            raise ArgumentError(f"{name}={shown(value)}: must be a dictionary with strings as keys")
        return {key: element.take(f"{name}[{key!r}]", item) for key, item in value.items()}

    return AcceptedValues("a dictionary", take)


def _either(kinds: list[AcceptedValues], allows_none: bool) -> AcceptedValues:
    """Return the converter that applies the first suitable one of several converters."""
    if len(kinds) == 1:
        return kinds[0]._replace(allows_none=allows_none)
    alone = _in_words([kind.what for kind in kinds if not kind.what.endswith(_SEVERAL)])
    several = _in_words([kind.what.removesuffix(_SEVERAL) for kind in kinds if kind.what.endswith(_SEVERAL)])
    what = f"{alone}, or several: {several}" if alone and several else f"{several}{_SEVERAL}" if several else alone
    if alone == several:
        what = f"{alone}{_SEVERAL}"

    def take(name: str, value: Any) -> Any:
        errors: list[ArgumentError] = []
        for kind in kinds:
            try:
                return kind.take(name, value)
            except ArgumentError as error:
                errors.append(error)
        # An error of one of several values names this value.
        of_items = [error for error in errors if str(error).startswith(f"{name}[")]
        raise (
            of_items[-1] if of_items else ArgumentError(f"{name}={shown(value)}: must be {what}{_at_hand(what, value)}")
        )

    return AcceptedValues(what, take, allows_none)


def _at_hand(what: str, value: Any) -> str:
    """Return a hint to pass an attribute of the value, such as ``result.recording``, or on a stored result; or ""."""
    names = [name for name in ("recording", "scenario") if f"a {name.capitalize()}" in what and hasattr(value, name)]
    if not names and "a Scenario" in what and hasattr(value, "recording"):
        return "; a stored result is not run or compared again: give what was run; its numbers are in '.metrics'"
    return f"; pass its attribute '{names[0]}'" if names else ""


def _in_words(kinds: list[str]) -> str:
    """Return a list of value descriptions as text: ``a name, a path or a Recording``; empty for no descriptions."""
    *others, last = dict.fromkeys(kinds) or [""]
    what = f"{', '.join(others)} or {last}" if others else last
    # In a list with a path, a text is a name.
    return what.replace("a text, a path", "a name, a path").replace("a text or a path", "a name or a path")
