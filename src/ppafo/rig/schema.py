"""The layout of a preset of the rig, built from the declarations, so that a value is declared in one place only."""

from typing import Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import STRICT, make_schema, table
from ppafo.model.declaration import Quantity
from ppafo.rig.declaration import SECTIONS


class PresetValue(BaseModel):
    """A value of the rig, with its reason."""

    model_config = STRICT

    value: float = Field(description="the number, in the unit beside it")
    unit: str = Field(description="unit of the number, such as 'mm^2'; empty for a plain number")
    reason: str = Field(min_length=1, description="reason for the number: a source, or why it was chosen")


def _description(quantity: Quantity) -> str:
    return f"{quantity.summary} [{quantity.unit or '-'}]"


def _section(name: str, quantities: tuple[Quantity, ...]) -> type[BaseModel]:
    title = "".join(part.capitalize() for part in name.split("_"))
    return table(title, {item.name: (PresetValue, Field(description=_description(item))) for item in quantities})


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a preset; every value is needed."""
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(description="name of the preset")),
        "title": (str, Field(description="which test bench it represents, in one line")),
        "notes": (str, Field(description="what is on, what is off, and where the values come from")),
    }
    fields |= {name: (_section(name, members), Field()) for name, members in SECTIONS.items()}
    return make_schema(table("RigPreset", fields), "ppafo rig preset")
