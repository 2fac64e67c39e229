"""Makes the random columns importable."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def draws() -> ModuleType:
    """Random columns of any scenario."""
    spec = importlib.util.spec_from_file_location("ppafo_test_columns", Path(__file__).with_name("draws.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
