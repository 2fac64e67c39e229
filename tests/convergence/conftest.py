"""Makes the random draws importable."""

import importlib
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def draws() -> ModuleType:
    """Random scenarios by seed."""
    return importlib.import_module("tests.convergence.draws")
