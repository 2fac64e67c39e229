"""Gait files: layout, conversion to a ``Gait``, and conversion of a gait to the text of a file."""

import functools
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.arguments import checked
from ppafo.documents.models import SchemaVersion, make_schema, optional, table, validate
from ppafo.documents.problems import NAME, QUANTITY
from ppafo.documents.toml_text import TomlKind, label, value_text
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.gait.gait import CURVES, REQUIRED, Gait, GaitCurve, Origin, plain_unit
from ppafo.gait.plausible import check_gait
from ppafo.units import from_si, parse_quantity, to_si

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
_LIMITS = {
    "subject.body_mass": ("kg", 1.0, 500.0),
    "subject.stature": ("m", 0.5, 2.5),
    "subject.walking_speed": ("m/s", 0.05, 4.0),
    "subject.recorded_speed": ("m/s", 0.05, 4.0),
    "stride.time": ("s", 0.3, 5.0),
    "stride.time_deviation": ("s", 0.0, 2.0),
    "stride.stance_share": ("", 0.2, 0.95),
    "stride.stance_share_deviation": ("", 0.0, 0.5),
}
"""Unit, lowest and highest value of the numbers in a gait file; wide limits that exclude only typing errors."""


@functools.cache
def gait_file() -> type[BaseModel]:
    """Return the Pydantic model of a gait file."""
    text = Annotated[str, Field(pattern=QUANTITY)]
    number = Annotated[float, Field(allow_inf_nan=False)]
    series = Annotated[list[number], Field(min_length=1, max_length=_MAXIMUM_HARMONICS)]
    subject = {
        "body_mass": (text, Field(description="mass of the wearer, such as '62 kg'")),
        "stature": optional(text, "height of the wearer, such as '1.75 m', where it is known"),
        "walking_speed": optional(text, "speed of this gait, such as '1.33 m/s'"),
        "recorded_speed": optional(text, "speed at which the curves were recorded, where it is another one"),
    }
    stride = {
        "time": (
            text,
            Field(description="stride time, from one heel strike to the next of the same foot, such as '1.04 s'"),
        ),
        "time_deviation": optional(text, "its standard deviation between strides"),
        "stance_share": (text, Field(description="fraction of the stride until toe-off, such as '62 percent'")),
        "stance_share_deviation": optional(text, "its standard deviation between strides"),
        "count": (Annotated[int, Field(ge=0)], Field(0, description="number of strides behind the curves; 0: unknown")),
    }
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME, max_length=100)),
        "title": (str, Field("", description="one line: who walks, and how")),
        "origin": (
            Origin,
            Field(
                description="imported: from a file that does not state its origin; synthetic: made by a model, not "
                "recorded from a person"
            ),
        ),
        "source": (Annotated[str, Field(min_length=1)], Field(description="where the numbers come from")),
        "notes": (str, Field("", description="further remarks")),
        "subject": (table("Subject", subject), Field(description="the wearer")),
        "stride": (table("Stride", stride), Field(description="times of the stride")),
    }
    for name, unit in CURVES.items():
        # Only angles have two units; every other curve has the one of its SI quantity.
        units: Any = Literal["deg", "rad"] if unit == "rad" else Literal[unit]
        columns = {
            "unit": (units, Field(description="unit of every number of this curve")),
            "mean": (number, Field(description="mean over the stride")),
            "cosine": (series, Field(description="amplitudes of the cosines, first harmonic first")),
            "sine": (series, Field(description="amplitudes of the sines, as many as of the cosines")),
            "deviation": (
                Annotated[number, Field(ge=0.0)],
                Field(0.0, description="standard deviation between strides, root mean square over the stride"),
            ),
        }
        curve = table("".join(part.capitalize() for part in name.split("_")), columns)
        required = (curve, Field(description=_SUMMARIES[name]))
        fields[name] = required if name in REQUIRED else optional(curve, _SUMMARIES[name])
    return table("GaitFile", fields)


