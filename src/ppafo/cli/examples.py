"""``ppafo new example``: files and scripts of the how-to pages, ready to run."""

import os
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path, PurePosixPath
from typing import Any

from ppafo.cli.output import CommandOutput, listing
from ppafo.errors import DataError
from ppafo.wording import known_names

_FOLDER = resources.files("ppafo") / "examples"


def load_examples() -> dict[str, dict[str, Any]]:
    """Load the bundled examples by name: summary, documentation page, commands in order."""
    return tomllib.loads((_FOLDER / "catalogue.toml").read_text(encoding="utf-8"))


def example_files(name: str) -> dict[PurePosixPath, bytes]:
    """Return the files of an example by relative path."""
    files, folders = {}, [(_FOLDER / name, PurePosixPath())]
    for folder, path in folders:
        for item in folder.iterdir():
            if item.is_file():
                files[path / item.name] = item.read_bytes()
            # A script of an example that was run where it is leaves one.
            elif item.name != "__pycache__":
                folders.append((item, path / item.name))
    return dict(sorted(files.items()))


def list_examples() -> CommandOutput:
    """List the bundled examples with summaries."""
    rows = [{"name": name, **example} for name, example in load_examples().items()]
    examples = listing("example", rows, ("name", "summary"))
    return replace(examples, text=f"{examples.text}\n\nppafo new example NAME writes one into a new folder.")


def write_example(name: str, folder: Path) -> CommandOutput:
    """Write all files of an example into a new folder, or none; the output names the next command."""
    from ppafo.storage.files import replace_folder

    examples = load_examples()
    if name not in examples:
        raise DataError(f"there is no example '{name}'{known_names(name, examples)}")
    example = examples[name]
    if os.path.lexists(folder):
        raise DataError(f"{folder}: already exists; remove it or choose another with --out")
    files = example_files(name)
    replace_folder(folder, {str(path): content for path, content in files.items()})
    lines = [f"written: {folder}, {', '.join(map(str, files))}", f"page: {example['page']}"]
    lines += ["run there:", *(f"  {command}" for command in example["commands"])]
    document = {"name": name, "folder": str(folder), "files": [str(path) for path in files], **example}
    return CommandOutput("\n".join(lines), document)
