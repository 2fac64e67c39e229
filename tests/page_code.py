"""The code that a page of the documents shows: its blocks as text, and a module of it as a package on the path."""

import re
import sys
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from ppafo.model.catalog import EFFECTS

DOCS = Path(__file__).parents[1] / "docs"


def code_blocks(page: str, *languages: str) -> list[str]:
    """The code blocks of a page below ``docs``, in any of some languages, without their indentation."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found = re.findall(rf"^( *)```(?:{'|'.join(languages)})\n(.*?)^\1```", text, re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(block) for _, block in found]


def block_with(page: str, words: str) -> str:
    """The one code block of a page that has some words."""
    (block,) = (block for block in code_blocks(page, r"\w+") if words in block)
    return block


def assert_shows(block: str, printed: str) -> None:
    """The lines of a block of a page stand in what was printed, in this order; ``...`` is for what is left out."""
    lines = iter(printed.splitlines())
    left_out = True
    for line in block.strip().splitlines():
        if line == "...":
            left_out = True
            continue
        found = next((other for other in lines if not left_out or other == line), None)
        assert found == line, f"{line!r} is not printed there, but {found!r}"
        left_out = False


def write_package(folder: Path, module: str, text: str, entry_points: str) -> None:
    """Write the one module of a package and what an installer leaves beside it; entry points as in pyproject.toml."""
    package, name = module.split(".")
    (folder / package).mkdir(parents=True)
    (folder / package / "__init__.py").touch()
    (folder / package / f"{name}.py").write_text(text, encoding="utf-8")
    about = folder / f"{package}-0.1.0.dist-info"
    about.mkdir()
    called = package.replace("_", "-")
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {called}\nVersion: 0.1.0\n", encoding="utf-8")
    groups = tomllib.loads(entry_points)["project"]["entry-points"]
    lines = [
        line for group, names in groups.items() for line in (f"[{group}]", *(f"{a} = {b}" for a, b in names.items()))
    ]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def with_the_effect_of_the_page(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have the effect of the page on extensions on the path as an installer leaves it, and forget it afterwards."""
    page = "how-to/extend.md"
    write_package(folder, "my_effects.ice", block_with(page, "EFFECT = Effect"), block_with(page, "ppafo.effects"))
    monkeypatch.syspath_prepend(folder)
    yield
    EFFECTS.pop("ice", None)
    for name in [name for name in sys.modules if name.split(".")[0] == "my_effects"]:
        del sys.modules[name]
