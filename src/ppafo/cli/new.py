"""``ppafo new KIND NAME``: a new input file from a template or a bundled file, or the files of an example."""

import os
import re
import shlex
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from ppafo.arguments import File, Name, Word
from ppafo.cli.output import CommandOutput, listing
from ppafo.errors import DataError
from ppafo.kinds import kind_at
from ppafo.wording import check_known, one_line

if TYPE_CHECKING:
    from ppafo.documents.toml_text import TomlKind

_SUFFIX = ".toml"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
_NAME_LINE = re.compile(r"""^name *= *(["'])(.*?)\1""", re.MULTILINE)
_PARENT_LINE = re.compile(r"^parent *=.*\n", re.MULTILINE)
_TITLE_LINE = re.compile(r"^title *=.*$", re.MULTILINE)
_NOTES = re.compile(r'^notes *= *""".*?"""\n', re.MULTILINE | re.DOTALL)
_TABLE = re.compile(r"^(?=\[)", re.MULTILINE)
_OF_THE_OTHER = "[reported.", "[[accepted]]"
_FIRST_TABLE = re.compile(r"^\s*\[", re.MULTILINE)
_FOLDER = resources.files("ppafo") / "examples"
_WITH_SOURCES = ("set", "bottle")
"""Kinds of file whose values have a source each."""
EXAMPLE = "example"


def load_examples() -> dict[str, dict[str, Any]]:
    """Load the bundled examples by name: summary, documentation page, commands in order."""
    return tomllib.loads((_FOLDER / "catalogue.toml").read_text(encoding="utf-8"))


def example_files(name: str) -> dict[PurePosixPath, bytes]:
    """Return the files of an example by relative path."""
    files = {}
    folders = [(_FOLDER / name, PurePosixPath())]
    for folder, path in folders:
        for item in folder.iterdir():
            if item.is_file():
                files[path / item.name] = item.read_bytes()
            # A script of an example that was run where it is leaves one.
            elif item.name != "__pycache__":
                folders.append((item, path / item.name))
    return dict(sorted(files.items()))


class _NewFile(NamedTuple):
    """Kind of input file: module of its ``FILE`` and its loader, and command to try next.

    In the command, ``FILE`` stands for the new file and ``NAME`` for its name.
    """

    module: str
    loader: str
    command: str

    @property
    def library(self) -> "TomlKind":
        """Kind of TOML file, with the bundled files."""
        library: TomlKind = kind_at(f"{self.module}:FILE")
        return library


KINDS: dict[str, _NewFile] = {
    "scenario": _NewFile("ppafo.simulation.loading", "load_scenario", "ppafo simulate FILE --out out/NAME"),
    "set": _NewFile("ppafo.parameters.loading", "load_parameter_set", "ppafo sets audit FILE"),
    "study": _NewFile("ppafo.studies.loading", "load_study", "ppafo sweep FILE --out out/NAME"),
    "walk": _NewFile("ppafo.walking.loading", "load_walk", "ppafo walk FILE --minutes 0.2 --out out/NAME"),
    "gait-map": _NewFile(
        "ppafo.gait.recorded.mapping",
        "load_map",
        "ppafo gait import RECORDING --map FILE --body-mass '75 kg' --out out/NAME",
    ),
    "bottle": _NewFile(
        "ppafo.parameters.bottles.bottle",
        "load_bottle",
        "ppafo bottle --bottle FILE --gas-per-stride '0.3 g' --out out/NAME",
    ),
}
"""Kinds of file written by ``ppafo new``, each with a template in ``templates``."""


