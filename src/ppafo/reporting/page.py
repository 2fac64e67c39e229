"""Pages of HTML in one file: no scripts, nothing to fetch, figures inside."""

import base64
from collections.abc import Mapping
from typing import Any

from ppafo.reporting.typesetting import sentence, typeset, with_paths_as_code


def rendered_page(template: str, values: Mapping[str, Any]) -> str:
    """Return a template filled with values; texts are escaped, and a value that is missing is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("ppafo.reporting"),
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


def inline_figure(svg: bytes) -> str:
    """Return the content of an SVG file as the address of an image that is part of the page."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode('ascii')}"


def inline_animation(gif: bytes) -> str:
    """Return the content of a GIF file as the address of an image that is part of the page."""
    return f"data:image/gif;base64,{base64.b64encode(gif).decode('ascii')}"
