"""Everything that ``ppafo design`` writes, as file contents by name."""

import csv
import io
from collections.abc import Mapping

import ppafo
from ppafo.documents.json_text import json_text
from ppafo.reporting.design_figure import design_figure
from ppafo.reporting.design_table import (
    design_document,
    doubt_sentence,
    failure_lines,
    number_cells,
    objective_cells,
    search_sentence,
    short_path,
    variable_paths,
)
from ppafo.reporting.page import inline_figure, rendered_page
from ppafo.reporting.style import rendered
from ppafo.simulation.scenario import Scenario
from ppafo.studies.design import Design

DOCUMENT, TABLE, REPORT = "design.json", "front.csv", "report.html"
TEMPLATE = "design.html.jinja"
_FIGURE, _FORMATS = "front", ("png", "svg")

FILE_NAMES = (*(f"{_FIGURE}.{file_format}" for file_format in _FORMATS), TABLE, DOCUMENT, REPORT)
"""Names of all files, in the order of writing."""


def design_files(design: Design) -> dict[str, bytes]:
    """Return every file: figure, table of the whole front, document and report."""
    drawn = rendered(design_figure(design), _FORMATS)
    contents = {f"{_FIGURE}.{file_format}": content for file_format, content in drawn.items()}
    contents[TABLE] = front_table(design).encode()
    contents[DOCUMENT] = f"{json_text(design_document(design))}\n".encode()
    contents[REPORT] = design_report(design, drawn["svg"]).encode()
    return contents


def front_table(design: Design) -> str:
    """Return the whole front as comma-separated text in SI units, named in the header."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    numbers = [f"{item.path} [{item.unit or '-'}]" for item in design.problem.variables]
    writer.writerow(["valve", "actuator", "error [N m]", "gas [kg]", "mass [kg]", *numbers])
    for point in design.front:
        values = [point.numbers.get(item.path, "") for item in design.problem.variables]
        writer.writerow([point.valve.name, point.actuator.name, *point.objectives, *values])
    return buffer.getvalue()


def design_report(design: Design, figure: bytes) -> str:
    """Return the report as HTML; the figure is the content of an SVG file."""
    problem = design.problem
    rows = [
        {
            "valve": design.front[place].valve,
            "actuator": design.front[place].actuator,
            "cells": [*objective_cells(design.front[place]), *number_cells(problem, design.front[place])],
            "suggested": place == design.knee,
        }
        for place in design.shown
    ]
    values = {
        "name": problem.name,
        "description": problem.description,
        "tasks": [(task.name, f"{100 * task.weight:.0f} %", _scenarios(task.scenarios)) for task in problem.tasks],
        "heads": ["Error", "Gas per task", "Mass", *(short_path(path) for path in variable_paths(design))],
        "rows": rows,
        "reason": design.reason,
        "search": search_sentence(design),
        "failures": failure_lines(design),
        "doubts": [doubt_sentence(part, name) for part, name in design.doubtful],
        "carried": [part.title for part in problem.carried],
        "figure": inline_figure(figure),
        "seed": problem.search.seed,
        "command": f"ppafo design {problem.file} --out DIR",
        "versions": f"ppafo {ppafo.__version__}",
    }
    return rendered_page(TEMPLATE, values)


def _scenarios(scenarios: Mapping[str, Scenario]) -> str:
    return ", ".join(f"{scenario.name} ({kind})" for kind, scenario in scenarios.items())
