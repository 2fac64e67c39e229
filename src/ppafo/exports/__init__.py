"""What leaves the package for other tools: thin layers around the translation of a program, made of templates.

In a template a mark between two @ is a word that is filled in.
"""

import re
from collections.abc import Mapping
from importlib.resources import files

_MARK = re.compile(r"@(\w+)@")


def template(package: str, name: str) -> str:
    """The text of a file in the folder ``templates`` of a package of ``ppafo.exports``."""
    return files(f"ppafo.exports.{package}").joinpath("templates", name).read_text(encoding="utf-8")


def filled(text: str, words: Mapping[str, str]) -> str:
    """A text with its marks, as ``@name@``, replaced."""
    return _MARK.sub(lambda found: words[found[1]], text)


def licence() -> str:
    """The licence of what is exported."""
    return template("c_library", "LICENSE")
