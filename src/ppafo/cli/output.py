"""Prints a result as text or JSON, and writes result files so that none is ever half written."""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppafo.errors import DataError


def add_output_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--json`` and ``--out``, which every command takes."""
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument("--out", metavar="DIR", type=Path, help="also write the result as files into this folder")


def add_override_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--set PATH=VALUE``, which every command that takes a device has."""
    parser.add_argument(
        "--set",
        dest="overrides",
        metavar="PATH=VALUE",
        action="append",
        default=[],
        help="change one value, for example valve.area=12.6mm^2; may be given again",
    )


def deliver(name: str, text: str, document: Mapping[str, Any], parsed: argparse.Namespace) -> None:
    """Print the text or the JSON document, and write both as ``NAME.txt`` and ``NAME.json`` where asked."""
    encoded = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    if parsed.out is not None:
        write_files(parsed.out, {f"{name}.txt": text + "\n", f"{name}.json": encoded + "\n"})
    print_text(encoded if parsed.json else text)


def print_result(text: str, document: Mapping[str, Any], as_json: bool) -> None:
    """Print the text, or the document as JSON; for commands that write files of their own."""
    print_text(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) if as_json else text)


def print_text(text: str) -> None:
    """Print, and end quietly where the reader has gone, as in ``ppafo sets show X | head``."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def write_files(folder: Path, contents: Mapping[str, str | bytes]) -> None:
    """Write files into a folder, made if need be: all of them aside first, then renamed. A text is written as UTF-8."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".writing-") as aside:
            for name, content in contents.items():
                (Path(aside) / name).write_bytes(content if isinstance(content, bytes) else content.encode())
            for name in contents:
                (Path(aside) / name).replace(folder / name)
    except OSError as error:
        raise DataError(f"--out {folder}: cannot be written: {error.strerror or error}") from error
