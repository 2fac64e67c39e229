"""What Sphinx is taught about this package: docstrings are plain text, dotted names are links, mathematics is MathML.

An extension of Sphinx, named in ``docs/conf.py``.
"""

import importlib
import re
import textwrap
from collections.abc import Iterable
from typing import Any

KERNEL = {
    "ipython_kernel_config.py": "get_config().IPKernelApp.log_level = 40\n",
    "startup/shell.py": """import subprocess
def sh(line, cell):
    print(subprocess.run(["sh", "-e", "-c", cell], check=True, stdout=subprocess.PIPE, text=True).stdout, end="")
get_ipython().register_magic_function(sh, "cell")
""",
}
"""Files of the IPython profile in which the tutorial runs. IPython's own %%sh hands on what is printed by the hundred
bytes, which the page would show torn apart."""

_CODE = re.compile(r"``(.+?)``|`([^`\n]+?)`", re.DOTALL)
_MARKS = re.compile(r"([\\*|])|(?<=\w)(_)(?!\w)")
_ALIAS = re.compile(r"Alias for field number \d+")
_DOTTED = re.compile(r"(ppafo(?:\.\w+)+)(?:\(.*\))?")
_ARGUMENT = re.compile(r"(\w+): (.+)")
_HEADINGS = ("Arguments:", "Returns:", "Raises:")
_ACCENT = re.compile(r'<munderover>\s*(<mi>\w</mi>)(.*?)(<mo stretchy="false">\S</mo>)\s*</munderover>', re.DOTALL)
"""Docutils puts the index of an accented symbol below it."""


def restructured(lines: Iterable[str]) -> list[str]:
    """Return a plain docstring as reStructuredText: code in backticks, indented blocks as they stand, marks as text.

    Arguments of a command, ``name: help`` with further lines indented, are a list; so is what stands under
    ``Arguments:``, ``Returns:`` and ``Raises:``.
    """
    text: list[str] = []
    for paragraph in re.split(r"\n{2,}", "\n".join(lines).strip("\n")):
        heading, _, below = paragraph.partition("\n")
        if heading in _HEADINGS:
            text.append(f"**{heading.removesuffix(':')}**")
        block = textwrap.dedent(below) if heading in _HEADINGS else paragraph
        entries = [_ARGUMENT.fullmatch(entry) for entry in re.sub(r"\n {4}", " ", block).split("\n")]
        if block.startswith("    "):
            text += ["::", block]
        elif all(entries):
            text.append("\n".join(f"- ``{entry[1]}``: {_with_code(entry[2])}" for entry in entries if entry))
        elif not _ALIAS.fullmatch(block):
            text.append(_with_code(block))
    return "\n\n".join(text).split("\n")


def _with_code(block: str) -> str:
    written, end = "", 0
    for found in _CODE.finditer(block):
        code = " ".join((found[1] or found[2]).split())
        written += _escaped(block[end : found.start()]) + f"``{code}``" + _gap(block, found.end())
        end = found.end()
    return written + _escaped(block[end:])


def _escaped(text: str) -> str:
    return _MARKS.sub(lambda found: "\\" + found[0], text)


def _gap(block: str, end: int) -> str:
    """What ends a literal where a word goes on."""
    return "\\ " if block[end : end + 1].isalnum() else ""


def link_names(app: Any, page: Any, name: str) -> None:
    """Let each dotted name of the package in the code of a page lead to its description, where there is one."""
    from docutils import nodes
    from sphinx.util.nodes import make_refnode

    known = app.env.domains.python_domain.objects
    for node in list(page.findall(nodes.literal)):
        found = _DOTTED.fullmatch(node.astext())
        if found is None or found[1] not in known or isinstance(node.parent, nodes.reference):
            continue
        entry = known[found[1]]
        node.replace_self(make_refnode(app.builder, name, entry.docname, entry.node_id, node.deepcopy()))


def home_of_builtins(_: Any, module: str, name: str) -> str | None:
    """Return the module that names a value whose own module is Python's ``builtins``, which has no source to show."""
    value: Any = importlib.import_module(module)
    for part in name.split("."):
        value = getattr(value, part, None)
    return module if getattr(value, "__module__", "") == "builtins" else None


def _plain(*given: Any) -> None:
    lines = given[-1]
    lines[:] = restructured(lines)


def lead_back_to_one_page(app: Any) -> list[Any]:
    """Let the source of a module lead back to the page of its room alone; no page is added.

    Viewcode keeps one name of a module, and of each member the page that was read last. A member that is also on a page
    of the public interface would lead to the name of the one on the page of the other.
    """
    known = app.env._viewcode_modules
    for module, entry in known.items():
        code, tags, used, reference = entry or ("", {}, {}, module)
        room = next((page for page in used.values() if page.startswith("api/rooms/")), "")
        if room and reference != module:
            known[module] = code, tags, dict.fromkeys(used, room), module
    return []


def mathematics(translator: Any, node: Any) -> None:
    """Write an equation as MathML, which browsers draw themselves: MathJax would be fetched from another host."""
    from docutils import nodes
    from docutils.utils.math.latex2mathml import tex2mathml

    is_block = isinstance(node, nodes.math_block)
    drawn = tex2mathml(node.astext().strip(), as_block=is_block)
    drawn = _ACCENT.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', drawn)
    translator.body.append(f'<div style="overflow: auto hidden; padding: 0.4em 0">{drawn}</div>' if is_block else drawn)
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Add these to Sphinx, and a language that forges know and Pygments does not."""
    from pygments.lexers.special import TextLexer

    app.add_html_math_renderer("mathml", (mathematics, None), (mathematics, None))

    app.connect("autodoc-process-docstring", _plain)
    app.connect("doctree-resolved", link_names)
    app.connect("viewcode-follow-imported", home_of_builtins)
    # Before viewcode makes its pages.
    app.connect("html-collect-pages", lead_back_to_one_page, priority=400)
    app.add_lexer("csv", TextLexer)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
