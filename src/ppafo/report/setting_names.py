"""Display names of settings from ``setting_names.toml``, for axis labels and for the page that simulates."""

import tomllib
from functools import cache
from importlib.resources import files

_PREFIXES = {"sensors": "Sensors: ", "supply_line": "Line: "}


@cache
def setting_names() -> dict[str, str]:
    """Return the display names of settings by path; most settings have none."""
    return tomllib.loads(files("ppafo.report").joinpath("setting_names.toml").read_text(encoding="utf-8"))


def label_of(path: str) -> str:
    """Return the display name of a setting; the default is the last part of its path."""
    group, _, name = path.rpartition(".")
    said = name.replace("_", " ")
    prefix = _PREFIXES.get(group.partition(".")[0], "")
    return setting_names().get(path, f"{prefix}{said}" if prefix else said[:1].upper() + said[1:])
