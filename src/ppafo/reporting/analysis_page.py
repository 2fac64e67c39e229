"""The page that the analyses of studies share: sections with paragraphs, a table and a figure."""

from collections.abc import Sequence
from dataclasses import dataclass

import ppafo
from ppafo.reporting.page import inline_figure, rendered_page

TEMPLATE = "analysis.html.jinja"


@dataclass(frozen=True, slots=True)
class Section:
    """A heading with paragraphs, a table (head and rows), code, an SVG file with its caption."""

    heading: str
    paragraphs: Sequence[str] = ()
    head: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    figure: bytes = b""
    caption: str = ""
    code: str = ""


def analysis_page(kicker: str, title: str, lead: Sequence[str], sections: Sequence[Section]) -> bytes:
    """Return the page as HTML in one file, with its figures inside."""
    values = {
        "kicker": kicker,
        "title": title,
        "lead": list(lead),
        "sections": [
            {
                "heading": item.heading,
                "paragraphs": list(item.paragraphs),
                "head": list(item.head),
                "rows": [list(row) for row in item.rows],
                "figure": inline_figure(item.figure) if item.figure else "",
                "caption": item.caption,
                "code": item.code,
            }
            for item in sections
        ],
        "versions": f"ppafo {ppafo.__version__}",
    }
    return rendered_page(TEMPLATE, values).encode()
