"""Building blocks of closed file layouts: strict tables, their validation, and JSON Schema."""

from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import PydanticKnownError

from ppafo.documents.faults import line_of, refuse
from ppafo.documents.problems import faults_of
from ppafo.documents.regular_file import decoded
from ppafo.documents.toml_text import SCHEMA, TomlKind, label
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


def read_model(kind: TomlKind, model: type[Model], name_or_path: str | Path) -> tuple[Model, str]:
    """Load and validate a file by bundled name or path. Returns the model and the label used in messages."""
    file = label(str(name_or_path))
    content = kind.read(name_or_path)
    return validate(model, kind.parse(content, file), file, kind.error, content), file


def validate(model: type[Model], document: object, file: str, refusal: type[PpafoError], content: bytes = b"") -> Model:
    """Validate a document as a model. Raises ``refusal`` with all problems, by line of the ``content`` of its file."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        faults = faults_of(error.errors(include_url=False), model)
    text = decoded(content)
    return refuse(faults, file, refusal, lambda path: line_of(text, path))


def make_schema(model: type[BaseModel], title: str) -> dict[str, Any]:
    """Return the JSON Schema of a file layout."""
    return {"$schema": SCHEMA, **model.model_json_schema(), "title": title}
