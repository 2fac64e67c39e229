"""Everything that ``ppafo league`` writes, as file contents by name."""

from collections.abc import Mapping, Sequence
from typing import Any

import ppafo
from ppafo.documents.json_text import json_text
from ppafo.reporting.league_figure import league_figure
from ppafo.reporting.league_table import HEAD, league_document, league_notes, league_rows, league_table
from ppafo.reporting.page import inline_figure, rendered_page
from ppafo.reporting.style import rendered
from ppafo.studies.league import League

FORMATS = ("png", "svg")
REPORT = "report.html"
NAMES = ("league.txt", "league.json", *(f"league.{file_format}" for file_format in FORMATS), REPORT)
TEMPLATE = "league.html.jinja"


def league_files(league: League) -> dict[str, bytes]:
    """Return every file: the table, the numbers, the figure, and the report with all of them."""
    drawn = rendered(league_figure(league), FORMATS)
    report = league_report(league, drawn["svg"])
    return contents_by_name(league_table(league), league_document(league), drawn, report)


def contents_by_name(
    table: Sequence[str], document: Mapping[str, Any], drawn: Mapping[str, bytes], report: str
) -> dict[str, bytes]:
    """Return the files of a league; ``drawn`` is its figure by format."""
    text = "\n".join(table)
    contents = {"league.txt": f"{text}\n".encode(), "league.json": f"{json_text(document)}\n".encode()}
    contents |= {f"league.{file_format}": content for file_format, content in drawn.items()}
    return contents | {REPORT: report.encode()}


INTRODUCTION = """Every controller was simulated on the device. Errors are in N m, gas in g. "Above least" is the
distance to the lower bound of the controller's own valve: to the least error that any control could have, and to the
least gas with which its own error could be had."""
CAPTION = """A mark for each controller; thin lines: 5 to 95 % of its error on drawn devices. Lines: lower bounds by
valve, for the device that is not drawn: others may lie beyond them."""


def league_report(league: League, figure: bytes) -> str:
    """Return the report as HTML; the figure is the content of an SVG file."""
    first = league.standings[0]
    return rendered_page(
        TEMPLATE,
        {
            "scenario": league.scenario,
            "introduction": INTRODUCTION.replace("the device", f"the device {first.result.scenario.device.name}", 1),
            "caption": CAPTION,
            "alternative": "Gas over RMS error of every controller, with the lower bounds",
            "overrides": list(league.overrides),
            "head": HEAD,
            "rows": league_rows(league),
            "notes": league_notes(league),
            "figure": inline_figure(figure),
            "entrants": [
                {
                    "name": standing.entrant.name,
                    "source": standing.entrant.source,
                    "found": standing.entrant.found,
                    "command": standing.command,
                }
                for standing in league.standings
            ],
            "versions": f"ppafo {ppafo.__version__}",
        },
    )
