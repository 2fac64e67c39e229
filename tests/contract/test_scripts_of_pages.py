"""Scripts and benchmarks that pages name start as the pages write them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
_COMMAND = re.compile(r"python ((?:-m (?:scripts|benchmarks)\.\w+)|(?:scripts/\w+\.py))")
PAGES = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
COMMANDS = sorted({command for page in PAGES for command in _COMMAND.findall(page.read_text(encoding="utf-8"))})


def _file(command: str) -> Path:
    module = command.removeprefix("-m ")
    return ROOT / (module if module.endswith(".py") else f"{module.replace('.', '/')}.py")


WITH_NEIGHBOURS = [command for command in COMMANDS if "\nfrom scripts" in _file(command).read_text(encoding="utf-8")]
"""Commands of scripts that import other scripts, which only some ways to call them find."""


def test_pages_name_scripts() -> None:
    assert "scripts/own_devices.py" in WITH_NEIGHBOURS
    assert all(_file(command).is_file() for command in COMMANDS)


@pytest.mark.long
@pytest.mark.parametrize("command", WITH_NEIGHBOURS)
def test_a_script_of_a_page_can_be_imported_as_it_is_called(command: str) -> None:
    """Import only: what a script does is for its own page to show."""
    words = command.split()
    name = words[-1] if words[0] == "-m" else words[0]
    run = f"import runpy, sys; sys.argv = [{name!r}]; " + (
        f"runpy.run_module({name!r}, run_name='imported')"
        if words[0] == "-m"
        else f"sys.path[0] = 'scripts'; runpy.run_path({name!r}, run_name='imported')"
    )
    done = subprocess.run([sys.executable, "-c", run], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
