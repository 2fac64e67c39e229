"""Texts of a page, read from ``words.toml``, and its stored data."""

import json
import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def words() -> dict[str, Any]:
    """Load the texts of a page on claims, sliders and questions from ``words.toml``."""
    return tomllib.loads(files("ppafo.page").joinpath("words.toml").read_text(encoding="utf-8"))


@cache
def stored_data(file: str) -> dict[str, Any]:
    """Load a JSON file that scripts write for pages, by its path in this folder, such as ``opening.json``."""
    data: dict[str, Any] = json.loads(files("ppafo.page").joinpath(file).read_text(encoding="utf-8"))
    return data
