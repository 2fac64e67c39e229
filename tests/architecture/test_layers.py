"""Imports go down only, and heavy packages are loaded only where they are used."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAVY = ("matplotlib", "xarray", "pandas", "scipy", "numpy", "jinja2", "h5netcdf")
PACKAGE = "import ppafo"
HELP = "from ppafo.cli.main import main\ntry:\n    main(['--help'])\nexcept SystemExit:\n    pass"
HELP_OF_A_COMMAND = HELP.replace("'--help'", "'simulate', '--help'")


def loaded_by(code: str) -> str:
    """The heavy packages that a fresh Python has loaded after running the code, as the last line that it prints."""
    tail = f"\nimport sys\nprint([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code + tail], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1]


def test_the_import_contracts_are_kept() -> None:
    program = shutil.which("lint-imports", path=str(Path(sys.executable).parent))
    assert program is not None, "import-linter belongs to the dev extra"
    done = subprocess.run([program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout


def test_every_package_has_its_place_in_the_layers() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    layers = {part.strip() for layer in contracts[0]["layers"] for part in layer.split("|")}
    source = ROOT / "src" / "ppafo"
    parts = {path.parent.name for path in source.glob("*/__init__.py")}
    parts |= {path.stem for path in source.glob("*.py") if path.stem != "__init__"}
    assert layers == {f"ppafo.{part}" for part in parts}


def test_the_page_on_architecture_shows_the_layers_of_the_contract() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rooms = re.findall(r"^ {4}(\S+(?: \| \S+)*) {2,}\S", page, re.MULTILINE)
    assert rooms == [layer.replace("ppafo.", "") for layer in contracts[0]["layers"]]


@pytest.mark.parametrize("code", [PACKAGE, HELP, HELP_OF_A_COMMAND], ids=["import", "help", "help of a command"])
def test_nothing_heavy_is_loaded(code: str) -> None:
    assert loaded_by(code) == "[]"
