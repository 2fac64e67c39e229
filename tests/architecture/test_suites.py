"""What `make quick`, `make test` and `make test-all` run, and what they say of costs."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate
from tests import costs
from tests.repeatable import TOO_SLOW

ROOT = Path(__file__).parents[2]
needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="no make on this machine")
BURNS = "def test_a():\n    assert sum(range(20_000_000)) > 1\n"
"""A test of about half a second of CPU time."""


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


def test_a_new_file_that_costs_much_is_an_error_until_it_is_recorded(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    (tmp_path / "conftest.py").write_text(
        "from pathlib import Path\nfrom tests import costs\npytest_plugins = ('tests.costs',)\n"
        "costs.RECORDED = Path(__file__).parent / 'tests' / 'costs.toml'\n"
        "costs.NOTED, costs.LARGEST, costs.SHOWN = 0.05, 0.1, 0.05\n",
        encoding="utf-8",
    )
    folder = tmp_path / "tests"
    folder.mkdir()
    (folder / "test_burns.py").write_text(BURNS, encoding="utf-8")
    (folder / "test_light.py").write_text("def test_b():\n    assert True\n", encoding="utf-8")
    asked = run_tests("--costs", "show", cwd=tmp_path)
    assert asked.returncode == 1
    assert "ERROR tests/test_burns.py takes more than 0.1 s" in asked.stdout
    assert "test_light.py takes" not in asked.stdout
    assert run_tests(cwd=tmp_path).returncode == 0, "nobody asked"
    assert run_tests("--costs", "record", cwd=tmp_path).returncode == 0
    assert re.findall(r'^"(.*)" = ', (folder / "costs.toml").read_text(), re.MULTILINE) == ["tests/test_burns.py"]
    again = run_tests("--costs", "show", cwd=tmp_path)
    assert again.returncode == 0
    assert "(1 tests)" in again.stdout


def test_the_recorded_files_are_there() -> None:
    assert [file for file in costs.recorded() if not (ROOT / file).is_file()] == []


@pytest.mark.usefixtures("fresh_cache")
def test_a_model_that_is_compiled_counts_apart() -> None:
    before = costs.BUILT.seconds
    simulate(load_scenario("step-response", ["sensors.delay=3 ms"]))
    assert costs.BUILT.seconds > before + 0.05


def test_drawn_tests_draw_the_same_every_time_and_may_be_slow() -> None:
    assert settings().derandomize
    assert settings().deadline is None
    assert TOO_SLOW in settings().suppress_health_check
    own = re.compile(r"^ *@settings\(.*suppress_health_check=(.*)\)$", re.MULTILINE)
    chosen = [text for path in (ROOT / "tests").rglob("test_*.py") for text in own.findall(path.read_text("utf-8"))]
    assert len(chosen) >= 5
    assert [text for text in chosen if "TOO_SLOW" not in text and text != f"list({HealthCheck.__name__})"] == []
