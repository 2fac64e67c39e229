"""What `make quick`, `make test` and `make test-all` run, and what they say of costs."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from ppafo.engine.cache import kept
from tests import costs
from tests.repeatable import TOO_SLOW

ROOT = Path(__file__).parents[2]
needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="no make on this machine")
BURNS = """
import pytest

def test_a():
    assert sum(range(20_000_000)) > 1

@pytest.mark.short
def test_b():
    assert sum(range(20_000_000)) > 1
"""
"""Tests of about half a second of CPU time."""


def words_of(target: str) -> list[str]:
    """The words by which a target of the Makefile runs the tests."""
    lines = subprocess.run(["make", "-n", target], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    (line,) = (line for line in lines.splitlines() if " -m pytest " in line)
    return shlex.split(line.partition(" -m pytest ")[2])


def run_tests(*words: str, cwd: Path = ROOT) -> "subprocess.CompletedProcess[str]":
    """Run pytest on its own."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


@needs_make
def test_make_quick_finds_its_tests_and_knows_its_options() -> None:
    done = run_tests(*words_of("quick"), "-n", "0", "--collect-only")
    assert done.returncode == 0, done.stdout[-1000:]
    assert done.stdout.count("::") > 1000


@needs_make
def test_make_test_leaves_out_what_is_long_and_make_test_all_nothing() -> None:
    short, everything = words_of("test"), words_of("test-all")
    assert [word for word in short if word not in everything] == ["-m", "not long"]
    assert [word for word in everything if word not in short] == []


@pytest.fixture
def costly(tmp_path: Path) -> Path:
    """A folder with a costly file and a light one, of which nothing is recorded, and limits that are soon reached."""
    (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    (tmp_path / "conftest.py").write_text(
        "from pathlib import Path\nfrom tests import costs\npytest_plugins = ('tests.costs',)\n"
        "costs.RECORDED = Path(__file__).parent / 'tests' / 'costs.toml'\n"
        "costs.LONG, costs.NOTED, costs.LARGEST, costs.SHOWN = 0.05, 0.05, 0.1, 0.05\n",
        encoding="utf-8",
    )
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_burns.py").write_text(BURNS, encoding="utf-8")
    (tmp_path / "tests" / "test_light.py").write_text("def test_c():\n    assert True\n", encoding="utf-8")
    return tmp_path


def test_a_new_file_that_costs_much_is_named_until_it_is_recorded(costly: Path) -> None:
    asked = run_tests("--costs", "show", cwd=costly)
    assert asked.returncode == 0, "a slow computer fails nothing"
    assert re.findall(r"^NOTE (\S+) costs \S+ s, more than 0.1 s: see costs.toml$", asked.stdout, re.MULTILINE) == [
        "tests/test_burns.py"
    ]
    assert "NOTE" not in run_tests(cwd=costly).stdout, "nobody asked"
    assert run_tests("--costs", "record", cwd=costly).returncode == 0
    again = run_tests("--costs", "show", cwd=costly)
    assert "NOTE" not in again.stdout
    assert "tests/test_burns.py (2 tests)" in again.stdout


def test_what_was_long_is_left_out_of_the_short_suite_but_for_what_is_marked_short(costly: Path) -> None:
    words = ("-m", "not long", "--costs", "record")
    assert "3 passed" in run_tests(*words, cwd=costly).stdout
    assert costs_of(costly).keys() == {"tests/test_burns.py"}
    assert costs_of(costly)["tests/test_burns.py"]["long"] == ["test_a", "test_b"]
    assert "2 passed, 1 deselected" in run_tests(*words, cwd=costly).stdout, "test_b is marked"
    assert costs_of(costly)["tests/test_burns.py"]["long"] == ["test_a", "test_b"], "what did not run stays"
    (costly / "tests" / "test_burns.py").write_text(BURNS.replace("test_a", "test_d"), encoding="utf-8")
    assert "2 passed, 1 deselected" not in run_tests(*words, cwd=costly).stdout
    assert costs_of(costly)["tests/test_burns.py"]["long"] == ["test_b", "test_d"], "what is gone does not"


def test_parts_of_a_suite_share_no_file_and_leave_none_out(costly: Path) -> None:
    parts = [run_tests("-v", "--part", part, cwd=costly).stdout for part in ("0/2", "7/2")]
    assert [re.findall(r"^tests/\w+\.py::(\w+) PASSED", text, re.MULTILINE) for text in parts] == [
        ["test_a", "test_b"],
        ["test_c"],
    ]


def costs_of(folder: Path) -> dict[str, Any]:
    """What was recorded in a folder."""
    return tomllib.loads((folder / "tests" / "costs.toml").read_text(encoding="utf-8"))


def test_the_recorded_files_and_tests_are_there() -> None:
    for file, cost in costs.recorded().items():
        text = (ROOT / file).read_text(encoding="utf-8")
        assert [name for name in cost.long if f"def {name}(" not in text] == []


def test_models_are_compiled_by_a_function_whose_time_counts_apart() -> None:
    before = costs.BUILT.seconds
    costs.counted(lambda: sum(range(20_000_000)))()
    assert costs.BUILT.seconds > before + 0.05
    assert kept.RequestedProgram.compile.__code__ is costs.counted(print).__code__


def test_drawn_tests_draw_the_same_every_time_and_may_be_slow() -> None:
    assert settings().derandomize
    assert settings().deadline is None
    assert TOO_SLOW in settings().suppress_health_check
    own = re.compile(r"^ *@settings\(.*suppress_health_check=(.*)\)$", re.MULTILINE)
    chosen = [text for path in (ROOT / "tests").rglob("test_*.py") for text in own.findall(path.read_text("utf-8"))]
    assert len(chosen) >= 5
    assert [text for text in chosen if "TOO_SLOW" not in text and text != f"list({HealthCheck.__name__})"] == []
