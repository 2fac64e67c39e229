"""Looks parts up in a catalogue."""

from dataclasses import dataclass
from pathlib import Path

from ppafo.answers import Solved
from ppafo.errors import ParameterError, nearest_name
from ppafo.parameters.parts import Catalogue, Part, load_catalogue
from ppafo.parameters.parts.catalogue import DEFAULT


@dataclass(frozen=True, slots=True)
class Parts(Solved):
    """Parts of a catalogue: one, or all where ``part`` is None."""

    catalogue: Catalogue
    part: Part | None


def parts(part: str | None = None, catalogue: str | Path = DEFAULT) -> Parts:
    """Return one part by name, or all parts, of a catalogue: one of the package by name, or a TOML file.

    ParameterError for bad input.
    """
    loaded = load_catalogue(catalogue)
    named = {item.name: item for item in loaded.parts}
    if part is not None and part not in named:
        raise ParameterError(
            f"{loaded.file}: there is no part '{part}'{nearest_name(part, named)}; available: {', '.join(named)}"
        )
    return Parts(loaded, None if part is None else named[part])
