"""What ``ppafo identify`` leaves in its folder: the new set, estimates.json, a text, and the figures."""

from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.identify import Identification
from ppafo.parameters.writing import parameter_set_toml
from ppafo.reporting.bench_figures import figure_3, procedure_figure
from ppafo.reporting.identification_table import identification_table
from ppafo.reporting.style import rendered
from ppafo.reporting.trajectory_files import posterior_file, trajectory_document, trajectory_figures
from ppafo.simulation.document import plain

FORMATS = ("png", "svg")
ESTIMATES = "estimates.json"
TEXT = "identify.txt"


def identification_document(identification: Identification) -> dict[str, Any]:
    """Return the outcome as data that JSON can hold; a value that could not be told is null. SI units."""
    return {
        "problem": identification.name,
        "started_from": identification.before.name,
        "is_good": identification.is_good,
        "beforehand": [plain(item) for item in identification.beforehand],
        "procedures": [_procedure(result) for result in identification.results],
        **trajectory_document(identification.trajectory),
        "new_set": {
            "file": f"{identification.name}.toml",
            "identified": list(identification.new_set.written),
            "fitted": list(identification.new_set.fitted),
            "problem": identification.new_set.problem,
        },
    }


def identification_files(identification: Identification) -> dict[str, bytes]:
    """Return the files by name; figure-3 is there when both of its panels are."""
    table = "\n".join(identification_table(identification))
    files = {
        f"{identification.name}.toml": parameter_set_toml(identification.new_set.parameter_set).encode(),
        ESTIMATES: f"{json_text(identification_document(identification))}\n".encode(),
        TEXT: f"{table}\n".encode(),
    }
    files |= posterior_file(identification)
    counts: dict[str, int] = {}
    for result in identification.results:
        counts[result.procedure] = counts.get(result.procedure, 0) + 1
        number = counts[result.procedure]
        name = result.procedure if number == 1 else f"{result.procedure}-{number}"
        files |= _figure(name, procedure_figure(result))
    files |= {
        file: content
        for name, figure in trajectory_figures(identification)
        for file, content in _figure(name, figure).items()
    }
    both = figure_3(identification.results)
    return files if both is None else files | _figure("figure-3", both)


def _figure(name: str, figure: Any) -> dict[str, bytes]:
    return {f"{name}.{file_format}": content for file_format, content in rendered(figure, FORMATS).items()}


def _procedure(result: BenchResult) -> dict[str, Any]:
    return {
        "procedure": result.procedure,
        "summary": result.summary,
        "recordings_are": result.kind,
        "estimates": [plain(item) for item in result.estimates],
        "checks": [plain(item) for item in result.checks],
        "remarks": list(result.remarks),
    }
