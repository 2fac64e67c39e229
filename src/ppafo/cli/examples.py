"""``ppafo new example``: the files and scripts of the how-to pages, ready to run."""

import os
import tomllib
from dataclasses import dataclass, replace
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path, PurePosixPath

from ppafo.cli.output import CommandOutput, listing
from ppafo.errors import DataError
from ppafo.wording import nearest_name

_FOLDER = resources.files("ppafo") / "examples"


@dataclass(frozen=True, slots=True)
class _Example:
    """Example of the documentation: its title, the page that explains it, and its commands in order."""

    summary: str
    page: str
    commands: tuple[str, ...]

    def document(self) -> dict[str, object]:
        """Return summary, page and commands as plain data."""
        return {"summary": self.summary, "page": self.page, "commands": list(self.commands)}


def load_examples() -> dict[str, _Example]:
    """Return the examples of the package by name."""
    content = tomllib.loads((_FOLDER / "catalogue.toml").read_text(encoding="utf-8"))
    return {
        name: _Example(entry["summary"], entry["page"], tuple(entry["commands"])) for name, entry in content.items()
    }


def example_files(name: str) -> dict[PurePosixPath, bytes]:
    """Return the files of an example, by their path in its folder."""
    return dict(sorted(_contents(_FOLDER / name, PurePosixPath())))


def _contents(folder: Traversable, path: PurePosixPath) -> list[tuple[PurePosixPath, bytes]]:
    found: list[tuple[PurePosixPath, bytes]] = []
    for item in folder.iterdir():
        if item.is_file():
            found.append((path / item.name, item.read_bytes()))
        # A script of an example that was run where it is leaves one.
        elif item.name != "__pycache__":
            found += _contents(item, path / item.name)
    return found


def list_examples() -> CommandOutput:
    """Return the examples with what each shows."""
    said = listing(
        "example", [{"name": name, **one.document()} for name, one in load_examples().items()], ("name", "summary")
    )
    return replace(said, text=f"{said.text}\n\nppafo new example NAME writes one into a new folder.")


def write_example(name: str, folder: Path) -> CommandOutput:
    """Write the files of an example, all or none, into a folder that is not there yet, and say what to run."""
    from ppafo.storage.files import replace_folder

    examples = load_examples()
    if name not in examples:
        hint = nearest_name(name, examples)
        raise DataError(f"there is no example '{name}'{hint}; available: {', '.join(examples)}")
    example = examples[name]
    if os.path.lexists(folder):
        raise DataError(f"{folder}: already exists; remove it or choose another with --out")
    files = example_files(name)
    replace_folder(folder, {str(path): content for path, content in files.items()})
    lines = [f"written: {folder}, {', '.join(map(str, files))}", f"page: {example.page}"]
    lines += ["run there:", *(f"  {command}" for command in example.commands)]
    document = {"name": name, "folder": str(folder), "files": [str(path) for path in files], **example.document()}
    return CommandOutput("\n".join(lines), document)
