"""The door of every public function: what a call gives is checked by the signature that makes the command line too.

``@checked`` reads the annotations at the first call. A value that does not fit is an ArgumentError that names the
argument, says what it takes and quotes the value; so are words that Python itself would answer with a TypeError.
"""

import contextlib
import functools
import inspect
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar

from ppafo.arguments.values import Taken, annotated_parameters, shown, taken
from ppafo.errors import ArgumentError, PpafoError, nearest_name

P = ParamSpec("P")
R = TypeVar("R")
_EMPTY = inspect.Parameter.empty


class _Parameter(NamedTuple):
    """A parameter: its default, ``inspect.Parameter.empty`` without one, and what it takes."""

    default: Any
    taken: Taken


class _Signature(NamedTuple):
    """The parameters of a function by name, and the ones that a call may give by position."""

    parameters: Mapping[str, _Parameter]
    positional: tuple[str, ...]


_says_arguments: ContextVar[bool] = ContextVar("_says_arguments", default=True)


_has_options: ContextVar[bool] = ContextVar("_has_options", default=False)


@contextlib.contextmanager
def without_names() -> Iterator[None]:
    """Leave errors inside as they are, without the name of an argument."""
    token = _says_arguments.set(False)
    try:
        yield
    finally:
        _says_arguments.reset(token)


@contextlib.contextmanager
def with_options() -> Iterator[None]:
    """Speak inside to somebody at a command line, who has options where a caller in Python has arguments."""
    token = _has_options.set(True)
    try:
        with without_names():
            yield
    finally:
        _has_options.reset(token)


def argument_text(name: str, value: str = "", option: str = "") -> str:
    """Return an argument as who called writes it, and a value with it.

    On the command line that is an ``option``, by default the name with dashes: ``--peak-flow '4 g/s'``.

    >>> argument_text("peak_flow"), argument_text("peak_flow", "4 g/s")
    ('peak_flow', "peak_flow='4 g/s'")
    """
    if not _has_options.get():
        return f"{name}={value!r}" if value else name
    option = option or f"--{name.replace('_', '-')}"
    return f"{option} {shlex.quote(value)}" if value else option


def _usual_numpy() -> contextlib.AbstractContextManager[object]:
    """NumPy's usual handling of errors, whatever the host program has set: an underflow is 0, and nothing to raise.

    Where nobody has loaded NumPy it is the usual one.
    """
    numpy = sys.modules.get("numpy")
    if numpy is None:
        return contextlib.nullcontext()
    usual: contextlib.AbstractContextManager[object] = numpy.errstate(all="warn", under="ignore")
    return usual


def _named(function: Callable[..., R], values: Mapping[str, Any]) -> R:
    """Call a function; an error that quotes an argument, and does not name it or begin with it, gets its name."""
    try:
        return function(**values)
    except PpafoError as error:
        message = str(error)
        # A module that was named is where other errors lie, and says itself where it is not there.
        asked = {name: value for name, value in values.items() if name != "plugins"}
        quoted = [(text, name) for name, value in asked.items() for text in _texts(value) if text in message]
        # A text in quotation marks before one that stands among others; the first, for an example may follow; and of
        # two within each other the longer one.
        rank = {name: (f"'{text}'" in message, -message.index(text), len(text)) for text, name in quoted}
        name = max(rank, key=lambda each: rank[each], default="")
        # A message that begins with the path that was given, or with a file below that folder, says where it lies.
        begins = any(re.match(rf"{re.escape(text)}[:/,]", message) for text, _ in quoted if text)
        if name and not begins and not re.search(rf"\b{name.removesuffix('s').replace('_', '[_ -]')}", message, re.I):
            error.args = (f"{name}: {message}",)
        raise


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts and paths of an argument, of a dictionary its keys."""
    if isinstance(value, str | Path):
        yield str(value)
    elif isinstance(value, tuple | Mapping):
        yield from (str(each) for each in value if isinstance(each, str | Path))


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function with the door before it."""

    @functools.cache
    def signature() -> _Signature:
        parameters = annotated_parameters(function)
        return _Signature(
            {name: _Parameter(each.default, taken(each.annotation)) for name, each in parameters.items()},
            tuple(name for name, each in parameters.items() if each.kind is each.POSITIONAL_OR_KEYWORD),
        )

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        values = _values(function.__name__, signature(), args, kwargs)
        with _usual_numpy():
            if _says_arguments.get():
                # Only the function that was called says which argument: those that it calls have others.
                with without_names():
                    return _named(function, values)
            return function(**values)  # type: ignore[call-arg]  # names and types are those of the signature

    return call


def _values(
    function: str, signature: _Signature, positional: tuple[Any, ...], by_name: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the arguments of a call by name, each as the function takes it."""
    parameters, places = signature
    if len(positional) > len(places):
        left = [name for name in parameters if name not in places]
        named = [(_taking(parameters, left, value), value) for value in positional[len(places) :]]
        known = map(shown, positional[: len(places)])
        now = ", ".join([*known, *(f"{name}={shown(value)}" for name, value in named)])
        count = {1: "one argument"}.get(len(places), f"{len(places)} arguments")
        raise ArgumentError(f"{function}() takes {count} by position: write {function}({now})")
    given = dict(zip(places, positional, strict=False))
    for name, value in by_name.items():
        if name not in parameters:
            hint = nearest_name(name, parameters)
            raise ArgumentError(f"{function}() has no argument '{name}'{hint}; it has {', '.join(parameters)}")
        if name in given:
            raise ArgumentError(f"{function}(): {name} is given twice, by position and by name")
        given[name] = value
    missing = [name for name, each in parameters.items() if each.default is _EMPTY and name not in given]
    if missing:
        takes = "; ".join(f"{name} is {parameters[name].taken.what}" for name in missing)
        raise ArgumentError(f"{function}() needs {' and '.join(missing)}: {takes}")
    return {name: _value(name, parameters[name], value) for name, value in given.items()}


def _taking(parameters: Mapping[str, _Parameter], left: list[str], value: Any) -> str:
    """Take from the names that are left the first whose parameter takes a value."""
    for name in left:
        with contextlib.suppress(ArgumentError):
            parameters[name].taken.take(name, value)
            left.remove(name)
            return name
    return left.pop(0) if left else "..."


def _value(name: str, parameter: _Parameter, value: Any) -> Any:
    if value is parameter.default or (value is None and parameter.taken.allows_none):
        return value
    return parameter.taken.take(name, value)
