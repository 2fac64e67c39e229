"""Texts of a page, read from ``words.toml``."""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def words() -> dict[str, Any]:
    """Load the texts of a page on claims, sliders and questions from ``words.toml``."""
    return tomllib.loads(files("ppafo.page").joinpath("words.toml").read_text(encoding="utf-8"))
