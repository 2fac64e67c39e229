"""Overrides of parameter set values: parsing, conflicts, alternative forms, and layers.

A form is one of several alternative ways to state a quantity. Files, overrides and study columns are checked against
the same table of forms. Overrides of the kinds of a scenario are in ``simulation/overrides.py``.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from ppafo.arguments import Name, Overrides, checked
from ppafo.errors import Faults, ParameterError, PpafoError, UnitError, refused_as
from ppafo.model.catalog import EFFECTS, find_effects
from ppafo.model.effects.kind import SECTION
from ppafo.model.gas import SPECIES
from ppafo.parameters.declaration import (
    AREA_FORM,
    OF_SECOND_CHAMBER,
    RELIEVING_PATH,
    SONIC_FORM,
    SPECIES_PATH,
    WHY_ONE_CHAMBER,
)
from ppafo.parameters.graph import ATMOSPHERE_PATH, acting
from ppafo.parameters.parameter_set import (
    SOURCE,
    Entry,
    ParameterSet,
    TextEntry,
    atmospheric_pressure,
    chosen_valve,
    entry_in_si,
    entry_text,
    links_of_set,
    with_followers,
    written_units,
)
from ppafo.units import SI, split_number
from ppafo.wording import check_known, known_names, nearest_name, one_line

CHOSEN_VALVE = "valve."
NAMED_VALVE = "valves."
Forms = Mapping[str, tuple[tuple[str, ...], ...]]
"""Alternative forms of the numbers of a section, each as the names of its values."""
_ORIFICE = tuple(tuple(quantity.name for quantity in form) for form in (AREA_FORM, SONIC_FORM))
FORMS: Forms = {"valve": _ORIFICE, "actuator.leak": _ORIFICE, "controller": (("rate",), ("period",))}


class Override(NamedTuple):
    """Override as typed by the user: full text, path and value."""

    words: str
    typed: str
    text: str

    def __str__(self) -> str:
        """Return the override as quoted in a message; a number of a program without the word that it is in SI."""
        return f"{self.typed}={self.text.removesuffix(f' {SI}')}"


def read_overrides(texts: Iterable[str], error: type[PpafoError] = ParameterError) -> tuple[Override, ...]:
    """Split texts such as ``run.duration=1 s`` into path and value, in their order.

    Raises ``error`` for all other texts, in sorted order.
    """
    in_order = tuple(texts)
    wrong = Faults()
    read = {}
    for text in sorted(in_order):
        on_one_line = one_line(text)
        path, separator, value = (part.strip() for part in on_one_line.partition("="))
        if separator and path and value:
            read[text] = Override(text, path, value)
        else:
            wrong.append(
                error(f"override '{on_one_line}' is not of the form PATH=VALUE, for example valve.area=12.6mm^2")
            )
    wrong.raise_all()
    return tuple(read[text] for text in in_order)


def override_set(
    overrides: Iterable[Override],
    error: type[PpafoError] = ParameterError,
    same: Mapping[str, str] | None = None,
    valve: str = "",
    forms: Forms = FORMS,
) -> dict[str, Override]:
    """Return overrides by path, sorted, so that the order of input does not matter.

    ``same`` maps a path to another path of the same value; ``valve`` is the name of the chosen valve, whose values have
    two paths. Raises ``error``, naming both overrides, if a value is given twice or in two forms.
    """
    by_path: dict[str, Override] = {}
    # Sorted, so that of two messages the same one comes in any order.
    for override in sorted(overrides):
        path = one_path((same or {}).get(override.typed, override.typed), valve)
        if path in by_path:
            raise error(f"overrides '{by_path[path]}' and '{override}' set the same value; remove one of them")
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
    """Merge two layers by path: a later override replaces earlier overrides of the value and of its other forms.

    The order within each layer is kept. The other arguments are described in ``override_set``.
    """
    old, new = (override_set(layer, error, same, valve) for layer in (earlier, later))
    replaced = {other for path in new for other in (path, *other_forms(path))}
    path_of = {override: path for layer in (old, new) for path, override in layer.items()}
    kept = [override for override in earlier if path_of[override] not in replaced]
    return {path_of[override]: override for override in (*kept, *later)}


def over(
    earlier: Iterable[str], later: Iterable[str], error: type[PpafoError] = ParameterError, valve: str = ""
) -> tuple[str, ...]:
    """Merge two layers of override texts, as in ``layered``."""
    old, new = (read_overrides(texts, error) for texts in (earlier, later))
    return tuple(override.words for override in layered(old, new, error, valve=valve).values())


def one_path(path: str, valve: str) -> str:
    """Replace ``valves.NAME.`` in a path by ``valve.`` if NAME is the chosen valve."""
    own = f"{NAMED_VALVE}{valve}."
    return CHOSEN_VALVE + path.removeprefix(own) if valve and path.startswith(own) else path


def of_another_valve(path: str, valve: str) -> bool:
    """Return True if a path names a valve other than the chosen valve."""
    return path.startswith(NAMED_VALVE) and not path.startswith(f"{NAMED_VALVE}{valve}.")


def check_valve(
    overrides: Iterable[Override], valve: str | None, choice: str, error: type[PpafoError] = ParameterError
) -> None:
    """Raise ``error`` if an override concerns another valve than the chosen ``valve``, None if none is chosen."""
    for override in sorted(overrides):
        if valve and of_another_valve(override.typed, valve):
            raise error(
                f"override '{override}' has no effect with {choice}, which selects another valve; remove one of them"
            )


def other_forms(path: str, forms: Forms = FORMS) -> tuple[str, ...]:
    """Return the paths of the alternative forms of a value; empty if it has a single form."""
    section, _, name = path.rpartition(".")
    ways = forms.get("valve" if section.startswith(NAMED_VALVE) else section, ())
    if not any(name in way for way in ways):
        return ()
    return tuple(f"{section}.{other}" for way in ways if name not in way for other in way)


def in_two_forms(paths: Collection[str], forms: Forms = FORMS) -> tuple[str, str] | None:
    """Return the first two paths that state a quantity in two forms, None if there are none."""
    pairs = ((path, other) for path in sorted(paths) for other in sorted(other_forms(path, forms)) if other in paths)
    return next(pairs, None)


def either(path: str, forms: Forms = FORMS) -> str:
    """Return the sentence of a message that asks for one of two forms of a quantity."""
    section = path.rpartition(".")[0]
    ways = forms["valve" if section.startswith(NAMED_VALVE) else section]
    return f"give either {' or '.join(' and '.join(f'{section}.{name}' for name in way) for way in ways)}, not both"


@checked
def apply_overrides(parameter_set: ParameterSet, overrides: Overrides, *, valve: Name | None = None) -> ParameterSet:
    """Apply overrides to a parameter set.

    ``valve.X`` means the valve that is chosen (``valve``, else the set's default), ``valves.NAME.X`` one by name.
    Naming another gas brings that gas's molar mass and heat capacity ratio, unless they are given too; giving an
    orifice in the form of ISO 6358 drops its area and discharge coefficient, and the reverse. Dependent numbers
    (``links_of_set``) is set with it, unless it is given too.

    Arguments:
        parameter_set: the set, which is not modified
        overrides: texts such as ``valve.area=12.6mm^2``, in any order, or a dictionary of paths with numbers in SI
        valve: name of the valve that ``valve.X`` means; default: the set's default valve

    Returns:
        the changed ParameterSet

    Raises:
        ParameterError: an override that does not fit the set, or two that give one value

    >>> import ppafo
    >>> changed = ppafo.apply_overrides(ppafo.load_parameter_set("ppafo2011"), ["supply.pressure=70 psi_g"])
    >>> changed.numbers["supply.pressure"].value, changed.numbers["supply.pressure"].unit
    (70.0, 'psi_g')
    """
    return with_overrides(parameter_set, read_overrides(overrides), valve)


def with_overrides(parameter_set: ParameterSet, overrides: Iterable[Override], valve: str | None) -> ParameterSet:
    """Apply overrides to a parameter set; ``valve`` as in ``apply_overrides``."""
    chosen = chosen_valve(parameter_set, valve)
    overrides_by_path = {
        f"{NAMED_VALVE}{chosen}.{path.removeprefix(CHOSEN_VALVE)}" if path.startswith(CHOSEN_VALVE) else path: override
        for path, override in override_set(overrides, valve=chosen).items()
    }
    if not overrides_by_path:
        return parameter_set
    followers = {
        path: overrides_by_path[link.sources[0]]
        for path, link in acting(links_of_set(parameter_set, chosen, overrides_by_path), overrides_by_path).items()
        if link.when
    }
    # A gas brings numbers, and gauge pressures count from the atmosphere, so these two come first.
    first = [path for path in (SPECIES_PATH, ATMOSPHERE_PATH) if path in overrides_by_path]
    every = {**{path: overrides_by_path[path] for path in first}, **overrides_by_path, **followers}
    wrong = Faults()
    for path, text in every.items():
        with wrong:
            change = _with_text if path in (SPECIES_PATH, RELIEVING_PATH) else _with_number
            parameter_set = change(parameter_set, path, text)
    wrong.raise_all()
    # A user who gives a pressure in bar reads pressures in bar; a program gives numbers in SI, and reads none.
    typed = {
        path: parameter_set.numbers[path]
        for path, override in overrides_by_path.items()
        if path in parameter_set.numbers and split_number(override.text)[1] != SI
    }
    return replace(parameter_set, shown={**parameter_set.shown, **written_units(typed)})


def _with_number(parameter_set: ParameterSet, path: str, override: Override) -> ParameterSet:
    find_effects([path])
    declared = parameter_set.declarations()
    if path in OF_SECOND_CHAMBER and parameter_set.has_one_chamber:
        raise ParameterError(f"override '{override}' concerns chamber 2, but in {parameter_set.file} {WHY_ONE_CHAMBER}")
    if path not in declared:
        # So that the hint knows the values of effects that no set of this run has named.
        EFFECTS.load_own()
        declared = parameter_set.declarations()
        allowed = [*declared, SPECIES_PATH, RELIEVING_PATH]
        if override.typed.startswith(CHOSEN_VALVE):
            allowed = [one_path(known, path.split(".")[1]) for known in allowed]
        hint = _nearest_value(override, allowed)
        raise ParameterError(f"override '{override}': {parameter_set.file} has no value '{override.typed}'{hint}")
    with refused_as(ParameterError, f"override '{override}'", UnitError):
        value, unit = split_number(override.text)
        unit = declared[path].unit if unit == SI else unit
        entry = Entry(value=value, unit=unit, origin="assumed", source=SOURCE, note=_before(parameter_set, path))
        entry_in_si(entry, declared[path], atmospheric_pressure(parameter_set))
    kept = {key: old for key, old in parameter_set.numbers.items() if key not in other_forms(path)}
    return replace(parameter_set, numbers={**kept, path: entry})


def _nearest_value(override: Override, allowed: Sequence[str]) -> str:
    """Return a hint on the values of a set that an unknown override may mean."""
    section, _, rest = override.typed.partition(".")
    name = rest.partition(".")[0]
    # A gas is given by the name of its species, whatever the value was called.
    if "gas" in override.typed.split(".") and override.text in SPECIES:
        return f", did you mean '{SPECIES_PATH}={override.text}'?"
    if section == SECTION and name not in EFFECTS.loaded():
        return f": no effect '{name}'{known_names(name, EFFECTS.loaded())}"
    section = f"{section}.{name}" if section == SECTION else section
    # Compared without their section, which all values in it have in common and which makes strangers look alike.
    near = [known.removeprefix(f"{section}.") for known in allowed if known.startswith(f"{section}.")]
    hint = nearest_name(override.typed.removeprefix(f"{section}."), near).replace("'", f"'{section}.", 1)
    # Where no name is spelt alike, the values of the same section are listed.
    return hint or (f"; '{section}' has {', '.join(near)}" if near else nearest_name(override.typed, allowed))


def _with_text(parameter_set: ParameterSet, path: str, override: Override) -> ParameterSet:
    """Return a set with another gas and its constants, or with relieving regulators or not."""
    numbers = dict(parameter_set.numbers)
    value = override.text
    if path == RELIEVING_PATH and value not in ("true", "false"):
        raise ParameterError(f"override '{override}': must be true or false")
    if path == SPECIES_PATH:
        check_known(value, SPECIES, ParameterError, f"override '{override}': unknown gas")
        species = SPECIES[value]
        note = f"follows from the override {path}={value}"
        for key, unit in (("molar_mass", "kg/mol"), ("heat_capacity_ratio", "")):
            numbers[f"gas.{key}"] = Entry(getattr(species, key), unit, "datasheet", species.source, note)
    note = _before(parameter_set, path)
    entry = TextEntry(value if path == SPECIES_PATH else value == "true", "assumed", SOURCE, note)
    return replace(parameter_set, numbers=numbers, texts={**parameter_set.texts, path: entry})


def _before(parameter_set: ParameterSet, path: str) -> str:
    """Return a note with the previous value at a path, to record with an override."""
    entry = with_followers(parameter_set).entries().get(path)
    return f"the set has {entry_text(entry)} ({entry.origin}: {entry.source})" if entry else "the set has no value"
