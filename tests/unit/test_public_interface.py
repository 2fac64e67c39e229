"""``import ppafo``: small, quick, and everything in it works."""

import importlib
import subprocess
import sys

import pytest

import ppafo


def test_every_public_name_can_be_had_and_is_listed() -> None:
    for name in ppafo.__all__:
        assert getattr(ppafo, name) is not None
    assert set(ppafo.__all__) <= set(dir(ppafo))
    assert sorted(ppafo.__all__) == ppafo.__all__


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'ppafo' has no attribute 'simulated'"):
        _ = ppafo.simulated
    assert not hasattr(ppafo, "nothing_of_the_kind")


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = ("numpy", "numba", "pint", "pydantic", "matplotlib", "xarray", "h5netcdf", "scipy", "pandas")
    code = f"import sys, ppafo; print([name for name in {heavy} if name in sys.modules])"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed == "[]\n"


def test_public_functions_are_the_ones_of_their_modules() -> None:
    assert ppafo.simulate is importlib.import_module("ppafo.simulation.simulate").simulate
    assert ppafo.audit is importlib.import_module("ppafo.parameters.audit").audit


def test_three_lines_give_a_result_and_a_plot() -> None:
    result = ppafo.simulate("step-response")
    assert result.status.kind == "completed"
    assert len(result.plot().axes) == 5
