"""Compiled programs: loaded from the cache if intact, otherwise compiled and stored."""

import logging
import sys
import threading
from types import ModuleType

from ppafo.engine.cache.folder import CACHE_VARIABLE, NOTE, cache_folder, refusal
from ppafo.engine.cache.kept import RequestedProgram, load_kept_module, short_hash
from ppafo.engine.compilers import Compiler

logger = logging.getLogger("ppafo")

_LOADING: dict[str, threading.RLock] = {}


def load_generated(source: str, compiler: Compiler) -> ModuleType:
    """Import the module with this source, from the cache if available and intact, otherwise after compilation.

    Raises ProgramError if the source cannot be compiled, with the source file of the faulty function, and CompilerError
    if the compiler does not work.
    """
    program = RequestedProgram(source, compiler)
    # A second thread must not get a module of which only the beginning has run.
    with _LOADING.setdefault(program.name, threading.RLock()):
        if program.name in sys.modules:
            return sys.modules[program.name]
        cache = cache_folder()
        # Loading runs what lies there, so the folder is looked at each time, not once for the process.
        why_not = refusal(cache)
        folder = None if cache is None or why_not else program.folder_in(cache)
        if folder is None:
            logger.warning("ppafo: compiled models are not cached: %s; change %s", why_not, CACHE_VARIABLE)
        module = None if folder is None else load_kept_module(folder, program)
        if module is not None:
            return module
        from ppafo.engine.cache.making import make  # most programs are there

        return make(program, folder)


def note_name(compiler: Compiler) -> str:
    """Return the name of the cache file with the reason why a compiler does not work on this computer."""
    return f"{NOTE}{compiler.name}-{short_hash(compiler.identity())}"
