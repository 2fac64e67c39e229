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
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from ppafo.arguments.conversion import shown
from ppafo.arguments.values import accepted_values, annotated_parameters
from ppafo.errors import ArgumentError, PpafoError
from ppafo.wording import nearest_name, read_by, reader

P = ParamSpec("P")
R = TypeVar("R")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that checks and converts its arguments before the call."""

    @functools.cache
    def signature() -> inspect.Signature:
        """Return the signature with the accepted values of each parameter in place of its annotation."""
        parameters = annotated_parameters(function).values()
        return inspect.Signature([item.replace(annotation=accepted_values(item.annotation)) for item in parameters])

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        values = _values(function.__name__, signature(), *args, **kwargs)
        # NumPy's usual handling of errors, whatever the host program has set: an underflow is 0, and nothing to raise.
        numpy = sys.modules.get("numpy")
        usual = contextlib.nullcontext() if numpy is None else numpy.errstate(all="warn", under="ignore")
        asking = reader()
        with usual, read_by("function") if asking == "caller" else contextlib.nullcontext():
            try:
                return function(**values)  # type: ignore[call-arg]  # names and types are those of the signature
            except PpafoError as error:
                if asking == "caller" and error.argument in values:
                    error.args = (f"{error.argument}: {error}",)
                raise
            except OSError as error:
                # Of a name too long to be asked whether there is such a file.
                if error.errno != errno.ENAMETOOLONG or asking == "function":
                    raise
                longest = max(Path(str(error.filename)).parts, key=len)
                given = next((f"{name}: " for name, value in values.items() if longest in str(value)), "")
                place = given if asking == "caller" else ""
                said = f"{place}{shown(str(error.filename))} is too long for the name of a file or a folder"
                raise ArgumentError(said) from error

    return call


def _values(function: str, signature: inspect.Signature, /, *args: Any, **kwargs: Any) -> dict[str, Any]:
    """Return the converted arguments of a call by name."""
    parameters = signature.parameters
    try:
        values = signature.bind_partial(*args, **kwargs).arguments
    except TypeError as error:
        near = next((nearest_name(name, parameters) for name in kwargs if name not in parameters), "")
        by_position = ", ".join(name for name, item in parameters.items() if item.kind is not item.KEYWORD_ONLY)
        by_name = ", ".join(name for name, item in parameters.items() if item.kind is item.KEYWORD_ONLY)
        available = f"by position: {by_position or 'none'}; by name: {by_name or 'none'}"
        raise ArgumentError(f"{function}(): {error}{near}; available {available}") from None
    missing = [name for name, item in parameters.items() if item.default is item.empty and name not in values]
    if missing:
        descriptions = "; ".join(f"{name} is {parameters[name].annotation.what}" for name in missing)
        raise ArgumentError(f"{function}() needs {' and '.join(missing)}: {descriptions}")
    for name, value in values.items():
        if value is not parameters[name].default:
            values[name] = parameters[name].annotation.take(name, value)
    return values
