"""Gait files: layout, conversion to a ``Gait``, and conversion of a gait to the text of a file."""

from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ppafo.arguments import checked
from ppafo.documents.toml_text import TomlKind, label, value_text
from ppafo.errors import DataError, refused_as
from ppafo.gait.gait import BODY_MASSES, CURVES, REQUIRED, SPEEDS, STATURES, Gait, GaitCurve, Origin, plain_unit
from ppafo.gait.plausible import MeanStride, check_plausible
from ppafo.model.declaration import Number, Quantity
from ppafo.parameters.declared import (
    SHORT_NAME,
    Field,
    InnerTable,
    Many,
    Words,
    check_keys,
    inside,
    number_in,
    schema_of,
    value_at,
)
from ppafo.units import from_si, to_si

_MAXIMUM_HARMONICS = 40
"""Largest number of harmonics of a curve in a gait file."""
_SUMMARIES = {
    "shank_angle": "shank angle from the vertical, above 0 while the ankle is in front of the knee",
    "ankle_angle": "ankle angle, 90 deg neutral, growing in plantarflexion",
    "ankle_moment": "internal ankle moment per body mass, above 0 in plantarflexion",
    "vertical_force": "vertical ground reaction on this foot in body weights, above 0 upwards",
    "centre_of_pressure": "centre of pressure, forward of the ankle along the foot; undefined in swing",
    "knee_forward": "acceleration of the knee in walking direction",
    "knee_up": "acceleration of the knee upwards, without gravity",
}
_NUMBERS: dict[str, tuple[str, Quantity]] = {
    "subject.body_mass": ("body_mass", Number("kg", "mass of the wearer, such as '62 kg'", None, *BODY_MASSES)),
    "subject.stature": ("stature", Number("m", "height of the wearer", None, *STATURES, optional=True)),
    "subject.walking_speed": ("walking_speed", Number("m/s", "speed of this gait", None, *SPEEDS, optional=True)),
    "subject.recorded_speed": (
        "recorded_speed",
        Number("m/s", "speed at which the curves were recorded, where it is another one", None, *SPEEDS, optional=True),
    ),
    "stride.time": (
        "stride_time",
        Number("s", "time from heel strike to heel strike of the same foot", None, 0.3, 5.0),
    ),
    "stride.stance_share": (
        "stance_share",
        Number("", "fraction of the stride until toe-off, such as '62 percent'", None, 0.2, 0.95),
    ),
    "stride.time_deviation": (
        "stride_time_deviation",
        Number("s", "its standard deviation between strides", 0.0, 0.0, 2.0),
    ),
    "stride.stance_share_deviation": (
        "stance_share_deviation",
        Number("", "its standard deviation between strides", 0.0, 0.0, 0.5),
    ),
    "stride.count": (
        "strides",
        Number("", "number of strides behind the curves; 0: unknown", 0.0, 0.0, whole=True),
    ),
}
"""Numbers of a gait file by path, each with its attribute; wide limits that exclude only typing errors."""
_COEFFICIENT = Number("", "", plain=True)
NORMATIVE = "falisse2019-subject1"
"""Name of the default gait."""
_DIGITS = 12
"""Significant digits of a written coefficient; conversion from radians to degrees adds noise beyond these."""


def declared(_document: Mapping[str, Any]) -> dict[str, Field]:
    """Return every field of a gait file, by path."""
    fields: dict[str, Field] = {
        "schema_version": Words("version of this layout", True, (1,)),
        "name": Words(required=True, pattern=SHORT_NAME),
        "title": Words("one line: who walks, and how"),
        "origin": Words("imported: from a file that states none; synthetic: by a model", True, get_args(Origin)),
        "source": Words("where the numbers come from", True),
        "notes": Words("further remarks"),
        "subject": InnerTable("the wearer", True),
        "stride": InnerTable("times of the stride", True),
        **{path: quantity for path, (_, quantity) in _NUMBERS.items()},
    }
    for name, unit in CURVES.items():
        # Only angles have two units; every other curve has the one of its SI quantity.
        curve: dict[str, Field] = {
            "unit": Words("unit of every number of this curve", True, ("deg", "rad") if unit == "rad" else (unit,)),
            "mean": Number("", "mean over the stride", plain=True),
            "cosine": Many(_COEFFICIENT, "amplitudes, first harmonic first", True, 1, _MAXIMUM_HARMONICS),
            "sine": Many(_COEFFICIENT, "amplitudes, as many as of the cosines", True, 1, _MAXIMUM_HARMONICS),
            "deviation": Number("", "standard deviation between strides, root mean square", 0.0, 0.0, plain=True),
        }
        fields |= inside(name, curve, _SUMMARIES[name], name in REQUIRED)
    return fields


