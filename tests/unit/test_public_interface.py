"""``import ppafo``: small, quick, and everything in it works."""

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


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'ppafo' has no attribute 'simulated'"):
        _ = ppafo.simulated
    assert not hasattr(ppafo, "nothing_of_the_kind")


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = ("numpy", "matplotlib", "xarray", "h5netcdf", "scipy", "pandas")
    code = f"import sys, ppafo; print([name for name in {heavy} if name in sys.modules])"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed == "[]\n"


def test_names_and_signatures_are_those_that_were_recorded() -> None:
    written = runpy.run_path(str(ROOT / "scripts" / "public_api.py"))["public_api"]()
    recorded = (ROOT / "tests" / "snapshots" / "public-api.txt").read_text(encoding="utf-8")
    assert written.splitlines() == recorded.splitlines(), (
        "if it is meant: python scripts/public_api.py, then CHANGELOG.md"
    )
