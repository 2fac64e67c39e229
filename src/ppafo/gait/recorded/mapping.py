"""Gait maps: assignment of the columns of recorded files to the curves of a gait, with unit and sign.

A map is a TOML file; without one, the file format provides a default. A term is the name of a column; a leading ``-``
subtracts the column.
"""

import re
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import resources
from numbers import Real
from pathlib import Path
from typing import Annotated, Literal, cast, get_args

from ppafo.documents.toml_text import NAME, TomlKind
from ppafo.errors import ArgumentError, DataError, Faults, UnitError, refused_as
from ppafo.gait.gait import BODY_MASSES, SPEEDS, STATURES
from ppafo.gait.recorded.table import LONGEST_FILLED
from ppafo.parameters.declared import Many, Words
from ppafo.parameters.records import SchemaVersion, checked_record, keyed, record_schema
from ppafo.units import parse_quantity
from ppafo.wording import argument_text

FILE = TomlKind("gait map", "gait-map", resources.files("ppafo.gait.recorded"), DataError)
_Terms = Annotated[tuple[str, ...], Many(Words("", True), "columns to add; '-' before one subtracts it", least=1)]
_Unit = Annotated[str | None, Words("unit of the columns, where the file does not state it")]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Vertical = Literal["x", "y", "z"]
_Flexion = Literal["plantarflexion", "dorsiflexion"]


@dataclass(frozen=True, slots=True)
class FrameClock:
    """Entry of a gait map for the clock of files that count frames or samples and have no time column."""

    rate: str = keyed("frames per second, such as '100 Hz'")

    def frequency(self) -> float:
        """Return the rate [Hz]; raises DataError for another unit, or a rate that is not above 0."""
        with refused_as(DataError, f"time.rate = {self.rate!r}", UnitError):
            rate = parse_quantity(self.rate, "1/s")
            if rate <= 0.0:
                raise UnitError("must be above 0 Hz")
        return rate


@dataclass(frozen=True, slots=True, kw_only=True)
class LaboratoryAxes:
    """Keys of the entry of an angle for the axes of its markers, None where it does not state them."""

    forward: Axis | None = keyed("axis along the walk, with markers; default: the shank's, else x", None)
    vertical: Vertical | None = keyed("axis upwards, with markers; default: the shank's, else z", None)

    @property
    def axes(self) -> tuple[Axis, Vertical]:
        """Axes along the walk and upwards."""
        return self.forward or "x", self.vertical or "z"


@dataclass(frozen=True, slots=True, kw_only=True)
class ShankMap(LaboratoryAxes):
    """Entry of a gait map for the shank angle: a sum of columns, or two markers and the laboratory axes."""

    terms: _Terms | None = None
    unit: _Unit = None
    positive: Literal["ankle_in_front", "ankle_behind"] = keyed("which lean is positive", "ankle_in_front")
    knee: str | None = keyed("marker at the knee, instead of terms", None)
    ankle: str | None = keyed("marker at the ankle", None)


@dataclass(frozen=True, slots=True, kw_only=True)
class AngleMap(LaboratoryAxes):
    """Entry of a gait map for the ankle angle: a sum of columns, or two foot markers relative to the shank.

    With markers, the zero is the flat foot; ``neutral`` is subtracted in both cases.
    """

    terms: _Terms | None = None
    heel: str | None = keyed("marker at the heel, instead of terms", None)
    toe: str | None = keyed("marker at the toes", None)
    unit: _Unit = None
    positive: _Flexion = keyed("which motion is positive")
    neutral: str = keyed("the reading of the file when the foot is perpendicular to the shank", "0 deg")

    def sign_and_neutral(self) -> tuple[float, float]:
        """Return 1 if plantarflexion is positive, else -1, and ``neutral`` [rad]; raises DataError for its unit."""
        with refused_as(DataError, f"ankle_angle.neutral = {self.neutral!r}", UnitError):
            neutral = parse_quantity(self.neutral, "rad")
        return 1.0 if self.positive == "plantarflexion" else -1.0, neutral


