"""A run of `ppafo simulate` once more, with the other readings of the paper's chambers (docs/decisions/0014)."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.errors import PpafoError
from ppafo.parameters.chamber_volumes import other_readings
from ppafo.questions.endurance.draw import Draw, draw_of_recording
from ppafo.simulation.document import scenario_document
from ppafo.simulation.loading import scenario_from_dict
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Scenario
from ppafo.simulation.simulate import simulate
from ppafo.storage.result_folder import RUN_FILE, read_document


def other_draws(recording: str | Path, step_time: float | None) -> dict[str, Draw]:
    """Return the gas use of a result folder with the other chambers, by name; {} where it cannot be run again.

    That is a file without a folder, a law in Python, chambers of its own, or a device that has changed since.
    """
    folder = Path(recording)
    if not (folder / RUN_FILE).is_file():
        return {}
    scenario = _again(read_document(folder).get("scenario"))
    if scenario is None:
        return {}
    found = {}
    for chambers in other_readings(scenario.device.actuator):
        result = simulate(replace(scenario, device=chambers.of(scenario.device)))
        if result.status.is_completed:
            found[chambers.name] = draw_of_recording(result.recording, step_time)
    return found


def _again(document: Any) -> Scenario | None:
    """Return the scenario of a result as what it was made from, None unless that gives the same device."""
    try:
        origin = document["origin"]
        scenario = scenario_from_dict(origin["content"], origin["overrides"])
    except (KeyError, TypeError, PpafoError):
        return None
    same = scenario_document(scenario)["device"] == document.get("device")
    return scenario if same and scenario.control.kind != PYTHON_CONTROLLER else None
