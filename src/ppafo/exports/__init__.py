"""Exports for other tools: templates filled with the translation of a program.

In a template, a name between two @ is a variable.
"""

import re
from collections.abc import Mapping
from importlib.resources import files

from ppafo.wording import one_line

_MARK = re.compile(r"@(\w+)@")
_OF_MARKDOWN = re.compile(r"([\\`*\[\]<~]|(?<![^\W_])_|_(?![^\W_])|:(?=//)|&(?=#?\w+;)|^[#>+=-])")


def template(package: str, name: str) -> str:
    """Return a file of the folder ``templates`` of a package such as ``ppafo.exports.c_library``, as text."""
    return files(package).joinpath("templates", name).read_text(encoding="utf-8")


def filled(text: str, words: Mapping[str, str]) -> str:
    """Return a text with its template variables, ``@name@``, replaced."""
    return _MARK.sub(lambda found: words[found[1]], text)


def in_markdown(text: str) -> str:
    """Return a text of a scenario for a Markdown page: one line of plain words, without markup, links or HTML."""
    return _OF_MARKDOWN.sub(r"\\\1", one_line(text))


def in_comment(text: str) -> str:
    """Return a text of a scenario for a C comment: one line that neither ends the comment nor starts another."""
    return one_line(text).replace("*/", "* /").replace("/*", "/ *")
