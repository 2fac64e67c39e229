"""Generated modules on disk: written once, named by their hash, compiled once for each computer."""

import hashlib
import importlib.util
import logging
import os
import sys
import tempfile
import threading
import time
from pathlib import Path
from types import ModuleType

from ppafo.errors import SimulationError

logger = logging.getLogger("ppafo")

CACHE_VARIABLE = "PPAFO_CACHE_DIR"
_LOADING = threading.RLock()


def cache_folder() -> Path:
    """Folder of the generated modules: ``PPAFO_CACHE_DIR``, or the user's cache folder."""
    if os.environ.get(CACHE_VARIABLE):
        return Path(os.environ[CACHE_VARIABLE])
    import platformdirs

    return Path(platformdirs.user_cache_dir("ppafo", appauthor=False)) / "programs"


def load_generated(kind: str, source: str) -> ModuleType:
    """Import the module with this source, from the cache where it is there; compiled code is cached beside it."""
    digest = hashlib.sha256(source.encode()).hexdigest()[:24]
    name = f"ppafo_{kind}_{digest}"
    # A second thread must not get a module of which only the beginning has run.
    with _LOADING:
        return sys.modules[name] if name in sys.modules else _imported(name, source)


def _imported(name: str, source: str) -> ModuleType:
    path = _written(f"{name}.py", source)
    is_new = not any((path.parent / "__pycache__").glob(f"{name}.*.nbi"))
    if is_new:
        logger.warning("ppafo: compiling a model for this computer, once; this takes some seconds ...")
    start = time.perf_counter()
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise SimulationError(f"{path}: the generated module cannot be imported; delete it and try again")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    if is_new:
        logger.warning("ppafo: compiled in %.1f s and kept in %s", time.perf_counter() - start, path.parent)
    return module


def _written(file_name: str, source: str) -> Path:
    """Path of the module's file, written aside and renamed; in a temporary folder where the cache is not writable."""
    try:
        return _write(cache_folder(), file_name, source)
    except OSError as error:
        fallback = Path(tempfile.gettempdir()) / f"ppafo-programs-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
        logger.warning("ppafo: the cache folder cannot be written (%s); using %s", error, fallback)
        try:
            return _write(fallback, file_name, source)
        except OSError as second:
            raise SimulationError(
                f"no folder for compiled models can be written ({second}); set {CACHE_VARIABLE} to one that can"
            ) from second


def _write(folder: Path, file_name: str, source: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / file_name
    if path.is_file() and path.read_text(encoding="utf-8") == source:
        return path
    handle, aside = tempfile.mkstemp(dir=folder, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(source)
    Path(aside).replace(path)
    return path
