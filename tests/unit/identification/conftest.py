"""Makes the planted recordings importable."""

import importlib
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def planted() -> ModuleType:
    """Recordings with known values planted."""
    return importlib.import_module("tests.unit.identification.planted")
