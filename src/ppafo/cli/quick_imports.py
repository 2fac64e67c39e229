"""Loads the compiler and the drawing library without what they do at import for other programs: a quarter of a start.

Called before the first import of either; what was imported earlier stays as it is.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

_LINEAR_ALGEBRA = "scipy.linalg"


def load_compiler() -> None:
    """Import Numba, where it compiles, without SciPy's linear algebra, which it looks for at import; models have none.

    SimulationError where ``PPAFO_BACKEND`` names what is no compiler, or one that is not here.
    """
    from ppafo.engine.loading import NUMBA, chosen_compiler

    if chosen_compiler().name != NUMBA:
        return
    if "numba" in sys.modules or _LINEAR_ALGEBRA in sys.modules:
        return
    modules: dict[str, Any] = sys.modules
    modules[_LINEAR_ALGEBRA] = None  # as where it is not installed: the import fails
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[_LINEAR_ALGEBRA]


def load_drawing() -> None:
    """Import matplotlib without the tables of settings that it writes into its own documentation at import."""
    if "matplotlib.artist" in sys.modules:
        return
    import matplotlib.artist

    with _replace_temporarily(matplotlib.artist, "kwdoc", lambda _artist: ""):
        import matplotlib.figure


@contextmanager
def _replace_temporarily(module: ModuleType, name: str, stand_in: object) -> Iterator[None]:
    original = getattr(module, name)
    setattr(module, name, stand_in)
    try:
        yield
    finally:
        setattr(module, name, original)
