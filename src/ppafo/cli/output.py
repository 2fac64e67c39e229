"""Arguments that commands share, printing as text or JSON, and files that are never half written."""

import argparse
import contextlib
import importlib
import importlib.util
import logging
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, one_line, reason

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ppafo.answers import Answer


EXIT_GOOD = 0
EXIT_CHECK_FAILED = 1


def add_output_arguments(parser: argparse.ArgumentParser, default: str = "") -> None:
    """Add ``--json`` and ``--out``, which every command takes; ``default`` is where it writes without ``--out``."""
    add_json_argument(parser)
    what = f"the result folder; default {default}" if default else "also write the result as files into this folder"
    parser.add_argument("--out", metavar="DIR", type=Path, help=what)


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``, for a command whose ``--out`` is another one."""
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")


def add_override_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--set PATH=VALUE``, which every command that takes a device has."""
    parser.add_argument(
        "--set",
        dest="overrides",
        metavar="PATH=VALUE",
        action="append",
        default=[],
        help="override one value, for example valve.area=12.6mm^2; may be repeated",
    )


def check_output(parsed: argparse.Namespace, kept: Mapping[str, bytes] | None = None) -> None:
    """Refuse, before anything runs, a folder of ``--out`` that is not absent, empty or this command's own result.

    Files that will be ``kept`` as they are may have grown since it was written.
    """
    if parsed.out is not None:
        from ppafo.storage.result_folder import check_owned_folder, marked_folder

        with blame_out_option():
            check_owned_folder(parsed.out, marked_folder(_command(parsed)), kept or {})


def check_new_file(path: Path) -> None:
    """Refuse a file of ``--out`` that is there: nothing in it would say whose it is."""
    if os.path.lexists(path):
        raise DataError(f"--out {path}: already exists; remove it or choose another name")


@contextlib.contextmanager
def blame_out_option() -> Iterator[None]:
    """Begin what is said of a folder with the option that named it."""
    try:
        yield
    except DataError as error:
        raise DataError(f"--out {error}") from error


def _command(parsed: argparse.Namespace) -> str:
    """Return the command with its action, such as ``gait show``."""
    return " ".join(word for word in (parsed.command, getattr(parsed, "action", None)) if word)


def deliver(
    name: str,
    text: str,
    document: Mapping[str, Any],
    parsed: argparse.Namespace,
    draw: "Callable[[], Figure] | None" = None,
) -> None:
    """Write text and JSON document as ``NAME.txt`` and ``NAME.json`` where requested, and print one of them.

    A figure, which is drawn only then, is written beside them.
    """
    if parsed.out is not None:
        contents = {f"{name}.txt": text, f"{name}.json": json_text(document)}
        files = {file: f"{content}\n".encode() for file, content in contents.items()}
        if draw is not None:
            load_drawing()
            from ppafo.answers.style import render_figure

            files |= {f"{name}.{form}": content for form, content in render_figure(draw(), ("png", "svg")).items()}
        write_files(parsed, files)
    print_result(text, document, parsed.json)


def deliver_answer(answer: "Answer", parsed: argparse.Namespace, filled: str | None = None) -> int:
    """Write an answer where requested, print it as text or JSON, and return the exit code.

    ``filled`` is a folder that has the files already.
    """
    from ppafo.answers.writing import text_of

    text, folder = text_of(answer), filled
    if filled is None and parsed.out is not None:
        load_drawing()
        from ppafo.answers.writing import files_of

        write_files(parsed, files_of(answer))
        folder = str(parsed.out)
    if folder is not None:
        from ppafo.answers.writing import REPORT

        text += f"\n\nreport: {folder}/{REPORT}"
    document = answer.data if folder is None else {**answer.data, "folder": folder}
    print_result(text, document, parsed.json)
    return EXIT_GOOD if answer.passed else EXIT_CHECK_FAILED


def print_result(text: str, document: Mapping[str, Any], as_json: bool) -> None:
    """Print the text, or the document as JSON; ends quietly where the reader has gone, as in ``ppafo sets | head``."""
    with printing():
        shown = json_text(document) if as_json else text
        encoding = sys.stdout.encoding or "utf-8"
        print(shown.encode(encoding, "backslashreplace").decode(encoding), flush=True)


