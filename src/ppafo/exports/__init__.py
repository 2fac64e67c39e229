"""Exports for other tools: thin layers of templates around the translation of a program.

In a template a mark between two @ is a word that is filled in.
"""

import re
from collections.abc import Mapping
from importlib.resources import files

from ppafo.wording import one_line

_MARK = re.compile(r"@(\w+)@")
_OF_MARKDOWN = re.compile(r"([\\`*_{}\[\]()#+\-!|~<>&:])")


def template(package: str, name: str) -> str:
    """The text of a file in the folder ``templates`` of a package, ``ppafo.exports.c_library``."""
    return files(package).joinpath("templates", name).read_text(encoding="utf-8")


def filled(text: str, words: Mapping[str, str]) -> str:
    """A text with its marks, as ``@name@``, replaced."""
    return _MARK.sub(lambda found: words[found[1]], text)


def in_markdown(text: str) -> str:
    """Text of a scenario for a page in Markdown: one line of plain words, without markup, links or HTML."""
    return _OF_MARKDOWN.sub(r"\\\1", one_line(text))


def in_comment(text: str) -> str:
    """Text of a scenario for a comment in C: one line that neither ends the comment nor starts another."""
    return one_line(text).replace("*/", "* /").replace("/*", "/ *")
