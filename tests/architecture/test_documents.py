"""The documents agree with the code: equations, names, units, paths and links."""

import ast
import dataclasses
import importlib
import inspect
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ppafo.model import plant, sensors
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import Effect
from ppafo.parameters import declaration, device
from ppafo.signals.recording import CHANNELS

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "ppafo"
PAGES = [
    *(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
PAPER_EQUATIONS = tuple(range(1, 15))

GROUPS_OF_NUMBERS = (plant.PlantParameters, plant.PlantState, plant.Openings, sensors.Measurement)
DEVICE_PARTS = [
    part for _, part in inspect.getmembers(device, dataclasses.is_dataclass) if part.__module__ == device.__name__
]

MACHINE_TRACES = (
    r"(?<!no-emit-)index[-]url",
    r"find[-]links",
    r"pypi[.]",
    r"[:]//\S+/simp[l]e",
    r"/wor[k]/",
    r"/roo[t]/",
    r"/hom[e]/",
)
"""Registry addresses and machine paths, written so that this file does not match itself."""


def sections_of_equations() -> dict[int, list[str]]:
    """Equation number to the dotted names of its section."""
    text = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## \((\d+)\)[^\n]*\n(.*?)(?=^## )", text, flags=re.MULTILINE | re.DOTALL)
    return {int(number): re.findall(r"`(ppafo\.[\w.]+)`", body) for number, body in sections}


def equations_of(docstring: str) -> set[int]:
    """Equation numbers that a docstring names, with ranges such as (6) to (9) written out."""
    numbers: set[int] = set()
    for clause in re.findall(r"(?:[Ee]quations?|Eqs)\s+((?:\(\d+\)(?:,? (?:and|to) |, )?)+)", docstring):
        for first, last in re.findall(r"\((\d+)\)(?: to \((\d+)\))?", clause):
            numbers |= set(range(int(first), int(last or first) + 1))
    return numbers


def found(dotted: str) -> Any:
    """What a dotted name stands for, or None."""
    module, _, name = dotted.rpartition(".")
    try:
        return getattr(importlib.import_module(module), name, None)
    except ModuleNotFoundError:
        return None


def dotted_names(page: str) -> list[str]:
    """Every dotted name of the package on a page."""
    return re.findall(r"`(ppafo\.[\w.]+)`", (ROOT / "docs" / page).read_text(encoding="utf-8"))


def nomenclature() -> Iterator[tuple[str, str]]:
    """Name and unit of every row of the nomenclature; a row may have several names, and a unit for each."""
    for line in (ROOT / "docs" / "nomenclature.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        place = next((number for number, cell in enumerate(cells[:2]) if "`" in cell and line.startswith("| ")), None)
        names = [] if place is None else re.findall(r"`(\w+)`", cells[place])
        units = [] if place is None else cells[place + 1].split(", ")
        units = units * len(names) if len(units) == 1 else units
        yield from zip(names, units, strict=True)


def names_of(folder: Path) -> set[str]:
    """Names of parameters of public functions and of fields of classes in a folder, at the top of their modules."""
    names: set[str] = set()
    for path in folder.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                names |= {item.arg for item in node.args.args}
            if isinstance(node, ast.ClassDef):
                fields = [item for item in node.body if isinstance(item, ast.AnnAssign)]
                targets = {item.target for item in fields}
                names |= {target.id for target in targets if isinstance(target, ast.Name)}
    return names


def declared_units() -> dict[str, str]:
    """Unit of every declared value and channel by name, as the nomenclature writes it."""
    quantities: list[Quantity] = [item for section in declaration.SECTIONS.values() for item in section]
    quantities += [item for kind in ACTUATORS.values() for item in kind.quantities]
    quantities += [item for kind in VALVES.values() for item in kind.quantities]
    units = {item.name: item.unit.removesuffix("_a") or "-" for item in quantities}
    return units | {name: kind.unit for name, kind in CHANNELS.items()}


def repository_files() -> list[Path]:
    """Files that are tracked, or would be."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("this is no git repository, so its files are not known")
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listed = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def test_every_equation_of_the_paper_has_a_section_with_functions() -> None:
    sections = sections_of_equations()
    assert tuple(sections) == PAPER_EQUATIONS
    assert [number for number, names in sections.items() if not names] == []


def test_every_dotted_name_on_the_page_of_equations_is_a_function() -> None:
    names = dotted_names("equations.md")
    assert len(names) > 30
    assert [name for name in names if not inspect.isfunction(inspect.unwrap(found(name) or str))] == []


@pytest.mark.parametrize("number", PAPER_EQUATIONS)
def test_the_functions_of_an_equation_name_it_in_their_docstrings(number: int) -> None:
    silent = [name for name in sections_of_equations()[number] if number not in equations_of(found(name).__doc__ or "")]
    assert silent == [], f"write 'Equation ({number}).' into the first line of the docstring of each of them"


def test_every_name_of_the_nomenclature_is_a_parameter_or_field_or_declared_value() -> None:
    used = set(declared_units())
    for package in ("model", "parameters", "control"):
        used |= names_of(SOURCE / package)
    assert sorted({name for name, _ in nomenclature()} - used) == []


@pytest.mark.parametrize("group", [*GROUPS_OF_NUMBERS, *DEVICE_PARTS], ids=lambda group: group.__name__)
def test_every_field_of_plant_state_and_device_is_in_the_nomenclature(group: Any) -> None:
    fields = [item.name for item in dataclasses.fields(group)] if dataclasses.is_dataclass(group) else group._fields
    missing = [
        f"| - | `{name}` | - | what it is | [page](page.md) |" for name in fields if name not in dict(nomenclature())
    ]
    assert missing == [], f"paste into docs/nomenclature.md, with symbol, unit and meaning of {group.__name__}:\n" + (
        "\n".join(missing)
    )


def test_every_channel_of_a_recording_is_in_the_nomenclature() -> None:
    missing = [
        f"| - | `{name}` | {CHANNELS[name].unit} | what it is | [page](page.md) |"
        for name in CHANNELS
        if name not in dict(nomenclature())
    ]
    assert missing == [], "paste into docs/nomenclature.md, with symbol and meaning:\n" + "\n".join(missing)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda effect: effect.name)
def test_an_effect_has_its_lines_in_nomenclature_and_equations(effect: Effect) -> None:
    nomenclature_page, equations = (
        (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("nomenclature.md", "equations.md")
    )
    rows = [line.rpartition(" [")[0] for line in nomenclature_page.splitlines()]
    lines = [f"| {symbol} | `{name}` | {unit} | {meaning} |" for symbol, name, unit, meaning in effect.symbols]
    missing = [line for line in lines if line not in rows]
    missing = ["paste into docs/nomenclature.md, below 'Effects':", *missing] if missing else []
    title, equation = f"### {effect.name}: {effect.summary}", f"    {effect.equation}"
    laws = [
        f"- `{law.__module__}.{law.__qualname__}`: at `{port.__name__}`; {effect.source}"
        for port, law in effect.laws.items()
    ]
    section = equations.partition(f"\n{title}\n")[2].partition("\n#")[0]
    names = re.findall(r"`([\w.]+)`", "\n".join(laws))
    if "```math" not in section or any(f"`{name}`" not in section for name in names):
        missing += ["paste into docs/equations.md, below 'Effects beside the paper's equations', with its mathematics:"]
        missing += [title, equation, *laws]
    assert missing == [], "\n".join(missing)


def test_units_of_the_nomenclature_are_the_declared_ones() -> None:
    declared = declared_units()
    listed = {name: unit for name, unit in nomenclature() if name in declared}
    assert len(listed) > 40
    assert {name: unit for name, unit in listed.items() if unit != declared[name]} == {}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_relative_link_leads_to_a_file_and_to_a_heading_of_it(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = [target for target in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in target]
    assert [target for target in targets if not _leads_somewhere(page, *target.partition("#")[::2])] == []


def _leads_somewhere(page: Path, place: str, anchor: str) -> bool:
    """True for a file that is there, and for an anchor that is the heading of a page."""
    file = page.parent / place if place else page
    if not file.is_file() or file.suffix != ".md" or not anchor:
        return file.is_file()
    headings = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    return anchor in {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_path_that_a_page_names_exists(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    paths = re.findall(r"`((?:[\w.-]+/)+(?:[\w-]+\.(?:py|toml|md))?)`", text)
    homes = (ROOT, SOURCE, page.parent)
    assert [path for path in paths if not any((home / path).exists() for home in homes)] == []


def test_the_page_on_architecture_lists_every_room_and_no_other() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rooms = text.partition("## The packages")[2].partition("## ")[0]
    listed = {
        name for line in re.findall(r"^ {4}(\S+(?: \| \S+)*) {2,}", rooms, re.MULTILINE) for name in line.split(" | ")
    }
    packages = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    modules = {path.stem for path in SOURCE.glob("*.py")} - {"__init__"}
    assert listed == packages | modules


def test_every_name_on_the_page_of_the_architecture_is_there() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    modules = {path: path.read_text(encoding="utf-8") for path in ROOT.rglob("*.py") if ".venv" not in path.parts}
    words = set(re.findall(r"\w+", "\n".join(modules.values()) + (ROOT / "pyproject.toml").read_text()))
    identifiers = re.findall(r"`(\w+)`", page)
    assert [name for name in identifiers if name not in words] == []
    # A name behind a file is one of this file.
    of_files = re.findall(r"`([\w/]+/\w+\.py)` \(((?:`[\w.]+`(?:, )?)+)\)", page)
    lost = [
        (file, name)
        for file, names in of_files
        for name in re.findall(r"`(?:\w+\.)?(\w+)`", names)
        if not re.search(rf"\b{name}\b", modules[SOURCE / file])
    ]
    assert lost == []


def test_the_documents_stay_short() -> None:
    words = {page: len(page.read_text(encoding="utf-8").split()) for page in ROOT.rglob("*.md") if _is_ours(page)}
    assert words[ROOT / "README.md"] <= 500
    assert sum(words.values()) <= 54_000


def _is_ours(page: Path) -> bool:
    """True for a page of this repository, not of what was installed or built in it."""
    return page.relative_to(ROOT).parts[0] in {
        "README.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "docs",
        "src",
    }


def test_no_file_of_the_repository_names_a_registry_or_a_place_on_one_machine() -> None:
    traces = []
    for file in repository_files():
        text = file.read_bytes().decode("utf-8", errors="replace")
        traces += [f"{file.relative_to(ROOT)}: {hit}" for rule in MACHINE_TRACES for hit in re.findall(rule, text)]
    assert traces == []


def test_lock_files_have_no_address_at_all() -> None:
    locks = sorted(ROOT.glob("*.lock"))
    assert len(locks) >= 2
    assert [lock.name for lock in locks if "://" in lock.read_text(encoding="utf-8")] == []
