"""Puts the site of the documents together, builds it, and checks every link within it.

    python scripts/website.py out/site

Sphinx (``docs/conf.py``) builds it from ``out/site.source``. This script puts the Markdown pages there as they are,
with links into the repository turned into pages of the site, and makes the pages of the interface from the package.
Warnings are errors. No other host is asked, neither here nor by the pages.
"""

import argparse
import importlib
import os
import re
import shutil
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple
from urllib.parse import unquote, urlsplit

import ppafo
from scripts.docstrings import KERNEL, restructured

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
FRONT = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
DECISIONS = "docs/decisions/README.md"
"""The list of the decisions, which are below it in the table of contents."""
WORKBENCH = "workbench.html"
"""The page that simulates, as `ppafo workbench` writes it, beside the pages of the site."""
ROOMS = ("control", "control.controllers", "control.profiles", "control.walking", "metrics", "model", "model.valves")
"""Rooms that users extend or look equations up in; all functions of their modules are described."""
LANGUAGES = {".py": "python", ".toml": "toml", ".cff": "yaml"}

_LINK = re.compile(r"(?<=\]\()([^)\s#]+)")
_NAMED = re.compile(r"\[(`ppafo\.[\w.]+`)\]\([^)]*\)")
"""A function with a link to its file, as a forge needs it; the site describes the function."""
_MEMBERS = "   :members:\n   :undoc-members:\n"
_CLASS = _MEMBERS + "   :inherited-members: object, tuple, BaseException\n"


class Section(NamedTuple):
    """A part of the index: its title, and the pages, as paths in the repository."""

    title: str
    pages: tuple[str, ...]


def documents() -> list[str]:
    """The pages of the repository, as paths in it."""
    return [*FRONT, *(page.relative_to(ROOT).as_posix() for page in sorted(DOCS.rglob("*.md")))]


