"""Display names of settings from ``setting_names.toml``, for axis labels and for the interactive page."""

import tomllib
from functools import cache
from importlib.resources import files

_PREFIXES = {"sensors": "Sensors: ", "supply_line": "Line: "}
REFERENCE_LEVELS = {"reference.level": "to hold", "reference.start_level": "before the ramp"}
"""Labels of reference settings after the name of the controlled quantity, as in "Torque before the ramp"."""


@cache
def setting_names() -> dict[str, str]:
    """Return the display names of settings by path; most settings have none."""
    return tomllib.loads(files("ppafo.report").joinpath("setting_names.toml").read_text(encoding="utf-8"))


def label_of(path: str, controlled: str = "torque") -> str:
    """Return the display name of a setting; the default is the last part of its path.

    ``controlled`` names the quantity that a reference prescribes, in words.
    """
    if path in REFERENCE_LEVELS:
        return f"{controlled[:1].upper()}{controlled[1:]} {REFERENCE_LEVELS[path]}"
    group, _, name = path.rpartition(".")
    said = name.replace("_", " ")
    prefix = _PREFIXES.get(group.partition(".")[0], "")
    return setting_names().get(path, f"{prefix}{said}" if prefix else said[:1].upper() + said[1:])
