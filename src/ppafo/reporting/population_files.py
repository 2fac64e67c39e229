"""Everything that ``ppafo walk --wearers N`` writes, as file contents by name."""

import platform
from pathlib import Path
from typing import Any

import numpy as np

import ppafo
from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.reporting.population_figure import population_figure
from ppafo.reporting.population_table import all_quantiles
from ppafo.reporting.style import rendered
from ppafo.simulation.document import UNITS, plain
from ppafo.storage.owned_folder import FolderKind, read_json
from ppafo.walking.anthropometry import CORRELATION, MASS_VARIATION, MOST_DEVIATIONS, STATURE_VARIATION
from ppafo.walking.population import OUTCOMES, TRAITS, Population
from ppafo.walking.wearers_rows import START_VARIATION, THRESHOLD_VARIATION

WEARERS_FILE = "wearers.json"
FORMAT = "ppafo wearers"
SCHEMA_VERSION = 1
_FORMATS = ("png", "svg")


def population_files(population: Population) -> dict[str, bytes]:
    """Return every file by name; no figure where every wearer diverged."""
    contents = {"wearers.csv": wearers_csv(population)}
    if population.count:
        figures = rendered(population_figure(population), _FORMATS)
        contents |= {f"wearers.{file_format}": content for file_format, content in figures.items()}
    document = population_document(population) | {"files": sorted([*contents, WEARERS_FILE])}
    return {**contents, WEARERS_FILE: f"{json_text(document)}\n".encode()}


def population_document(population: Population) -> dict[str, Any]:
    """Return what ``wearers.json`` says, in SI units."""
    configuration = population.configuration
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "units": UNITS,
        "status": {"kind": "diverged" if population.diverged else "completed", "message": population.message},
        "wearers": population.count,
        "diverged": population.diverged,
        "vented": population.vented,
        "minutes": population.minutes,
        "seed": population.seed,
        "varied": {
            "body_mass": MASS_VARIATION,
            "stature": STATURE_VARIATION,
            "correlation": CORRELATION,
            "thresholds": THRESHOLD_VARIATION,
            "push_off_start": START_VARIATION,
            "gait": "stride time, stance share and series coefficients by the deviations of the gait",
            "most_deviations": MOST_DEVIATIONS,
        },
        **all_quantiles(population),
        "versions": {"ppafo": ppafo.__version__, "python": platform.python_version(), "numpy": np.__version__},
        "configuration": plain(configuration) | {"controller": configuration.controller.name},
    }


def wearers_csv(population: Population) -> bytes:
    """Return one line for each wearer, in SI units."""
    columns = {f"{name} [{item.unit}]": population.traits[name] for name, item in TRAITS.items()}
    columns |= {f"{name} [{item.unit}]": population.outcomes[name] for name, item in OUTCOMES.items()}
    lines = ["# simulated: a model's own output, not measured", ",".join(columns)]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return ("\n".join([*lines, *(",".join(map(repr, row)) for row in rows)]) + "\n").encode()


def _files_of(folder: Path) -> set[str]:
    """Return the names that an earlier run may have left; DataError where its mark is somebody else's."""
    path = folder / WEARERS_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: is not of a ppafo population (its 'format' is not '{FORMAT}')")
    files = document.get("files")
    return {WEARERS_FILE, *map(str, files if isinstance(files, list) else [])}


POPULATION_FOLDER = FolderKind("ppafo population", WEARERS_FILE, _files_of)
