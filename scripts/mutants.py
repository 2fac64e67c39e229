"""Mutants of the package that its short tests kill: small faults drawn at random, each tried alone in a copy of `src`.

    python scripts/mutants.py --count 60 --seed 1 --out out/mutants.json      # draw and try
    python scripts/mutants.py --again out/mutants.json --out out/after.json   # the same faults, where their lines stand

A mutant is tried with up to ten files of tests that import its module or are of its package, and with the golden bits:
`killed` where one fails twice that passes without the fault, `survived` where all pass, `late` where none failed within
`--limit` seconds, and `gone` where the line has left.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FILES = 10
COMPARISONS = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "=="}
ARITHMETIC = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
SIGNS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


class Mutant(NamedTuple):
    """Fault in one line of the package: file below `src`, line, number among equal lines, the line with the fault."""

    file: str
    line: str
    occurrence: int
    faulty: str


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield the faults of a module: a comparison, an operator, a condition or a number changed, one line each."""
    text = path.read_text(encoding="utf-8")
    rows = text.splitlines()
    name = path.relative_to(ROOT / "src").as_posix()

    def fault(row: int, start: int, end: int, old: str, new: str) -> Iterator[Mutant]:
        line = rows[row - 1]
        within = line[start:end]
        if within.count(old) == 1 and line.isascii():
            occurrence = rows[: row - 1].count(line)
            yield Mutant(name, line, occurrence, line[:start] + within.replace(old, new) + line[end:])

    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.expr) or node.lineno != node.end_lineno:
            continue
        row, start, end = node.lineno, node.col_offset, node.end_col_offset or 0
        match node:
            case ast.Compare(ops=[op], left=left, comparators=[right]) if type(op) in COMPARISONS:
                yield from fault(
                    row, left.end_col_offset or 0, right.col_offset, SIGNS[type(op)], COMPARISONS[type(op)]
                )
            case ast.BinOp(op=op, left=left, right=right) if type(op) in ARITHMETIC:
                yield from fault(row, left.end_col_offset or 0, right.col_offset, *ARITHMETIC[type(op)])
            case ast.BoolOp(op=op, values=[left, right]):
                signs = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
                yield from fault(row, left.end_col_offset or 0, right.col_offset, *signs)
            case ast.UnaryOp(op=ast.Not()):
                yield from fault(row, start, start + 4, "not ", "")
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                yield from fault(row, start, end, rows[row - 1][start:end], repr(value + 1))


def tests_for(module: str) -> list[str]:
    """Paths of the tests of a module: at most `FILES` that import it or are of its package, and the golden bits."""
    dotted = module.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    package, _, last = dotted.rpartition(".")
    words = (f"from {dotted} import", f"import {dotted}", f"from {package} import {last}")
    folder = ROOT / "tests" / "unit" / Path(module).relative_to("ppafo").parent
    while not folder.is_dir():
        folder = folder.parent

    def distance(path: Path) -> tuple[bool, bool, bool, str]:
        imports = any(word in path.read_text(encoding="utf-8") for word in words)
        return not imports, path.parent != folder, not path.is_relative_to(folder), path.as_posix()

    nearest = sorted((ROOT / "tests").rglob("test_*.py"), key=distance)[:FILES]
    chosen = [path for path in nearest if path.is_relative_to(folder) or not distance(path)[0]]
    golden = ROOT / "tests" / "unit" / "test_golden_bits.py"
    return [path.relative_to(ROOT).as_posix() for path in dict.fromkeys([*chosen, golden])]


def failure_of(tests: list[str], source: Path, limit: float) -> str | None:
    """Return the first test that fails with the package in `source`; empty where none does, None after the limit."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-n",
        "0",
        "-m",
        "not long",
        "-p",
        "no:cacheprovider",
        *tests,
    ]
    environment = {**os.environ, "PYTHONPATH": str(source)}
    try:
        ended = subprocess.run(
            command, check=False, cwd=ROOT, env=environment, timeout=limit, capture_output=True, text=True
        )
    except subprocess.TimeoutExpired:
        return None
    rows = [row for row in ended.stdout.splitlines() if row.startswith(("FAILED ", "ERROR "))]
    failed = [row.partition(" ")[2].partition(" - ")[0] for row in rows]
    return failed[0] if failed else "" if ended.returncode == 0 else f"exit {ended.returncode}"


def fate_of(mutant: Mutant, before: str, source: Path, limit: float) -> tuple[str, str]:
    """Return `killed`, `survived`, `late` or `gone`, and the test that failed, for the package with one fault.

    ``before`` is the test that found the fault in an earlier trial; its file is tried first.
    """
    path = source / mutant.file
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    rows = text.splitlines()
    places = [number for number, row in enumerate(rows) if row == mutant.line]
    if not places:
        return "gone", ""
    rows[places[min(mutant.occurrence, len(places) - 1)]] = mutant.faulty
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    try:
        first = [name for name in [before.partition("::")[0]] if name and (ROOT / name).is_file()]
        failed = failure_of([*dict.fromkeys([*first, *tests_for(mutant.file)])], source, limit)
        if failed and "::" in failed and failure_of([failed], source, limit) == "":
            return "survived", f"fails by chance: {failed}"
    finally:
        path.write_text(text, encoding="utf-8")
    if failed is None:
        return "late", ""
    blamed = failed and "::" in failed and failure_of([failed], source, limit)
    return (
        ("survived", f"fails without the fault: {failed}") if blamed else ("killed" if failed else "survived", failed)
    )


def main() -> None:
    """Draw mutants or take those of a file, try them, and print and write what became of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for the tests of a mutant")
    parser.add_argument("--again", type=Path, help="a file that --out wrote: its mutants are tried")
    parser.add_argument("--without", nargs="*", default=[], help="paths below src/ppafo from which nothing is drawn")
    parser.add_argument("--out", type=Path, default=Path("out/mutants.json"))
    given = parser.parse_args()
    if given.again:
        earlier = json.loads(given.again.read_text(encoding="utf-8"))
        drawn, found = [Mutant(*row[:4]) for row in earlier], [row[5] for row in earlier]
    else:
        files = [
            path
            for path in sorted((ROOT / "src" / "ppafo").rglob("*.py"))
            if not any(path.is_relative_to(ROOT / "src" / "ppafo" / name) for name in given.without)
        ]
        everything = [mutant for path in files for mutant in mutants_of(path)]
        drawn, found = random.Random(given.seed).sample(everything, given.count), [""] * given.count
    results: list[tuple[str | int, ...]] = []
    given.out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "src")
        shutil.copytree(ROOT / "src", source)
        # Tests that look up pages from the package find them beside the copy.
        Path(folder, "docs").symlink_to(ROOT / "docs")
        for number, (mutant, before) in enumerate(zip(drawn, found, strict=True), 1):
            fate, failed = fate_of(mutant, before, source, given.limit)
            results.append((*mutant, fate, failed))
            print(f"{number:3d} {fate:9s} {mutant.file}: {mutant.faulty.strip()[:80]}  {failed}", flush=True)
            given.out.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    print(", ".join(f"{count} {fate}" for fate, count in sorted(Counter(row[4] for row in results).items())))


if __name__ == "__main__":
    main()
