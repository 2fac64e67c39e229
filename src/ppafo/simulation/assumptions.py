"""The assumed values of a scenario, which no source gives, each with its reason."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ppafo.errors import ScenarioError, nearest_name, one_line
from ppafo.model.declaration import Quantity
from ppafo.parameters import ParameterSet
from ppafo.parameters.declaration import RELIEVING_PATH
from ppafo.parameters.parameter_set import entry_text
from ppafo.simulation.declaration import quantities, value_at
from ppafo.simulation.overriding import device_paths, scenario_paths, split_override
from ppafo.simulation.reading import Reading, quantity_text
from ppafo.simulation.scenario import Assumption

_SECTION = "assumed"


@dataclass(frozen=True, slots=True)
class Hardware:
    """The parameter set with all overrides in it and the name of its valve that is used."""

    parameter_set: ParameterSet
    valve: str


def read_assumptions(
    before: Reading, reading: Reading, hardware: Hardware, overrides: Iterable[str]
) -> tuple[Assumption, ...]:
    """Return every assumption that still has a value; one that an override replaced says what it was ``before``.

    ScenarioError for a path that has no value.
    """
    replaced = frozenset(split_override(text)[0] for text in overrides)
    notes: Mapping[str, str] = reading.document.get(_SECTION, {})
    assumptions = []
    for path, note in notes.items():
        value, earlier = _value(reading, hardware, path), _value(before, hardware, path)
        if value is None and earlier is None:
            raise _unknown(reading, path)
        if value is not None:
            assumptions.append(
                Assumption(path, value, _note(before, path, note, earlier) if path in replaced else note)
            )
    return tuple(assumptions)


def _note(before: Reading, path: str, note: str, earlier: str | None) -> str:
    """Return the note of a value that an override has replaced."""
    was = earlier if value_at(before.document, path) is not None else "another value"
    return f"set by an override; the scenario has {was}: {note}"


def _value(reading: Reading, hardware: Hardware, path: str) -> str | None:
    """Return the value at a path as written in the file or, where it has none, the default; None without either."""
    given = value_at(reading.document, path)
    if path in scenario_paths(reading.document) and given is not None:
        return str(given)
    quantity = quantities(reading.document).get(path)
    return _device_value(hardware, path) if quantity is None else _default(quantity)


def _device_value(hardware: Hardware, path: str) -> str | None:
    full = f"valves.{hardware.valve}.{path.removeprefix('valve.')}" if path.startswith("valve.") else path
    entry = hardware.parameter_set.entries().get(full)
    quantity = hardware.parameter_set.declarations().get(full)
    if entry is not None:
        return entry_text(entry)
    if path == RELIEVING_PATH:
        return "false"
    return None if quantity is None else _default(quantity)


def _default(quantity: Quantity) -> str | None:
    return None if quantity.default is None else quantity_text(quantity.default, quantity.unit)


def _unknown(reading: Reading, path: str) -> ScenarioError:
    hint = nearest_name(path, [*scenario_paths(reading.document), *device_paths()])
    return ScenarioError(
        f"{reading.file}: [{_SECTION}] names '{one_line(path)}', which has no value in this scenario{hint}"
    )
