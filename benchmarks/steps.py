"""``python -m benchmarks.steps``: CPU seconds of commands whose models are compiled, and where those of a run go.

CPU seconds (user and system, child processes among them) say what a command costs; on a busy machine they depend less
on the others than its duration does. Each number is the best of some processes, which all find what they need in the
cache.
"""

import argparse
import gc
import importlib
import json
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.command import run_command
from benchmarks.telling import tell
from benchmarks.timing import Outcome, run_python
from ppafo.cli.main import OBJECTS_BETWEEN_COLLECTIONS
from ppafo.cli.output import EXIT_GOOD, print_result
from ppafo.errors import SimulationError

ENTRY = "import sys; from ppafo.cli.main import main; sys.exit(main())"
SCENARIO, WALK = "torque-task-proportional", "solenoid"
MEASURED = """
import sys
sys.argv[1:] = {words!r}
try:
    exec({code!r}, {{"__name__": "measured"}})
finally:
    from benchmarks.steps import cpu_seconds
    sys.stdout.flush()
    print("\\n" + str(cpu_seconds()))
"""


def cpu_seconds() -> float:
    """Return the CPU time [s] of this process so far, and of its children that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def commands(folder: Path, scenario: str) -> dict[str, tuple[str, list[str]]]:
    """Return code and words of the commands by what they are called."""
    return {
        "ppafo --help": (ENTRY, ["--help"]),
        "ppafo sets list": (ENTRY, ["sets", "list"]),
        f"ppafo simulate {scenario}": (ENTRY, ["simulate", scenario, "--out", str(folder / "run")]),
        f"ppafo.simulate({scenario!r})": (f"import ppafo; ppafo.simulate({scenario!r})", []),
        f"ppafo walk {WALK}": (ENTRY, ["walk", WALK, "--out", str(folder / "walk")]),
    }


def steps_of_run(scenario: str, folder: Path) -> list[dict[str, Any]]:
    """Return CPU time [s] and modules loaded by each step of ``ppafo simulate``, which this process does as it does."""
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    found: list[dict[str, Any]] = []
    state: dict[str, Any] = {}

    def step(name: str, do: Callable[[], Any]) -> None:
        before, modules = cpu_seconds(), len(sys.modules)
        state[name] = do()
        ours = sum(module.partition(".")[0] == "ppafo" for module in sys.modules)
        seconds = cpu_seconds() - before
        found.append({"step": name, "seconds": seconds, "modules": len(sys.modules) - modules, "of ppafo so far": ours})

    def load(*names: str) -> list[Any]:
        return [importlib.import_module(name) for name in names]

    step("start of Python and of the command line", lambda: load("ppafo.cli.main", "ppafo.cli.simulate"))
    found[0]["seconds"] = cpu_seconds()
    command: Any = sys.modules["ppafo.cli.simulate"]
    step("imports to read the scenario", lambda: load("ppafo.simulation.loading", "ppafo.storage"))
    step("scenario", lambda: sys.modules["ppafo.simulation.loading"].load_scenario(scenario))
    step("imports to run it", lambda: load("ppafo.simulation.simulate"))
    step("run", lambda: sys.modules["ppafo.simulation.simulate"].simulate(state["scenario"]))
    result = state["run"]
    step("imports to draw", importlib.import_module("ppafo.report.style").load_drawing)
    finding = command.finding_of(command.assessed(result, False))
    step("figure and page", lambda: load("ppafo.report.finding")[0].page_files(finding))
    step("files", lambda: result.save(folder, state[found[-1]["step"]]))
    return found


def measure(scenario: str, repetitions: int, say: Callable[[str], None]) -> dict[str, Any]:
    """Return the best and the median CPU seconds of each command, and the best of each step of a run."""
    with tempfile.TemporaryDirectory(prefix="ppafo-bench-") as name:
        folder = Path(name)
        found: dict[str, Any] = {}
        for called, (code, words) in commands(folder, scenario).items():
            say(called)
            child = ["-c", MEASURED.format(words=words, code=code)]
            _answered(run_python(child, {}))
            seconds = sorted(float(_answered(run_python(child, {})).splitlines()[-1]) for _ in range(repetitions))
            found[called] = {"best": seconds[0], "median": seconds[len(seconds) // 2]}
        say("steps of a run")
        child = ["-m", "benchmarks.steps", "--scenario", scenario, "--steps-into", str(folder / "steps")]
        runs = [json.loads(_answered(run_python(child, {})).splitlines()[-1]) for _ in range(repetitions)]
    best = [min(same, key=lambda step: float(step["seconds"])) for same in zip(*runs, strict=True)]
    return {"commands": found, "steps": best}


def _answered(outcome: Outcome) -> str:
    if outcome.code != 0:
        raise SimulationError(outcome.complaint)
    return outcome.output


def lines_of(measured: Mapping[str, Any]) -> list[str]:
    """Return the tables of what was measured."""
    width = max(map(len, [*measured["commands"], *(step["step"] for step in measured["steps"])]))
    head = f"{'CPU seconds, models compiled':<{width}}  best  median"
    rows = [f"{name:<{width}}  {row['best']:4.2f}  {row['median']:6.2f}" for name, row in measured["commands"].items()]
    steps = [
        f"{step['step']:<{width}}  {step['seconds']:4.2f}  {step['modules']:7d}  {step['of ppafo so far']:16d}"
        for step in measured["steps"]
    ]
    head_of_steps = f"{'Step of simulate':<{width}}  best  modules  of ppafo so far"
    total = f"{'all steps':<{width}}  {sum(step['seconds'] for step in measured['steps']):4.2f}"
    return [head, *rows, "", head_of_steps, *steps, total]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "--scenario", metavar="NAME", default=SCENARIO, help=f"what is simulated; {SCENARIO} by default"
    )
    parser.add_argument("--repetitions", metavar="N", type=int, default=5, help="processes of each; 5 by default")
    parser.add_argument(
        "--steps-into", metavar="DIR", type=Path, help="do the steps once, in this process, and print them"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")


def run(parsed: argparse.Namespace) -> int:
    """Measure and print."""
    if parsed.steps_into is not None:
        print(json.dumps(steps_of_run(parsed.scenario, parsed.steps_into)))
        return EXIT_GOOD
    measured = measure(parsed.scenario, max(1, parsed.repetitions), tell)
    print_result("\n".join(lines_of(measured)), measured, parsed.json)
    return EXIT_GOOD


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    return run_command("benchmarks.steps", "Measure where the CPU seconds of a run go.", add_arguments, run, words)


if __name__ == "__main__":
    sys.exit(main())
