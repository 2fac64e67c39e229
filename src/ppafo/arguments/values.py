"""Python arguments, checked and converted by the annotations that also define the arguments of a command.

``@checked`` reads the annotations at the first call. An unsuitable value raises an ArgumentError that names the
argument, describes the accepted values and quotes the value. Wrong or missing arguments, for which Python raises a
TypeError, do the same. Numbers, flags and texts are also accepted from NumPy, and nothing slow to load is imported.
"""

import builtins
import collections.abc
import contextlib
import dataclasses
import errno
import functools
import inspect
import math
import numbers
import os
import re
import reprlib
import sys
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, ParamSpec, TypeVar

from ppafo.arguments.reading import ANY, MAXIMUM_DIGITS, NUMBER, NumberRange, NumberWithUnit, Word, task
from ppafo.errors import ArgumentError, KindError, PpafoError
from ppafo.kinds import fault_of_user
from ppafo.plugins import name_plugins
from ppafo.units import SI, carried
from ppafo.wording import nearest_name, read_by, reader

P = ParamSpec("P")
R = TypeVar("R")
_MAXIMUM_LEVELS = 60
"""Maximum depth of nested dictionaries and lists that are copied."""
_QUOTED = reprlib.Repr()
_QUOTED.maxstring = _QUOTED.maxother = 60


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that checks and converts its arguments, and names its ``plugins``, before the call."""

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
                name_plugins(values.get("plugins", ()))
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
                raise ArgumentError(f"{given}{shown(longest)} is too long for the name of a file") from error
            except Exception as error:  # what a kind of another package raises while it runs is anybody's guess
                if line := fault_of_user(error):
                    raise KindError(line) from error
                raise

    return call


def _values(function: str, signature: inspect.Signature, /, *args: Any, **kwargs: Any) -> dict[str, Any]:
    """Return the converted arguments of a call by name."""
    parameters = signature.parameters
    try:
        values = signature.bind_partial(*args, **kwargs).arguments
    except TypeError as error:
        near = next((nearest_name(name, parameters) for name in kwargs if name not in parameters), "")
        known = ", ".join(f"{name}{'=' if item.kind is item.KEYWORD_ONLY else ''}" for name, item in parameters.items())
        raise ArgumentError(f"{function}(): {error}{near}; available: {known}") from None
    missing = [name for name, item in parameters.items() if item.default is item.empty and name not in values]
    if missing:
        descriptions = "; ".join(f"{name} is {parameters[name].annotation.what}" for name in missing)
        raise ArgumentError(f"{function}() needs {' and '.join(missing)}: {descriptions}")
    for name, value in values.items():
        if value is not parameters[name].default:
            values[name] = parameters[name].annotation.take(name, value)
    return values


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


def accepted_values(annotation: Any) -> AcceptedValues:
    """Return the accepted values of a parameter with an annotation."""
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    if origin is Annotated:
        # Python flattens nested annotations with the outermost last: that one has priority.
        taking = [(item.what, item.take) for item in inner[1:] if isinstance(item, Word) and item.take]
        return _single(*taking[-1]) if taking else accepted_values(inner[0])
    if origin in (typing.Union, types.UnionType):
        options = [accepted_values(item) for item in inner if item is not types.NoneType]
        kinds = tuple(kind for each in options for kind in each.kinds)
        first = AcceptedValues(kinds, functools.partial(_first_of, options)) if len(options) > 1 else options[0]
        return first._replace(allows_none=types.NoneType in inner)
    if annotation in _PLAIN:
        return _single(*_PLAIN[annotation])
    kind = origin or annotation
    if issubclass(kind, Mapping):
        items = functools.partial(_items, accepted_values(inner[1]))
        return AcceptedValues(("a dictionary with strings as keys",), items)
    if inner and issubclass(kind, Iterable):
        element = accepted_values(inner[0])
        return AcceptedValues((*element.kinds, "several"), functools.partial(_each, element))
    what = "a function" if kind is collections.abc.Callable else f"a {kind.__name__}"
    return _single(what, functools.partial(_of_class, kind))


def _single(what: str, take: Callable[[Any], Any]) -> AcceptedValues:
    return AcceptedValues((what,), lambda _, value: take(value))


def _of_class(kind: type, value: Any) -> Any:
    """Return an object of a class, by its name of one not imported. Raises TypeError for another."""
    if not isinstance(value, kind) and kind.__name__ not in [base.__name__ for base in type(value).__mro__]:
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


def shown(value: Any) -> str:
    """Return a value as quoted in a message: shortened, or the name of its class."""
    with contextlib.suppress(Exception):  # the class attribute of a foreign object may raise anything
        if isinstance(value, str | bytes | int | float | complex | Path | list | tuple | dict | set | None):
            return _QUOTED.repr(value)
    return f"<{type(value).__name__}>"


def taken_text(value: Any) -> str:
    """Return a text that is not empty; ValueError for anything else.

    A member of a text enumeration or another subclass of str becomes its text content, not its ``str()``.
    """
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise ValueError
    return str.__str__(value)


def _scalar(value: Any) -> Any:
    """Return an array without axes as a Python value, None if masked or a time; any other value unchanged.

    Otherwise a NumPy time would count as a whole number, and a masked value as the hidden number. A number that carries
    a unit becomes the text of both, as a person writes it.
    """
    if (with_unit := carried(value)) is not None:
        number = _scalar(with_unit[0])
        unit = with_unit[1]
        is_number = isinstance(number, numbers.Real) and not isinstance(number, bool)
        return f"{float(number)!r} {unit}" if is_number and unit != "1" else number
    if getattr(value, "ndim", None) != 0 or not hasattr(value, "item"):
        return value
    is_hidden = bool(getattr(value, "mask", False))
    return None if is_hidden or getattr(value.dtype, "kind", "") in "mM" else value.item()


def _taken_flag(value: Any) -> bool:
    flag = _scalar(value)
    if not isinstance(flag, bool):
        raise ValueError
    return flag


def taken_whole(lowest: int) -> Callable[[Any], Any]:
    """Return a converter of whole numbers not below ``lowest``, also from NumPy, with ValueError for others."""
    return taken_number(NumberRange(lowest, highest=10**MAXIMUM_DIGITS - 1), of=int)


def taken_number(
    allowed: NumberRange = ANY, read: Callable[[str], Any] | None = None, of: type[float] = float
) -> Callable[[Any], Any]:
    """Return a converter of finite numbers in a range, also from NumPy, or of texts converted by ``read``."""
    kind: Any = numbers.Integral if of is int else numbers.Real

    def take(value: Any) -> Any:
        number = _scalar(value)
        if isinstance(number, str) and read is not None and not NUMBER.fullmatch(number.strip()):
            return read(taken_text(number))
        if read is not None and carried(value) is not None:
            # Only a dimensionless value is taken without a unit: a share is one, a mass is not.
            return read(f"{number!r} 1")
        is_number = isinstance(number, kind) and not isinstance(number, bool) and math.isfinite(number)
        if not is_number or of(number) not in allowed:
            raise ValueError
        return number if isinstance(number, NumberWithUnit) else of(number)

    return take


def taken_overrides(value: Any) -> tuple[str, ...]:
    """Return overrides as texts ``PATH=VALUE``, from one, several, or a dictionary; ValueError for anything else.

    The keys of a dictionary are paths or sections with nested dictionaries; values are texts, flags, or numbers in SI
    units.
    """
    if isinstance(value, Mapping):
        return tuple(_overrides_of(value, ""))
    texts = (value,) if isinstance(value, str) else value
    # Iterating over a table of pandas yields the names of its columns.
    if isinstance(texts, bytes) or hasattr(texts, "keys") or not isinstance(texts, Iterable):
        raise ValueError
    return tuple(taken_text(text) for text in texts)


def _overrides_of(table: Mapping[Any, Any], section: str) -> Iterator[str]:
    for name, value in table.items():
        path = f"{section}{taken_text(name)}"
        scalar = _scalar(value)
        if isinstance(scalar, Mapping):
            yield from _overrides_of(scalar, f"{path}.")
        elif isinstance(scalar, bool):
            yield f"{path}={str(scalar).lower()}"
        elif isinstance(scalar, numbers.Real) and math.isfinite(scalar):
            number = int(scalar) if isinstance(scalar, numbers.Integral) else float(scalar)
            yield f"{path}={number!r} {SI}"
        elif isinstance(scalar, str) and scalar.strip():
            yield f"{path}={taken_text(scalar)}"
        else:
            requirement = "must be a finite number in SI units, True, False or a text such as '12.6 mm^2'"
            raise ArgumentError(f"{path} = {shown(value)}: {requirement}")


def taken_tasks(value: Any) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return pairs of a name and overrides, from a dictionary, pairs or texts; ValueError for anything else."""
    items = value.items() if isinstance(value, Mapping) else (value,) if isinstance(value, str) else value
    pairs = [task(item) if isinstance(item, str) else item for item in items]
    return tuple((taken_text(name), taken_overrides(overrides)) for name, overrides in pairs)


