"""Everything that ``ppafo league --walk`` writes, as file contents by name."""

import ppafo
from ppafo.reporting.league_files import FORMATS, TEMPLATE, contents_by_name
from ppafo.reporting.page import inline_figure, rendered_page
from ppafo.reporting.style import rendered
from ppafo.reporting.walking_league_document import walking_league_document
from ppafo.reporting.walking_league_figure import walking_league_figure
from ppafo.reporting.walking_league_table import (
    HEAD,
    UNITS,
    walking_league_notes,
    walking_league_rows,
    walking_league_table,
)
from ppafo.studies.league.walking import WalkingLeague

INTRODUCTION = """Every controller was simulated on the same device and wearer, with a torque to follow in push-off and
toes to hold up in the swing. Units: {units}. "Lag" is how late the torque comes, "error at lag" what is missed beside
it. "Above least" is the distance to the lower bound of the controller's own valve: to the least error that any control
could have with toes above the ground, and to the least gas in a stride with a torque as late, an error at lag as small
and toes as high as its own."""
CAPTION = """A mark for each controller; thin lines across: 5 to 95 % of its error on drawn wearers and devices; dotted
lines down: the least gas with its own lag, error and toes. Lines: the least gas without a lag and with toes above the
ground, by valve. The lines are for the wearer and device that are not drawn."""


def walking_league_files(league: WalkingLeague) -> dict[str, bytes]:
    """Return every file: the table, the numbers, the figure, and the report with all of them."""
    drawn = rendered(walking_league_figure(league), FORMATS)
    report = walking_league_report(league, drawn["svg"])
    return contents_by_name(walking_league_table(league), walking_league_document(league), drawn, report)


def walking_league_report(league: WalkingLeague, figure: bytes) -> str:
    """Return the report as HTML; the figure is the content of an SVG file."""
    return rendered_page(
        TEMPLATE,
        {
            "scenario": f"walking, {league.task.file}",
            "introduction": INTRODUCTION.format(units=UNITS),
            "caption": CAPTION,
            "alternative": "Gas over RMS torque error of every controller, with the lower bounds",
            "overrides": list(league.task.overrides),
            "head": HEAD,
            "rows": walking_league_rows(league),
            "notes": walking_league_notes(league),
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
