"""Additions of the command ``ppafo walk``: list of walks, and default output folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppafo.walking import task_sequence as task_sequences
from ppafo.walking.loading import FILE, load_walk
from ppafo.walking.motion import walk_of


def list_files() -> list[dict[str, Any]]:
    """Return the walks and task sequences included in the package: name, kind of file, description."""
    libraries = (FILE, task_sequences.FILE)
    files = ((kind, name, kind.parse(kind.read(name), name)) for kind in libraries for name in kind.names())
    return [
        {"name": name, "kind": kind.noun, "description": str(file.get("description", ""))} for kind, name, file in files
    ]


def default_folder(values: Mapping[str, Any]) -> Path:
    """Return the default output folder of the command, named after the configuration."""
    names = ("overrides", "gait", "task_sequence", "bottle")
    configuration = load_walk(values["scenario"], **{name: values[name] for name in names})
    walked, bottled = walk_of(configuration).task_sequence, walk_of(configuration).bottle
    along = ("" if walked is None else f"-{walked.name}") + ("" if bottled is None else f"-{bottled.bottle.name}")
    kind = "walk" if values["wearers"] is None else "wearers"
    return Path("out") / f"{kind}-{configuration.name}{along}"
