"""The functions on the page of equations: its lists, and what moves where one of them is changed.

    python scripts/equations.py
    python scripts/equations.py ppafo.model.plant.net_torque

Without a name it writes the lists of ``docs/equations.md`` from ``tests/reference/equations.toml``. With names it
changes each function in a copy of the source, its result times 1.2 and by the term of the list, and prints what runs
do. A process that has loaded the copy is forked for each function: loading takes as long as all that a run does.
"""

import ast
import gc
import importlib
import json
import linecache
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

ROOT = Path(__file__).parents[1]
PAGE, LIST = ROOT / "docs" / "equations.md", ROOT / "tests" / "reference" / "equations.toml"
FACTOR = 1.2
BULLET = "- [`"
MAKERS = ("rigid",)
"""Functions of a row of their arguments."""


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


def changed(text: str, name: str, one: Mapping[str, Any]) -> str:
    """Return the source of a module where a function returns ``FACTOR`` times its numbers, and these with a term.

    Of a row its first number is changed, or that of its ``field``. ``one`` is what the list says of the function.
    """
    (function,) = (node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef) and node.name == name)
    form = f"{one.get('factor', FACTOR)} * ({{}})"
    form += f" + ({one['term']})" if "term" in one else ""
    lines = text.splitlines(keepends=True)
    returns = [node for node in ast.walk(function) if isinstance(node, ast.Return) and node.value is not None]
    for node in sorted(returns, key=lambda node: -node.lineno):
        assert node.value is not None, "only such are chosen"
        indent, new = " " * node.col_offset, ast.unparse(_changed(node.value, form, one.get("field")))
        lines[node.lineno - 1 : node.end_lineno] = [f"{indent}return {new}\n"]
    return "".join(lines)


def _changed(value: ast.expr, form: str, field: str | None) -> ast.expr:
    if isinstance(value, ast.Tuple):
        return ast.Tuple([_changed(part, form, field) for part in value.elts], ast.Load())
    # By its name a row, but for the makers of rows.
    if isinstance(value, ast.Call) and (
        ast.unparse(value.func).lstrip("_")[0].isupper() or ast.unparse(value.func) in MAKERS
    ):
        if value.args:
            value.args[0] = _changed(value.args[0], form, None)
        else:
            given = next((each for each in value.keywords if each.arg == field), value.keywords[0])
            given.value = _changed(given.value, form, None)
        return value
    return ast.parse(form.format(ast.unparse(value)), mode="eval").body


def recorded(case: dict[str, Any]) -> dict[str, Any]:
    """Bits of the recording of a walk, of one on a bottle, or of a bottle alone."""
    import numpy as np

    import ppafo
    from ppafo.golden_bits import hash_of
    from ppafo.walking.motion import with_duration

    if "gas_per_stride" in case:
        found: Any = ppafo.bottle(gas_per_stride=case["gas_per_stride"]).found
        recording = found.record()
    elif "minutes" in case:
        recording = ppafo.walk(case["walk"], minutes=case["minutes"], overrides=case["set"]).recording
    else:
        os.environ["PPAFO_BACKEND"] = "python"
        recording = ppafo.simulate(with_duration(ppafo.load_walk(case["walk"]), 1.0)).recording
    return {"recorded": hash_of(tuple(np.asarray(recording[name]) for name in recording.names))}


LOCKED = ("motion.kind=locked", "run.step=0.1 ms", "run.output_interval=0.1 ms")
EMPTYING = (
    *("motion.kind=locked", "run.duration=40 ms", "controller.command=-1", "actuator.leak.area=1e-6 mm^2"),
    *("initial.pressure_1=480 kPa_a", "gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=0 W/(m^2 K)"),
    "gas_model.wall_area_per_volume=100 1/m",
)