def taken_document(value: Any) -> Any:
    """Return a copy of nested dictionaries as the plain data of a file; ValueError for anything but a dictionary.

    Accepts mappings of any class, lists, iterators, texts and numbers, also from NumPy. Raises ArgumentError for None.
    """
    if not isinstance(value, Mapping):
        raise ValueError
    return _plain(value, "", ())


def _plain(value: Any, path: str, above: tuple[int, ...]) -> Any:
    """Return a value as plain data; ``above`` are the identities of the containers around it."""
    scalar = _scalar(value)
    if scalar is None:
        raise ArgumentError(f"{path} = {shown(value)}: has no value; omit the key for the default")
    if isinstance(scalar, str):
        return str.__str__(scalar)
    # A value that contains itself, or is nested deeper than any file, is refused by the check of the document.
    is_endless = id(value) in above or len(above) > _MAXIMUM_LEVELS
    if is_endless or isinstance(scalar, bytes) or not isinstance(scalar, Iterable):
        return scalar
    inside = (*above, id(value))
    if isinstance(scalar, Mapping):
        return {taken_text(name): _plain(item, f"{path}.{name}".lstrip("."), inside) for name, item in scalar.items()}
    if hasattr(scalar, "keys"):
        return scalar
    return [_plain(item, f"{path}[{index}]", inside) for index, item in enumerate(scalar)]


