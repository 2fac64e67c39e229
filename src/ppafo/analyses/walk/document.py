"""A walk as data and in rows: what ``walk.json`` and the tables say of every walk, whoever walks."""

import platform
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ppafo.documents.json_text import plain
from ppafo.report.display_units import display_unit, display_value
from ppafo.report.finding import Column, columns_of
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
        "shown": dict(worn.scenario.device.shown),
    }


def versions() -> dict[str, str]:
    """Return the versions of the packages that computed a result."""
    return {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__}


def walk_document(scenario: Scenario) -> dict[str, Any]:
    """Return a walk as data in SI units; its bottle by its values, not by the tables of its gas."""
    motion, control, origin = walk_of(scenario), scenario.controller, scenario.origin
    return {
        "name": scenario.name,
        "description": scenario.description,
        "device": plain(scenario.device),
        "gait": plain(motion.gait),
        "wearer": plain(motion.wearer),
        "wearer_origin": motion.wearer_origin,
        "task_sequence": plain(motion.task_sequence),
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
        "assumed": {assumption.path: assumption.note for assumption in scenario.assumptions},
        "file": origin.file,
        "overrides": list(origin.overrides),
        "content": origin.content,
    }


Row = tuple[str, str, str, int]
"""Name of a number, title, kind of quantity and digits behind the point, as a table of a walk shows it."""
WOULD_DRAG = "would drag"
"""What is said of toes that would be in the ground."""


def number_texts(row: Row, values: Iterable[float | str | None]) -> tuple[str | None, ...]:
    """Return the title with its unit, and values [SI] as text; a text and None stay what they are."""
    _, title, quantity, digits = row
    texts: list[str | None] = []
    for number in values:
        if number is None or isinstance(number, str):
            texts.append(number)
            continue
        text = f"{display_value(number, quantity):.{digits}f}"
        # Without the sign of what is rounded to zero.
        texts.append(text.removeprefix("-") if float(text) == 0.0 else text)
    unit = display_unit(quantity)
    return (f"{title} ({unit})" if unit else title, *texts)


def toes(height: float | None) -> float | str | None:
    """Return how high the toes are over the ground [m]; of toes below it only that they would drag."""
    return WOULD_DRAG if height is not None and height < 0.0 else height


def metrics_table(rows: Sequence[Row], columns: Sequence[tuple[str, Mapping[str, float | str | None]]]) -> list[Column]:
    """Return a row for each number that one of the columns has: title and values [SI]; each column has its head."""
    # A number that no walk of the table has would be a row of dashes.
    shown = [row for row in rows if any(values.get(row[0]) is not None for _, values in columns)]
    cells = (number_texts(row, (values.get(row[0]) for _, values in columns)) for row in shown)
    return columns_of(["", *(head for head, _ in columns)], cells)


def csv_of(columns: Mapping[str, Iterable[Any]]) -> bytes:
    """Return simulated columns as comma-separated text; a cell is empty where there is nothing to say."""
    lines = ["# simulated: a model's own output, not measured", ",".join(columns)]
    cells = (values.tolist() if isinstance(values, np.ndarray) else values for values in columns.values())
    lines += [
        ",".join("" if cell is None else cell if isinstance(cell, str) else repr(cell) for cell in row)
        for row in zip(*cells, strict=True)
    ]
    return ("\n".join(lines) + "\n").encode()
