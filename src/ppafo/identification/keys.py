"""Keys common to several tables of a problem file, and conversion of their texts to numbers."""

import math
from typing import Annotated

from pydantic import Field

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import StrictTable, Text
from ppafo.errors import IdentificationError
from ppafo.identification.tolerances import quantity_of

Columns = Annotated[Text | None, Field(description="name of a column map; default: units in the header of the file")]
Confidence = Annotated[float, Field(gt=0.5, lt=1.0, description="confidence of the intervals; default 0.95")]


def quantity_in(
    table: StrictTable,
    key: str,
    unit: str,
    where: str,
    low: float = -math.inf,
    high: float = math.inf,
    atmosphere: float = STANDARD_ATMOSPHERE,
) -> float | None:
    """Return the value of a key in ``unit``, None if the key is absent; ``where`` is the prefix of messages.

    Raises IdentificationError if the text does not fit the unit or the number is not from ``low`` to ``high``.
    """
    text = getattr(table, key)
    if text is None:
        return None
    value = quantity_of(f"{where}: {key}", text, unit, atmosphere)
    if not low <= value <= high:
        raise IdentificationError(f"{where}: {key} = {text!r} must be from {low:g} to {high:g} {unit}")
    return value


def positive_in(table: StrictTable, key: str, unit: str, where: str) -> float | None:
    """Return the positive value of a key in ``unit``, None if absent. Raises IdentificationError unless above zero."""
    value = quantity_in(table, key, unit, where)
    if value is not None and value <= 0.0:
        raise IdentificationError(f"{where}: {key} = {getattr(table, key)!r} must be above zero")
    return value
