"""Assumptions of a scenario: values without a source, with the reason for each."""

from collections.abc import Mapping
from dataclasses import replace

from ppafo.errors import ScenarioError
from ppafo.parameters.declaration import RELIEVING_PATH
from ppafo.parameters.declared import value_at
from ppafo.parameters.parameter_set import entry_text
from ppafo.simulation.declaration import OF_A_VANE, SUPPLY_LINE, line_entries, quantities
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.hardware import Hardware
from ppafo.simulation.overrides import device_paths
from ppafo.simulation.scenario import Assumption
from ppafo.units import format_quantity
from ppafo.units.shown import written_text
from ppafo.wording import nearest_name, one_line

_ASSUMED = "assumed"
"""Section of a file with a note for each assumed path."""


def read_assumptions(reading: DocumentReader, hardware: Hardware) -> tuple[Assumption, ...]:
    """Return all assumptions with a value; the note of an overridden assumption states the value in the file.

    Raises ScenarioError for a path without a value.
    """
    replaced, as_written = (
        {override.typed for override in reading.overrides},
        replace(reading, document=reading.content),
    )
    notes: Mapping[str, str] = reading.document.get(_ASSUMED, {})
    assumptions, unknown = [], []
    for path, note in notes.items():
        value, value_in_file = _value_text(reading, hardware, path), _value_text(as_written, hardware, path)
        if value is None and value_in_file is None:
            unknown.append(path)
        if value is None:
            continue
        if path in replaced:
            file_value = value_in_file if value_at(as_written.document, path) is not None else "another value"
            assumptions.append(Assumption(path, value, f"set by an override; the scenario has {file_value}: {note}"))
        else:
            assumptions.append(Assumption(path, value, note))
    if unknown:
        known = [*OF_A_VANE.paths(reading.document), *device_paths()]
        hints = "".join(nearest_name(path, known) for path in unknown)
        names, has = ", ".join(f"'{one_line(path)}'" for path in unknown), "has" if len(unknown) == 1 else "have"
        raise ScenarioError(f"{reading.file}: [{_ASSUMED}] names {names}, which {has} no value in this scenario{hints}")
    return tuple(assumptions)


def _value_text(reading: DocumentReader, hardware: Hardware, path: str) -> str | None:
    """Return the value at a path as written in the file, else its default; None if there is neither."""
    written = value_at(reading.document, path)
    if written is not None and path in OF_A_VANE.paths(reading.document):
        return str(written)
    quantity = quantities(reading.document).get(path)
    if quantity is None:
        # A number that is not the scenario's is its device's, where the valve has a name.
        full = f"valves.{hardware.valve}.{path.removeprefix('valve.')}" if path.startswith("valve.") else path
        entry = hardware.parameter_set.entries().get(full)
        if entry is not None:
            return entry_text(entry)
        if path == RELIEVING_PATH:
            return "false"
        quantity = hardware.parameter_set.declarations().get(full)
    if quantity is not None and quantity.default is None and quantity.follows:
        return "the value computed from the device"
    return None if quantity is None or quantity.default is None else written_text(quantity.default, quantity.unit)


def assumed_lines(reading: DocumentReader) -> tuple[Assumption, ...]:
    """Return one assumption, with its reason, for each supply-line value that the file leaves at its default."""
    if value_at(reading.document, SUPPLY_LINE) is None:
        return ()
    return tuple(
        Assumption(f"{SUPPLY_LINE}.{path}", format_quantity(entry.value, entry.unit), f"{entry.origin}: {entry.source}")
        for path, entry in line_entries().items()
        if value_at(reading.document, f"{SUPPLY_LINE}.{path}") is None
    )
