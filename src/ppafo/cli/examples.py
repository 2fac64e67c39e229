"""``ppafo new example``: the files and scripts of the how-to pages, ready to run."""

import os
from dataclasses import replace
from pathlib import Path

from ppafo.cli.output import Said, listing
from ppafo.documents.examples import example_files, load_examples
from ppafo.errors import DataError, nearest_name


def list_examples() -> Said:
    """Return the examples with what each shows."""
    said = listing(
        "example", [{"name": name, **one.document()} for name, one in load_examples().items()], ("name", "summary")
    )
    return replace(said, text=f"{said.text}\n\nppafo new example NAME writes one into a new folder.")


def write_example(name: str, folder: Path) -> Said:
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
    return Said("\n".join(lines), document)
