"""Everything that ``ppafo size`` writes, as file contents by name."""

import ppafo
from ppafo.documents.json_text import json_text
from ppafo.reporting.design_table import doubt_sentence
from ppafo.reporting.page import inline_figure, rendered_page
from ppafo.reporting.sizing_figure import sizing_figure
from ppafo.reporting.sizing_table import (
    HEADS,
    failure_sentence,
    gains_sentence,
    margin_cells,
    profile_sentence,
    sizing_document,
    suggestion_sentence,
    valve_cells,
)
from ppafo.reporting.style import rendered
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.studies.sizing import Sizing
from ppafo.studies.sizing.result import LIMITS

DOCUMENT, REPORT, RECORDING = "sizing.json", "report.html", "suggested.csv"
TEMPLATE = "sizing.html.jinja"
_FIGURE, _FORMATS = "sizing", ("png", "svg")

FILE_NAMES = (*(f"{_FIGURE}.{file_format}" for file_format in _FORMATS), RECORDING, DOCUMENT, REPORT)
"""Names of all files, in the order of writing; the recording is there where something is suggested."""


def sizing_files(sizing: Sizing) -> dict[str, bytes]:
    """Return every file: figure, recording of the suggestion, document and report."""
    drawn = rendered(sizing_figure(sizing), _FORMATS)
    contents = {f"{_FIGURE}.{file_format}": content for file_format, content in drawn.items()}
    if sizing.recording is not None:
        contents[RECORDING] = marked_csv_bytes(sizing.recording)
    contents[DOCUMENT] = f"{json_text(sizing_document(sizing))}\n".encode()
    contents[REPORT] = sizing_report(sizing, drawn["svg"]).encode()
    return contents


def sizing_report(sizing: Sizing, figure: bytes) -> str:
    """Return the report as HTML; the figure is the content of an SVG file."""
    problem = sizing.problem
    rows = [
        {
            "valve": item.valve,
            "cells": valve_cells(item)[1:-1],
            "limit": LIMITS[item.limit],
            "margins": margin_cells(item),
            "gains": gains_sentence(problem, item),
            "remark": item.remark,
            "works": item.works,
            "suggested": place == sizing.suggested,
        }
        for place, item in enumerate(sizing.valves)
    ]
    carried = [*problem.regulators, *([] if problem.actuator is None else [problem.actuator])]
    values = {
        "name": problem.name,
        "description": problem.description,
        "profile": profile_sentence(problem),
        "suggestion": suggestion_sentence(sizing),
        "has_suggestion": sizing.choice is not None,
        "heads": HEADS[1:-1],
        "rows": rows,
        "carried": [part.title for part in carried],
        "simulated": problem.simulated,
        "runs": f"{sizing.runs} runs; {failure_sentence(sizing)}",
        "doubts": [doubt_sentence(part, name) for part, name in sizing.doubtful],
        "figure": inline_figure(figure),
        "command": f"ppafo size {problem.file} --out DIR",
        "versions": f"ppafo {ppafo.__version__}",
    }
    return rendered_page(TEMPLATE, values)