def new(
    kind: Annotated[str, Word("KIND")],
    name: Name | None = None,
    *,
    source: Annotated[str, Word("SOURCE", option="--from")] | None = None,
    out: File | None = None,
) -> CommandOutput:
    """Write an input file to start from: a template, or a copy of a shipped one; or the files of an example.

    kind: scenario, set, study, walk, gait-map, bottle, or example: the files of a how-to page
    name: name of the file and of what it describes; of an example, its name; without it, the examples are listed
    source: copy this one: a shipped name, or a .toml file
    out: the .toml file to write, default NAME.toml; of an example, the new folder, default NAME

    >>> print(new("set", "mine").text)
    written: mine.toml; next: ppafo sets audit mine.toml
    """
    from ppafo.storage.files import replace_folder, write_file

    if kind == EXAMPLE:
        if source is not None or (name is None and out is not None):
            raise DataError(
                "--from is not allowed for an example; remove --from"
                if source
                else "--out: needs the NAME of the example to write"
            )

        examples = load_examples()
        if name is None:
            rows = [{"name": name, **example} for name, example in examples.items()]
            listed = listing("example", rows, ("name", "summary"))
            return replace(listed, text=f"{listed.text}\n\nppafo new example NAME writes one into a new folder.")
        folder = out or Path(name)
        check_known(name, examples, DataError, f"there is no example '{name}'")
        example = examples[name]
        if os.path.lexists(folder):
            raise DataError(f"{folder}: already exists; remove it or choose another with --out")
        files = example_files(name)
        replace_folder(folder, {str(path): content for path, content in files.items()})
        lines = [f"written: {folder}, {', '.join(map(str, files))}", f"page: {example['page']}"]
        lines += ["run there:", *(f"  {command}" for command in example["commands"])]
        document = {"name": name, "folder": str(folder), "files": [str(path) for path in files], **example}
        return CommandOutput("\n".join(lines), document)
    known = (*KINDS, EXAMPLE)
    check_known(kind, known, DataError, f"there is no kind of file '{kind}'")
    if name is None or not _NAME.fullmatch(name):
        given = "is missing; it" if name is None else f"{one_line(name)}:"
        raise DataError(f"NAME {given} must consist of letters, digits, - and _; give a path with --out")
    chosen = KINDS[kind]
    path = out or Path(name + _SUFFIX)
    if path.suffix != _SUFFIX:
        raise DataError(f"--out {path}: the name must end in {_SUFFIX}")
    if os.path.lexists(path):
        raise DataError(f"{path}: already exists; remove it or choose another name")
    load = kind_at(f"{chosen.module}:{chosen.loader}")
    if source is not None and source.endswith(_SUFFIX):
        # What is wrong in the file itself is said of it, not of its copy.
        load(source)
    write_file(path, _content(kind, source, name, path).encode())
    # A copy that does not load, such as one with a path relative to another folder, is not left.
    try:
        loaded = load(path)
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    command = chosen.command.replace("FILE", shlex.quote(str(path))).replace("NAME", name)
    document = {"kind": kind, "name": name, "file": str(path), "next": command}
    kept = "values, sources and citation" if kind == "set" else "values, notes and sources"
    copied = f", still with {kept} of {source}" if source and kind in _WITH_SOURCES else ""
    text = f"written: {path}{copied}; next: {command}"
    if kind == "set":
        from ppafo.parameters.audit.evidence import Evidence
        from ppafo.parameters.audit.proportions import unusual

        text = "\n".join((text, *(f"warning: {finding.title}" for finding in unusual(Evidence(loaded)))))
    return CommandOutput(text, document)


def list_kinds() -> list[dict[str, str]]:
    """List the kinds of file with their meaning, and the bundled files for ``--from``."""
    rows = [
        {"name": kind, "noun": new_file.library.noun, "shipped": ", ".join(new_file.library.names())}
        for kind, new_file in KINDS.items()
    ]
    return [*rows, {"name": EXAMPLE, "noun": "files of a how-to page", "shipped": "see 'ppafo new example'"}]


def _content(kind: str, source: str | None, name: str, path: Path) -> str:
    """Return the text of a new file: template or source, under the new name."""
    from ppafo.documents.toml_text import value_text

    templates = resources.files("ppafo.cli") / "templates"
    files = KINDS[kind].library
    content = (templates / f"{kind}{_SUFFIX}").read_bytes() if source is None else files.read(source)
    files.parse(content, source or f"template of a {kind}")
    text = content.decode("utf-8")
    # A name below a table belongs to something else.
    table = _FIRST_TABLE.search(text)
    named = _NAME_LINE.search(text, 0, table.start() if table else len(text))
    if named is None:
        return text
    head = text[: named.start()]
    rest = text[named.end() :]
    if kind == "set" and source is not None:
        # 'ppafo sets audit' then lists the changes of the copy, not those of the source.
        parent = source if source in files.names() else os.path.relpath(source, path.parent)
        rest = f"\nparent = {value_text(parent)}{_PARENT_LINE.sub('', rest, count=1)}"
        # Title and notes are of the other device; the citation stays, to which the sources of its values refer.
        title = f"title = {value_text(f'{name}, from {Path(parent).stem}')}"
        rest = _NOTES.sub("", _TITLE_LINE.sub(lambda _: title, rest, count=1), count=1)
        # Numbers reported of the other device, and accepted of it, are no evidence on this one.
        rest = "".join(part for part in _TABLE.split(rest) if not part.startswith(_OF_THE_OTHER))
    text = f'{head}name = "{name}"{rest}'
    # A file of the package shows in its first lines how it is run.
    renamed = {named[2]: shlex.quote(str(path)), f"out/{named[2]}": f"out/{name}"}
    return "\n".join(
        " ".join(renamed.get(word, word) for word in line.split(" ")) if line.startswith("#   ppafo ") else line
        for line in text.split("\n")
    )
