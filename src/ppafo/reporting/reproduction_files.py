"""Everything that ``ppafo reproduce`` writes, as file contents by name, and the folder that it goes into."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.reporting.bench_figures import synthetic_figure_3
from ppafo.reporting.reproduction_report import holding_torque, reproduction_report
from ppafo.reporting.step_response_figure import step_response_figure
from ppafo.reporting.style import rendered
from ppafo.reporting.torque_task_figure import torque_task_figure
from ppafo.reporting.unreported_figure import unreported_figure
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.owned_folder import FolderKind, check_owned_folder, read_json, write_owned_folder
from ppafo.studies.reproduction import Reproduction
from ppafo.studies.reproduction.claim import verdict_counts
from ppafo.studies.reproduction.step_response import Levels
from ppafo.studies.reproduction.study import EXPERIMENTS
from ppafo.studies.reproduction.synthetic import NoEvidence

REPORT = "report.html"
CLAIMS = "claims.json"
IDENTIFICATION_FIGURE = "figure-3-identification"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
UNSAID_FIGURE = "unreported-settings"
_FORMATS = ("png", "svg")

FILES = (
    *(f"{name}.csv" for name in EXPERIMENTS),
    *(
        f"{figure}.{file_format}"
        for figure in (IDENTIFICATION_FIGURE, STEP_FIGURE, TORQUE_FIGURE, UNSAID_FIGURE)
        for file_format in _FORMATS
    ),
    CLAIMS,
    REPORT,
)
"""Names of all files, in the order of writing; the report comes last.

Without the virtual rig there is no figure 3, with changed values no figure of what the paper leaves unsaid.
"""


def check_reproduction_folder(folder: Path) -> None:
    """Refuse a folder that holds anything but an earlier reproduction, or that cannot be made."""
    check_owned_folder(folder, _REPRODUCTION)


def write_reproduction(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write ``reproduction_files`` as a folder, all of them or none, in the place of an earlier reproduction."""
    write_owned_folder(folder, contents, _REPRODUCTION)


def reproduction_files(reproduction: Reproduction) -> dict[str, bytes]:
    """Return the contents of ``FILES``: recordings as CSV, the figures as PNG and SVG, claims and report."""
    step, torque = _step_figure(reproduction), _torque_figure(reproduction)
    identification, unsaid = _identification_figure(reproduction), _unsaid_figure(reproduction)
    figures = (step["svg"], torque["svg"], identification.get("svg"), unsaid.get("svg"))
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    return {
        **{f"{run.scenario.name}.csv": marked_csv_bytes(run.recording) for run in runs},
        **{f"{IDENTIFICATION_FIGURE}.{file_format}": content for file_format, content in identification.items()},
        **{f"{STEP_FIGURE}.{file_format}": content for file_format, content in step.items()},
        **{f"{TORQUE_FIGURE}.{file_format}": content for file_format, content in torque.items()},
        **{f"{UNSAID_FIGURE}.{file_format}": content for file_format, content in unsaid.items()},
        CLAIMS: f"{json_text(claims_document(reproduction))}\n".encode(),
        REPORT: reproduction_report(reproduction, *figures).encode(),
    }


def claims_document(reproduction: Reproduction) -> dict[str, Any]:
    """Return what ``claims.json`` says: the claims, how many have each verdict, and what was changed for this run."""
    return {
        "counts": verdict_counts(reproduction.claims),
        "claims": [claim.document() for claim in reproduction.claims],
        "overrides": list(reproduction.overrides),
        "versions": dict(reproduction.step.versions),
    }


def _identification_figure(reproduction: Reproduction) -> dict[str, bytes]:
    """Return figure 3 by format; nothing where the virtual rig could not measure."""
    evidence = reproduction.synthetic
    if isinstance(evidence, NoEvidence):
        return {}
    return rendered(synthetic_figure_3(evidence.bench.torque, evidence.bench.decay), _FORMATS)


def _unsaid_figure(reproduction: Reproduction) -> dict[str, bytes]:
    """Return the figure of what the paper leaves unsaid by format; nothing where values were changed."""
    family = reproduction.family
    return {} if family is None else rendered(unreported_figure(family), _FORMATS)


def _step_figure(reproduction: Reproduction) -> dict[str, bytes]:
    supply = reproduction.step.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    evidence = reproduction.synthetic
    measured = None if isinstance(evidence, NoEvidence) else evidence.step.measured
    figure = step_response_figure(reproduction.step.recording, levels, reproduction.step_events, measured)
    return rendered(figure, _FORMATS)


def _torque_figure(reproduction: Reproduction) -> dict[str, bytes]:
    stated = {claim.id: claim.paper for claim in reproduction.claims}
    evidence = reproduction.synthetic
    figure = torque_task_figure(
        reproduction.solenoid.recording,
        reproduction.proportional.recording,
        holding_torque(reproduction.solenoid),
        (stated["co2_solenoid"], stated["co2_proportional"]),
        None if isinstance(evidence, NoEvidence) else (evidence.solenoid, evidence.proportional),
    )
    return rendered(figure, _FORMATS)


def _files_of(folder: Path) -> tuple[str, ...]:
    """Return the names that an earlier reproduction may have."""
    path = folder / CLAIMS
    document = read_json(path)
    if not isinstance(document, dict) or not isinstance(document.get("claims"), list):
        raise DataError(f"{path}: is not of a ppafo reproduction (it has no list of claims); choose another folder")
    return FILES


_REPRODUCTION = FolderKind("ppafo reproduction", CLAIMS, _files_of)
