"""Changing single values of a set by dotted path, with the change visible in the provenance."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ppafo.errors import ParameterError, UnitError, nearest_name, one_line
from ppafo.model.catalog import EFFECTS, find_effects
from ppafo.model.gas import SPECIES
from ppafo.parameters.declaration import AREA_FORM, RELIEVING_PATH, SONIC_FORM, SPECIES_PATH
from ppafo.parameters.graph import acting
from ppafo.parameters.parameter_set import (
    Entry,
    FlagEntry,
    ParameterSet,
    TextEntry,
    atmospheric_pressure,
    chosen_valve,
    entry_in_si,
    entry_text,
    links_of_set,
)
from ppafo.units import split_quantity

SOURCE = "override"

_CHOSEN = "valve."

_AREA_NAMES = frozenset(quantity.name for quantity in AREA_FORM)
_SONIC_NAMES = frozenset(quantity.name for quantity in SONIC_FORM)


@dataclass(frozen=True, slots=True)
class _Order:
    """An override as it was typed, and the valve that ``valve`` means in it."""

    typed: str
    chosen: str
    text: str

    @property
    def path(self) -> str:
        """The path in the set."""
        inside = self.typed.removeprefix(_CHOSEN)
        return f"valves.{self.chosen}.{inside}" if self.typed.startswith(_CHOSEN) else self.typed

    def typed_path(self, path: str) -> str:
        """Return a path of the set in the way in which this override was typed."""
        own = f"valves.{self.chosen}."
        return _CHOSEN + path.removeprefix(own) if self.typed.startswith(_CHOSEN) and path.startswith(own) else path

    def refusal(self, why: object) -> ParameterError:
        """Return the error that quotes the override as it was typed."""
        return ParameterError(f"override '{self.typed}={self.text}': {why}")


def apply_overrides(parameter_set: ParameterSet, overrides: Iterable[str], valve: str | None = None) -> ParameterSet:
    """Return the set with values replaced; each override is a text such as ``valve.area=12.6mm^2``.

    ``valve.X`` means the valve that is chosen (``valve``, else the set's default), ``valves.NAME.X`` one by name.
    Naming another gas brings that gas's molar mass and heat capacity ratio; giving an orifice in the form of ISO 6358
    drops its area and discharge coefficient, and the reverse. What follows a number (``links_of_set``) is set with it,
    unless it is given too. ParameterError for an override that does not fit the set.
    """
    chosen, orders = chosen_valve(parameter_set, valve), list(overrides)
    atmosphere = atmospheric_pressure(parameter_set) if orders else None
    given = [override.partition("=")[0].strip() for override in orders]
    for number, override in enumerate(orders):
        on_one_line = one_line(override)
        path, separator, text = (part.strip() for part in on_one_line.partition("="))
        if not separator or not path or not text:
            raise ParameterError(
                f"override '{on_one_line}' is not of the form PATH=VALUE, for example valve.area=12.6mm^2"
            )
        change = _CHANGES.get(path, _with_number)
        links = acting(links_of_set(parameter_set, given[:number], atmosphere), {path, *given[number + 1 :]})
        parameter_set = change(parameter_set, _Order(path, chosen, text))
        for follower in (follower for follower, link in links.items() if link.when_set and link.sources == (path,)):
            parameter_set = _with_number(parameter_set, _Order(follower, chosen, text))
    return parameter_set


def overridden_paths(parameter_set: ParameterSet) -> frozenset[str]:
    """Return the paths whose values come from overrides."""
    return frozenset(path for path, entry in parameter_set.entries().items() if entry.source == SOURCE)


def _with_number(parameter_set: ParameterSet, order: _Order) -> ParameterSet:
    path = order.path
    find_effects([path])
    declared = parameter_set.declarations()
    if path not in declared:
        EFFECTS.load_own()
        declared = parameter_set.declarations()
        allowed = [order.typed_path(known) for known in (*declared, SPECIES_PATH, RELIEVING_PATH)]
        hint = nearest_name(order.typed, allowed) or f"; for example {', '.join(_neighbours(order.typed, allowed))}"
        raise order.refusal(f"{parameter_set.file} has no value '{order.typed}'{hint}")
    try:
        value, unit = split_quantity(order.text)
        entry = Entry(value=value, unit=unit, origin="assumed", source=SOURCE, note=_before(parameter_set, path))
        entry_in_si(entry, declared[path], atmospheric_pressure(parameter_set))
    except UnitError as error:
        raise order.refusal(error) from error
    kept = {key: old for key, old in parameter_set.numbers.items() if key not in _other_form(path)}
    return replace(parameter_set, numbers={**kept, path: entry})


def _with_species(parameter_set: ParameterSet, order: _Order) -> ParameterSet:
    path, text = order.path, order.text
    species = SPECIES.get(text)
    if species is None:
        raise order.refusal(f"unknown gas{nearest_name(text, SPECIES)}; available: {', '.join(SPECIES)}")
    note = f"follows from the override {path}={text}"
    constants = {"gas.molar_mass": (species.molar_mass, "kg/mol")}
    constants["gas.heat_capacity_ratio"] = (species.heat_capacity_ratio, "")
    numbers = {
        key: Entry(value=value, unit=unit, origin="datasheet", source=species.source, note=note)
        for key, (value, unit) in constants.items()
    }
    chosen = TextEntry(value=text, origin="assumed", source=SOURCE, note=_before(parameter_set, path))
    return replace(
        parameter_set,
        numbers={**parameter_set.numbers, **numbers},
        texts={**parameter_set.texts, path: chosen},
    )


def _with_relieving(parameter_set: ParameterSet, order: _Order) -> ParameterSet:
    if order.text not in _FLAGS:
        raise order.refusal(f"must be {' or '.join(_FLAGS)}")
    note = _before(parameter_set, order.path)
    entry = FlagEntry(value=_FLAGS[order.text], origin="assumed", source=SOURCE, note=note)
    return replace(parameter_set, flags={**parameter_set.flags, order.path: entry})


_FLAGS = {"true": True, "false": False}
_CHANGES = {SPECIES_PATH: _with_species, RELIEVING_PATH: _with_relieving}


def _before(parameter_set: ParameterSet, path: str) -> str:
    """Return what stood at the path, so that an override never hides the value it replaces."""
    entry = parameter_set.entries().get(path)
    return f"the set has {entry_text(entry)} ({entry.origin}: {entry.source})" if entry else "the set has no value"


def _other_form(path: str) -> frozenset[str]:
    """Return the paths that no longer hold when an orifice is given in the form that ``path`` belongs to."""
    section, _, name = path.rpartition(".")
    other = _SONIC_NAMES if name in _AREA_NAMES else _AREA_NAMES if name in _SONIC_NAMES else frozenset()
    return frozenset(f"{section}.{member}" for member in other)


def _neighbours(path: str, allowed: list[str]) -> list[str]:
    section = path.partition(".")[0]
    return [name for name in allowed if name.startswith(f"{section}.")][:6] or allowed[:6]
