"""The functions on the page of equations: its lists, and what moves where one of them is changed.

    python scripts/equations.py
    python scripts/equations.py ppafo.model.plant.net_torque

Without a name it writes the lists of ``docs/equations.md`` from ``tests/reference/equations.toml``. With names it
changes each function in a copy of the source, its result by 1.2 and by the term of the list, and prints what runs do.
"""

import ast
import importlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGE, LIST = ROOT / "docs" / "equations.md", ROOT / "tests" / "reference" / "equations.toml"
FACTOR = 1.2
BULLET = "- [`"


def listed() -> dict[str, Any]:
    """Functions by section of the page, and the runs in which they are changed."""
    return tomllib.loads(LIST.read_text(encoding="utf-8"))


def functions() -> dict[str, dict[str, Any]]:
    """What the list says of each function, by its dotted name."""
    return {one["name"]: one for section in listed()["section"] for one in section["function"]}


def page_text() -> str:
    """Return the page with its lists of functions as the list has them, one section for each."""
    sections, lines = iter(listed()["section"]), [""]
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if not line.startswith(BULLET):
            lines.append(line)
        elif not lines[-1].startswith(BULLET):
            lines += [bullet(one) for one in next(sections)["function"]]
    return "\n".join(lines[1:]) + "\n"


def bullet(one: dict[str, Any]) -> str:
    """Line of a function on the page."""
    path = one["name"].rpartition(".")[0].replace(".", "/")
    said = f": {one['is']}" if "is" in one else ""
    return f"{BULLET}{one['name']}`](../src/{path}.py){said}"


def changed(text: str, name: str, term: str | None) -> str:
    """Return the source of a module where a function returns ``FACTOR`` times its numbers, or these with a term.

    Of a row the first number is changed.
    """
    (function,) = (node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef) and node.name == name)
    lines = text.splitlines(keepends=True)
    returns = [node for node in ast.walk(function) if isinstance(node, ast.Return) and node.value is not None]
    for node in sorted(returns, key=lambda node: -node.lineno):
        assert node.value is not None, "only such are chosen"
        indent, new = " " * node.col_offset, ast.unparse(_changed(node.value, term))
        lines[node.lineno - 1 : node.end_lineno] = [f"{indent}return {new}\n"]
    return "".join(lines)


def _changed(value: ast.expr, term: str | None) -> ast.expr:
    if isinstance(value, ast.Tuple):
        return ast.Tuple([_changed(part, term) for part in value.elts], ast.Load())
    if isinstance(value, ast.Call) and ast.unparse(value.func)[0].isupper():
        if value.args:
            value.args[0] = _changed(value.args[0], term)
        else:
            value.keywords[0].value = _changed(value.keywords[0].value, term)
        return value
    new = f"({ast.unparse(value)}) + ({term})" if term else f"{FACTOR} * ({ast.unparse(value)})"
    return ast.parse(new, mode="eval").body


def outcome(case: dict[str, Any]) -> dict[str, Any]:
    """What a case does: bits of the run compiled and by Python, of the export in C, its linear model, and errors."""
    import numpy as np

    from ppafo import load_scenario
    from ppafo.analyses.linearise.model import linear_model
    from ppafo.engine.lanes import run_batch
    from ppafo.engine.run import batch_of
    from ppafo.exports.c_library import c_library
    from ppafo.golden_bits import digest
    from ppafo.running import simulate
    from ppafo.simulation.plan import plan_run
    from ppafo.simulation.vane_recording import net_torques
    from tests.reference.reference_solver import compare_with_reference

    found: dict[str, Any] = {}
    scenario = load_scenario(case["scenario"], case.get("set", []))
    run = plan_run(scenario)
    found["compiled"] = digest(run_batch(batch_of(run)))
    recording = simulate(scenario).recording
    with tempfile.TemporaryDirectory() as folder:
        for file, content in c_library(scenario).items():
            (Path(folder) / file).write_bytes(content)
        words = ["make", "-s", "-C", folder, "CFLAGS=-std=c99 -O0", "check"]
        found["exported"] = subprocess.run(words, capture_output=True, check=False).returncode == 0
    if "linear" in case:
        model = linear_model(scenario, case["linear"])
        found["linear"] = [np.asarray(matrix).tolist() for matrix in (model.a, model.b, model.c, model.d)]
    if case.get("solver", True):
        agreement = compare_with_reference(run)
        found["apart"] = max(agreement.angle / 2e-4, agreement.pressure_1 / 1e-3, agreement.pressure_2 / 1e-3)
    if case.get("closes"):
        rows = {f"state.{name}": recording[name] for name in ("angle", "angular_velocity", "mass_1", "mass_2")}
        net = net_torques(run, rows, recording["torque"])
        pushed = run.plant.inertia * np.gradient(recording["angular_velocity"], recording.time)
        found["open"] = float(np.abs(net - pushed)[2:-2].max() / np.abs(net).max())
    os.environ["PPAFO_BACKEND"] = "python"
    found["python"] = digest(run_batch(batch_of(plan_run(scenario))))
    return found


def outcome_of(case: str, source: Path = ROOT / "src") -> dict[str, Any] | str:
    """Outcome of a case with the package of a folder, or the last line of what it says against it."""
    words = [sys.executable, "-c", f"from scripts import equations as e; e.print_outcome({case!r})"]
    environment = {**os.environ, "PYTHONPATH": f"{source}{os.pathsep}{ROOT}", "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        return done.stderr.strip().splitlines()[-1]
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def print_outcome(case: str) -> None:
    """Print the outcome of a case as JSON."""
    print(json.dumps(outcome(listed()["case"][case])))


def turned(name: str, case: str) -> Iterator[tuple[str, dict[str, Any] | str]]:
    """Yield each change of a function and the outcome of a case with it."""
    module, _, function = name.rpartition(".")
    path = Path(*module.split(".")).with_suffix(".py")
    one = functions()[name]
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "src"
        shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("__pycache__"))
        text = (source / path).read_text(encoding="utf-8")
        terms = [None] if one.get("times", True) else []
        for term in [*terms, one["term"]] if "term" in one else terms:
            (source / path).write_text(changed(text, function, term), encoding="utf-8")
            yield f"+ {term}" if term else f"times {FACTOR}", outcome_of(case, source)


def main() -> None:
    """Write the page, or print what the change of functions does."""
    for name in sys.argv[1:]:
        case = functions()[name]["case"]
        print(name, "in", case)
        for change, found in turned(name, case):
            print(" ", change, found if isinstance(found, str) else {k: v for k, v in found.items() if k != "linear"})
    if not sys.argv[1:]:
        PAGE.write_text(page_text(), encoding="utf-8")


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    importlib.invalidate_caches()
    main()
