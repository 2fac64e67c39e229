"""Wearer files: gains of reflexes, strengths of muscles and how the gains were found; and the wearer that they make."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, make_schema, optional, read_model, table
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.model.wearer.reflexes import Gains
from ppafo.model.wearer.walker import Fibres, Muscles, Wearer
from ppafo.units import parse_quantity
from ppafo.wearers.published import published_wearer

NOT_PUBLISHED = ("soleus_stretch", "gastrocnemius_stretch")
"""Gains that a file may leave out: they are 0 but in a spastic leg."""

PUBLISHED = "geyer-herr"
"""The wearer that is taken where none is named."""

_FILE = TomlKind("wearer", "wearer", resources.files("ppafo") / "wearers" / "files", DataError)


@dataclass(frozen=True)
class WearerFile:
    """A wearer who reacts: name, one line about him, source, notes, speed at the start [m/s], how the gains were found.

    Gains of both legs in the units of ``Gains``; strengths of the muscles of both legs, 1 healthy, those not named 1;
    their largest velocities as a factor, and the stiffness of the ankles beside muscles [N m/rad].
    """

    name: str
    title: str
    source: str
    notes: str
    speed: float
    found: str
    left_gains: Gains
    right_gains: Gains
    left_strengths: Mapping[str, float]
    right_strengths: Mapping[str, float]
    left_quickness: float = 1.0
    right_quickness: float = 1.0
    left_ankle_stiffness: float = 0.0
    right_ankle_stiffness: float = 0.0


@functools.cache
def wearer_file() -> type[BaseModel]:
    """Return the model of a wearer file."""
    number = Annotated[float, Field(allow_inf_nan=False, strict=False)]
    gain = Annotated[number, Field(ge=0.0, le=100.0)]
    strength = Annotated[number, Field(ge=0.0, le=3.0)]
    text = Annotated[str, Field(min_length=1)]
    names = Gains._fields
    leg = table(
        "Leg",
        {
            "strength": optional(
                table(
                    "Strength",
                    {name: optional(strength, "largest force, of the healthy one") for name in Fibres._fields},
                ),
                "muscles that are weaker or stronger than the published ones, as a factor",
            ),
            "gains": optional(
                table("GainsOfLeg", {name: optional(gain, "gain of this leg alone") for name in names}),
                "gains in which this leg differs",
            ),
            "quickness": optional(
                Annotated[number, Field(ge=0.1, le=3.0)], "largest velocity of all muscles, of the healthy one"
            ),
            "ankle_stiffness": optional(str, "what resists the ankle beside muscles, such as '20 N m/rad'"),
        },
    )
    found = {
        "by": (Literal["publication", "search"], Field(description="where the gains are from")),
        "start": optional(str, "wearer whose gains the search began with"),
        "seed": optional(Annotated[int, Field(ge=0)], "seed of the search"),
        "restart": optional(Annotated[int, Field(ge=1)], "which restart of the search, from 1"),
        "generations": optional(Annotated[int, Field(ge=1)], "generations of the search"),
        "population": optional(Annotated[int, Field(ge=2)], "candidates of a generation"),
        "target_speed": optional(str, "speed that the search aimed at, such as '1.3 m/s'"),
        "objective": optional(str, "what the search made small"),
    }
    return table(
        "WearerFile",
        {
            "schema_version": (Literal[1], Field(description="version of this layout")),
            "name": (str, Field(pattern=NAME, max_length=100)),
            "title": (str, Field("", description="one line: who walks, and how")),
            "source": (text, Field(description="where the numbers come from")),
            "notes": (str, Field("", description="further remarks")),
            "start_speed": (
                Annotated[str, Field(pattern=r"^\s*[+-]?(\d|\.\d)")],
                Field(description="speed of the body at the start, such as '1.3 m/s'"),
            ),
            "found": optional(table("Found", found), "how the gains were found"),
            "gains": (
                table(
                    "GainsOfBoth",
                    {
                        name: optional(gain, "gain of both legs")
                        if name in NOT_PUBLISHED
                        else (gain, Field(description="gain of both legs"))
                        for name in names
                    },
                ),
                Field(
                    default_factory=dict,
                    description="gains of the reflexes: forces in largest forces, lengths in optimum lengths, rad",
                ),
            ),
            "based_on": optional(str, "wearer of the package whose gains these are, instead of [gains] and [found]"),
            "both": optional(leg, "in what both legs differ from the published body"),
            "left": optional(leg, "in what the left leg differs"),
            "right": optional(leg, "in what the right leg differs"),
        },
    )


def list_wearers() -> tuple[str, ...]:
    """Return the names of the wearers that come with the package."""
    return _FILE.names()


def find_wearer(name_or_path: str | Path = PUBLISHED) -> WearerFile:
    """Return a wearer by its name in the package or by the path of a wearer file (TOML).

    DataError where it cannot be used.
    """
    model, file = read_model(_FILE, wearer_file(), name_or_path)
    document = model.model_dump(exclude_unset=True)
    base = _base(document, file)
    gains = {**dict.fromkeys(NOT_PUBLISHED, 0.0), **base["gains"]}
    speed = _number(document, "start_speed", "m/s", 3.0, file)
    left, right = ({**document.get("both", {}), **document.get(side, {})} for side in ("left", "right"))
    return WearerFile(
        name=document["name"],
        title=document.get("title", ""),
        source=document["source"],
        notes=document.get("notes", ""),
        speed=speed,
        found=_how_found(base["found"]),
        left_gains=Gains(**{**gains, **left.get("gains", {})}),
        right_gains=Gains(**{**gains, **right.get("gains", {})}),
        left_strengths=left.get("strength", {}),
        right_strengths=right.get("strength", {}),
        left_quickness=left.get("quickness", 1.0),
        right_quickness=right.get("quickness", 1.0),
        left_ankle_stiffness=_number(left, "ankle_stiffness", "N m/rad", 500.0, file),
        right_ankle_stiffness=_number(right, "ankle_stiffness", "N m/rad", 500.0, file),
    )


def _base(document: dict[str, Any], file: str) -> dict[str, Any]:
    """The document that has the gains: this one, or that of the wearer on whom it is based."""
    given = [key for key in ("gains", "found", "based_on") if key in document]
    if given == ["gains", "found"]:
        return document
    if given != ["based_on"]:
        raise DataError(f"{file}: give [gains] and [found], or based_on alone with the name of a wearer")
    model, other = read_model(_FILE, wearer_file(), document["based_on"])
    base: dict[str, Any] = model.model_dump(exclude_unset=True)
    if "based_on" in base:
        raise DataError(
            f"{file}: based_on = {document['based_on']!r} is not allowed; '{other}' has no gains of its own"
        )
    return base


def _number(table: Mapping[str, Any], key: str, unit: str, largest: float, file: str) -> float:
    """A quantity of a table in SI, 0 where it is missing."""
    text = table.get(key, f"0 {unit}")
    with refused_as(DataError, f"{file}: {key} = {text!r}", UnitError):
        value = parse_quantity(text, unit)
    if not 0.0 <= value <= largest:
        raise DataError(f"{file}: {key} = {text!r} is not allowed; it lies between 0 and {largest:g} {unit}")
    return value


def _how_found(found: dict[str, Any]) -> str:
    """One line on how gains were found."""
    if found["by"] == "publication":
        return "published"
    parts = [
        f"from {found['start']}" if "start" in found else "",
        f"seed {found['seed']}" if "seed" in found else "",
        f"restart {found['restart']}" if "restart" in found else "",
        f"{found['generations']} generations" if "generations" in found else "",
        f"of {found['population']}" if "population" in found else "",
        f"towards {found['target_speed']}" if "target_speed" in found else "",
    ]
    return f"by search: {' '.join(part for part in parts if part)}"


def wearer_of(file: WearerFile) -> Wearer:
    """Return the wearer that a file describes, on the published body."""
    wearer = published_wearer(file.left_gains, file.right_gains)
    left = _quicker(with_strengths(wearer.left, file.left_strengths), file.left_quickness)
    right = _quicker(with_strengths(wearer.right, file.right_strengths), file.right_quickness)
    return wearer._replace(
        left=left._replace(ankle_stiffness=file.left_ankle_stiffness),
        right=right._replace(ankle_stiffness=file.right_ankle_stiffness),
    )


def _quicker(muscles: Muscles, factor: float) -> Muscles:
    """The muscles of a leg with largest velocities times a factor."""
    own: dict[str, Any] = {name: getattr(muscles, name) for name in Fibres._fields}
    return muscles._replace(
        **{name: muscle._replace(velocity=muscle.velocity * factor) for name, muscle in own.items()}
    )


def with_strengths(muscles: Muscles, strengths: Mapping[str, float]) -> Muscles:
    """Return the muscles of a leg with largest forces times these factors, by the names of ``Fibres``."""
    weaker: dict[str, Any] = {name: getattr(muscles, name) for name in strengths}
    return muscles._replace(
        **{name: muscle._replace(force=muscle.force * strengths[name]) for name, muscle in weaker.items()}
    )


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a wearer file."""
    return make_schema(wearer_file(), "ppafo wearer")
