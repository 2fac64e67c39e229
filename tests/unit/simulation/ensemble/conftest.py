"""Makes the random columns importable."""

import importlib
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def draws() -> ModuleType:
    """Random columns of any scenario."""
    return importlib.import_module("tests.unit.simulation.ensemble.draws")