def gait_of(document: dict[str, Any], file: str) -> Gait:
    """Return the gait in a parsed gait file; ``file`` is its name in messages.

    Raises DataError if the document is not a valid gait.
    """
    validate(gait_file(), document, file, DataError)
    numbers = {path: _number(document, path, file) for path in _LIMITS}
    curves: dict[str, Any] = {name: _curve(document[name], name, file) for name in CURVES if name in document}
    # Required by the schema already: this tells the type checker.
    if numbers["stride.time"] is None or numbers["stride.stance_share"] is None or numbers["subject.body_mass"] is None:
        raise DataError(f"{file}: [subject] and [stride] are incomplete; import the gait again")
    return Gait(
        name=document["name"],
        title=document.get("title", ""),
        origin=document["origin"],
        source=document["source"],
        body_mass=numbers["subject.body_mass"],
        stature=numbers["subject.stature"],
        walking_speed=numbers["subject.walking_speed"],
        recorded_speed=numbers["subject.recorded_speed"],
        stride_time=numbers["stride.time"],
        stance_share=numbers["stride.stance_share"],
        stride_time_deviation=numbers["stride.time_deviation"] or 0.0,
        stance_share_deviation=numbers["stride.stance_share_deviation"] or 0.0,
        strides=document["stride"].get("count", 0),
        notes=document.get("notes", ""),
        **curves,
    )


def _number(document: dict[str, Any], path: str, file: str) -> float | None:
    section, _, key = path.partition(".")
    text = document[section].get(key)
    if text is None:
        return None
    unit, low, high = _LIMITS[path]
    with refused_as(DataError, f"{file}: {path} = {text!r}", UnitError):
        value = parse_quantity(text, unit)
    if not low <= value <= high:
        raise DataError(f"{file}: {path} = {text!r}: must be from {low:g} to {high:g} {unit}".strip())
    return value


def _curve(table: dict[str, Any], name: str, file: str) -> GaitCurve:
    # The schema checks each list by itself; that both agree is said here.
    if len(table["cosine"]) != len(table["sine"]):
        counts = f"{len(table['cosine'])} numbers in cosine and {len(table['sine'])} in sine"
        raise DataError(f"{file}: {name} has {counts}; both lists must have the same length")

    def si(value: float) -> float:
        return to_si(float(value), plain_unit(table["unit"]), plain_unit(CURVES[name]))

    return GaitCurve(
        si(table["mean"]),
        tuple(map(si, table["cosine"])),
        tuple(map(si, table["sine"])),
        si(table.get("deviation", 0.0)),
    )


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a gait file."""
    return make_schema(gait_file(), "ppafo gait")


NORMATIVE = "falisse2019-subject1"
"""Name of the default gait."""

_FILE = TomlKind(
    "gait",
    "gait",
    resources.files("ppafo") / "gait" / "normative",
    DataError,
    made=", which 'ppafo gait import' makes from a recording",
)


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


def parse_gait(content: bytes, file: str) -> Gait:
    """Return the gait in the content of a gait file; ``file`` names it in messages. Raises DataError if invalid."""
    gait = gait_of(_FILE.parse(content, label(file)), label(file))
    # A file that is well formed may still have a reversed sign or a wrong zero.
    check_gait(gait, label(file))
    return gait


WRITTEN_UNITS: dict[str, str] = {"rad": "deg"}
"""Units of curves in a gait file by SI unit: degrees for angles; every other curve is in its SI unit."""

_DIGITS = 12
"""Significant digits of a written coefficient; conversion from radians to degrees adds noise beyond these."""


def gait_toml(gait: Gait) -> str:
    """Return a gait as the text of a gait file; reading the file gives the same gait, with angles rounded."""
    lines = ["schema_version = 1"]
    texts = {"name": gait.name, "title": gait.title, "origin": gait.origin, "source": gait.source, "notes": gait.notes}
    lines += [f"{key} = {value_text(value)}" for key, value in texts.items() if value]
    lines += ["", "[subject]", f'body_mass = "{gait.body_mass!r} kg"']
    known = {"stature": "m", "walking_speed": "m/s", "recorded_speed": "m/s"}
    lines += [f'{key} = "{value!r} {unit}"' for key, unit in known.items() if (value := getattr(gait, key)) is not None]
    lines += ["", "[stride]", f'time = "{gait.stride_time!r} s"', f'stance_share = "{gait.stance_share!r}"']
    if gait.stride_time_deviation:
        lines.append(f'time_deviation = "{gait.stride_time_deviation!r} s"')
    if gait.stance_share_deviation:
        lines.append(f'stance_share_deviation = "{gait.stance_share_deviation!r}"')
    lines.append(f"count = {gait.strides}")
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
