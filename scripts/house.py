"""Counts of the house, to compare before and after: lines and files by room, the longest, what has a single user.

    python scripts/house.py                      the package beside this script
    python scripts/house.py path/to/src/ppafo    another one, such as that of an older commit

A room is a folder of the package. Lines are all lines of Python. Imports under TYPE_CHECKING and inside functions count
as others do, and so does a module that is named in a text, alone or as ``module:name``, because it is imported by that
name later. A circle is a set of modules that import each other. The package itself, which names what is public, is
left out of circles; which modules import it is counted apart.
"""

import ast
import statistics
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
SMALL_MEDIAN = 50
LONGEST_SHOWN = 8

Graph = Mapping[str, frozenset[str]]


def source_files(package: Path) -> list[Path]:
    """The modules of a package: files that every folder above them makes importable, so no example for users."""
    return sorted(path for path in package.rglob("*.py") if _is_importable(path.parent, package))


def _is_importable(folder: Path, package: Path) -> bool:
    return folder == package or ((folder / "__init__.py").is_file() and _is_importable(folder.parent, package))


def module_names(package: Path) -> dict[str, Path]:
    """The modules of a package by dotted name."""
    files = source_files(package)
    dotted = {path: ".".join(path.relative_to(package.parent).with_suffix("").parts) for path in files}
    return {name.removesuffix(".__init__"): path for path, name in dotted.items()}


def line_count(path: Path) -> int:
    """All lines of a file."""
    return len(path.read_text(encoding="utf-8").splitlines())


def imports(package: Path) -> Graph:
    """What each module imports of the package, anywhere in its file."""
    names = module_names(package)
    return {name: frozenset(_imported(path, names) & names.keys() - {name}) for name, path in names.items()}


def _imported(path: Path, names: Mapping[str, Path]) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            dotted = {f"{node.module}.{alias.name}" for alias in node.names}
            inside = dotted & names.keys()
            found |= inside | ({node.module} if dotted - inside else set())
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            # A package that is named alone may be where files of data lie.
            named, is_of_module, _ = node.value.partition(":")
            if "." in named and named in names and (is_of_module or names[named].stem != "__init__"):
                found.add(named)
    return found


def circles(graph: Graph) -> list[tuple[str, ...]]:
    """Sets of modules that import each other, directly or through others; the root of the package left out."""
    root = min(graph, key=len)
    reached = {name: _reached(name, graph, root) for name in graph}
    together = {name: tuple(sorted({name} | {far for far in reached[name] if name in reached[far]})) for name in graph}
    return sorted({circle for circle in together.values() if len(circle) > 1})


def _reached(start: str, graph: Graph, root: str) -> set[str]:
    found: set[str] = set()
    ahead = [start]
    while ahead:
        new = graph[ahead.pop()] - found - {root}
        found |= new
        ahead.extend(new)
    return found


def importers_of_root(graph: Graph) -> list[str]:
    """Modules that import the package itself, whose first lines lie above all of them."""
    root = min(graph, key=len)
    return sorted(name for name, imported in graph.items() if root in imported)


def single_importers(graph: Graph) -> dict[str, str]:
    """Modules that exactly one other module imports, and which; packages and what nobody imports left out."""
    root = min(graph, key=len)
    users: dict[str, set[str]] = {name: set() for name in graph}
    for name, imported in graph.items():
        for target in imported if name != root else ():
            users[target].add(name)
    is_package = {name.rpartition(".")[0] for name in graph}
    return {name: min(found) for name, found in users.items() if len(found) == 1 and name not in is_package}


def functions(path: Path) -> Iterator[tuple[str, int]]:
    """Name and lines of the body, less the docstring, of every function of a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None and len(node.body) > 1 else node.body
            yield node.name, (body[-1].end_lineno or 0) - body[0].lineno + 1


def small_folders(package: Path) -> dict[str, float]:
    """Folders of two files or more, ``__init__`` not counted, whose median file has fewer than 50 lines."""
    medians = {}
    for folder in sorted({path.parent for path in source_files(package)}):
        lengths = [line_count(path) for path in sorted(folder.glob("*.py")) if path.stem != "__init__"]
        if len(lengths) > 1 and (median := statistics.median(lengths)) < SMALL_MEDIAN:
            medians[str(folder.relative_to(package))] = median
    return medians


def _rooms(package: Path) -> Iterator[str]:
    lengths = {path: line_count(path) for path in source_files(package)}
    rooms: dict[str, list[int]] = {}
    for path, length in sorted(lengths.items()):
        parts = path.relative_to(package).parts
        rooms.setdefault(parts[0] if len(parts) > 1 else "(top)", []).append(length)
    yield f"| {'package':<15} | {'files':>5} | {'lines':>6} | {'median':>6} | {'longest':>7} |"
    yield f"|{'-' * 17}|{'-' * 6}:|{'-' * 7}:|{'-' * 7}:|{'-' * 8}:|"
    for room, found in [*sorted(rooms.items()), ("all", list(lengths.values()))]:
        yield f"| {room:<15} | {len(found):>5} | {sum(found):>6} | {statistics.median(found):>6.0f} | {max(found):>7} |"


def report(package: Path) -> Iterator[str]:
    """The counts as lines of Markdown."""
    graph = imports(package)
    yield from _rooms(package)
    lengths = sorted(((line_count(path), name) for name, path in module_names(package).items()), reverse=True)
    yield from ("", "Longest files:", *(f"- {count} {name}" for count, name in lengths[:LONGEST_SHOWN]))
    bodies = [
        (count, f"{name}.{function}")
        for name, path in module_names(package).items()
        for function, count in functions(path)
    ]
    yield from (
        "",
        "Longest functions:",
        *(f"- {count} {name}" for count, name in sorted(bodies, reverse=True)[:LONGEST_SHOWN]),
    )
    single = single_importers(graph)
    yield from ("", f"Modules with a single importer: {len(single)} of {len(graph)}")
    found = circles(graph)
    yield from ("", f"Circles: {len(found)}", *(f"- {', '.join(circle)}" for circle in found))
    yield f"Modules that import the package itself: {len(importers_of_root(graph))}"
    small = small_folders(package)
    yield from ("", f"Folders whose median file is under {SMALL_MEDIAN} lines: {len(small)}")
    yield from (f"- {folder}: {median:.0f}" for folder, median in small.items())


if __name__ == "__main__":
    package = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "src" / "ppafo"
    sys.stdout.write("\n".join([*report(package), ""]))
