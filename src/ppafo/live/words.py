"""What people call a setting: ``words.toml``, for the page that simulates and for the axes of figures."""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

_PREFIXES = {"sensors": "Sensors: ", "supply_line": "Line: "}


@cache
def words() -> dict[str, Any]:
    """Return names, sliders and questions: ``words.toml``."""
    return tomllib.loads(files("ppafo.live").joinpath("words.toml").read_text(encoding="utf-8"))


def label_of(path: str) -> str:
    """Return what a setting is called; one without a name of its own is called after the last part of its path."""
    group, _, name = path.rpartition(".")
    said = name.replace("_", " ")
    prefix = _PREFIXES.get(group.partition(".")[0], "")
    found: str = words()["labels"].get(path, f"{prefix}{said}" if prefix else said[:1].upper() + said[1:])
    return found
