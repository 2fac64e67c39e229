"""What a physical effect is: one value, from which every door of the package takes what it needs.

Files, overrides, columns of studies, fits, exported libraries, the page, linear models, the reference solver and walks
know an effect by this value alone; none of them names one.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ProgramError
from ppafo.model.declaration import Quantity

SECTION = "effects"
"""Section of a parameter set, and begin of the paths, that hold the settings of effects."""


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """A physical effect: its name in files, what it is, its settings in SI, its row of numbers, and its laws.

    ``switch`` names settings, none of them ever below 0; where all of them are 0 the effect is off, and programs are
    composed without it: they have the bits that they would have if it did not exist.

    ``prepare(settings, device)`` makes the NamedTuple ``parameters`` from the settings by name and the numbers of the
    device (``device.gas``, ``.actuator``, ``.friction``, ``.foot_plate`` and ``.supply``, by their names in a parameter
    set). It must be in the subset that is compiled, for an exported library has it in C.

    ``laws`` has for places of ``ppafo.model.places`` the functions that act there. A law takes what its place takes,
    and its row by the effect's name as a further parameter, which whoever calls the place then hands on. A law that
    calls its own place gets the law of the effect before, or the place as it is without effects.

    ``source`` says where law and numbers are from, ``equation`` is its line of the equations; ``symbols`` are lines of
    the nomenclature: symbol, name in the code, unit, meaning.
    """

    name: str
    summary: str
    quantities: tuple[Quantity, ...]
    parameters: type
    prepare: Callable[..., Any]
    switch: tuple[str, ...]
    laws: Mapping[Callable[..., Any], Callable[..., Any]]
    source: str = ""
    equation: str = ""
    symbols: tuple[tuple[str, str, str, str], ...] = ()

    @property
    def section(self) -> str:
        """Where its settings stand in a parameter set, and what their paths begin with."""
        return f"{SECTION}.{self.name}"

    def defaults(self) -> dict[str, float]:
        """Settings [SI] of a device that says nothing of the effect."""
        return {item.name: float(item.default or 0.0) for item in self.quantities}

    def is_on(self, settings: Mapping[str, Any]) -> Any:
        """Whether the effect is on with some settings; for arrays (runs,) among them an array of truth values."""
        found: Any = False
        for name in self.switch:
            found = found | (settings[name] > 0.0)
        return found


def nomenclature_lines(effect: Effect) -> list[str]:
    """Return the lines that an effect has in the table of the nomenclature."""
    return [f"| {symbol} | `{name}` | {unit} | {meaning} |" for symbol, name, unit, meaning in effect.symbols]


def equation_lines(effect: Effect) -> list[str]:
    """Return what the page of the equations says of an effect: its laws by place, its equation and its source."""
    laws = [
        f"- `{law.__module__}.{law.__qualname__}`: at `{place.__name__}`; {effect.source}"
        for place, law in effect.laws.items()
    ]
    return [f"### {effect.name}: {effect.summary}", "", f"    {effect.equation}", "", *laws]


def effect_problem(effect: Effect) -> str:
    """Return what is wrong with an effect as a value, in words; empty where nothing is."""
    lowest = {item.name: item.minimum for item in effect.quantities}
    if not effect.name.isidentifier():
        return "its name is the parameter by which laws ask for its row, and must be an identifier"
    missing = [item.name for item in effect.quantities if item.default is None]
    if missing:
        return f"'{missing[0]}' has no default: a device that says nothing of an effect must be without it"
    unknown = [name for name in effect.switch if lowest.get(name) != 0.0]
    if unknown or not effect.switch:
        return f"switch names '{unknown[0]}', which is no quantity with a minimum of 0" if unknown else "has no switch"
    if effect.is_on(effect.defaults()):
        return "its defaults leave it on: a device that says nothing of an effect must be without it"
    for place, law in effect.laws.items():
        given, taken = _parameters(place), [name for name in _parameters(law) if name != effect.name]
        if taken != given:
            return f"{law.__name__}({', '.join(taken)}) must take ({', '.join(given)}), as {place.__name__} does"
    return ""


def laws_in_order(effects: Sequence[Effect]) -> dict[Any, Any]:
    """Return what stands for each place, and under pairs of law and place what a law that calls its place gets.

    Effects act in the order in which they are given: each but the first of a place must call it, or it would be as if
    those before it did not exist. ProgramError where one does not.
    """
    found: dict[Any, Any] = {}
    last: dict[Any, Effect] = {}
    for effect in effects:
        for place, law in effect.laws.items():
            if place in last and not _calls(law, place):
                raise ProgramError(
                    f"effects '{last[place].name}' and '{effect.name}' both act on {place.__name__}, and "
                    f"{law.__name__} of '{effect.name}' does not call it: switch one of them off"
                )
            found[law, place] = found.get(place, place)
            found[place], last[place] = law, effect
    return found


def _parameters(function: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(function).parameters)


def _calls(law: Any, place: Callable[..., Any]) -> bool:
    return any(law.__globals__.get(name) is place for name in law.__code__.co_names)
