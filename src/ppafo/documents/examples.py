"""The files and scripts of the how-to pages, ready to run, a folder each."""

import tomllib
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import PurePosixPath

_FOLDER = resources.files("ppafo") / "examples"


@dataclass(frozen=True, slots=True)
class Example:
    """What an example shows, the page that explains it, and its commands in order."""

    summary: str
    page: str
    commands: tuple[str, ...]

    def document(self) -> dict[str, object]:
        """Return the same as plain data."""
        return {"summary": self.summary, "page": self.page, "commands": list(self.commands)}


def load_examples() -> dict[str, Example]:
    """Return the examples of the package by name."""
    content = tomllib.loads((_FOLDER / "catalogue.toml").read_text(encoding="utf-8"))
    return {name: Example(entry["summary"], entry["page"], tuple(entry["commands"])) for name, entry in content.items()}


def example_files(name: str) -> dict[PurePosixPath, bytes]:
    """Return the files of an example, by their path in its folder."""
    return dict(sorted(_contents(_FOLDER / name, PurePosixPath())))


def _contents(folder: Traversable, path: PurePosixPath) -> list[tuple[PurePosixPath, bytes]]:
    found: list[tuple[PurePosixPath, bytes]] = []
    for item in folder.iterdir():
        if item.is_file():
            found.append((path / item.name, item.read_bytes()))
        elif item.name != "__pycache__":
            found += _contents(item, path / item.name)
    return found