def consequences() -> dict[str, float]:
    """Relative departures [-] of what follows from the equations, whatever function is changed.

    ``start``: first pressures from those asked for, the inverse of equation (3). ``linear``: A and B of the linear
    model from differences of runs at the same state. ``isentrope``: temperature of a chamber that empties without heat
    from ``T_0 (P/P_0)^((k - 1)/k)``, whatever the flow law.
    """
    import numpy as np

    from ppafo import load_scenario
    from ppafo.analyses.linearise.model import linear_model
    from ppafo.running import simulate

    def locked(pressure_1: float, pressure_2: float, command: float) -> Any:
        numbers = f"initial.pressure_1={pressure_1} kPa_a", f"initial.pressure_2={pressure_2} kPa_a"
        return load_scenario("step-response", [*LOCKED, *numbers, f"controller.command={command}", "run.duration=1 ms"])

    def pressures_and_rates(*numbers: float) -> Any:
        recording = simulate(locked(*numbers)).recording
        before_2, before, now, after, after_2, *_ = np.stack([recording["pressure_1"], recording["pressure_2"]], axis=1)
        return np.stack([now, (before_2 - 8.0 * before + 8.0 * after - after_2) / (12.0 * 0.1e-3)])

    def change(low: tuple[float, ...], high: tuple[float, ...]) -> Any:
        return pressures_and_rates(*high) - pressures_and_rates(*low)

    middle = 450.0, 250.0, 0.5
    by_1, by_2 = change((448.0, 250.0, 0.5), (452.0, 250.0, 0.5)), change((450.0, 248.0, 0.5), (450.0, 252.0, 0.5))
    by_command = change((450.0, 250.0, 0.49), (450.0, 250.0, 0.51))
    slopes = np.stack([by_1[1], by_2[1]], axis=1) @ np.linalg.inv(np.stack([by_1[0], by_2[0]], axis=1))
    gains = (by_command[1] - slopes @ by_command[0]) / 0.02
    model = linear_model(locked(*middle), "0.2 ms")
    first = simulate(locked(*middle)).recording
    emptied = simulate(load_scenario("step-response", EMPTYING))
    k = emptied.scenario.device.gas.heat_capacity_ratio
    pressure, temperature = emptied.recording["pressure_1"], emptied.recording["temperature_1"]
    isentrope = temperature[0] * (pressure / pressure[0]) ** ((k - 1.0) / k)
    return {
        "start": float(max(abs(first["pressure_1"][0] / 450e3 - 1.0), abs(first["pressure_2"][0] / 250e3 - 1.0))),
        "linear": max(
            float(np.abs(np.asarray(model.A) - slopes).max() / np.abs(slopes).max()),
            float(np.abs(np.asarray(model.B)[:, 0] / gains - 1.0).max()),
        ),
        "isentrope": float(np.abs(temperature / isentrope - 1.0).max()),
    }


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

    if "scenario" not in case:
        return recorded(case)
    found: dict[str, Any] = {}
    scenario = load_scenario(case["scenario"], case.get("set", []))
    run = plan_run(scenario)
    found["compiled"] = digest(run_batch(batch_of(run)))
    with tempfile.TemporaryDirectory() as folder:
        for file, content in c_library(scenario).items():
            (Path(folder) / file).write_bytes(content)
        words = ["make", "-s", "-C", folder, "CFLAGS=-std=c99 -O0", "check"]
        found["exported"] = subprocess.run(words, capture_output=True, check=False).returncode == 0
    if "linear" in case:
        model = linear_model(scenario, case["linear"])
        found["linear"] = [np.asarray(matrix).tolist() for matrix in (model.A, model.B, model.C, model.D)]
    if case.get("solver", True):
        agreement = compare_with_reference(run)
        found["apart"] = max(agreement.angle / 2e-4, agreement.pressure_1 / 1e-3, agreement.pressure_2 / 1e-3)
    if case.get("closes"):
        recording = simulate(scenario).recording
        rows = {f"state.{name}": recording[name] for name in ("angle", "angular_velocity", "mass_1", "mass_2")}
        net = net_torques(run, rows, recording["torque"])
        pushed = run.plant.inertia * np.gradient(recording["angular_velocity"], recording.time)
        found["open"] = float(np.abs(net - pushed)[2:-2].max() / np.abs(net).max())
    os.environ["PPAFO_BACKEND"] = "python"
    found["python"] = digest(run_batch(batch_of(plan_run(scenario))))
    if case.get("closes"):
        found["consequences"] = consequences()
    return found


