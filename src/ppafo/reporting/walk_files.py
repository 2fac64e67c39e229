"""Everything that ``ppafo walk`` writes, as file contents by name."""

import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import ppafo
from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.reporting.page import inline_animation, inline_figure, rendered_page
from ppafo.reporting.style import rendered
from ppafo.reporting.walk_animation import animation
from ppafo.reporting.walk_figure import comparison_figure
from ppafo.reporting.walk_frames import frames_figure
from ppafo.reporting.walk_strip import strip_figure
from ppafo.reporting.walk_table import COLUMNS, bottle_document, bottle_sentence, safety_sentence, walk_rows
from ppafo.signals.recording import Floats
from ppafo.simulation.document import UNITS, plain
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.netcdf import netcdf_bytes
from ppafo.storage.owned_folder import FolderKind, read_json
from ppafo.studies.endurance import Endurance
from ppafo.studies.endurance.walked import FORMAT, WALK_FILE
from ppafo.walking.comparison import Comparison
from ppafo.walking.strides import PER_STRIDE, PHASES
from ppafo.walking.walk import WalkResult

SCHEMA_VERSION = 1
REPORT = "report.html"
TEMPLATE = "walk.html.jinja"
ANIMATION = "legs.gif"
_FORMATS = ("png", "svg")


def walk_files(comparison: Comparison, life: Endurance | None) -> dict[str, bytes]:
    """Return every file of a walk by name; a walk that diverged has numbers and no pictures.

    ``life`` is how long one bottle lasts on it, None where it took no gas.
    """
    worn, bare = comparison.with_device, comparison.without_device
    contents = {
        "recording.nc": netcdf_bytes(worn.recording, None),
        "recording.csv": marked_csv_bytes(worn.recording),
        "recording-off.nc": netcdf_bytes(bare.recording, None),
        "strides.csv": strides_csv(worn),
        "strides-off.csv": strides_csv(bare),
        "mean-stride.csv": mean_stride_csv(worn),
        "mean-stride-off.csv": mean_stride_csv(bare),
    }
    pictures = walk_pictures(comparison) if worn.averages and bare.averages else {}
    contents |= pictures
    contents[REPORT] = walk_report(comparison, pictures, life).encode()
    document = walk_document(comparison, life) | {"files": sorted([*contents, WALK_FILE])}
    return {**contents, WALK_FILE: f"{json_text(document)}\n".encode()}


def walk_pictures(comparison: Comparison) -> dict[str, bytes]:
    """Return figures (PNG and SVG) and the animation (GIF) by file name."""
    figures = {
        "mean-stride": comparison_figure(comparison),
        "gait-phases": strip_figure(comparison.with_device),
        "legs": frames_figure(comparison),
    }
    contents = {
        f"{name}.{file_format}": content
        for name, figure in figures.items()
        for file_format, content in rendered(figure, _FORMATS).items()
    }
    return contents | {ANIMATION: animation(comparison)}


def walk_document(comparison: Comparison, life: Endurance | None) -> dict[str, Any]:
    """Return what ``walk.json`` says, as data that JSON can hold, in SI units."""
    configuration = comparison.with_device.configuration
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "units": UNITS,
        "status": plain(comparison.with_device.status),
        "status_off": plain(comparison.without_device.status),
        "minutes": float(comparison.with_device.recording.time[-1]) / 60.0,
        "metrics": plain(dict(comparison.with_device.metrics)),
        "bottle": bottle_document(life),
        "metrics_off": plain(dict(comparison.without_device.metrics)),
        "healthy": plain(dict(comparison.healthy)),
        "versions": {"ppafo": ppafo.__version__, "python": platform.python_version(), "numpy": np.__version__},
        "configuration": plain(configuration) | {"controller": configuration.controller.name},
    }


def strides_csv(result: WalkResult) -> bytes:
    """Return the numbers of each whole stride; the start of each is the sample right after its heel strike."""
    count = result.strides["gas"].size
    columns = {"stride [-]": np.arange(1.0, count + 1.0), "start [s]": result.recording.time[result.starts[:count]]}
    columns |= {f"{name} [{item.unit}]": result.strides[name] for name, item in PER_STRIDE.items()}
    return _table(columns)


def mean_stride_csv(result: WalkResult) -> bytes:
    """Return mean and standard deviation over strides of each channel, at every percent of the stride."""
    columns = {"phase [-]": PHASES} if result.averages else {"phase [-]": PHASES[:0]}
    for name, curves in result.averages.items():
        columns[f"{name} [{curves.unit}]"] = curves.mean
        columns[f"{name}_deviation [{curves.unit}]"] = curves.deviation
    return _table(columns)


def _table(columns: Mapping[str, Floats]) -> bytes:
    lines = ["# simulated: a model's own output, not measured", ",".join(columns)]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return ("\n".join([*lines, *(",".join(map(repr, row)) for row in rows)]) + "\n").encode()


def walk_report(comparison: Comparison, pictures: Mapping[str, bytes], life: Endurance | None) -> str:
    """Return the report as HTML, with the figures inside."""
    configuration = comparison.with_device.configuration
    walks = (comparison.with_device, comparison.without_device)
    figures = {
        name: inline_figure(pictures[f"{name}.svg"])
        for name in ("mean-stride", "gait-phases", "legs")
        if f"{name}.svg" in pictures
    }
    values = {
        "name": configuration.name,
        "description": configuration.description,
        "gait": configuration.gait.name,
        "gait_title": configuration.gait.title,
        "device": configuration.device.name,
        "controller": configuration.controller.summary,
        "overrides": list(configuration.overrides),
        "assumed": dict(configuration.assumed),
        "minutes": f"{float(comparison.with_device.recording.time[-1]) / 60.0:.3g}",
        "is_completed": comparison.is_completed,
        "messages": [walk.status.message for walk in walks if not walk.status.is_completed],
        "safety": safety_sentence(comparison),
        "bottle": bottle_sentence(life),
        "columns": COLUMNS,
        "rows": walk_rows(comparison),
        "figures": figures,
        "animation": inline_animation(pictures[ANIMATION]) if ANIMATION in pictures else "",
        "versions": f"ppafo {ppafo.__version__}",
    }
    return rendered_page(TEMPLATE, values)


def _files_of(folder: Path) -> set[str]:
    """Return the names that an earlier walk may have left; DataError where its mark is somebody else's."""
    path = folder / WALK_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: is not of a ppafo walk (its 'format' is not '{FORMAT}')")
    files = document.get("files")
    return {WALK_FILE, *map(str, files if isinstance(files, list) else [])}


WALK_FOLDER = FolderKind("ppafo walk", WALK_FILE, _files_of)