def parse_gait(content: bytes, file: str) -> Gait:
    """Return the gait in the content of a gait file; ``file`` names it in messages. Raises DataError if invalid."""
    place = label(file)
    parsed = _FILE.parse(content, place)
    document = parsed.document
    check_keys(parsed, declared(document))
    numbers = {
        name: quantity.default if (value := value_at(document, path)) is None else number_in(value, quantity)
        for path, (name, quantity) in _NUMBERS.items()
    }
    strides = int(numbers.pop("strides") or 0)
    texts = {name: document.get(name, "") for name in ("name", "title", "origin", "source", "notes")}
    curves: dict[str, Any] = {name: _curve(document[name], name, place) for name in CURVES if name in document}
    gait = Gait(**texts, **numbers, strides=strides, **curves)  # type: ignore[arg-type]  # required numbers are there
    # A file that is well formed may still have a reversed sign or a wrong zero.
    series = {name: curve.values_at(np.linspace(0.0, 1.0, 101)) for name, curve in gait.curves.items()}
    check_plausible(MeanStride(dict.fromkeys(series, place), series, gait.stance_share, gait.stride_time))
    return gait


def _curve(table: dict[str, Any], name: str, file: str) -> GaitCurve:
    def si(value: float) -> float:
        return to_si(float(value), plain_unit(table["unit"]), plain_unit(CURVES[name]))

    # The layout has each list by itself; that both agree is said here.
    with refused_as(DataError, f"{file}: {name}", DataError):
        return GaitCurve(
            si(table["mean"]),
            tuple(map(si, table["cosine"])),
            tuple(map(si, table["sine"])),
            si(table.get("deviation", 0.0)),
        )


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a gait file."""
    return schema_of("ppafo gait", declared)


_FILE = TomlKind("gait", "gait", resources.files("ppafo") / "gait" / "normative", DataError)


def list_gaits() -> tuple[str, ...]:
    """Return the names of the gaits included in the package.

    >>> import ppafo
    >>> ppafo.list_gaits()
    ('falisse2019-subject1',)
    """
    return _FILE.names()


@checked
def load_gait(gait: str | Path = NORMATIVE) -> Gait:
    """Return a gait by its name in the package or by the path of a gait file (TOML), in SI units.

    Raises DataError if the gait cannot be used.

    >>> import ppafo
    >>> gait = ppafo.load_gait("falisse2019-subject1")
    >>> print(f"{gait.stride_time:.3f} s at {gait.walking_speed:.2f} m/s")
    1.038 s at 1.33 m/s
    """
    return parse_gait(_FILE.read(gait), str(gait))


WRITTEN_UNITS: dict[str, str] = {"rad": "deg"}
"""Units of curves in a gait file by SI unit: degrees for angles; every other curve is in its SI unit."""


def gait_toml(gait: Gait) -> str:
    """Return a gait as the text of a gait file; reading the file gives the same gait, with angles rounded."""
    lines = ["schema_version = 1"]
    texts = {"name": gait.name, "title": gait.title, "origin": gait.origin, "source": gait.source, "notes": gait.notes}
    lines += [f"{key} = {value_text(value)}" for key, value in texts.items() if value]
    section = ""
    for path, (name, quantity) in _NUMBERS.items():
        table, _, key = path.partition(".")
        lines += [] if table == section else ["", f"[{table}]"]
        section = table
        value = getattr(gait, name)
        if quantity.whole:
            lines.append(f"{key} = {value}")
        elif value is not None and value != quantity.default:
            lines.append(f'{key} = "{f"{value!r} {quantity.unit}".rstrip()}"')
    for name, curve in gait.curves.items():
        si_unit = CURVES[name]
        lines += ["", f"[{name}]", f"unit = {value_text(WRITTEN_UNITS.get(si_unit, si_unit))}"]
        lines.append(f"mean = {_number_text(curve.mean, si_unit)}")
        for key, values in (("cosine", curve.cosines), ("sine", curve.sines)):
            lines.append(f"{key} = [{', '.join(_number_text(value, si_unit) for value in values)}]")
        lines.append(f"deviation = {_number_text(curve.deviation, si_unit)}")
    return "\n".join(lines) + "\n"


def _number_text(value: float, si_unit: str) -> str:
    """Return a coefficient [SI] as text, in the unit used for its curve in a gait file."""
    unit = WRITTEN_UNITS.get(si_unit, si_unit)
    return repr(float(f"{from_si(value, plain_unit(unit), plain_unit(si_unit)):.{_DIGITS}g}"))
