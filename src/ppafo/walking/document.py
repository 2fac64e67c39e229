"""A walk as plain data, for the files that say what was walked."""

from typing import Any

from ppafo.simulation.scenario import Scenario, plain
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import sensor_settings


def walk_document(scenario: Scenario) -> dict[str, Any]:
    """Return a walk as data in SI units; its bottle by its values, not by the tables of its gas."""
    motion, control, origin = walk_of(scenario), scenario.control, scenario.origin
    lines = scenario.supply_lines
    return {
        "name": scenario.name,
        "description": scenario.description,
        "device": plain(scenario.device),
        "gait": plain(motion.gait),
        "wearer": plain(motion.wearer),
        "controller": control.kind,
        "arithmetic": control.arithmetic,
        "timing": motion.timing,
        "settings": plain(control.settings),
        "period": control.period,
        "step": scenario.time_step,
        "sensors": plain(sensor_settings(scenario)) | {"seed": scenario.sensors.seed},
        "supply_lines": None if lines is None else plain(lines._asdict()),
        "thermal": plain(scenario.thermal),
        "course": plain(motion.course),
        "bottle": None if motion.bottle is None else motion.bottle.to_dict(),
        "wearer_origin": motion.wearer_origin,
        "assumed": {item.path: item.note for item in scenario.assumptions},
        "file": origin.file,
        "overrides": list(origin.overrides),
    }
