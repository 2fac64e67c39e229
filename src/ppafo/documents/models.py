"""The pieces of which the layouts of files are made: strict tables, values that may be left out, unions of kinds."""

from pathlib import Path
from typing import Annotated, Any, TypeVar, Union

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from ppafo.documents.problems import first_problem
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import PpafoError

Model = TypeVar("Model", bound=BaseModel)

NAME = r"^[a-z0-9][a-z0-9_-]*$"
"""What the name of a set or scenario looks like."""

STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)
"""What is true of every table of a file: no other keys, no other types, finite numbers; made ready when it is read."""

Text = Annotated[str, Field(min_length=1)]
Texts = Annotated[tuple[Text, ...], Field(strict=False)]

_CONFIG = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)


def table(name: str, fields: dict[str, Any]) -> type[BaseModel]:
    """Return the model of a table with these keys and no others."""
    model: type[BaseModel] = create_model(name, __config__=_CONFIG, **fields)
    return model


def optional(annotation: Any, description: str) -> Any:
    """Return the field of a value that a file may leave out."""
    return annotation, Field(default_factory=_no_value, description=description)


def one_of(models: list[Any]) -> Any:
    """Return the union of tables that are distinguished by their ``kind``."""
    return Annotated[Union[tuple(models)], Field(discriminator="kind")]  # noqa: UP007


def read_model(kind: TomlKind, model: type[Model], name_or_path: str | Path) -> tuple[Model, str]:
    """Return a file by its name in the package or by its path, and what messages call it; the kind's error if wrong."""
    file = label(str(name_or_path))
    return validate(model, kind.parse(kind.read(name_or_path), file), file, kind.error), file


def validate(model: type[Model], document: object, file: str, refusal: type[PpafoError]) -> Model:
    """Return a document as its model; ``refusal`` with the first problem where it has another layout."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise refusal(f"{file}: {first_problem(error.errors(include_url=False), model)}") from error


def make_schema(model: type[BaseModel], title: str) -> dict[str, Any]:
    """Return the JSON Schema of a file with this layout."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **model.model_json_schema(), "title": title}


def _no_value() -> None:
    """Stand in for a value that a file may leave out; keeps 'null' out of the published schema."""
