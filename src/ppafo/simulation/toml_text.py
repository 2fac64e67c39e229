"""The bytes of a scenario file as a TOML document."""

import tomllib
from pathlib import Path
from typing import Any

from ppafo.errors import ScenarioError


def read_bytes(path: Path, file: str) -> bytes:
    """Return the content of a file; ``file`` is what messages call it."""
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ScenarioError(f"{file}: cannot be read: {reason}") from error


def parse_toml(content: bytes, file: str) -> dict[str, Any]:
    """Return the document in the bytes of a TOML file."""
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{file}: is not a text file in UTF-8 (byte {error.start})") from error
    if not text.strip():
        raise ScenarioError(f"{file}: is empty; 'ppafo schema scenario' prints what belongs in it")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{file}: is not valid TOML: {' '.join(str(error).split())}") from error
    except (RecursionError, ValueError) as error:
        raise ScenarioError(f"{file}: is not usable TOML: nested too deeply or a number too long") from error
