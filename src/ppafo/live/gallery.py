"""Ready workbenches by name: those of ``gallery.toml``, each as a page."""

import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from ppafo.live.workbench import workbench


def gallery() -> dict[str, bytes]:
    """Return the pages of the gallery by file name, in the order in which they are declared."""
    return {f"{name}.html": _page(entry) for name, entry in declared_workbenches().items()}


def declared_workbenches() -> dict[str, Mapping[str, Any]]:
    """Return title, summary, scenarios and start of each workbench by name."""
    return tomllib.loads(files("ppafo.live").joinpath("gallery.toml").read_text(encoding="utf-8"))


def _page(entry: Mapping[str, Any]) -> bytes:
    return workbench(
        entry["scenarios"], entry.get("overrides", ()), entry["title"], entry.get("start", ()), entry["summary"]
    )
