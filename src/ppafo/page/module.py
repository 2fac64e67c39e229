"""WebAssembly module of an exported library, built by the compiler of this computer."""

import hashlib
import importlib.util
import shutil
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from ppafo.engine.cache.texts import kept_bytes
from ppafo.errors import ProgramError
from ppafo.exports import filled, template
from ppafo.exports.c_library.entries import with_reach
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import Library
from ppafo.storage.files import temporary_folder
from ppafo.translation.compiling import asked, complaint

_STRICT = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
_ALONE = ("-ffreestanding", "-nostdlib", "-fvisibility=hidden", "-I.", "-Wl,--no-entry", "-Wl,--strip-all")
_FLAGS = (*_STRICT, *_ALONE, "-Wl,-z,stack-size=262144")
_ZIG = ("-m", "ziglang", "cc", "--target=wasm32-freestanding", "-mcpu=generic+bulk_memory", "-fno-sanitize=undefined")
_CLANG = ("clang", "--target=wasm32", "-mbulk-memory")
_REMEDY = "a page needs a compiler for WebAssembly: pip install 'ppafo[workbench]', or clang with lld"


def module_of(library: Library) -> bytes:
    """Return the WebAssembly module of a library; raises ProgramError without a compiler for it."""
    has_reach = "reference" in library.program.outputs
    words = {"name": library.name, "NAME": library.name.upper(), "REACH": str(int(has_reach))}
    written = library_files(replace(library, further=partial(with_reach, library)) if has_reach else library)
    sources = {f"{library.name}{end}": written[f"{library.name}{end}"] for end in (".c", ".h")}
    sources |= dict.fromkeys(("math.h", "string.h"), template("ppafo.page", "standard.h").encode())
    sources["module.c"] = filled(template("ppafo.page", "module.c"), words).encode()
    digests = [hashlib.sha256(text).hexdigest() for _, text in sorted(sources.items())]
    return kept_bytes("wasm", "\n".join([*compiler(), *_FLAGS, *digests]), lambda: built(sources))


def compiler() -> list[str]:
    """Return the command of a compiler for WebAssembly; raises ProgramError without one."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, *_ZIG]
    if shutil.which("clang") and shutil.which("wasm-ld"):
        return [*_CLANG]
    raise ProgramError(_REMEDY)


def built(sources: Mapping[str, bytes]) -> bytes:
    """Return the module of ``module.c`` and the files beside it; raises ProgramError where it cannot be built."""
    line = [*compiler(), *_FLAGS, "module.c", "-o", "module.wasm"]
    with temporary_folder("ppafo", sources) as folder:
        done, made = asked(line, _REMEDY, folder, Path(folder)), Path(folder) / "module.wasm"
        if done.returncode != 0 or not made.is_file():
            raise ProgramError(f"the WebAssembly module could not be built: {complaint(done)}")
        return made.read_bytes()
