"""No circle of imports: under TYPE_CHECKING, inside functions and by the names of modules neither."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HOUSE = runpy.run_path(str(ROOT / "scripts" / "house.py"))


def written_package(folder: Path, **texts: str) -> Path:
    """A package ``small`` of these modules."""
    package = folder / "small"
    package.mkdir()
    for name, text in {"__init__": "", **texts}.items():
        (package / f"{name}.py").write_text(text, encoding="utf-8")
    return package


@pytest.mark.parametrize(
    "back",
    [
        "from small import first",
        "from small.first import name",
        "import small.first",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from small.first import name",
        "def late():\n    from small.first import name",
        "LATER = 'small.first'",
        "LATER = 'small.first:name'",
    ],
)
def test_a_circle_is_found_however_it_is_written(back: str, tmp_path: Path) -> None:
    package = written_package(tmp_path, first="from small import middle", middle="import small.last", last=back)
    assert HOUSE["circles"](HOUSE["imports"](package)) == [("small.first", "small.last", "small.middle")]


def test_imports_one_way_are_no_circle_and_a_module_with_one_importer_is_counted(tmp_path: Path) -> None:
    package = written_package(
        tmp_path, first="from small.last import name", middle="import small.first", last="name = 1"
    )
    graph = HOUSE["imports"](package)
    assert HOUSE["circles"](graph) == []
    assert HOUSE["single_importers"](graph) == {"small.first": "small.middle", "small.last": "small.first"}


def test_no_modules_import_each_other() -> None:
    graph = HOUSE["imports"](ROOT / "src" / "ppafo")
    assert len(graph) > 100
    assert HOUSE["circles"](graph) == []


def test_no_module_imports_the_package_itself() -> None:
    found = HOUSE["importers_of_root"](HOUSE["imports"](ROOT / "src" / "ppafo"))
    assert {name.removeprefix("ppafo.") for name in found} == set()
