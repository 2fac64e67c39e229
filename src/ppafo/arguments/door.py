"""Argument checks of every public function, from the signature that also defines its command line.

``@checked`` reads the annotations at the first call. An unsuitable value raises an ArgumentError that names the
argument, describes the accepted values and quotes the value. Wrong or missing arguments, for which Python raises a
TypeError, do the same.
"""

import contextlib
import functools
import inspect
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from typing import Any, Literal, NamedTuple, ParamSpec, TypeVar

from ppafo.arguments.values import Taken, annotated_parameters, shown, taken
from ppafo.errors import ArgumentError, PpafoError
from ppafo.wording import nearest_name

P = ParamSpec("P")
R = TypeVar("R")
_EMPTY = inspect.Parameter.empty


class _Parameter(NamedTuple):
    """Parameter of a checked function: its default (``inspect.Parameter.empty`` for none) and its accepted values."""

    default: Any
    taken: Taken


_Reader = Literal["caller", "function", "command line"]
_reader: ContextVar[_Reader] = ContextVar("_reader", default="caller")


@contextlib.contextmanager
def read_by(reader: _Reader) -> Iterator[None]:
    """Word errors within a ``with`` block for their reader: Python caller, function of the package, or command line.

    A caller knows arguments, a command line user knows options. A function of the package passes arguments that its
    caller never gave.
    """
    token = _reader.set(reader)
    try:
        yield
    finally:
        _reader.reset(token)


def argument_text(name: str, value: str = "", option: str = "") -> str:
    """Return an argument, optionally with its value, as written by the caller.

    On the command line this is the ``option``, by default the name with dashes: ``--peak-flow '4 g/s'``.

    >>> argument_text("peak_flow"), argument_text("peak_flow", "4 g/s")
    ('peak_flow', "peak_flow='4 g/s'")
    """
    if _reader.get() != "command line":
        return f"{name}={value!r}" if value else name
    option = option or f"--{name.replace('_', '-')}"
    return f"{option} {shlex.quote(value)}" if value else option


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that checks and converts its arguments before the call."""

    @functools.cache
    def signature() -> tuple[Mapping[str, _Parameter], tuple[str, ...]]:
        """Return the parameters by name, and the names of those that may be passed by position."""
        parameters = annotated_parameters(function)
        return (
            {name: _Parameter(each.default, taken(each.annotation)) for name, each in parameters.items()},
            tuple(name for name, each in parameters.items() if each.kind is each.POSITIONAL_OR_KEYWORD),
        )

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        values = _values(function.__name__, *signature(), args, kwargs)
        # NumPy's usual handling of errors, whatever the host program has set: an underflow is 0, and nothing to raise.
        numpy = sys.modules.get("numpy")
        usual = contextlib.nullcontext() if numpy is None else numpy.errstate(all="warn", under="ignore")
        is_outermost = _reader.get() == "caller"
        with usual, read_by("function") if is_outermost else contextlib.nullcontext():
            try:
                return function(**values)  # type: ignore[call-arg]  # names and types are those of the signature
            except PpafoError as error:
                if is_outermost and error.argument in values:
                    error.args = (f"{error.argument}: {error}",)
                raise

    return call


def _values(
    function: str,
    parameters: Mapping[str, _Parameter],
    places: Sequence[str],
    positional: Sequence[Any],
    by_name: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the converted arguments of a call by name."""
    if len(positional) > len(places):
        left = [name for name in parameters if name not in places]
        now = list(map(shown, positional[: len(places)]))
        for value in positional[len(places) :]:
            # The first of the names that are left whose parameter takes the value.
            name = next((name for name in left if _takes(parameters[name], value)), left[0] if left else "...")
            left = [other for other in left if other != name]
            now.append(f"{name}={shown(value)}")
        count = {1: "one argument"}.get(len(places), f"{len(places)} arguments")
        raise ArgumentError(f"{function}() takes {count} by position: write {function}({', '.join(now)})")
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
    for name, value in given.items():
        own = parameters[name]
        if value is not own.default and not (value is None and own.taken.allows_none):
            given[name] = own.taken.take(name, value)
    return given


def _takes(parameter: _Parameter, value: Any) -> bool:
    """Return True if a parameter accepts a value."""
    try:
        parameter.taken.take("", value)
    except ArgumentError:
        return False
    return True
