"""``import ppafo``: small, quick, and everything in it works."""

import importlib
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import ppafo

ROOT = Path(__file__).parents[2]


def test_every_public_name_can_be_had_and_is_listed() -> None:
    for name in ppafo.__all__:
        assert getattr(ppafo, name) is not None
    assert set(ppafo.__all__) <= set(dir(ppafo))
    assert sorted(ppafo.__all__) == ppafo.__all__


def test_the_stub_for_type_checkers_is_that_of_the_table() -> None:
    written = runpy.run_path(str(ROOT / "scripts" / "public_api.py"))["stub"]()
    stub = (ROOT / "src" / "ppafo" / "__init__.pyi").read_text(encoding="utf-8")
    assert stub.splitlines() == written.splitlines(), "python scripts/public_api.py"


@pytest.mark.long
def test_a_type_checker_knows_the_types_of_public_names(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    code = "import ppafo\n\nresult: int = ppafo.simulate('step-response')\nppafo.simulated\n"
    (tmp_path / "user.py").write_text(code, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--config-file=", "--cache-dir", str(tmp_path), "user.py"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert "user.py:3: error: Incompatible types in assignment" in done.stdout
    assert 'user.py:4: error: Module has no attribute "simulated"' in done.stdout


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'ppafo' has no attribute 'simulated'"):
        _ = ppafo.simulated
    assert not hasattr(ppafo, "nothing_of_the_kind")


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = ("numpy", "pint", "pydantic", "matplotlib", "xarray", "h5netcdf", "scipy", "pandas")
    code = f"import sys, ppafo; print([name for name in {heavy} if name in sys.modules])"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed == "[]\n"


def test_a_plain_run_loads_nothing_of_walking() -> None:
    code = (
        "import sys\nfrom ppafo.simulation.loading import load_scenario\nfrom ppafo.simulation import plan, simulate\n"
        "plan.plan_run(load_scenario('step-response'))\n"
        "print([name for name in sys.modules if name.startswith('ppafo.') and 'walking' in name])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_public_functions_are_the_ones_of_their_modules() -> None:
    assert ppafo.simulate is importlib.import_module("ppafo.running").simulate
    assert ppafo.audit is importlib.import_module("ppafo.analyses.sets.audit").audit


def test_three_lines_give_a_result_and_a_plot() -> None:
    result = ppafo.simulate("step-response")
    assert result.status.kind == "completed"
    assert len(result.plot().axes) == 5


def test_names_and_signatures_are_those_that_were_recorded() -> None:
    written = runpy.run_path(str(ROOT / "scripts" / "public_api.py"))["public_api"]()
    recorded = (ROOT / "tests" / "snapshots" / "public-api.txt").read_text(encoding="utf-8")
    assert written.splitlines() == recorded.splitlines(), (
        "if it is meant: python scripts/public_api.py, then CHANGELOG.md"
    )


def test_the_record_of_the_interface_lists_every_public_name() -> None:
    recorded = (ROOT / "tests" / "snapshots" / "public-api.txt").read_text(encoding="utf-8").splitlines()
    heads = [line.removeprefix("class ").partition("(")[0] for line in recorded if line[:1].isalpha()]
    assert sorted(heads) == ppafo.__all__
