"""Models of tests are compiled with less optimisation: a third of the CPU time for the same bits.

The golden bits are found with both (``tests/unit/test_golden_bits.py``), by the fixture ``fully_compiled``.
"""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from ppafo.engine import loading
from ppafo.engine.compilers import Effort
from ppafo.translation.native import CCompiler

_WITH_EFFORT = CCompiler.with_effort


def pytest_configure() -> None:
    """Let the compilers of this process take the least effort, whatever they are asked for."""
    CCompiler.with_effort = _quick  # type: ignore[method-assign, assignment]


def _quick(compiler: CCompiler, _effort: Effort) -> CCompiler:
    return replace(compiler, effort=Effort.QUICK)


@pytest.fixture
def fully_compiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Models compiled as a study compiles them."""
    monkeypatch.setattr(CCompiler, "with_effort", _WITH_EFFORT)
    loading._load_by.cache_clear()
    yield
    loading._load_by.cache_clear()