@dataclass(frozen=True, slots=True, kw_only=True)
class MomentMap:
    """Entry of a gait map for the ankle moment, in N m or N m/kg."""

    terms: _Terms
    unit: _Unit = None
    positive: _Flexion = keyed("which internal moment is positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceMap:
    """Entry of a gait map for the vertical ground reaction on the foot, in N, or in body weights with the unit '-'."""

    terms: _Terms
    unit: _Unit = None
    positive: Literal["up", "down"] = keyed("which force is positive", "up")


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureMap:
    """Entry of a gait map for the centre of pressure along the foot, from the ankle."""

    terms: _Terms
    unit: _Unit = None
    positive: Literal["forward", "backward"] = keyed("which direction is positive", "forward")


@dataclass(frozen=True, slots=True, kw_only=True)
class KneeMap:
    """Entry of a gait map for the knee: position [m] or acceleration [m/s^2], or hip position and lean of the thigh."""

    forward: _Terms
    up: _Terms
    unit: _Unit = None
    thigh: _Terms | None = keyed(
        "lean of the thigh, above 0 with the knee in front; forward and up then are of the hip", None
    )
    thigh_unit: str | None = keyed("unit of the lean, where the file does not state it", None)
    thigh_length: str | None = keyed("hip to knee, such as '0.40 m'; default: a fraction of the stature", None)


_OF_THE_FORM = Words("default: the columns and sign of the file format")
_SHANK = ShankMap(terms=("shank_angle",))
_ANKLE = AngleMap(terms=("ankle_angle",), positive="plantarflexion", neutral="90 deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitMap:
    """Gait map: meaning of the columns of recorded files.

    A curve that is not listed has the columns, signs and units of the file format.
    """

    schema_version: SchemaVersion = 1
    time: FrameClock | None = keyed("sampling rate of files without a time column", None)
    shank_angle: ShankMap = keyed(_OF_THE_FORM, _SHANK)
    ankle_angle: AngleMap = keyed(_OF_THE_FORM, _ANKLE)
    ankle_moment: MomentMap | None = keyed(_OF_THE_FORM, None)
    vertical_force: ForceMap | None = keyed(_OF_THE_FORM, None)
    centre_of_pressure: PressureMap | None = keyed(_OF_THE_FORM, None)
    knee: KneeMap | None = keyed(_OF_THE_FORM, None)

    def __post_init__(self) -> None:
        """Take the axes that the ankle does not state from the shank: one walk has one forward axis."""
        shank = self.shank_angle
        ankle = self.ankle_angle
        if ankle is not _ANKLE:
            own = replace(ankle, forward=ankle.forward or shank.forward, vertical=ankle.vertical or shank.vertical)
            object.__setattr__(self, "ankle_angle", own)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the curves that the map states."""
        return tuple(
            item.name for item in fields(self) if item.name in CURVES and getattr(self, item.name) is not item.default
        )


CURVES = tuple(item.name for item in fields(GaitMap) if item.name not in ("schema_version", "time"))
"""Names of the curves in a gait map."""

_UNIT_OF_HEADER = re.compile(r"\s+\[[^\[\]]*\]$")


def column_names(mapped: object) -> tuple[str, ...]:
    """Return the columns named in the map of one curve, with a leading minus for subtracted columns."""
    if isinstance(mapped, KneeMap):
        return (*mapped.forward, *mapped.up, *(mapped.thigh or ()))
    if isinstance(mapped, ShankMap | AngleMap) and mapped.terms is None:
        markers = (mapped.knee, mapped.ankle) if isinstance(mapped, ShankMap) else (mapped.heel, mapped.toe)
        return tuple(f"{marker}.{axis.removeprefix('-')}" for marker in markers for axis in mapped.axes)
    terms: tuple[str, ...] = getattr(mapped, "terms")  # noqa: B009  # every other map has them, by its own class
    # As in the header of a CSV file, whose units are no part of the names.
    return tuple(_UNIT_OF_HEADER.sub("", term) for term in terms)


def unsigned_names(mapped: object) -> list[str]:
    """Return the columns named in the map of one curve, without their signs; none for a curve without a map."""
    return [] if mapped is None else [column.removeprefix("-") for column in column_names(mapped)]


def unsaid_axes(columns: GaitMap) -> list[str]:
    """Return remarks on assumed axes, for markers whose map does not state the forward or the upward axis."""
    return [
        f"{name}.{key} is {axis!r}, assumed: the gait map does not give it"
        for name, mapped in (("shank_angle", columns.shank_angle), ("ankle_angle", columns.ankle_angle))
        for key, axis in zip(("forward", "vertical"), mapped.axes, strict=True)
        if mapped.terms is None and getattr(mapped, key) is None
    ]


Side = Literal["right", "left"]


def package_map() -> GaitMap:
    """Return the gait map of a CSV file with the column names and signs of the package."""
    return GaitMap(
        ankle_moment=MomentMap(terms=("ankle_moment",), positive="plantarflexion"),
        vertical_force=ForceMap(terms=("vertical_force",)),
        centre_of_pressure=PressureMap(terms=("centre_of_pressure",)),
        knee=KneeMap(forward=("knee_forward",), up=("knee_up",)),
    )


def load_map(path: str | Path) -> GaitMap:
    """Load a gait map from a TOML file; raises DataError if it cannot be used."""
    source = FILE.load(path)
    loaded = checked_record(GaitMap, source)
    wrong = []
    shank = loaded.shank_angle
    ankle = loaded.ankle_angle
    knee = loaded.knee
    for name, terms, markers in (
        ("shank_angle", shank.terms, {"knee": shank.knee, "ankle": shank.ankle}),
        ("ankle_angle", ankle.terms, {"heel": ankle.heel, "toe": ankle.toe}),
    ):
        given = [marker for marker in markers.values() if marker is not None]
        if len(given) != (2 if terms is None else 0):
            wrong.append(f"{name}: give either terms, or both {' and '.join(markers)}")
    if knee is not None and knee.thigh is None and (knee.thigh_length is not None or knee.thigh_unit is not None):
        wrong.append("knee: thigh_length and thigh_unit are given without thigh; omit them or give thigh")
    if not loaded.named and loaded.time is None:
        wrong.append("the gait map has no curve, such as [ankle_angle]")
    Faults([DataError(f"{source.label}: {fault}") for fault in wrong]).raise_all()
    return loaded


json_schema = partial(record_schema, GaitMap, "ppafo gait map")
"""JSON Schema of a gait map."""


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """Settings of the import of a gait.

    - ``body_mass``: body mass [kg], None if a file states it
    - ``side``: side of the foot
    - ``columns``: gait map, None for the default of the file format
    - ``walking_speed``: walking speed [m/s]
    - ``low_pass``: cut-off frequency [Hz], None for no filter
    - ``least_strides``: least number of strides; default 2, and 1 overground or for a single cycle
    - ``name``, ``title``: name and title of the gait
    - ``stature``: stature [m], gives the length of the thigh if no map does
    - ``start``, ``end``: limits of the used part of the files [s]
    - ``longest_gap``: longest gap that is filled [s]
    - ``ankle_neutral``: reading [rad] with the foot perpendicular to the shank; it overrides map and convention
    - ``form``: name of the file format, detected if empty
    - ``stride_time``: duration [s] of the mean stride in a file over percent of the stride
    """

    body_mass: float | None = None
    side: Side = "right"
    columns: GaitMap | None = None
    walking_speed: float | None = None
    low_pass: float | None = None
    least_strides: int | None = None
    name: str = "imported-gait"
    title: str = ""
    stature: float | None = None
    start: float | None = None
    end: float | None = None
    longest_gap: float = 0.0
    ankle_neutral: float | None = None
    form: str = ""
    stride_time: float | None = None

    def __post_init__(self) -> None:
        """Raise ArgumentError for a setting of another type, such as a text with a unit in place of a number."""
        for each in fields(self):
            value = getattr(self, each.name)
            kind = cast("type", Real)
            words = "a number in SI units"
            if isinstance(each.default, str):
                kind = str
                words = "a text"
            elif each.name == "columns":
                kind = GaitMap
                words = "a GaitMap"
            if not (isinstance(value, kind) or value is each.default is None):
                raise ArgumentError(f"{each.name}: must be {words}, not {value!r}")
        if self.side not in get_args(Side):
            raise ArgumentError(f"side: must be {' or '.join(get_args(Side))}, not {self.side!r}")


_OPTIONS = {"columns": "--map", "least_strides": "--minimum-strides", "longest_gap": "--fill-gaps"}
"""Options of ``ppafo gait import`` with names different from the settings."""


def setting_text(name: str) -> str:
    """Return a setting as the caller would write it."""
    return argument_text(name, option=_OPTIONS.get(name, ""))


_PLAUSIBLE = {
    "body_mass": (*BODY_MASSES, "kg"),
    "walking_speed": (*SPEEDS, "m/s"),
    "stature": (*STATURES, "m"),
    # Below 1 Hz the gait itself would be removed; usual are 6 Hz.
    "low_pass": (1.0, 1.0e6, "Hz"),
    "longest_gap": (0.0, LONGEST_FILLED, "s"),
    "stride_time": (0.2, 10.0, "s"),
}
"""Limits of the settings of an import."""


def check_settings(settings: ImportSettings) -> None:
    """Raise DataError for implausible settings; the message lists all of them."""
    wrong = [
        f"{name.replace('_', ' ')} {value:g} {unit} is not plausible; allowed is {low:g} to {high:g} {unit}"
        for name, (low, high, unit) in _PLAUSIBLE.items()
        if (value := getattr(settings, name)) is not None and not low <= value <= high
    ]
    if settings.start is not None and settings.end is not None and not settings.start < settings.end:
        wrong.append(f"the start, {settings.start:g} s, must be before the end, {settings.end:g} s")
    if re.fullmatch(NAME, settings.name) is None:
        wrong.append(f"name {settings.name!r} must consist of lower-case letters, digits, '-' and '_'")
    if settings.least_strides is not None and settings.least_strides < 1:
        wrong.append(f"the minimum number of strides must be 1 or more, not {settings.least_strides}")
    Faults([DataError(text) for text in wrong]).raise_all()
