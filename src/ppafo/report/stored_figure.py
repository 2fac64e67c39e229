"""Figures of saved results and walks, with the data stated in their documents: joint, atmosphere, units, ending.

Documents may come from any source; each error names the key with an invalid value.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.arguments import checked
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, UnitError
from ppafo.metrics.metric import Metric, Metrics
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.report.kind import metrics_lines
from ppafo.report.recording_figure import recording_figure
from ppafo.report.style import drawn_at, shown
from ppafo.signals import Recording
from ppafo.storage import StoredResult, read_stored
from ppafo.storage.result_folder import RUN_FILE
from ppafo.units import conversion
from ppafo.units.shown import GAUGE_ZERO, counted_from, shown_in
from ppafo.wording import one_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LARGEST = 1e9
"""Upper limit of the atmosphere [Pa absolute] and of times [s] in a document."""
_LONGEST_SHOWN = 60
"""Largest number of characters of a key, value or word in a message or figure."""
_LONGEST_REMARK = 500
"""Largest number of characters of a document's message about the end of a run."""
_END_OF_WALK = 5.0
"""Duration drawn from the end of a walk [s]: a few strides, since a longer one would be unreadable."""


@checked
def read_result(folder: str | Path) -> StoredResult:
    """Return the content of a result folder, with its figure; raises DataError for a folder without a result.

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("step")
    >>> stored = ppafo.read_result(folder)
    >>> stored.document["status"]["kind"], len(stored.plot().axes), round(max(stored["pressure_1", "psi_g"]))
    ('completed', 5, 55)
    """
    stored = read_stored(folder)
    file = stored.folder / RUN_FILE
    metrics = Metrics()
    for name, stated in table_at(file, stored.document, "metrics").items():
        try:
            # JSON has no nan, which a metric without a value has.
            value = math.nan if stated["value"] is None else float(stated["value"])
            metrics[name] = Metric(value, str(stated["unit"]), str(stated["summary"]))
        except (KeyError, TypeError, ValueError) as error:
            raise _other_form(file, f"metrics.{name}", stated, "a value with unit and summary") from error
    atmosphere = _stated_atmosphere(file, stored.document, "scenario", "device")
    # Folders of earlier versions hold no verdict.
    said = stored.document.get("verdict", [_ending(file, stored.document)])
    if not (isinstance(said, list) and all(isinstance(each, str) for each in said)):
        raise _other_form(file, "verdict", said, "a list of texts")
    kind = one_line(table_at(file, stored.document, "status").get("kind", ""))[:_LONGEST_SHOWN]
    with shown_in(stated_units(file, stored.document, device=("scenario", "device"))):
        text = "\n".join([kind, *filter(None, map(one_line, said)), "", *metrics_lines(metrics), ""])
    return replace(stored, metrics=metrics, atmosphere=atmosphere, drawn_by=draw_stored_result, text=text)


def draw_stored_result(stored: StoredResult, width: float | str | None = None) -> "Figure":
    """Return the figure of a saved result, identical to the figure of ``Result.plot``.

    Raises DataError that names the invalid key of ``run.json``.
    """
    file, document = stored.folder / RUN_FILE, stored.document
    title = table_at(file, document, "scenario").get("name", "")
    if not isinstance(title, str):
        raise _other_form(file, "scenario.name", title, "a text")
    valve = str(table_at(file, document, "scenario", "device", "valve").get("kind", ""))
    words = table_at(file, document, "scenario", "device", "joint")
    joint = {name: words.get(name, getattr(ANKLE, name)) for name in ("name", "positive", "negative")}
    for name, word in joint.items():
        if not isinstance(word, str):
            raise _other_form(file, f"scenario.device.joint.{name}", word, "a text")
    names = JointNames(**{name: one_line(word)[:_LONGEST_SHOWN] for name, word in joint.items()})
    with shown_in(stated_units(file, document, device=("scenario", "device"))), drawn_at(width):
        return shown(recording_figure(stored.recording, one_line(title), _ending(file, document), valve, names))


def draw_stored_walk(file: Path, document: Mapping[str, Any], recording: Recording) -> "Figure":
    """Return the figure of the last seconds of a saved walk, with the failure that ended it, if any.

    ``document`` is the content of ``file``, empty without a file. Raises DataError that names the invalid key.
    """
    end = float(recording.time[-1])
    # A short walk is drawn whole, and then nothing is left out that had to be said.
    part = f"the last {_END_OF_WALK:g} s of {end:.4g} s" if recording.duration > _END_OF_WALK else ""
    remark = "; ".join(text for text in (_ending(file, document), part) if text)
    shown = recording.between(end - _END_OF_WALK, end)
    valve = str(table_at(file, document, "configuration", "device", "valve").get("kind", ""))
    with shown_in(stated_units(file, document, device=("configuration", "device"))):
        return recording_figure(shown, recording.label, remark, valve)


def stated_units(
    file: Path, document: Mapping[str, Any], *keys: str, device: tuple[str, ...] = ("device",)
) -> dict[str, str]:
    """Return the display units stated in a document at some keys, by SI unit.

    They include the atmosphere of the device, the reference of gauge pressures. Raises DataError for a unit of a wrong
    kind, and for an invalid value, with its key.
    """
    # The device itself says from which pressure gauge ones count.
    stated = {key: unit for key, unit in table_at(file, document, *keys, "shown").items() if key != GAUGE_ZERO}
    for si_unit, unit in stated.items():
        try:
            conversion(str(unit), si_unit)
        except UnitError as error:
            raise _other_form(file, f"shown.{one_line(si_unit)[:_LONGEST_SHOWN]}", unit, "a unit for it") from error
    return counted_from(stated, _stated_atmosphere(file, document, *keys, *device))


def _stated_atmosphere(file: Path, document: Mapping[str, Any], *device: str) -> float:
    """Return the atmosphere of the device at some keys of a document [Pa absolute], standard if it is missing."""
    path = (*device, "supply", "atmospheric_pressure")
    atmosphere = table_at(file, document, *path[:-1]).get(path[-1], STANDARD_ATMOSPHERE)
    # JSON has true and false, which Python takes for 1 and 0.
    is_number = isinstance(atmosphere, int | float) and not isinstance(atmosphere, bool)
    if not is_number or not 0.0 < atmosphere < _LARGEST:
        raise _other_form(file, ".".join(path), atmosphere, "a pressure in Pa")
    return float(atmosphere)


def _ending(file: Path, document: Mapping[str, Any]) -> str:
    """Return the reason for an early stop of a run; empty for a completed run."""
    status = table_at(file, document, "status")
    message = one_line(status.get("message", ""))[:_LONGEST_REMARK]
    return "" if status.get("kind", "completed") == "completed" else message


def table_at(file: Path, document: Mapping[str, Any], *keys: str) -> Mapping[str, Any]:
    """Return the table at some keys of a document, empty if it is missing."""
    for depth, key in enumerate(keys, start=1):
        below = document.get(key, {})
        if not isinstance(below, Mapping):
            raise _other_form(file, ".".join(keys[:depth]), below, "a table")
        document = below
    return document


def _other_form(file: Path, path: str, given: object, wanted: str) -> DataError:
    """Build the error for an invalid value at a dotted path of a file; ``wanted`` describes the valid values."""
    return DataError(f"{file}: {path} = {one_line(repr(given))[:_LONGEST_SHOWN]} must be {wanted}")
