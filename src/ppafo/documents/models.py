"""Building blocks of file layouts: strict tables, optional values, unions by kind, and JSON Schema."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model
from pydantic_core import PydanticKnownError

from ppafo.documents.problems import all_problems
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import PpafoError

Model = TypeVar("Model", bound=BaseModel)


class StrictTable(BaseModel):
    """Table of a file that accepts only declared keys and types, and finite numbers; built at first use."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


def _no_flag(value: Any) -> Any:
    # Python takes True for 1.
    if isinstance(value, bool):
        raise PydanticKnownError("literal_error", {"expected": "1"})
    return value


SchemaVersion = Annotated[Literal[1], BeforeValidator(_no_flag), Field(description="version of this layout")]
"""Version of a file layout; all layouts have version 1 so far."""
Text = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[Text, ...], Field(strict=False)]

SCHEMA = "https://json-schema.org/draft/2020-12/schema"
"""JSON Schema version of the published file layouts."""

_CONFIG = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)


def table(name: str, fields: dict[str, Any]) -> type[BaseModel]:
    """Create the model of a table with exactly these keys."""
    model: type[BaseModel] = create_model(name, __config__=_CONFIG, **fields)
    return model


def optional(annotation: Any, description: str) -> Any:
    """Return annotation and field of an optional value."""
    # A factory keeps 'null' out of the published schema.
    return annotation, Field(default_factory=lambda: None, description=description)


def one_of(models: list[Any]) -> Any:
    """Return the union of table models, discriminated by their ``kind``."""
    if len(models) == 1:
        return models[0]
    return Annotated[Union[tuple(models)], Field(discriminator="kind")]  # noqa: UP007


def read_model(kind: TomlKind, model: type[Model], name_or_path: str | Path) -> tuple[Model, str]:
    """Load and validate a file by bundled name or path. Returns the model and the label used in messages."""
    file = label(str(name_or_path))
    return validate(model, kind.parse(kind.read(name_or_path), file), file, kind.error), file


def validate(
    model: type[Model],
    document: object,
    file: str,
    refusal: type[PpafoError],
    whole: Callable[[], type[Model]] | None = None,
) -> Model:
    """Validate a document as a model. Raises ``refusal`` with all problems if the layout differs.

    If ``model`` contains only the loaded kinds, ``whole`` returns the model with all kinds, used for messages.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        if whole is not None:
            return validate(whole(), document, file, refusal)
        raise refusal(f"{file}: {all_problems(error.errors(include_url=False), model)}") from error


REFERENCE = "#/$defs/{model}"
"""Template of a reference to a definition inside a JSON Schema."""


def make_schema(model: type[BaseModel], title: str, reference: str = REFERENCE) -> dict[str, Any]:
    """Return the JSON Schema of a file layout; ``reference`` is the template of internal references."""
    return {"$schema": SCHEMA, **model.model_json_schema(ref_template=reference), "title": title}