def flush_output() -> None:
    """Write what was printed so far, such as a help text, with the same errors as ``print_result``."""
    with printing():
        print(end="", flush=True)


@contextlib.contextmanager
def printing() -> Iterator[None]:
    """Print with one line of error where standard output cannot be written, and none where its reader has gone."""
    try:
        yield
    except BrokenPipeError:
        _drop_output()
    except OSError as error:
        _drop_output()
        raise DataError(f"standard output cannot be written: {reason(error)}") from error


def _drop_output() -> None:
    """Let what is left go nowhere: Python would try to write it once more when it ends, and complain again."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def write_files(parsed: argparse.Namespace, contents: Mapping[str, bytes]) -> None:
    """Make the folder of ``--out`` hold exactly these files, and the mark by which it is known: all of them or none."""
    from ppafo.storage.result_folder import write_marked_folder

    with blame_out_option():
        write_marked_folder(parsed.out, contents, _command(parsed))


def tell(text: str) -> None:
    """Say on the side, where it does not mix with the result, what is being done."""
    print(f"ppafo: {text} ...", file=sys.stderr, flush=True)


_AXES_IN_SPACE = "mpl_toolkits.mplot3d"


def load_drawing() -> None:
    """Import matplotlib without what it does at import for others.

    It writes tables of settings into its documentation, and loads axes in three dimensions and the names of glyphs of
    TeX; the latter are loaded when they are first used, the others never are here. DataError where a setting of the
    user's own stops it.
    """
    if "matplotlib.artist" in sys.modules:
        return
    _load_late("fontTools.agl")
    # Its two lines about a folder that cannot be written say nothing of the result.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        import matplotlib.artist
    except ValueError as error:
        settings = "its settings: MPLBACKEND in the environment, or a file matplotlibrc"
        raise DataError(f"Matplotlib refuses {settings}: {one_line(error)}") from error

    flat = ModuleType(_AXES_IN_SPACE)
    flat.__dict__["Axes3D"] = None
    modules: dict[str, Any] = sys.modules
    artist: Any = matplotlib.artist.Artist
    with (
        _replaced(vars(matplotlib.artist), "kwdoc", lambda _artist: ""),
        _replaced(modules, _AXES_IN_SPACE, flat),
        _attribute_replaced(artist, "_update_set_signature_and_docstring", classmethod(_without_signature)),
    ):
        import matplotlib.figure


def _without_signature(artist: Any) -> None:
    """Mark ``set`` of an artist as made by matplotlib, and do not list in its signature what it takes."""
    artist.set._autogenerated_signature = True


def _load_late(name: str) -> None:
    """Have a module loaded when something of it is first used; one that is absent stays so."""
    package, _, own = name.rpartition(".")
    if name in sys.modules or importlib.util.find_spec(package) is None:
        return
    stand_in = ModuleType(name)

    def of_module(attribute: str) -> Any:
        if attribute.startswith("__"):
            raise AttributeError(attribute)
        if sys.modules.get(name) is stand_in:
            del sys.modules[name]
        return getattr(importlib.import_module(name), attribute)

    stand_in.__dict__["__getattr__"] = of_module
    sys.modules[name] = stand_in
    setattr(importlib.import_module(package), own, stand_in)


@contextmanager
def _replaced(names: dict[str, Any], name: str, stand_in: object) -> Iterator[None]:
    """Let a name stand for something else for the length of a ``with`` block."""
    before = names.get(name)
    names[name] = stand_in
    try:
        yield
    finally:
        if before is None:
            del names[name]
        else:
            names[name] = before


@contextmanager
def _attribute_replaced(owner: Any, name: str, stand_in: object) -> Iterator[None]:
    """The same of an attribute of a class; nothing where it is not there, as in another version."""
    before = vars(owner).get(name)
    if before is None:
        yield
        return
    setattr(owner, name, stand_in)
    try:
        yield
    finally:
        setattr(owner, name, before)
