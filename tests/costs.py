"""What the files of tests cost, and which tests are long: ``make test`` leaves those out, ``make test-all`` nothing.

``--costs show`` prints the table, ``--costs record`` also writes it to ``costs.toml``. A cost is CPU time of the tests
and of the processes that they start, so that a busy machine changes it little. Models and libraries that are built only
once in a session count apart: which file builds them is chance.
"""

import contextlib
import gc
import json
import os
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from ppafo.engine import loading

RECORDED = Path(__file__).with_name("costs.toml")
LONG = 2.0
"""CPU seconds of a test function, with all its parameters, above which it is long."""
NOTED = 5.0
"""CPU seconds above which a file is recorded."""
LARGEST = 10.0
"""CPU seconds above which a file that is not recorded is named: twice ``NOTED``, for a slower or busy computer."""
SHOWN = 2.0
PIECE = 30
"""Number of tests from which a file is dealt to several parts."""
HEADING = """\
# CPU seconds of the costly files of tests, models not counted, and their long tests, which `make test` leaves out.
# Written by
#     .venv/bin/pytest -n 2 --dist loadfile --costs record
# which adds tests above 2 s; take a name out to try it again. `@pytest.mark.short` keeps a test in `make test` whatever
# it costs, `@pytest.mark.long` keeps one out. A file above 10 s that is not here is named after a run: make it quicker
# before you record it.
"""
_PROPERTY = "ppafo_costs"


class Built:
    """CPU seconds of this process that went into what is built once, however many threads build at a time."""

    def __init__(self) -> None:
        self.seconds, self._under_way, self._start = 0.0, 0, 0.0

    @contextlib.contextmanager
    def counted(self) -> Iterator[None]:
        """Count what happens inside a ``with`` block."""
        if self._under_way == 0:
            self._start = cpu_seconds()
        self._under_way += 1
        try:
            yield
        finally:
            self._under_way -= 1
            if self._under_way == 0:
                self.seconds += cpu_seconds() - self._start


BUILT = Built()


