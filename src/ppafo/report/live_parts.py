"""Interactive part of a page, provided by another package or module that is loaded when a page is written."""

from collections.abc import Sequence
from types import FunctionType
from typing import Any

from ppafo.errors import KindError
from ppafo.kinds import Kinds
from ppafo.report.finding import LivePart

LIVE_PARTS: Kinds[FunctionType] = Kinds(
    "ppafo.live_parts", "live part", FunctionType, {"workbench": "ppafo.page.workbench:live_part"}
)
"""Builders of the interactive part of a page from scenarios; a builder returns a ``LivePart``, or None."""


def live_part(scenarios: Sequence[Any], name: str = "workbench") -> LivePart | None:
    """Return the interactive part of a page for some scenarios; only a remark if its provider is not installed."""
    try:
        make = LIVE_PARTS[name]
    except KindError as error:
        return LivePart(remark=f"This page cannot simulate: the {error}.")
    part: LivePart | None = make(scenarios)
    return part
