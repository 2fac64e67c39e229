"""Wearer files: gains of reflexes, strengths of muscles and how the gains were found; and the wearer that they make."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, QUANTITY, make_schema, optional, quote, read_model, table
from ppafo.documents.toml_text import TomlKind, beside
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.units import parse_quantity
from ppafo.wearer.model.reflexes import Gains
from ppafo.wearer.model.walker import Fibres, Muscles, Wearer
from ppafo.wearer.published import published_wearer

NOT_PUBLISHED = ("soleus_stretch", "gastrocnemius_stretch")
"""Gains that a file may leave out: they are 0 but in a spastic leg."""

IN_RADIANS = ("knee_stop_angle", "lean_reference")
"""Gains that are angles."""

LARGEST_GAINS = {name: 4.0 if name in IN_RADIANS else 100.0 for name in Gains._fields}
SLOWEST_START, FASTEST_START = 0.5, 2.0
"""Speeds [m/s] with which a walk may begin."""

PUBLISHED = "geyer-herr"
"""The wearer that is taken where none is named."""

_FILE = TomlKind("wearer", "wearer", resources.files("ppafo.wearer") / "files", DataError)


@dataclass(frozen=True)
class WearerFile:
    """A neuromuscular gait model: name, title in one line, source, notes, start speed [m/s], origin of the gains.

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
    number = Annotated[float, Field(allow_inf_nan=False)]
    gains = {name: Annotated[number, Field(ge=0.0, le=largest)] for name, largest in LARGEST_GAINS.items()}
    strength = Annotated[number, Field(ge=0.0, le=3.0)]
    text = Annotated[str, Field(min_length=1)]
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
                table("GainsOfLeg", {name: optional(gain, "gain of this leg alone") for name, gain in gains.items()}),
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
                Annotated[str, Field(pattern=QUANTITY)],
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
                        for name, gain in gains.items()
                    },
                ),
                Field(
                    default_factory=dict,
                    description="gains of the reflexes: forces in largest forces, lengths in optimum lengths, rad",
                ),
            ),
            "based_on": optional(
                text, "wearer, by name or file, whose gains these are, instead of [gains] and [found]"
            ),
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
    folder = Path() if str(name_or_path) in list_wearers() else Path(name_or_path).parent
    base = _base(document, file, folder)
    speed = _number(document, "start_speed", "m/s", SLOWEST_START, FASTEST_START, file)
    left, right = (_leg(document, side) for side in ("left", "right"))
    left_gains, right_gains = (
        # The later replaces the earlier: published, the wearer's on whom it is based, of that one's leg, of this one's.
        {**dict.fromkeys(NOT_PUBLISHED, 0.0), **base["gains"], **_leg(base, side)["gains"], **leg["gains"]}
        for side, leg in (("left", left), ("right", right))
    )
    return WearerFile(
        name=document["name"],
        title=document.get("title", ""),
        source=document["source"],
        notes=document.get("notes", ""),
        speed=speed,
        found=_how_found(base["found"]),
        left_gains=Gains(**left_gains),
        right_gains=Gains(**right_gains),
        left_strengths=left["strength"],
        right_strengths=right["strength"],
        left_quickness=left.get("quickness", 1.0),
        right_quickness=right.get("quickness", 1.0),
        left_ankle_stiffness=_number(left, "ankle_stiffness", "N m/rad", 0.0, 500.0, file),
        right_ankle_stiffness=_number(right, "ankle_stiffness", "N m/rad", 0.0, 500.0, file),
    )


def _leg(document: Mapping[str, Any], side: str) -> dict[str, Any]:
    """In what a leg differs: what both do, and what this one does."""
    both, own = document.get("both", {}), document.get(side, {})
    return {**both, **own, **{name: {**both.get(name, {}), **own.get(name, {})} for name in ("strength", "gains")}}


def _base(document: dict[str, Any], file: str, folder: Path) -> dict[str, Any]:
    """The document that has the gains: this one, or the document of the wearer on whom it is based."""
    given = [key for key in ("gains", "found", "based_on") if key in document]
    if given == ["gains", "found"]:
        return document
    if given != ["based_on"]:
        raise DataError(f"{file}: give [gains] and [found], or based_on alone with the name of a wearer")
    named = document["based_on"]
    with refused_as(DataError, f"{file}: based_on = {quote(named)}", DataError):
        model, other = read_model(_FILE, wearer_file(), beside(named, folder, list_wearers()))
        base: dict[str, Any] = model.model_dump(exclude_unset=True)
        if "gains" not in base or "found" not in base:
            raise DataError(f"'{other}' has no gains of its own")
    return base


def _number(table: Mapping[str, Any], key: str, unit: str, least: float, most: float, file: str) -> float:
    """A quantity of a table in SI, 0 where it is missing."""
    text = table.get(key, f"0 {unit}")
    with refused_as(DataError, f"{file}: {key} = {quote(text)}", UnitError):
        value = parse_quantity(text, unit)
    if not least <= value <= most:
        raise DataError(f"{file}: {key} = {quote(text)}: must be at least {least:g} and at most {most:g} {unit}")
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
