"""What a user waits for at the command line: help, the very first simulation, and every later one."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.report import Line, Target
from benchmarks.timing import Timing, run_python, time_in_turn
from ppafo.engine.cache.folder import CACHE_VARIABLE
from ppafo.errors import SimulationError

GROUP = "Command line, from start to end of the process"
ENTRY = ("-c", "import sys; from ppafo.cli.main import main; sys.exit(main())")
SCENARIO = "step-response"
HELP_TARGET = Target(0.4, at_least=False)
FIRST_TARGET = Target(15.0, at_least=False)
LATER_TARGET = Target(1.5, at_least=False)


def measure_start_up(first_times: int, later_times: int, say: Callable[[str], None]) -> list[Line]:
    """Lines about ``ppafo --help`` and ``ppafo simulate``, with an empty cache folder and with a filled one."""
    with tempfile.TemporaryDirectory(prefix="ppafo-bench-") as folder:
        say("command line: help")
        lines = [_line("start_help", "ppafo --help", HELP_TARGET, _help(Path(folder), later_times))]
        say(f"command line: first simulation, {first_times} times, each with an empty cache")
        names = [str(number) for number in range(first_times)]
        first = _joined([_simulation(Path(folder) / name, 1) for name in names])
        what = f"ppafo simulate {SCENARIO}"
        lines.append(_line("start_first_simulation", f"{what}, first ever", FIRST_TARGET, first))
        say("command line: later simulations")
        later = _simulation(Path(folder) / names[-1], later_times)
        lines.append(_line("start_later_simulation", f"{what}, later", LATER_TARGET, later))
    return lines


def _help(folder: Path, times: int) -> Timing | str:
    return _timed(("--help",), folder, times)


def _simulation(folder: Path, times: int) -> Timing | str:
    return _timed(("simulate", SCENARIO, "--out", str(folder / "result")), folder, times)


def _timed(words: Sequence[str], folder: Path, times: int) -> Timing | str:
    """Durations of a command whose caches (compiled models, fonts) are in ``folder``, or why it failed."""
    environment = {
        CACHE_VARIABLE: str(folder / "programs"),
        "MPLCONFIGDIR": str(folder / "matplotlib"),
        "PYTHONDONTWRITEBYTECODE": "",  # as on a user's machine, where Python keeps its own compiled files
    }

    def call() -> None:
        outcome = run_python([*ENTRY, *words], environment)
        if outcome.code != 0:
            raise SimulationError(f"ppafo {words[0]}: {outcome.complaint}")

    try:
        return time_in_turn({"command": call}, times)["command"]
    except SimulationError as error:
        return str(error)


def _joined(parts: Sequence[Timing | str]) -> Timing | str:
    failures = [part for part in parts if isinstance(part, str)]
    if failures:
        return failures[0]
    return Timing(tuple(seconds for part in parts if isinstance(part, Timing) for seconds in part.seconds))


def _line(line_id: str, what: str, target: Target, timing: Timing | str) -> Line:
    if isinstance(timing, str):
        return Line(line_id, GROUP, what, None, "s", target, note=f"not measured: {timing}")
    return Line(line_id, GROUP, what, timing.best, "s", target, (timing.worst, timing.best))
