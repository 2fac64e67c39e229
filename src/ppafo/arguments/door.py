"""Argument checks of every public function, from the signature that also defines its command line.

``@checked`` reads the annotations at the first call. An unsuitable value raises an ArgumentError that names the
argument, describes the accepted values and quotes the value. Wrong or missing arguments, for which Python raises a
TypeError, do the same.
"""

import contextlib
import errno
import functools
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar

from ppafo.arguments.values import AcceptedValues, accepted_values, annotated_parameters, shown
from ppafo.errors import ArgumentError, PpafoError
from ppafo.wording import nearest_name, read_by, reader

P = ParamSpec("P")
R = TypeVar("R")
_EMPTY = inspect.Parameter.empty


class _Parameter(NamedTuple):
    """Parameter of a checked function: its default (``inspect.Parameter.empty`` for none) and its accepted values."""

    default: Any
    accepted: AcceptedValues


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that checks and converts its arguments before the call."""

    @functools.cache
    def signature() -> tuple[Mapping[str, _Parameter], tuple[str, ...]]:
        """Return the parameters by name, and the names of those that may be passed by position."""
        parameters = annotated_parameters(function)
        return (
            {name: _Parameter(item.default, accepted_values(item.annotation)) for name, item in parameters.items()},
            tuple(name for name, item in parameters.items() if item.kind is item.POSITIONAL_OR_KEYWORD),
        )

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        values = _values(function.__name__, *signature(), args, kwargs)
        # NumPy's usual handling of errors, whatever the host program has set: an underflow is 0, and nothing to raise.
        numpy = sys.modules.get("numpy")
        usual = contextlib.nullcontext() if numpy is None else numpy.errstate(all="warn", under="ignore")
        is_outermost, is_inner = reader() == "caller", reader() == "function"
        with usual, read_by("function") if is_outermost else contextlib.nullcontext():
            try:
                with contextlib.nullcontext() if is_inner else _names_of_files(values):
                    return function(**values)  # type: ignore[call-arg]  # names and types are those of the signature
            except PpafoError as error:
                if is_outermost and error.argument in values:
                    error.args = (f"{error.argument}: {error}",)
                raise

    return call


@contextlib.contextmanager
def _names_of_files(values: Mapping[str, Any]) -> Iterator[None]:
    """Refuse a name that is too long to be asked whether there is such a file, with the argument that gave it."""
    try:
        yield
    except OSError as error:
        if error.errno != errno.ENAMETOOLONG:
            raise
        refused = ArgumentError(f"{shown(str(error.filename))} is too long for the name of a file or a folder")
        name = max(Path(str(error.filename)).parts, key=len)
        refused.argument = next((argument for argument, value in values.items() if name in str(value)), "")
        raise refused from error


def _values(
    function: str,
    parameters: Mapping[str, _Parameter],
    positional_names: Sequence[str],
    positional: Sequence[Any],
    by_name: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the converted arguments of a call by name."""
    if len(positional) > len(positional_names):
        raise _too_many_positional(function, parameters, positional_names, positional)
    values = dict(zip(positional_names, positional, strict=False))
    for name, value in by_name.items():
        if name not in parameters:
            available = f"{nearest_name(name, parameters)}; available: {', '.join(parameters)}"
            raise ArgumentError(f"{function}() has no argument '{name}'{available}")
        if name in values:
            raise ArgumentError(f"{function}(): {name} is given twice, by position and by name")
        values[name] = value
    missing = [name for name, item in parameters.items() if item.default is _EMPTY and name not in values]
    if missing:
        descriptions = "; ".join(f"{name} is {parameters[name].accepted.what}" for name in missing)
        raise ArgumentError(f"{function}() needs {' and '.join(missing)}: {descriptions}")
    for name, value in values.items():
        parameter = parameters[name]
        if value is not parameter.default and not (value is None and parameter.accepted.allows_none):
            values[name] = parameter.accepted.take(name, value)
    return values


def _too_many_positional(
    function: str, parameters: Mapping[str, _Parameter], positional_names: Sequence[str], positional: Sequence[Any]
) -> ArgumentError:
    """Return the error that writes the call with names: for each further value the first parameter that accepts it."""
    others = [name for name in parameters if name not in positional_names]
    arguments = list(map(shown, positional[: len(positional_names)]))
    for value in positional[len(positional_names) :]:
        name = others[0] if others else "..."
        for other in others:
            with contextlib.suppress(ArgumentError):
                parameters[other].accepted.take("", value)
                name = other
                break
        others = [other for other in others if other != name]
        arguments.append(f"{name}={shown(value)}")
    count = "one argument" if len(positional_names) == 1 else f"{len(positional_names)} arguments"
    return ArgumentError(f"{function}() takes {count} by position: write {function}({', '.join(arguments)})")
