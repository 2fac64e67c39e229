"""A walk as data: its set-up in SI units, and what ``walk.json`` says of every walk, whoever walks."""

import platform
from typing import Any

import numpy as np

from ppafo.documents.json_text import plain
from ppafo.simulation.scenario import UNITS, Scenario
from ppafo.version import __version__
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import sensor_numbers
from ppafo.walking.walk import Comparison


def walk_data(name: str, version: int, comparison: Comparison) -> dict[str, Any]:
    """Return what the file of every walk says, of a format with this name and version."""
    worn, bare = comparison.with_device, comparison.without_device
    return {
        "format": name,
        "schema_version": version,
        "units": UNITS,
        "status": plain(worn.status),
        "status_off": plain(bare.status),
        "metrics": plain(dict(worn.metrics)),
        "metrics_off": plain(dict(bare.metrics)),
        "events": [event.to_dict() for event in worn.events],
        "versions": versions(),
        "configuration": walk_document(worn.scenario),
    }


def versions() -> dict[str, str]:
    """Return the versions of what computed."""
    return {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__}


def walk_document(scenario: Scenario) -> dict[str, Any]:
    """Return a walk as data in SI units; its bottle by its values, not by the tables of its gas."""
    motion, control, origin = walk_of(scenario), scenario.controller, scenario.origin
    return {
        "name": scenario.name,
        "description": scenario.description,
        "device": plain(scenario.device),
        **motion.who.document(motion),
        "controller": control.kind,
        "timing": motion.timing,
        "settings": plain(control.settings),
        "period": control.period,
        "step": scenario.run.step,
        "sensors": {
            "numbers": plain(sensor_numbers(scenario)),
            "faults": plain(motion.faults),
            "seed": scenario.sensors.seed,
        },
        "supply_line": plain(scenario.supply_line),
        "gas_model": plain(scenario.gas_model),
        "bottle": None if motion.bottle is None else motion.bottle.to_dict(),
        "assumed": {item.path: item.note for item in scenario.assumptions},
        "file": origin.file,
        "overrides": list(origin.overrides),
        "content": origin.content,
    }
