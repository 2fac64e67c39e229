"""Writes what pint says of the units that the package uses, into ``known_units.json``.

``python scripts/known_units.py``. A unit that is not there is read by pint, which takes a fifth of a second to load;
nothing else depends on it.
"""

import ast
import contextlib
import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ppafo
from ppafo import units
from ppafo.errors import UnitError

PACKAGE = Path(ppafo.__file__).parent
_LONGEST = 40


def texts_of_package() -> set[str]:
    """Return every short text in the code and in the data files of the package: units are among them."""
    code = (ast.walk(ast.parse(path.read_text(encoding="utf-8"))) for path in PACKAGE.rglob("*.py"))
    found = {node.value for tree in code for node in tree if isinstance(node, ast.Constant) and type(node.value) is str}
    for path in PACKAGE.rglob("*.toml"):
        found.update(_texts_in(tomllib.loads(path.read_text(encoding="utf-8"))))
    return {text for text in found if len(text) <= _LONGEST}


def _texts_in(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts_in(item)


def known_units() -> dict[str, list[Any]]:
    """Return scale, offset and dimensions of each unit by its normal spelling."""
    found = {}
    for unit in {unit for text in texts_of_package() for unit in _units_in(text)}:
        with contextlib.suppress(UnitError):
            # A word that happens to be made of units, as mul is m uL, is no unit of the package.
            if unit.isalpha() and " " in units.split_pressure_kind(unit)[0]:
                continue
            parsed = units.unit_by_pint(unit)
            found[units.split_pressure_kind(unit)[0]] = [str(parsed.scale), str(parsed.offset), parsed.dimensions]
    return dict(sorted(found.items()))


def _units_in(text: str) -> Iterator[str]:
    """A text as a unit, and as a quantity such as ``50 psi_g``."""
    yield text
    with contextlib.suppress(UnitError):
        yield units.split_quantity(text)[1]


def text_of(known: dict[str, list[Any]]) -> str:
    """Return the content of the file, a line for each unit."""
    lines = [f"{json.dumps(unit)}: {json.dumps(parsed, ensure_ascii=False)}" for unit, parsed in known.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> int:
    """Write the file."""
    known = known_units()
    (PACKAGE / "known_units.json").write_text(text_of(known), encoding="utf-8")
    print(f"{len(known)} units")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