def cpu_seconds() -> float:
    """CPU seconds of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def counted(build: Callable[..., Any]) -> Callable[..., Any]:
    """A function whose time counts as that of building."""

    def call(*arguments: Any) -> Any:
        with BUILT.counted():
            return build(*arguments)

    return call


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option of ``make test`` and ``make test-all``."""
    parser.addoption("--costs", choices=["show", "record"], help="show what each file costs, and record it too")
    parser.addoption(
        "--part", metavar="I/N", help="run the files of one of N parts of about equal cost; I may be any number"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Let models count apart, and gather the costs where the session is led."""
    config.addinivalue_line("markers", "long: `make test-all` alone runs it")
    config.addinivalue_line("markers", "short: `make test` runs it too, whatever it costs")
    loading.load_or_compile = counted(loading.load_or_compile)
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Table(config), "table of costs")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[object]:
    """Do not search for garbage among the tests, neither while they are collected nor later: they stay to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what is long; let costly files begin first, so that no process is left alone with one at the end."""
    known = recorded()
    for item in items:
        file, function = file_and_function(item.nodeid)
        if file in known and function in known[file].long and item.get_closest_marker("short") is None:
            item.add_marker("long")
    items.sort(key=lambda item: -known.get(file_and_function(item.nodeid)[0], NOTHING).seconds)
    if part := config.getoption("--part"):
        number, parts = map(int, part.split("/"))
        # The costliest files are dealt one by one, so that the parts cost about the same; one of many tests in pieces.
        counted, pieces = Counter[str](), list[tuple[str, int]]()
        for item in items:
            file, _ = file_and_function(item.nodeid)
            pieces.append((file, counted[file] // PIECE))
            counted[file] += 1
        places = {piece: place for place, piece in enumerate(dict.fromkeys(pieces))}
        items[:] = [item for item, piece in zip(items, pieces, strict=True) if places[piece] % parts == number % parts]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note what the clocks show before a test."""
    item.stash[_BEFORE] = cpu_seconds(), BUILT.seconds
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Send along with the last report of a test what it cost."""
    report = yield
    if call.when == "teardown":
        before, built_before = item.stash[_BEFORE]
        built = BUILT.seconds - built_before
        report.user_properties.append((_PROPERTY, (cpu_seconds() - before - built, built)))
    return report


_BEFORE = pytest.StashKey[tuple[float, float]]()


@dataclass(frozen=True, slots=True)
class Cost:
    """Recorded CPU seconds of a file, and the names of its long tests."""

    seconds: float
    long: frozenset[str]


NOTHING = Cost(0.0, frozenset())


def file_and_function(nodeid: str) -> tuple[str, str]:
    """The file of a test, and its name without parameters."""
    file, _, name = nodeid.partition("::")
    return file, name.partition("[")[0]


def recorded() -> dict[str, Cost]:
    """What is recorded, by file."""
    if not RECORDED.exists():
        return {}
    tables = tomllib.loads(RECORDED.read_text(encoding="utf-8"))
    return {file: Cost(table["seconds"], frozenset(table["long"])) for file, table in tables.items()}


class Table:
    """The costs of all processes, gathered where the session is led."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.own: dict[str, float] = defaultdict(float)
        self.functions: dict[tuple[str, str], float] = defaultdict(float)
        self.tests: dict[str, int] = defaultdict(int)
        self.built = 0.0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up what a test cost."""
        for name, costs in report.user_properties:
            if name == _PROPERTY and report.when == "teardown":
                own, built = costs
                file, function = file_and_function(report.nodeid)
                self.own[file] += own
                self.functions[file, function] += own
                self.tests[file] += 1
                self.built += built

    def too_costly(self) -> list[str]:
        """A line about each costly file that is not recorded.

        No failure: a slower computer, or linear algebra of an older processor, doubles a cost without a change of code.
        """
        return [
            f"{file} costs {own:.1f} s, more than {LARGEST:g} s: see {RECORDED.name}"
            for file, own in sorted(self.own.items())
            if own > LARGEST and file not in recorded()
        ]

    def pytest_sessionfinish(self) -> None:
        """Record, where that was asked for."""
        if self.config.getoption("--costs") == "record":
            write(self.own, self.functions, is_whole=not (self.config.option.markexpr or self.config.option.keyword))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the table."""
        if not self.config.getoption("--costs"):
            return
        write_line = terminalreporter.write_line
        terminalreporter.section("CPU seconds of each file")
        shown = [file for file in sorted(self.own, key=lambda file: -self.own[file]) if self.own[file] > SHOWN]
        for file in shown:
            write_line(f"{self.own[file]:8.1f}  {file} ({self.tests[file]} tests)")
        others = self.own.keys() - set(shown)
        write_line(f"{sum(self.own[file] for file in others):8.1f}  {len(others)} other files")
        write_line(f"{self.built:8.1f}  models and libraries that are built once")
        write_line(f"{sum(self.own.values()) + self.built:8.1f}  in all, of {sum(self.tests.values())} tests")
        for line in self.too_costly():
            write_line(f"NOTE {line}")


def write(own: Mapping[str, float], functions: Mapping[tuple[str, str], float], is_whole: bool) -> None:
    """Record the costs [s] of files and test functions that ran. Where only some were to run, costs of files stay."""
    root, known = RECORDED.parents[1], recorded()
    lines = []
    for file in sorted(known.keys() | own.keys()):
        before = known.get(file, NOTHING)
        text = (root / file).read_text(encoding="utf-8") if (root / file).is_file() else ""
        found = {name for (place, name), seconds in functions.items() if place == file and seconds > LONG}
        long = sorted(name for name in before.long | found if f"def {name}(" in text)
        seconds = own[file] if file in own and (is_whole or file not in known) else before.seconds
        if text and (long or seconds > NOTED):
            names = "".join(f"    {json.dumps(name)},\n" for name in long)
            lines.append(f'\n["{file}"]\nseconds = {seconds:.1f}\nlong = [\n{names}]\n')
    RECORDED.write_text(HEADING + "".join(lines), encoding="utf-8")
