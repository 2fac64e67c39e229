"""Display of a result in a notebook: metrics as a table, and the figure as an image."""

import base64
import html
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from ppafo.metrics import Metric
from ppafo.report.kind import metric_text, metric_words
from ppafo.report.style import render_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def result_html(head: str, metrics: Mapping[str, Metric], figure: "Figure") -> str:
    """Return status line, metrics in display units, and figure of a run as HTML."""
    rows = []
    for name, metric in metrics.items():
        cells = (metric_words(name), metric_text(metric.value, metric.unit), metric.summary)
        rows.append("".join(f'<td style="text-align: left">{html.escape(cell)}</td>' for cell in cells))
    table = "".join(f"<tr>{row}</tr>" for row in rows)
    picture = base64.b64encode(png_of(figure)).decode()
    return (
        f"<p><b>{html.escape(head)}</b></p><table>{table}</table>"
        f'<img alt="{html.escape(head)}" style="max-width: 100%" src="data:image/png;base64,{picture}">'
    )


def png_of(figure: "Figure") -> bytes:
    """Return a figure as PNG bytes, for a notebook."""
    return render_figure(figure, ("png",))["png"]


def shown(figure: "Figure") -> "Figure":
    """Return the figure, prepared for display in a notebook with or without a backend, and for publishers."""
    vars(figure).update(_repr_png_=partial(png_of, figure), savefig=partial(_save, figure))
    return figure


def _save(figure: "Figure", *arguments: Any, **options: Any) -> None:
    """Save a figure as ``Figure.savefig`` does, with TrueType fonts: many publishers refuse Type 3 fonts.

    The settings of Matplotlib, which other figures of the caller share, remain as they are.
    """
    import matplotlib

    with matplotlib.rc_context({"pdf.fonttype": 42, "ps.fonttype": 42}):
        type(figure).savefig(figure, *arguments, **options)