def turn(module: ModuleType, name: str, one: Mapping[str, Any]) -> None:
    """Change a function of a loaded module, and the file of the module."""
    path = Path(str(module.__file__))
    text = changed(path.read_text(encoding="utf-8"), name, one)
    path.write_text(text, encoding="utf-8")
    compiled = compile(text, str(path), "exec", dont_inherit=True).co_consts
    made = {code.co_name: code for code in compiled if isinstance(code, CodeType)}
    # All functions of the module, whose lines the change may move.
    old = {at: each for at, each in vars(module).items() if at in made and isinstance(each, FunctionType)}
    new = {each.__code__: made[at] for at, each in old.items() if each.__code__.co_name == at}
    # What was made of a function with its parts has the same code.
    for each in gc.get_objects():
        if isinstance(each, FunctionType) and each.__code__ in new:
            each.__code__ = new[each.__code__]
    linecache.checkcache()


def serve() -> None:
    """Print the outcome of each line of the input: a case, and the name of a changed function or nothing."""
    from ppafo.errors import PpafoError
    from tests.reference import reference_solver  # noqa: F401

    for needed in ("ppafo.exports.c_library", "ppafo.analyses.linearise.model", "ppafo.running", "scipy.integrate"):
        importlib.import_module(needed)
    for line in sys.stdin:
        case, name = json.loads(line)
        module = importlib.import_module(name.rpartition(".")[0]) if name else None
        text = Path(str(module.__file__)).read_text(encoding="utf-8") if module else ""
        end, begin = os.pipe()
        if os.fork() == 0:
            try:
                if module:
                    turn(module, name.rpartition(".")[2], functions()[name])
                found: Any = outcome(listed()["case"][case])
            except PpafoError as error:
                found = f"{type(error).__name__}: {error}"
            os.write(begin, json.dumps(found).encode())
            os._exit(0)
        os.close(begin)
        with os.fdopen(end) as answer:
            print(answer.read(), flush=True)
        os.wait()
        if module:
            Path(str(module.__file__)).write_text(text, encoding="utf-8")


@contextmanager
def outcomes() -> Iterator[Callable[[str, str], dict[str, Any] | str]]:
    """Yield a function of a case and the name of a changed function or nothing, for the outcome or the refusal."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "src"
        shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("__pycache__"))
        words = [sys.executable, "-c", "from scripts import equations as e; e.serve()"]
        environment = {**os.environ, "PYTHONPATH": f"{source}{os.pathsep}{ROOT}", "PYTHONDONTWRITEBYTECODE": "1"}
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        with subprocess.Popen(words, cwd=ROOT, env=environment, **pipes) as server:
            assert server.stdin is not None
            assert server.stdout is not None
            asks, answers = server.stdin, server.stdout

            def outcome_of(case: str, name: str) -> dict[str, Any] | str:
                asks.write(json.dumps([case, name]) + "\n")
                asks.flush()
                found: dict[str, Any] | str = json.loads(answers.readline())
                return found

            yield outcome_of
            asks.close()


def main() -> None:
    """Write the page, or print what the change of functions does."""
    if not sys.argv[1:]:
        PAGE.write_text(page_text(), encoding="utf-8")
        return
    with outcomes() as outcome_of:
        for name in sys.argv[1:]:
            case = functions()[name]["case"]
            found = outcome_of(case, name)
            print(name, "in", case)
            print(" ", found if isinstance(found, str) else {k: v for k, v in found.items() if k != "linear"})


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    importlib.invalidate_caches()
    main()
