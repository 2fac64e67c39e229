"""What the files of tests cost: costly ones begin first, each is shown with its seconds, and a new one is an error.

``--costs show`` prints the table, ``--costs record`` also writes it to ``costs.toml``. A cost is CPU time of the tests
and of the processes that they start, so that a busy machine changes it little. Models and libraries that are built only
once in a session count apart: which file builds them is chance.
"""

import contextlib
import gc
import os
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from ppafo.engine import cache

RECORDED = Path(__file__).with_name("costs.toml")
NOTED = 5.0
"""CPU seconds above which a file is recorded."""
LARGEST = 10.0
"""CPU seconds of a file that is not recorded: twice the above, for a machine that is slower or busy."""
SHOWN = 2.0
HEADING = """\
# CPU seconds of each file of tests that costs more than 5, models not counted. Written by
#     .venv/bin/pytest -n 2 --dist loadfile --costs record
# A file above 10 that is not here is an error of `make test` and `make test-all`: make it quicker, mark as
# `@pytest.mark.long` what `make test-all` alone shall run, and only then record it here.

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


def pytest_configure(config: pytest.Config) -> None:
    """Let models count apart, and gather the costs where the session is led."""
    config.addinivalue_line("markers", "long: takes long, so that `make test-all` alone runs it")
    cache._Wanted.compile = counted(cache._Wanted.compile)  # type: ignore[method-assign]
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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let costly files begin first, so that no process is left alone with one at the end."""
    known = recorded()
    items.sort(key=lambda item: -known.get(file_of(item.nodeid), 0.0))


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


def file_of(nodeid: str) -> str:
    """The file of a test."""
    return nodeid.partition("::")[0]


def recorded() -> dict[str, float]:
    """Recorded costs [s] by file."""
    return tomllib.loads(RECORDED.read_text(encoding="utf-8")) if RECORDED.exists() else {}


class Table:
    """The costs of all processes, gathered where the session is led."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.own: dict[str, float] = defaultdict(float)
        self.tests: dict[str, int] = defaultdict(int)
        self.built = 0.0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up what a test cost."""
        for name, costs in report.user_properties:
            if name == _PROPERTY and report.when == "teardown":
                own, built = costs
                self.own[file_of(report.nodeid)] += own
                self.tests[file_of(report.nodeid)] += 1
                self.built += built

    def unrecorded(self) -> list[str]:
        """Files that are costly, and not recorded as such."""
        return sorted({file for file, own in self.own.items() if own > LARGEST} - recorded().keys())

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Record, or let the session fail."""
        asked = self.config.getoption("--costs")
        if asked == "record":
            write(self.own)
        elif asked and self.unrecorded() and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

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
        for file in self.unrecorded():
            write_line(f"ERROR {file} takes more than {LARGEST:g} s: see {RECORDED.name}")


def write(own: dict[str, float]) -> None:
    """Record the costs [s] of files that ran; those of others stay as long as the files are there."""
    root = RECORDED.parents[1]
    known = {file: seconds for file, seconds in recorded().items() if file not in own and (root / file).is_file()}
    known |= {file: seconds for file, seconds in own.items() if seconds > NOTED}
    lines = [f'"{file}" = {seconds:.1f}\n' for file, seconds in sorted(known.items())]
    RECORDED.write_text(HEADING + "".join(lines), encoding="utf-8")
