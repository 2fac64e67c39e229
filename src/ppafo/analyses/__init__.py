"""Analyses beyond a single run, each a file or a package of its own, with the vocabulary that they share: ``ask``."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from ppafo.analyses import asking as ask
else:

    class _AtFirstUse:
        """Module that is imported when one of its names is first used: ``--help`` of a question needs none."""

        def __init__(self, module: str) -> None:
            self._module = module

        def __getattr__(self, name: str) -> Any:
            """Return what the module has under a name."""
            return getattr(import_module(self._module), name)

    ask = _AtFirstUse("ppafo.analyses.asking")
    np = _AtFirstUse("numpy")

__all__ = ["ask", "np"]
