"""What `make quick`, `make test` and `make test-all` run, and what they say of costs."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests import costs
from tests.repeatable import TOO_SLOW

ROOT = Path(__file__).parents[2]
needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="no make on this machine")


def words_of(target: str) -> list[str]:
    """The words by which a target of the Makefile runs the tests."""
    lines = subprocess.run(["make", "-n", target], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    (line,) = (line for line in lines.splitlines() if " -m pytest " in line)
    return shlex.split(line.partition(" -m pytest ")[2])


@needs_make
def test_make_test_leaves_out_what_is_long_and_make_test_all_nothing() -> None:
    short = words_of("test")
    everything = words_of("test-all")
    assert [word for word in short if word not in everything] == ["-m", "not long"]
    assert [word for word in everything if word not in short] == []


def test_the_recorded_files_and_tests_are_there() -> None:
    for file, cost in costs.recorded().items():
        text = (ROOT / file).read_text(encoding="utf-8")
        assert [name for name in cost.long if f"def {name}(" not in text] == []


def test_every_folder_of_unit_tests_is_a_package_or_module_and_every_package_has_unit_tests() -> None:
    unit = ROOT / "tests" / "unit"
    source = ROOT / "src" / "ppafo"
    folders = {path.parent.relative_to(unit) for path in unit.rglob("test_*.py")}
    strangers = [f for f in folders if not (source / f).is_dir() and not (source / f).with_suffix(".py").is_file()]
    assert strangers == []
    packages = {path.parent.name for path in source.glob("*/__init__.py")}
    untested = [name for name in packages if not (unit / name).is_dir() and not (unit / f"test_{name}.py").is_file()]
    assert untested == []


def test_drawn_tests_draw_the_same_every_time_and_may_be_slow() -> None:
    assert settings().derandomize
    assert settings().deadline is None
    assert TOO_SLOW in settings().suppress_health_check
    own = re.compile(r"^ *@settings\(.*suppress_health_check=(.*)\)$", re.MULTILINE)
    chosen = [text for path in (ROOT / "tests").rglob("test_*.py") for text in own.findall(path.read_text("utf-8"))]
    assert len(chosen) >= 5
    assert [text for text in chosen if "TOO_SLOW" not in text and text != f"list({HealthCheck.__name__})"] == []
