"""What a user waits for at the command line: help, the very first simulation, and every later one."""

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.report import Line, Target
from benchmarks.timing import Timing, run_python
from ppafo.engine.cache import CACHE_VARIABLE

GROUP = "Command line, from start to end of the process"
ENTRY = ("-c", "import sys; from ppafo.cli.main import main; sys.exit(main())")
SCENARIO = "step-response"
HELP_TARGET = Target(0.4, at_least=False)
FIRST_TARGET = Target(15.0, at_least=False)
LATER_TARGET = Target(1.5, at_least=False)


def measure_start_up(first_times: int, later_times: int, say: Callable[[str], None]) -> list[Line]:
    """Lines about ``ppafo --help`` and ``ppafo simulate``, with an empty cache folder and with a filled one.

    Of a simulation to its first number and to its end: figures and page come after the numbers.
    """
    with tempfile.TemporaryDirectory(prefix="ppafo-bench-") as folder:
        say("command line: help")
        helped = _timed([Path(folder)] * later_times, ("--help",))
        lines = [_line("start_help", "ppafo --help", HELP_TARGET, helped, "end")]
        say(f"command line: first simulation, {first_times} times, each with an empty cache")
        folders = [Path(folder) / str(number) for number in range(first_times)]
        words, what = ("simulate", SCENARIO), f"ppafo simulate {SCENARIO}"
        ever = _timed(folders, words)
        lines.append(_line("start_first_number", f"{what}, first ever, to its first number", None, ever, "first"))
        lines.append(_line("start_first_simulation", f"{what}, first ever", FIRST_TARGET, ever, "end"))
        say("command line: later simulations")
        later = _timed(folders[-1:] * later_times, words)
        lines.append(_line("start_later_number", f"{what}, later, to its first number", None, later, "first"))
        lines.append(_line("start_later_simulation", f"{what}, later", LATER_TARGET, later, "end"))
    return lines


def _timed(folders: Sequence[Path], words: Sequence[str]) -> dict[str, Timing] | str:
    """Times of a command to its ``first`` output and to its ``end``, or why it failed.

    It runs once for each folder, in which its caches (compiled models, fonts) and its result are.
    """
    first, end = [], []
    for folder in folders:
        environment = {
            CACHE_VARIABLE: str(folder / "programs"),
            "MPLCONFIGDIR": str(folder / "matplotlib"),
            "PYTHONDONTWRITEBYTECODE": "",  # as on a user's machine, where Python keeps its own compiled files
        }
        result = () if words[0].startswith("-") else ("--out", str(folder / "result"))
        start = time.perf_counter()
        outcome = run_python([*ENTRY, *words, *result], environment)
        end.append(time.perf_counter() - start)
        first.append(outcome.first)
        if outcome.code != 0:
            return f"ppafo {words[0]}: {outcome.complaint}"
    return {"first": Timing(tuple(first)), "end": Timing(tuple(end))}


def _line(line_id: str, what: str, target: Target | None, timed: dict[str, Timing] | str, which: str) -> Line:
    if isinstance(timed, str):
        return Line(line_id, GROUP, what, None, "s", target, note=f"not measured: {timed}")
    timing = timed[which]
    return Line(line_id, GROUP, what, timing.best, "s", target, (timing.worst, timing.best))
