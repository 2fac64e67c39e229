"""Overrides are a set: each value once, each orifice in one form, the same result in any order; two sets are layers.

A form is one of the ways to give a thing, of which only one is taken: files, overrides and columns of studies are
checked by the same table. What the kinds of a scenario add is in ``simulation/overrides.py``.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from ppafo.errors import ParameterError, PpafoError, one_line
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM

CHOSEN_VALVE, NAMED_VALVE = "valve.", "valves."
Forms = Mapping[str, tuple[tuple[str, ...], ...]]
"""By section the forms in which something is given, each as the names of its values."""
_ORIFICE = tuple(tuple(quantity.name for quantity in form) for form in (AREA_FORM, SONIC_FORM))
FORMS: Forms = {"valve": _ORIFICE, "actuator.leak": _ORIFICE, "controller": (("rate",), ("period",))}


class Override(NamedTuple):
    """An override: its words as they were given, path and value in them."""

    words: str
    typed: str
    text: str

    def __str__(self) -> str:
        """The override as a message quotes it."""
        return f"{self.typed}={self.text}"


def split_override(override: str, error: type[PpafoError] = ParameterError) -> Override:
    """Return path and value of a text such as ``run.duration=1 s``; an ``error`` for any other text."""
    on_one_line = one_line(override)
    path, separator, text = (part.strip() for part in on_one_line.partition("="))
    if not separator or not path or not text:
        raise error(f"override '{on_one_line}' is not of the form PATH=VALUE, for example valve.area=12.6mm^2")
    return Override(override, path, text)


def read_overrides(texts: Iterable[str], error: type[PpafoError] = ParameterError) -> tuple[Override, ...]:
    """Return texts as overrides, in their order; an ``error`` for the first, in sorted order, that is none."""
    in_order = tuple(texts)
    read = {text: split_override(text, error) for text in sorted(in_order)}
    return tuple(read[text] for text in in_order)


def override_set(
    overrides: Iterable[Override],
    error: type[PpafoError] = ParameterError,
    same: Mapping[str, str] | None = None,
    valve: str = "",
    forms: Forms = FORMS,
) -> dict[str, Override]:
    """Return overrides by path, sorted, so that their order is forgotten.

    ``same`` maps a path to another one of the same value; ``valve`` is the name of the valve that is chosen, whose
    values have two paths. An ``error`` where a value is given twice or in two forms names both overrides.
    """
    by_path: dict[str, Override] = {}
    # Sorted, so that of two messages the same one comes in any order.
    for override in sorted(overrides):
        path = one_path((same or {}).get(override.typed, override.typed), valve)
        if path in by_path:
            raise error(f"overrides '{by_path[path]}' and '{override}': the same value is given twice; omit one")
        by_path[path] = override
    pair = in_two_forms(by_path, forms)
    if pair is not None:
        first, second = (by_path[path] for path in pair)
        raise error(f"overrides '{first}' and '{second}': {either(pair[0], forms)}")
    return {path: by_path[path] for path in sorted(by_path)}


def layered(
    earlier: Sequence[Override],
    later: Sequence[Override],
    error: type[PpafoError],
    same: Mapping[str, str] | None = None,
    valve: str = "",
) -> dict[str, Override]:
    """Return two layers as one set by path: what the later gives replaces value, and other form, of the earlier.

    Those of a layer keep their order. The other arguments as in ``override_set``.
    """
    old, new = (override_set(layer, error, same, valve) for layer in (earlier, later))
    replaced = {other for path in new for other in (path, *other_forms(path))}
    path_of = {override: path for layer in (old, new) for path, override in layer.items()}
    kept = [override for override in earlier if path_of[override] not in replaced]
    return {path_of[override]: override for override in (*kept, *later)}


def over(
    earlier: Iterable[str], later: Iterable[str], error: type[PpafoError] = ParameterError, valve: str = ""
) -> tuple[str, ...]:
    """Return two layers of texts as the texts of one set, as ``layered`` does."""
    old, new = (read_overrides(texts, error) for texts in (earlier, later))
    return tuple(override.words for override in layered(old, new, error, valve=valve).values())


def one_path(path: str, valve: str) -> str:
    """Return the path with ``valve.`` in place of ``valves.NAME.`` where that is the valve that is chosen."""
    own = f"{NAMED_VALVE}{valve}."
    return CHOSEN_VALVE + path.removeprefix(own) if valve and path.startswith(own) else path


def of_another_valve(path: str, valve: str) -> bool:
    """Tell whether a path is of a valve by name that is not the one that is chosen."""
    return path.startswith(NAMED_VALVE) and not path.startswith(f"{NAMED_VALVE}{valve}.")


def check_valve(
    overrides: Iterable[Override], valve: str | None, choice: str, error: type[PpafoError] = ParameterError
) -> None:
    """Refuse an override of another valve than the one that is chosen beside it, None for no choice.

    The ``error`` names the override and the ``choice`` as it was given.
    """
    for override in sorted(overrides) if valve else ():
        if valve and of_another_valve(override.typed, valve):
            raise error(f"override '{override}' and {choice}: with the latter that valve is not used; omit one")


def other_forms(path: str, forms: Forms = FORMS) -> tuple[str, ...]:
    """Return the paths of the other forms of what a path gives; none where there is one form."""
    section, _, name = path.rpartition(".")
    ways = forms.get("valve" if section.startswith(NAMED_VALVE) else section, ())
    if not any(name in way for way in ways):
        return ()
    return tuple(f"{section}.{other}" for way in ways if name not in way for other in way)


def in_two_forms(paths: Collection[str], forms: Forms = FORMS) -> tuple[str, str] | None:
    """Return the first two paths that give one thing in two forms, None where all give each thing in one."""
    pairs = ((path, other) for path in sorted(paths) for other in sorted(other_forms(path, forms)) if other in paths)
    return next(pairs, None)


def either(path: str, forms: Forms = FORMS) -> str:
    """Return what a message asks for where a thing is given in two forms."""
    section = path.rpartition(".")[0]
    ways = forms["valve" if section.startswith(NAMED_VALVE) else section]
    return f"give either {' or '.join(' and '.join(f'{section}.{name}' for name in way) for way in ways)}, not both"
