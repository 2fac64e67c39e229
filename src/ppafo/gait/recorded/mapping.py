"""Gait maps: assignment of the columns of recorded files to the curves of a gait, with unit and sign.

A map is a TOML file; without one, the file format provides a default. A term is the name of a column; a leading ``-``
subtracts the column.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ppafo.documents.models import SchemaVersion, StrictTable, Text, make_schema, read_model
from ppafo.documents.toml_text import NAME, TomlKind
from ppafo.errors import DataError, UnitError, raise_noted, refused_as
from ppafo.gait.gait import BODY_MASSES, SPEEDS, STATURES
from ppafo.gait.recorded.table import LONGEST_FILLED
from ppafo.units import parse_quantity
from ppafo.wording import argument_text

_FILE = TomlKind("gait map", "gait-map", resources.files("ppafo.gait.recorded"), DataError)
_Terms = Annotated[
    tuple[Text, ...], Field(strict=False, min_length=1, description="columns to add; '-' before one subtracts it")
]
_Unit = Annotated[Text | None, Field(description="unit of the columns, where the file does not state it")]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Vertical = Literal["x", "y", "z"]
_Flexion = Literal["plantarflexion", "dorsiflexion"]


class FrameClock(StrictTable):
    """Entry of a gait map for the clock of files that count frames or samples and have no time column."""

    rate: Annotated[Text, Field(description="frames per second, such as '100 Hz'")]

    def frequency(self) -> float:
        """Return the rate [Hz]; raises DataError for another unit, or a rate that is not above 0."""
        with refused_as(DataError, f"time.rate = {self.rate!r}", UnitError):
            rate = parse_quantity(self.rate, "1/s")
            if rate <= 0.0:
                raise UnitError("must be above 0 Hz")
        return rate


class ShankMap(StrictTable):
    """Entry of a gait map for the shank angle: a sum of columns, or two markers and the laboratory axes."""

    terms: _Terms | None = None
    unit: _Unit = None
    positive: Annotated[Literal["ankle_in_front", "ankle_behind"], Field(description="which lean is positive")] = (
        "ankle_in_front"
    )
    knee: Annotated[Text | None, Field(description="marker at the knee, instead of terms")] = None
    ankle: Annotated[Text | None, Field(description="marker at the ankle")] = None
    forward: Annotated[Axis, Field(description="axis along the walk")] = "x"
    vertical: Annotated[Vertical, Field(description="axis upwards")] = "z"

    @model_validator(mode="after")
    def _one_way(self) -> "ShankMap":
        if (self.terms is None) == (self.knee is None) or (self.knee is None) != (self.ankle is None):
            raise ValueError("give either terms, or both knee and ankle")
        return self


class AngleMap(StrictTable):
    """Entry of a gait map for the ankle angle: a sum of columns, or two foot markers relative to the shank.

    With markers, the zero is the flat foot; ``neutral`` is subtracted in both cases.
    """

    terms: _Terms | None = None
    heel: Annotated[Text | None, Field(description="marker at the heel, instead of terms")] = None
    toe: Annotated[Text | None, Field(description="marker at the toes")] = None
    forward: Annotated[Axis, Field(description="axis along the walk, with markers; default: the shank's")] = "x"
    vertical: Annotated[Vertical, Field(description="axis upwards, with markers; default: the shank's")] = "z"
    unit: _Unit = None
    positive: Annotated[_Flexion, Field(description="which motion is positive")]
    neutral: Annotated[
        Text, Field(description="the reading of the file when the foot is perpendicular to the shank")
    ] = "0 deg"

    @model_validator(mode="after")
    def _one_way(self) -> "AngleMap":
        if (self.terms is None) == (self.heel is None) or (self.heel is None) != (self.toe is None):
            raise ValueError("give either terms, or both heel and toe")
        return self

    def sign_and_neutral(self) -> tuple[float, float]:
        """Return 1 if plantarflexion is positive, else -1, and ``neutral`` [rad]; raises DataError for its unit."""
        with refused_as(DataError, f"ankle_angle.neutral = {self.neutral!r}", UnitError):
            neutral = parse_quantity(self.neutral, "rad")
        return 1.0 if self.positive == "plantarflexion" else -1.0, neutral


class MomentMap(StrictTable):
    """Entry of a gait map for the ankle moment, in N m or N m/kg."""

    terms: _Terms
    unit: _Unit = None
    positive: Annotated[_Flexion, Field(description="which internal moment is positive")]


class ForceMap(StrictTable):
    """Entry of a gait map for the vertical ground reaction on the foot, in N, or in body weights with the unit '-'."""

    terms: _Terms
    unit: _Unit = None
    positive: Annotated[Literal["up", "down"], Field(description="which force is positive")] = "up"


class PressureMap(StrictTable):
    """Entry of a gait map for the centre of pressure along the foot, from the ankle."""

    terms: _Terms
    unit: _Unit = None
    positive: Annotated[Literal["forward", "backward"], Field(description="which direction is positive")] = "forward"


class KneeMap(StrictTable):
    """Entry of a gait map for the knee: position [m] or acceleration [m/s^2], or hip position and lean of the thigh."""

    forward: _Terms
    up: _Terms
    unit: _Unit = None
    thigh: Annotated[
        _Terms | None,
        Field(description="lean of the thigh, above 0 with the knee in front; forward and up then are of the hip"),
    ] = None
    thigh_unit: Annotated[Text | None, Field(description="unit of the lean, where the file does not state it")] = None
    thigh_length: Annotated[
        Text | None, Field(description="hip to knee, such as '0.40 m'; default: a fraction of the stature")
    ] = None

    @model_validator(mode="after")
    def _thigh_has_a_lean(self) -> "KneeMap":
        if self.thigh is None and (self.thigh_length is not None or self.thigh_unit is not None):
            raise ValueError("thigh_length and thigh_unit are given without thigh; omit them or give thigh")
        return self


_OF_THE_FORM = "default: the columns and sign of the file format"


class GaitMap(StrictTable):
    """Gait map: meaning of the columns of recorded files.

    A curve that is not listed has the columns, signs and units of the file format.
    """

    schema_version: SchemaVersion = 1
    time: FrameClock | None = Field(None, description="sampling rate of files without a time column")
    shank_angle: ShankMap = Field(default_factory=lambda: ShankMap(terms=("shank_angle",)), description=_OF_THE_FORM)
    ankle_angle: AngleMap = Field(
        default_factory=lambda: AngleMap(terms=("ankle_angle",), positive="plantarflexion", neutral="90 deg"),
        description=_OF_THE_FORM,
    )
    ankle_moment: MomentMap | None = Field(None, description=_OF_THE_FORM)
    vertical_force: ForceMap | None = Field(None, description=_OF_THE_FORM)
    centre_of_pressure: PressureMap | None = Field(None, description=_OF_THE_FORM)
    knee: KneeMap | None = Field(None, description=_OF_THE_FORM)

    @model_validator(mode="before")
    @classmethod
    def _one_laboratory(cls, tables: Any) -> Any:
        # One walk has one forward axis: it is stated once, with the shank.
        shank, ankle = (_stated(tables.get(name)) for name in ("shank_angle", "ankle_angle"))
        axes = {axis: shank[axis] for axis in ("forward", "vertical") if axis in shank}
        return {**tables, "ankle_angle": {**axes, **ankle}} if axes and ankle else tables


def _stated(table: Any) -> Mapping[str, Any]:
    """Return the keys that the map of a curve states."""
    given = table.model_dump(exclude_unset=True) if isinstance(table, StrictTable) else table
    return given if isinstance(given, Mapping) else {}


CURVES = tuple(name for name in GaitMap.model_fields if name not in ("schema_version", "time"))
"""Names of the curves in a gait map."""

_UNIT_OF_HEADER = re.compile(r"\s+\[[^\[\]]*\]$")


def column_names(mapped: object) -> tuple[str, ...]:
    """Return the columns named in the map of one curve, with a leading minus for subtracted columns."""
    if isinstance(mapped, KneeMap):
        return (*mapped.forward, *mapped.up, *(mapped.thigh or ()))
    if isinstance(mapped, ShankMap | AngleMap) and mapped.terms is None:
        markers = (mapped.knee, mapped.ankle) if isinstance(mapped, ShankMap) else (mapped.heel, mapped.toe)
        axes = mapped.forward.removeprefix("-"), mapped.vertical
        return tuple(f"{marker}.{axis}" for marker in markers for axis in axes)
    terms: tuple[str, ...] = getattr(mapped, "terms")  # noqa: B009  # every other map has them, by its own class
    # As in the header of a CSV file, whose units are no part of the names.
    return tuple(_UNIT_OF_HEADER.sub("", term) for term in terms)


def unsaid_axes(columns: GaitMap) -> list[str]:
    """Return remarks on assumed axes, for markers whose map does not state the forward or the upward axis."""
    axes = []
    for name, mapped in (("shank_angle", columns.shank_angle), ("ankle_angle", columns.ankle_angle)):
        unsaid = [key for key in ("forward", "vertical") if key not in mapped.model_fields_set]
        if mapped.terms is None and unsaid:
            assumed_axes = " and ".join(f'{key} = "{getattr(mapped, key)}"' for key in unsaid)
            verb = "is" if len(unsaid) == 1 else "are"
            axes.append(f"the gait map does not give {' and '.join(unsaid)} of {name}: {assumed_axes} {verb} assumed")
    return axes


Side = Literal["right", "left"]


def package_map() -> GaitMap:
    """Return the gait map of a CSV file with the column names and signs of the package."""
    return GaitMap(
        ankle_moment=MomentMap(terms=("ankle_moment",), positive="plantarflexion"),
        vertical_force=ForceMap(terms=("vertical_force",)),
        centre_of_pressure=PressureMap(terms=("centre_of_pressure",)),
        knee=KneeMap(forward=("knee_forward",), up=("knee_up",)),
    )


def opensim_map(side: Side) -> GaitMap:
    """Return the map of OpenSim's gait models: knee negative in flexion as in gait2392, ankle positive in dorsiflexion.

    The shank angle is the sum of pelvis tilt, hip flexion and knee flexion in the sagittal plane. The lean of the thigh
    is computed in the same way, with the hip at the origin of the pelvis.
    """
    foot = side[0]
    force = "ground_force_vy" if side == "right" else "l_ground_force_vy"
    return GaitMap(
        shank_angle=ShankMap(terms=("pelvis_tilt", f"hip_flexion_{foot}", f"knee_angle_{foot}")),
        ankle_angle=AngleMap(terms=(f"ankle_angle_{foot}",), positive="dorsiflexion"),
        ankle_moment=MomentMap(terms=(f"ankle_angle_{foot}_moment",), positive="dorsiflexion"),
        vertical_force=ForceMap(terms=(force,)),
        knee=KneeMap(forward=("pelvis_tx",), up=("pelvis_ty",), thigh=("pelvis_tilt", f"hip_flexion_{foot}")),
    )


def load_map(path: str | Path) -> GaitMap:
    """Load a gait map from a TOML file; raises DataError if it cannot be used."""
    loaded = read_model(_FILE, GaitMap, path)[0]
    if loaded.model_fields_set <= {"schema_version"}:
        raise DataError(f"{path}: the gait map has no curve, such as [ankle_angle]")
    return loaded


json_schema = partial(make_schema, GaitMap, "ppafo gait map")
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
    raise_noted([DataError(text) for text in wrong])
