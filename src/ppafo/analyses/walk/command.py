"""Additions of the command ``ppafo walk``: list of walks, and default output folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppafo.walking.loading import FILE, load_walk
from ppafo.walking.motion import walk_of


def list_files() -> list[dict[str, Any]]:
    """Return the walks included in the package: name and description."""
    files = ((name, FILE.parse(FILE.read(name), name)) for name in FILE.names())
    return [{"name": name, "description": str(file.get("description", ""))} for name, file in files]


def default_folder(values: Mapping[str, Any]) -> Path:
    """Return the default output folder of the command, named after the configuration."""
    names = ("overrides", "gait", "bottle")
    configuration = load_walk(values["scenario"], **{name: values[name] for name in names})
    bottled = walk_of(configuration).bottle
    along = "" if bottled is None else f"-{bottled.bottle.name}"
    return Path("out") / f"walk-{configuration.name}{along}"
