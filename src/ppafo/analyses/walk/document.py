"""Walk as plain data and as table rows: content of ``walk.json`` and of the tables of all walks."""

import platform
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ppafo.documents.json_text import fields_of, plain
from ppafo.report.display_units import display_unit, display_value
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import sensor_numbers


def versions() -> dict[str, str]:
    """Return the versions of the packages with which a result was computed."""
    return {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__}


def walk_document(scenario: Scenario) -> dict[str, Any]:
    """Return a walk as data in SI units; a bottle is described by its values, without the gas property tables."""
    motion, control, origin = walk_of(scenario), scenario.controller, scenario.origin
    seed = scenario.sensors.seed
    return {
        **fields_of(scenario, "name", "description"),
        "device": plain(scenario.device),
        "gait": plain(motion.gait),
        "wearer": plain(motion.wearer),
        "wearer_origin": motion.wearer_origin,
        "controller": control.kind,
        "settings": plain(control.settings),
        "period": control.period,
        "step": scenario.run.step,
        "sensors": {"numbers": plain(sensor_numbers(scenario)), "seed": seed},
        "supply_line": plain(scenario.supply_line),
        "gas_model": plain(scenario.gas_model),
        "bottle": None if motion.bottle is None else motion.bottle.to_dict(),
        "assumed": {assumption.path: assumption.note for assumption in scenario.assumptions},
        **fields_of(origin, "file", "content"),
        "overrides": list(origin.overrides),
    }


class ShownNumber(NamedTuple):
    """Row in the table of a walk: name of the number, title, kind of quantity and number of decimals."""

    name: str
    title: str
    quantity: str
    digits: int


WOULD_DRAG = "would drag"
"""Text in tables for toes that would penetrate the ground."""


def number_texts(shown: ShownNumber, values: Iterable[float | str | None]) -> tuple[str | None, ...]:
    """Return the title with its unit, and the values [SI] as text; texts and None are returned unchanged."""
    texts: list[str | None] = []
    for number in values:
        if number is None or isinstance(number, str):
            texts.append(number)
            continue
        text = f"{display_value(number, shown.quantity):.{shown.digits}f}"
        # Without the sign of what is rounded to zero.
        texts.append(text.removeprefix("-") if float(text) == 0.0 else text)
    unit = display_unit(shown.quantity)
    return (f"{shown.title} ({unit})" if unit else shown.title, *texts)


def toes(height: float | None) -> float | str | None:
    """Return the toe clearance above the ground [m] or, if negative, the text that the toes would drag."""
    return WOULD_DRAG if height is not None and height < 0.0 else height


def csv_of(columns: Mapping[str, Iterable[Any]]) -> bytes:
    """Return simulated columns as CSV; a missing value is an empty cell."""
    lists = (values.tolist() if isinstance(values, np.ndarray) else values for values in columns.values())
    rows = (
        ",".join("" if value is None else value if isinstance(value, str) else repr(value) for value in row)
        for row in zip(*lists, strict=True)
    )
    lines = ["# simulated: a model's own output, not measured", ",".join(columns), *rows]
    return ("\n".join(lines) + "\n").encode()
