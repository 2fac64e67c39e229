"""Pages of HTML in one file: nothing to fetch, figures inside, no script but that of a part that simulates."""

import base64
from collections.abc import Mapping
from typing import Any

from ppafo.answers.answer import Answer, Section
from ppafo.answers.text import head_texts, row_texts
from ppafo.answers.typesetting import sentence, typeset, with_paths_as_code
from ppafo.version import __version__

_ORIGINS = {
    "simulated": "Every run is of the model; nothing on this page was measured.",
    "synthetic": "The recordings are synthetic: the virtual test rig made them, nothing was measured.",
    "measured": "",
}


def page_of(answer: Answer, drawn: Mapping[str, bytes]) -> bytes:
    """Return the page of an answer; ``drawn`` has the SVG or GIF content of each of its figures by name."""
    if answer.page is not None:
        return answer.page(drawn)
    values = {
        "answer": answer,
        "sections": [_section(section, drawn) for section in answer.sections],
        "origin": _ORIGINS[answer.kind],
        "data": f"{answer.name}.json",
        "versions": f"ppafo {__version__}",
        "live": None if answer.live is None else answer.live(),
    }
    return render_page("answer.html.jinja", values).encode()


def _section(section: Section, drawn: Mapping[str, bytes]) -> dict[str, Any]:
    table, figure = section.table, section.figure
    return {
        "heading": section.heading,
        "paragraphs": section.paragraphs,
        "head": [_unbroken_unit(text) for text in head_texts(table)] if table else [],
        "rows": row_texts(table) if table else [],
        "left": table.left if table else 1,
        "marked": table.marked if table else (),
        "remarks": section.remarks,
        "code": section.code,
        "figure": inline_figure(drawn[figure.name]) if figure else "",
        "caption": figure.caption if figure else "",
    }


def _unbroken_unit(title: str) -> str:
    """Return the title of a column whose unit, at its end, is not broken over two lines."""
    words, bracket, unit = title.rpartition("(")
    return words + bracket + unit.replace(" ", "\N{NO-BREAK SPACE}") if bracket and title.endswith(")") else title


def render_page(template: str, values: Mapping[str, Any], package: str = "ppafo.answers") -> str:
    """Return a template of a package filled with values; texts are escaped, a value that is missing is an error."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    packages = dict.fromkeys((package, "ppafo.answers"))
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["typeset"] = typeset
    environment.filters["sentence"] = sentence
    environment.filters["coded"] = with_paths_as_code
    return environment.get_template(template).render(values)


def inline_figure(content: bytes) -> str:
    """Return the content of an SVG or GIF file as the address of an image that is part of the page."""
    kind = "gif" if content.startswith(b"GIF8") else "svg+xml"
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