_PLAIN: Mapping[Any, tuple[str, Callable[[Any], Any]]] = {
    str: ("a text", taken_text),
    bool: ("True or False", _taken_flag),
    int: ("a whole number", taken_whole(-(2**63))),
    float: ("a finite number", taken_number()),
    # Where a name is accepted too, its converter comes first and takes texts.
    Path: ("a path", lambda value: Path(taken_text(os.fspath(value)))),
    Mapping[str, Any]: ("a dictionary with strings as keys", taken_document),
    # The object of a method.
    inspect.Parameter.empty: ("anything", lambda value: value),
}
"""Description and converter of each type without a ``Word``."""


class _AnnotationNames(dict[str, Any]):
    """Namespace of an annotation: names of its module and of Python, and placeholders for classes not imported.

    The help of a command needs no import of the class; a caller that passes an object has imported it already.
    """

    def __contains__(self, name: object) -> bool:
        """Return True: an unknown name stands for a class not imported."""
        return True

    def __missing__(self, name: str) -> Any:
        """Return a Python builtin, or a placeholder for a class not imported."""
        # Type parameters of a placeholder are ignored.
        here = {"__class_getitem__": classmethod(lambda cls, _parameters: cls)}
        return getattr(builtins, name) if hasattr(builtins, name) else type(name, (), here)


def _annotations(function: Callable[..., Any], with_words: bool) -> Mapping[str, Any]:
    """Return the evaluated annotations of a function by name."""
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
    hints = {name: _type_text(hint) for name, hint in _annotations(function, with_words=False).items()}
    signature = inspect.signature(function)
    parameters = []
    for name, item in signature.parameters.items():
        # A function, or the factory of a field, has no text of its own.
        has_text = item.default is item.empty or not repr(item.default).startswith("<")
        default = item.default if has_text else _Shown(getattr(item.default, "__name__", "..."))
        parameters.append(item.replace(annotation=hints.get(name, item.annotation), default=default))
    function.__signature__ = signature.replace(  # type: ignore[attr-defined]  # of all functions, says inspect
        parameters=parameters, return_annotation=hints.get("return", signature.return_annotation)
    )


def _type_text(hint: Any) -> _Shown:
    """Return a type as plain text, ``Scenario | str | Path``, without module names."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return _Shown(" | ".join(dict.fromkeys(map(_type_text, typing.get_args(hint)))))
    return _Shown(re.sub(r"\b([A-Za-z_]\w*\.)+|Type\b(?<=NoneType)", "", inspect.formatannotation(hint)))
