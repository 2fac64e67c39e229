"""Plain data as JSON, in the one form that files and ``--json`` have."""

import json
from collections.abc import Mapping
from typing import Any


def json_text(document: Mapping[str, Any]) -> str:
    """Return the document as indented JSON without a final line break; ValueError for a number that is not finite."""
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