def contents() -> list[Section]:
    """The sections of ``docs/README.md``, which is the table of contents of the site as well."""
    parts = re.split(r"^\*\*(.+)\*\*\n", (DOCS / "README.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    found = []
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        places = (os.path.normpath(f"docs/{target}") for target in _LINK.findall(body) if target.endswith(".md"))
        found.append(Section(title, tuple(dict.fromkeys(places))))
    return found


def decisions() -> list[str]:
    """The decisions in the order of their list, as paths in the repository."""
    text = (ROOT / DECISIONS).read_text(encoding="utf-8")
    return [f"docs/decisions/{target}" for target in _LINK.findall(text)]


def stage(folder: Path) -> None:
    """Write all that Sphinx reads."""
    files: set[str] = set()
    for page in documents():
        text = (ROOT / page).read_text(encoding="utf-8")
        _write(folder / ("index.md" if page == "README.md" else page), _linked(text, page, files))
    with (folder / "index.md").open("a", encoding="utf-8") as front:
        front.write(_hidden("", ["docs/README.md"]) + "".join(_hidden(*section) for section in contents()))
        front.write(_hidden("Reference", ["api/index", "api/kinds", "api/rooms"]))
    with (folder / DECISIONS).open("a", encoding="utf-8") as front:
        front.write(_hidden("", [Path(page).name for page in decisions()]))
    for file in sorted(files):
        text = (ROOT / file).read_text(encoding="utf-8")
        language = LANGUAGES.get(Path(file).suffix, "text")
        _write(folder / "files" / f"{file}.md", f"---\norphan: true\n---\n\n# {file}\n\n````{language}\n{text}````\n")
    for name, text in interface().items():
        _write(folder / "api" / f"{name}.rst", text)
    shutil.copytree(DOCS / "images", folder / "docs" / "images", dirs_exist_ok=True)


def _linked(text: str, page: str, files: set[str]) -> str:
    """A page with its links as they are on the site; files of the repository that it leads to are noted."""
    here = Path(page).parent.as_posix()

    def led(found: re.Match[str]) -> str:
        place = os.path.normpath(f"{here}/{found[1]}")
        if "://" in found[1] or place.startswith("docs/") or place in FRONT[1:]:
            return found[1]
        if place == "README.md":
            return os.path.relpath("index.md", here)
        files.add(place)
        return os.path.relpath(f"files/{place}.md", here)

    text = _LINK.sub(led, _NAMED.sub(r"\1", text))
    if page == "docs/how-to/export.md":
        text = text.replace(f"Open `out/{WORKBENCH}`", f'Open <a href="../../{WORKBENCH}">{WORKBENCH}</a>')
    return text


def _hidden(caption: str, pages: Sequence[str]) -> str:
    head = f":caption: {caption}\n" if caption else ""
    return (
        "\n```{toctree}\n:hidden:\n" + head + "\n" + "\n".join(page.removesuffix(".md") for page in pages) + "\n```\n"
    )


def interface() -> dict[str, str]:
    """The pages of the Python interface by name, for autodoc."""
    homes: dict[str, list[str]] = {}
    for name in ppafo.__all__:
        homes.setdefault(getattr(ppafo, name).__module__.split(".")[1], []).append(name)
    pages = {f"public/{room}": _public(room, names) for room, names in sorted(homes.items())}
    pages["index"] = _index(homes)
    rooms = {room: list(_modules(f"ppafo.{room}")) for room in ROOMS}
    pages |= {f"rooms/{room}": _room(room, modules) for room, modules in rooms.items()}
    pages["rooms/equations"] = _equations({module.__name__ for modules in rooms.values() for module in modules})
    pages["rooms"] = _titled("Inside, by package", "Pure functions of floats: unit, sign, equation.") + _tree(
        ["rooms/equations", *(f"rooms/{room}" for room in ROOMS)], shown=True
    )
    pages["kinds"] = kinds()
    return pages


def _titled(title: str, text: str = "", line: str = "=") -> str:
    return f"{title}\n{line * len(title)}\n\n{text}\n\n"


def _tree(pages: Iterable[str], shown: bool = False) -> str:
    options = "   :maxdepth: 1\n" if shown else "   :hidden:\n"
    return f".. toctree::\n{options}\n" + "".join(f"   {page}\n" for page in pages) + "\n"


def _first_line(module: ModuleType) -> str:
    return (module.__doc__ or "").strip().split("\n")[0]


def _index(homes: Mapping[str, Sequence[str]]) -> str:
    """All public names by the package that they live in, each with its first line."""
    text = _titled("Python interface", "All that ``import ppafo`` offers, loaded when it is first used.")
    text += _tree(f"public/{room}" for room in sorted(homes))
    for room, names in sorted(homes.items()):
        text += _titled(_heading(room), line="-") + ".. autosummary::\n   :nosignatures:\n\n"
        text += "".join(f"   ppafo.{name}\n" for name in names) + "\n"
    return text


def _heading(room: str) -> str:
    """What a room is, by the docstring of its package."""
    return re.split(r"[:.]", _first_line(importlib.import_module(f"ppafo.{room}")))[0]


def _public(room: str, names: Iterable[str]) -> str:
    text = _titled(_heading(room))
    for name in names:
        value = getattr(ppafo, name)
        if isinstance(value, type) and issubclass(value, Exception):
            text += f".. autoexception:: ppafo.{name}\n   :show-inheritance:\n\n"
        elif isinstance(value, type):
            text += f".. autoclass:: ppafo.{name}\n{_CLASS}\n"
        else:
            text += f".. autofunction:: ppafo.{name}\n\n"
    return text


def _modules(room: str) -> Iterator[ModuleType]:
    """The modules of a room, those of rooms below it left out."""
    package = importlib.import_module(room)
    if not hasattr(package, "__path__"):
        yield package
        return
    for path in sorted(Path(package.__path__[0]).glob("[a-z]*.py")):
        if f"{room}.{path.stem}" not in {f"ppafo.{other}" for other in ROOMS}:
            yield importlib.import_module(f"{room}.{path.stem}")


def _room(room: str, modules: Iterable[ModuleType]) -> str:
    """The modules of a room, one after the other."""
    text = _titled(room.replace(".", ": "), _plain(_first_line(importlib.import_module(f"ppafo.{room}"))))
    for module in modules:
        name = module.__name__
        text += _titled(name, line="-") + f".. automodule:: {name}\n{_MEMBERS}\n"
    return text


def _equations(described: set[str]) -> str:
    """Functions that carry an equation of the paper and live elsewhere: engine, walking, translation."""
    named = re.findall(r"`(ppafo\.[\w.]+)`", (DOCS / "equations.md").read_text(encoding="utf-8"))
    elsewhere = [name for name in dict.fromkeys(named) if name.rpartition(".")[0] not in described]
    text = "Functions that :doc:`the page on equations </docs/equations>` names and that are not in the packages below."
    return _titled("Equations in other packages", text) + "".join(f".. autofunction:: {name}\n\n" for name in elsewhere)


def kinds() -> str:
    """The page of all that a file can name, from the catalogues."""
    from ppafo.control.catalog import CONTROLLERS, PROFILES
    from ppafo.control.walking.catalog import WALKING_CONTROLLERS
    from ppafo.metrics import METRICS
    from ppafo.model.catalog import VALVES
    from ppafo.signals.recording import CHANNELS

    text = _titled("Kinds and their settings", "What a file can name, as this package has it; numbers are in SI units.")
    catalogues: dict[str, Mapping[str, Any]] = {
        "Valves": VALVES,
        "Controllers": CONTROLLERS,
        "Controllers of walking": WALKING_CONTROLLERS,
        "Profiles": PROFILES,
    }
    for title, catalogue in catalogues.items():
        text += _titled(title, line="-")
        for name, kind in catalogue.items():
            text += _titled(name, _plain(kind.summary), line="~") + _settings(kind.quantities)
    metrics = [(kind.name, kind.unit, kind.summary, ", ".join(kind.channels)) for kind in METRICS.values()]
    text += _titled("Metrics", line="-") + _table(("metric", "unit", "meaning", "channels that it needs"), metrics)
    channels = [(name, kind.unit, kind.summary) for name, kind in CHANNELS.items()]
    return text + _titled("Channels", line="-") + _table(("channel", "unit", "meaning"), channels)


def _settings(quantities: Iterable[Any]) -> str:
    rows = [
        (item.name, item.unit or "1", "" if item.default is None else f"{item.default:g}", *_range(item), item.summary)
        for item in quantities
    ]
    return _table(("setting", "unit", "default", "from", "to", "meaning"), rows) if rows else ""


def _range(item: Any) -> tuple[str, str]:
    return (f"{item.minimum:g}" if item.minimum_allowed else f"over {item.minimum:g}"), f"{item.maximum:g}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in (head, *rows):
        cells = [f"``{row[0]}``" if row is not head else row[0], *map(_plain, row[1:])]
        lines += [f"   {'*' if place == 0 else ' '} - {cell}".rstrip() for place, cell in enumerate(cells)]
    return "\n".join(lines) + "\n\n"


def _plain(text: str) -> str:
    return " ".join(restructured([text]))


class Page(HTMLParser):
    """What a page of the site offers and asks for: anchors, links, and what it loads."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.anchors: set[str] = {"", "top"}
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note one element."""
        given = {name: value for name, value in attrs if value}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag in {"link", "script", "img", "iframe", "source"}:
            self.loaded += [given[name] for name in ("src", "href") if name in given]


def faults(site: Path) -> list[str]:
    """Links within the site that lead nowhere, and whatever a page would load from another host."""
    pages = {file: Page(file) for file in sorted(site.rglob("*.html")) if file != site / WORKBENCH}
    found = []
    for file, page in pages.items():
        here = file.relative_to(site).as_posix()
        found += [f"{here} loads {link}" for link in page.loaded if urlsplit(link).netloc]
        for link in [*page.links, *page.loaded]:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            if not target.is_file():
                found.append(f"{here} leads to {link}, which is not there")
            elif target in pages and unquote(parts.fragment) not in pages[target].anchors:
                found.append(f"{here} leads to {link}, whose anchor is not there")
    return found


def build(site: Path) -> int:
    """Stage, build, add the page that simulates, check; return 0 where all is well."""
    from sphinx.cmd.build import build_main

    from ppafo.cli.main import main as command

    source = site.with_suffix(".source")
    for folder in (source, site):
        shutil.rmtree(folder, ignore_errors=True)
    stage(source)
    options = ["-q", "-E", "-W", "--keep-going", "-j", "auto", "-b", "html", "-c", str(DOCS)]
    if build_main([*options, "-d", str(site.with_suffix(".doctrees")), str(source), str(site)]) != 0:
        return 1
    if command(["workbench", "--out", str(site / WORKBENCH)]) != 0:
        return 1
    found = faults(site)
    print("".join(f"{line}\n" for line in found), end="")
    return 1 if found else 0


def _write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")


def main() -> int:
    """Build the site into a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("out/site"))
    site = parser.parse_args().folder.resolve()
    # The tutorial runs with a profile of its own, not the user's; that its kernel listens on this computer is known.
    profile = site.with_suffix(".ipython") / "profile_default"
    for name, text in KERNEL.items():
        _write(profile / name, text)
    os.environ["IPYTHONDIR"] = str(profile.parent)
    # Its kernel finds the command.
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    start = time.monotonic()
    failed = build(site)
    files = [file for file in site.rglob("*") if file.is_file()]
    size = sum(file.stat().st_size for file in files)
    print(f"{site / 'index.html'}: {len(files)} files, {size / 1e6:.1f} MB, {time.monotonic() - start:.0f} s")
    return failed


if __name__ == "__main__":
    raise SystemExit(main())
