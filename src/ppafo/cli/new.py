"""``ppafo new KIND NAME``: an input file to start from, a commented template or a copy of a file of the package."""

import argparse
import json
import os
import re
import shlex
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from ppafo.cli import output
from ppafo.errors import DataError, nearest_name, one_line

_SUFFIX = ".toml"
_SCHEMAS = {"set": "parameters"}
"""Kinds that ``ppafo schema`` has under another name."""
_TEMPLATES = resources.files("ppafo.cli") / "templates"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
_NAME_LINE = re.compile(r"""^name *= *(["'])(.*?)\1""", re.MULTILINE)
_PARENT_LINE = re.compile(r"^parent *=.*\n", re.MULTILINE)
_FIRST_TABLE = re.compile(r"^\s*\[", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class _NewFile:
    """A kind of file: what it is called, the folder of those of the package, what loads one, the command to try next.

    The command has ``FILE`` in the place of the new file and ``NAME`` in that of its name.
    """

    noun: str
    shipped: str
    load: str
    command: str


KINDS: dict[str, _NewFile] = {
    "scenario": _NewFile(
        "scenario", "scenarios", "ppafo.simulation.loading:load_scenario", "ppafo simulate FILE --out out/NAME"
    ),
    "set": _NewFile("parameter set", "parameters/sets", "ppafo.parameters:load_parameter_set", "ppafo audit FILE"),
    "study": _NewFile(
        "study", "studies/library", "ppafo.studies.loading:load_study", "ppafo sweep FILE --out out/NAME"
    ),
    "walk": _NewFile(
        "walk",
        "walking/configurations",
        "ppafo.walking.loading:load_walk",
        "ppafo walk FILE --minutes 0.2 --out out/NAME",
    ),
    "course": _NewFile(
        "course",
        "walking/courses",
        "ppafo.walking.course:load_course",
        "ppafo walk solenoid --course FILE --out out/NAME",
    ),
    "gait-map": _NewFile(
        "gait map",
        "gait/recorded",
        "ppafo.gait.recorded.mapping:load_map",
        "ppafo gait import RECORDING --map FILE --body-mass '75 kg' --out out/NAME",
    ),
    "bottle": _NewFile(
        "bottle",
        "parameters/bottles/files",
        "ppafo.parameters.bottles.bottle:load_bottle",
        "ppafo endurance --bottle FILE --gas-per-stride '0.3 g' --out out/NAME",
    ),
    "parts": _NewFile(
        "catalogue of parts",
        "parameters/parts/catalogues",
        "ppafo.parameters.parts:load_catalogue",
        "ppafo parts --catalogue FILE",
    ),
}
"""What can be begun. To add one: a template of that name in ``templates``, and an entry here."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("kind", metavar="KIND", help=f"one of: {', '.join(KINDS)}")
    parser.add_argument("name", metavar="NAME", help="name of the file and of what it describes")
    parser.add_argument(
        "--from", dest="source", metavar="SOURCE", help="copy this one: a shipped name, or a .toml file"
    )
    output.add_json_argument(parser)
    parser.add_argument("--out", metavar="FILE", type=Path, help="the .toml file to write; default NAME.toml")


def run(parsed: argparse.Namespace) -> int:
    """Write the file, see that it loads, and say what to run next."""
    if parsed.kind not in KINDS:
        hint = nearest_name(parsed.kind, KINDS)
        raise DataError(f"there is no kind of file '{parsed.kind}'{hint}; available: {', '.join(KINDS)}")
    if not _NAME.fullmatch(parsed.name):
        raise DataError(
            f"NAME {one_line(parsed.name)}: must consist of letters, digits, - and _; use --out for the path"
        )
    kind, path = KINDS[parsed.kind], parsed.out or Path(parsed.name + _SUFFIX)
    if path.suffix != _SUFFIX:
        raise DataError(f"--out {path}: the name must end in {_SUFFIX}")
    if os.path.lexists(path):
        raise DataError(f"{path}: already exists; remove it or choose another name")
    from ppafo.questions.question import load_name
    from ppafo.storage.files import write_file

    load = load_name(kind.load)
    write_file(path, _content(parsed.kind, parsed.source, parsed.name, path).encode())
    # What does not load, such as a file with a path relative to another folder, is not left.
    is_good = False
    try:
        load(path)
        is_good = True
    finally:
        if not is_good:
            path.unlink(missing_ok=True)
    command = kind.command.replace("FILE", shlex.quote(str(path))).replace("NAME", parsed.name)
    document = {"kind": parsed.kind, "name": parsed.name, "file": str(path), "next": command}
    output.print_result(f"written: {path}; next: {command}", document, parsed.json)
    return output.EXIT_GOOD


def _content(kind: str, source: str | None, name: str, path: Path) -> str:
    """Return the text of the new file: that of the template or of the source, under the new name."""
    from ppafo.documents.toml_text import TomlKind

    shipped = resources.files("ppafo").joinpath(*KINDS[kind].shipped.split("/"))
    files = TomlKind(KINDS[kind].noun, _SCHEMAS.get(kind, kind), shipped, DataError)
    content = (_TEMPLATES / f"{kind}{_SUFFIX}").read_bytes() if source is None else files.read(source)
    files.parse(content, source or f"template of a {kind}")
    text = content.decode("utf-8")
    table = _FIRST_TABLE.search(text)
    named = _NAME_LINE.search(text, 0, table.start() if table else len(text))
    if named is None:
        return text
    head, rest = text[: named.start()], text[named.end() :]
    if kind == "set" and source is not None:
        # What the copy changes is shown by 'ppafo audit'; what the source changed is not its matter.
        parent = source if source in files.names() else os.path.relpath(source, path.parent)
        rest = f"\nparent = {json.dumps(parent, ensure_ascii=False)}{_PARENT_LINE.sub('', rest, count=1)}"
    text = f'{head}name = "{name}"{rest}'
    # A file of the package shows in its first lines how it is run.
    shown = [line.replace(named[2], str(path)) if line.startswith("#   ppafo ") else line for line in text.split("\n")]
    return "\n".join(shown)
