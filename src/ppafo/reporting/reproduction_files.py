"""Everything that ``ppafo reproduce`` writes, as file contents by name."""

import json
from typing import Any

from ppafo.reporting.reproduction_report import holding_torque, reproduction_report
from ppafo.reporting.step_response_figure import step_response_figure
from ppafo.reporting.style import rendered
from ppafo.reporting.torque_task_figure import torque_task_figure
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.studies.reproduction import Reproduction
from ppafo.studies.reproduction.step_response import Levels

REPORT = "report.html"
CLAIMS = "claims.json"
STEP_FIGURE = "figure-7-step-response"
TORQUE_FIGURE = "figure-8-torque-task"
_FORMATS = ("png", "svg")


def reproduction_files(reproduction: Reproduction) -> dict[str, bytes]:
    """Return report, claims, both figures as PNG and SVG, and the three recordings as CSV; the report comes last."""
    step, torque = _step_figure(reproduction), _torque_figure(reproduction)
    runs = (reproduction.step, reproduction.solenoid, reproduction.proportional)
    claims = json.dumps(claims_document(reproduction), indent=2, ensure_ascii=False, allow_nan=False)
    return {
        **{f"{run.scenario.name}.csv": marked_csv_bytes(run.recording) for run in runs},
        **{f"{STEP_FIGURE}.{file_format}": content for file_format, content in step.items()},
        **{f"{TORQUE_FIGURE}.{file_format}": content for file_format, content in torque.items()},
        CLAIMS: f"{claims}\n".encode(),
        REPORT: reproduction_report(reproduction, step["svg"], torque["svg"]).encode(),
    }


def claims_document(reproduction: Reproduction) -> dict[str, Any]:
    """Return what ``claims.json`` says: the claims, and what was changed for this run."""
    return {
        "claims": [claim.document() for claim in reproduction.claims],
        "overrides": list(reproduction.overrides),
        "versions": dict(reproduction.step.versions),
    }


def _step_figure(reproduction: Reproduction) -> dict[str, bytes]:
    supply = reproduction.step.scenario.device.supply
    levels = Levels(supply.pressure, supply.atmospheric_pressure)
    return rendered(step_response_figure(reproduction.step.recording, levels, reproduction.step_events), _FORMATS)


def _torque_figure(reproduction: Reproduction) -> dict[str, bytes]:
    stated = {claim.id: claim.paper for claim in reproduction.claims}
    figure = torque_task_figure(
        reproduction.solenoid.recording,
        reproduction.proportional.recording,
        holding_torque(reproduction.solenoid),
        (stated["co2_solenoid"], stated["co2_proportional"]),
    )
    return rendered(figure, _FORMATS)
