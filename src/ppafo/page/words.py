"""Texts of a page and ranges of its sliders: ``words.toml``."""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def words() -> dict[str, Any]:
    """Return the claims, sliders and questions of pages."""
    return tomllib.loads(files("ppafo.page").joinpath("words.toml").read_text(encoding="utf-8"))
