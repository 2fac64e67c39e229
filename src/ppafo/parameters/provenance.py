"""One value with where it comes from. This is what a parameter set consists of."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import STRICT, Text, Texts

Origin = Literal["published", "datasheet", "derived", "identified", "fitted", "assumed"]
"""How a value came to be known; ``fitted`` is one that recordings do not fix, or whose recordings no model explains."""


CONFIDENCE = 0.95
"""Of the interval whose half width an entry states."""


class Entry(BaseModel):
    """A number as it was given, in its own unit."""

    model_config = STRICT

    value: Annotated[float, Field(description="the number, in the unit beside it")]
    unit: Annotated[str, Field(description="such as 'mm^2', 'psi_g' (gauge), 'psi_a' (absolute); '' for a number")]
    origin: Annotated[Origin, Field(description="how the value came to be known")]
    source: Annotated[Text, Field(description="where to look it up: page, equation, data sheet, recording")]
    note: Annotated[str, Field(description="reason, conflict or remark")] = ""
    uncertainty: Annotated[float | None, Field(ge=0.0, description="half width of the 95 % interval, same unit")] = None


class TextEntry(BaseModel):
    """A name or formula as it was given."""

    model_config = STRICT

    value: Text
    origin: Annotated[Origin, Field(description="how the value came to be known")]
    source: Annotated[Text, Field(description="where to look it up")]
    note: Annotated[str, Field(description="reason, conflict or remark")] = ""


class FlagEntry(BaseModel):
    """A yes or no as it was given."""

    model_config = STRICT

    value: Annotated[bool, Field(description="true or false")]
    origin: Annotated[Origin, Field(description="how the value came to be known")]
    source: Annotated[Text, Field(description="where to look it up")]
    note: Annotated[str, Field(description="reason, conflict or remark")] = ""


class Citation(BaseModel):
    """The publication or report that the set comes from; what is not known is left out."""

    model_config = STRICT

    title: Text
    authors: Texts = ()
    year: Annotated[int | None, Field(ge=1800, le=2200)] = None
    doi: str = ""
    note: str = ""


class Accepted(BaseModel):
    """A contradiction that the author of the set knows of and keeps, with the reason."""

    model_config = STRICT

    finding: Annotated[Text, Field(description="identifier of the finding, as 'ppafo audit' prints it")]
    reason: Text
