"""Delivery of a result: printed text or JSON, result folder, and exit code."""

import contextlib
import logging
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.progress import ProgressLine
from ppafo.wording import reason

EXIT_GOOD = 0
EXIT_CHECK_FAILED = 1
# As a shell has it for what SIGINT, signal 2, ended: 128 + 2.
EXIT_INTERRUPTED = 130


def check_output(out: Path | None, command: str) -> None:
    """Raise DataError for an ``--out`` folder unless it is new, empty, or a result of the command."""
    if out is not None:
        from ppafo.storage.owned_folder import check_owned_folder, marked_folder

        with blame_out_option():
            check_owned_folder(out, marked_folder(command))


def check_new_file(path: Path) -> None:
    """Raise DataError for an ``--out`` file that cannot be written, or exists: files have no mark of their command."""
    from ppafo.storage.files import check_files_can_be_added

    # A link to nowhere exists too, and writing would create the file that it points to.
    if os.path.lexists(path):
        raise DataError(f"--out {path}: already exists; remove it or choose another name")
    with blame_out_option():
        check_files_can_be_added(path.parent, [path.name])


@contextlib.contextmanager
def blame_out_option() -> Iterator[None]:
    """Prefix errors about a folder with the option ``--out``."""
    try:
        yield
    except DataError as error:
        raise DataError(f"--out {error}") from error


@dataclass(frozen=True, slots=True)
class CommandOutput:
    """Output of a command: text, JSON document and files.

    ``name`` is the stem of the files in the ``--out`` folder. ``finish`` draws and writes after the text is printed,
    and returns the last lines of text. ``aside`` is a line for standard error after the result.
    """

    text: str
    document: Mapping[str, Any]
    name: str = ""
    exit_code: int = EXIT_GOOD
    aside: str = ""
    finish: Callable[[], str] | None = None


def deliver(answer: Any, as_json: bool, out: Path | None, command: str, *, has_written: bool = False) -> int:
    """Write the result of a command into a folder if requested, print it as text or JSON, and return the exit code.

    ``has_written`` is True for a command that writes its files itself and returns the folder.
    """
    if isinstance(answer, CommandOutput):
        if out is not None:
            write_files(out, files_of_output(answer), command)
        if answer.finish is None or not as_json:
            print_result(answer.text, answer.document, as_json)
        if answer.finish is not None:
            if not as_json:
                _tell_drawing()
            print_result(answer.finish(), answer.document, as_json)
        if answer.aside:
            print(f"ppafo: {answer.aside}", file=sys.stderr)
        return answer.exit_code
    from ppafo.report.finding import REPORT, text_of
    from ppafo.report.writing import terminal_width

    text = text_of(answer, terminal_width())
    document = answer.to_dict()
    folder = str(document["folder"]) if has_written else None
    usable_files: list[str] = []
    if not as_json:
        # Numbers at once: drawing takes longer than most runs.
        print_result(text, {}, as_json)
    if out is not None:
        _tell_drawing()
        from ppafo.report.style import load_drawing

        # Before anything else imports Matplotlib, so that it comes without what it does for others.
        load_drawing()
        from ppafo.report.finding import files_of

        write_files(out, files_of(answer), command)
        folder = str(out)
        # Files that other commands take, such as the gait of 'ppafo walk --gait'.
        label = "file to use" if answer.passed else "file, not passed"
        usable_files = [f"{label}: {out / name}" for name in answer.files if name.endswith(".toml")]
        from ppafo.walking.bottle.coupling import WALKED

        # A walk that ended before its bottle did.
        if document.get("supply", {}).get("ending", {}).get("kind") == WALKED:
            usable_files.append(f"time until the bottle ends: ppafo bottle {shlex.quote(folder)}")
    if as_json:
        print_result("", document if folder is None else {**document, "folder": folder}, as_json)
    elif folder is not None:
        print_result("\n".join(["", f"report: {folder}/{REPORT}", *usable_files]), {}, as_json)
    return EXIT_GOOD if answer.passed else EXIT_CHECK_FAILED


def files_of_output(output: CommandOutput) -> dict[str, bytes]:
    """Return text and JSON document of an output as files."""
    contents = {f"{output.name}.txt": output.text, f"{output.name}.json": json_text(output.document)}
    return {file: f"{content}\n".encode() for file, content in contents.items()}


_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Pattern of characters that control a terminal or change the writing direction, possible in foreign files."""


def print_result(text: str, document: Mapping[str, Any], as_json: bool) -> None:
    """Print text, or a document as JSON; a closed pipe, as of ``... | head``, ends quietly."""
    with printing():
        # A terminal without a character shows its number, where Python would end with an error.
        printed = json_text(document) if as_json else _UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)
        encoding = sys.stdout.encoding or "utf-8"
        print(printed.encode(encoding, "backslashreplace").decode(encoding), flush=True)


@contextlib.contextmanager
def printing() -> Iterator[None]:
    """Handle failed writes to standard output in a ``with`` block: one-line error, silence for a closed pipe."""
    try:
        yield
    except BrokenPipeError:
        _drop_output()
    except OSError as error:
        _drop_output()
        raise DataError(f"cannot write to standard output: {reason(error)}") from error


def _drop_output() -> None:
    """Discard unwritten output, so that Python does not write it again at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def write_files(out: Path, contents: Mapping[str, bytes], command: str) -> None:
    """Replace the content of the ``--out`` folder by files and the mark of the command, all or none."""
    from ppafo.storage.owned_folder import write_marked_folder

    with blame_out_option():
        write_marked_folder(out, contents, command)


def export(
    out: Path,
    command: str,
    make: Callable[[], Mapping[str, bytes]],
    next_step: Callable[[Sequence[str]], str],
) -> CommandOutput:
    """Write the files of an export; the output has their names and the next command."""
    # Before the files are made: a folder that is refused must not cost their making.
    check_output(out, command)
    contents = make()
    write_files(out, contents, command)
    files = list(contents)
    following = next_step(files)
    document = {"folder": str(out), "files": files, "next": following}
    return CommandOutput(f"written: {out} ({', '.join(files)}); next: {following}", document)


def listing(noun: str, rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()) -> CommandOutput:
    """Format a list with a row for each entry and the given columns (default: all), with all entries as data."""
    from ppafo.report.writing import align_columns

    # A count is shown with what it counts, the name of its column.
    cells = [
        [f"{row[name]:,} {name}" if isinstance(row[name], int) else row[name] for name in columns or row]
        for row in rows
    ]
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return CommandOutput("\n".join(align_columns(cells, len(cells[0]))), {plural: list(rows)}, plural)


@contextmanager
def progress_line() -> Iterator[ProgressLine]:
    """Display progress on standard error in a ``with`` block; log messages start on a new line."""
    line = ProgressLine(sys.stderr)
    logger = logging.getLogger("ppafo")

    def end_line(_record: logging.LogRecord) -> bool:
        # A filter comes before the record is written; it lets every record pass.
        line.close()
        return True

    logger.addFilter(end_line)
    try:
        yield line
    finally:
        logger.removeFilter(end_line)
        line.close()


def _tell_drawing() -> None:
    if sys.stderr.isatty():
        print("ppafo: drawing figures and page ...", file=sys.stderr, flush=True)
