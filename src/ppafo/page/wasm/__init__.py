"""WebAssembly modules of scenarios and walks, for pages that simulate: interface and programs.

``module_of(scenario)`` returns the ``wasm`` bytes and a ``description`` of settings, channels and metrics
(``description.py``). A module imports nothing. It needs 128-bit vectors, which every browser in use supports; without
them ``WebAssembly.validate`` returns false. All numbers are 64-bit floats in SI units, pressures absolute. All
arguments and results are 32-bit integers; pointers are byte offsets from the start of ``memory``.

Memory
    ``reserve(bytes)`` returns a 16-byte aligned pointer to a block of this size, or 0 if memory is exhausted. The
    memory may grow in ``reserve``, ``run`` and ``ensemble``: create views (``Float64Array``) again after each of them.
    ``release(pointer)`` frees this block and all blocks reserved after it.

One run, with S settings, C channels (the first is ``time``) and M metrics as listed in the description
    ``check(settings)`` returns -1 if the S numbers at ``settings`` are valid. It returns the index of the first number
    that is out of range or contradicts another. It returns S plus the index of a number that needs another program: a
    ``kept`` setting has changed, or samples are more frequent than steps.
    ``samples(settings)`` returns the number of samples N of the run, 0 if ``check`` does not return -1.
    ``run(settings, columns, metrics, good)`` returns a status. It writes C columns of N numbers, one after the other,
    and M metrics. A metric without a value is NaN; all are NaN if the run was not completed. ``good`` points to a
    32-bit integer: the number of valid samples from the first on, N if the run was completed.

Many runs
    ``ensemble(settings, runs, metrics, statuses, channel, every, places, traces)`` takes ``runs`` times S settings,
    writes ``runs`` times M metrics and ``runs`` 32-bit statuses, and returns 0, or 4 if memory is exhausted.
    With ``channel`` -1 the last three arguments are 0. Otherwise it also writes ``runs`` times ``places`` numbers to
    ``traces``: every ``every``-th sample of a channel, from the first on. Channel 0 is the first after ``time`` in the
    description; with ``channel`` -2 all channels are written, for each run ``places`` numbers per channel. Samples
    after the end of a run, and samples and metrics of runs that were not completed, are NaN. Groups of eight runs
    with the same ``run``, delay and ``controller.period`` are fastest.

Statuses: 0 completed, 1 diverged, 2 diverged in too many parts of a step, 3 refused by ``check``, 4 no memory.

Every sample of every channel is bit-identical to ``ppafo.simulate`` for the same settings. Metrics differ by rounding,
as in an ensemble. Each instance has its own memory; create one for each worker. A module is compiled from a C
translation unit by ziglang, or taken from an earlier compilation of the same text.
"""

import hashlib
import importlib.util
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from ppafo.engine.cache.texts import kept_bytes
from ppafo.engine.package_key import COMPOSED, Key, package_key
from ppafo.errors import ProgramError
from ppafo.exports import filled, template
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.conditions import conditions_of, conditions_of_program
from ppafo.exports.c_library.exported import COUNTS, IN_PARTS, TOGETHER, WHOLE, ExportedProgram, places_of
from ppafo.exports.c_library.files import run_words
from ppafo.exports.c_library.library import Library
from ppafo.page.wasm.description import description_of
from ppafo.page.words import stored_data
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import temporary_folder
from ppafo.translation.compiling import asked, complaint
from ppafo.version import __version__

if TYPE_CHECKING:
    from ppafo.exports.c_library.program import ComposedLibrary

LANES = 8
"""Number of runs computed together, limited by the registers of current browsers."""
TARGET = ("--target=wasm32-freestanding", "-mcpu=generic+simd128+bulk_memory")
# -O2 makes modules 14 % larger and no quicker.
STRICT = ("-std=c99", "-Os", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
_FREESTANDING = ("-nostdlib", "-fno-sanitize=undefined", "-fvisibility=hidden", "-Wno-pass-failed", "-I.")
STACK = 262144
"""Stack size of a module [bytes]."""
_LINKED = ("-Wl,--no-entry", "-Wl,--strip-all", f"-Wl,-z,stack-size={STACK}")
FLAGS = (*TARGET, *STRICT, *_FREESTANDING, *_LINKED)
INDEX = "index.json"
"""Index file of prebuilt programs: file name of each by digest of its C text, and compiler version."""
_TITLE = "The functions that a run is made of, from ppafo."
_COMMENT = re.compile(r"\s*/\*.*?\*/\s*", re.DOTALL)
_INSIDE = re.compile(r"(?:PPAFO_INLINE\s[\w\s*]*?\b|^\} )(\w+)(?=[(;])", re.MULTILINE)
"""Pattern of functions and types that are internal to a module."""
_COUNT = re.compile(r"counts\.(\w+)")
_HOW_TO_INSTALL = "pip install 'ppafo[workbench]'"


_WRITERS = ("exports", "gait", "page", "parameters", "simulation", "translation", "walking")
"""Package folders behind the C text of a module, besides the folders of a program."""
WRITTEN_BY = (*COMPOSED, *_WRITERS)
SHIPPED_KEYS = "shipped.json"
"""File of program digests of bundled scenarios and walks, by description and by outline of the text, with the package
files for which they are valid."""


def program_of(library: Library, scenario: Scenario) -> bytes:
    """Return the WebAssembly of a library: the bundled program if identical, else compiled.

    C text and module are cached on disk.
    """
    key = module_key(scenario)
    # Stored digests of C texts, by scenario description and by outline, which are void after any change of code.
    keys, shipped = stored_data(f"wasm/{SHIPPED_KEYS}"), dict[str, str]()
    if key is not None and key.files == keys["files"]:
        shipped = keys["digests"] if key.values.items() <= keys["values"].items() else {}
    if key is None:
        digest = _known_digest(library, shipped)
    elif not (digest := shipped.get(short_digest(key.described), "")):
        words = "\n".join([__version__, *FLAGS, key.words])
        digest = kept_bytes("module", words, lambda: _known_digest(library, shipped).encode()).decode()
    prebuilt = stored_data(f"wasm/programs/{INDEX}")["programs"].get(digest)
    if prebuilt is not None:
        return files("ppafo.page.wasm").joinpath("programs", prebuilt).read_bytes()
    check_can_build()
    return kept_bytes("wasm", f"{digest} {compiler_version()}", lambda: build(source_of(library, compose(library))))


def module_key(scenario: Scenario) -> Key | None:
    """Return the key of a scenario's module, the same for each duration; None if parts are not from the package."""
    return package_key(replace(scenario, run=replace(scenario.run, duration=0.0)), WRITTEN_BY)


def short_digest(described: str) -> str:
    """Return a short hash of a scenario description or of an outline."""
    return hashlib.sha256(described.encode()).hexdigest()[:16]


def _known_digest(library: Library, shipped: Mapping[str, str]) -> str:
    """Return the digest of a library's C text, which is independent of setting values.

    ``shipped`` has digests by outline that are valid for the package as it is.
    """
    composed = compose(library)
    outline = outline_of_unit(library, composed)
    if digest := shipped.get(short_digest(outline)):
        return digest
    # What decides the translation unit: what its functions are made from, and what translates them.
    translators = [*(files("ppafo.translation").iterdir()), *(files("ppafo.exports.c_library").iterdir()), __file__]
    contents = {Path(str(file)).name: Path(str(file)).read_bytes() for file in translators if Path(str(file)).is_file()}
    hashes = [f"{name} {hashlib.sha256(content).hexdigest()}" for name, content in sorted(contents.items())]
    return kept_bytes(
        "digest",
        "\n".join([__version__, *hashes, *FLAGS, template(__name__, "math.h"), outline]),
        lambda: digest_of(source_of(library, composed)).encode(),
    ).decode()


def compose(library: Library) -> "ComposedLibrary":
    """Compose the functions of a library from their Python sources."""
    from ppafo.exports.c_library.program import composed_library  # most digests are kept

    return composed_library(library.program, library.further, LANES)


def outline_of_unit(library: Library, composed: "ComposedLibrary") -> str:
    """Return the translation unit with functions still in Python, which determines the C text."""
    from ppafo.exports.c_library.program import outline_of

    return _unit(library, outline_of(library.program, composed, [setting.name for setting in library.settings]))


def source_of(library: Library, composed: "ComposedLibrary") -> str:
    """Return the C translation unit of a composed library, independent of setting values."""
    from ppafo.exports.c_library.program import c_text

    names = [setting.name for setting in library.settings]
    return _unit(library, c_text(library.program, composed, _TITLE, names))


def _unit(library: Library, functions: str) -> str:
    """Return the C translation unit around given functions."""
    program, names = library.program, [setting.name for setting in library.settings]
    assignments = [f"given[SETTING_{name.upper()}] = settings->{name};" for name in names]
    arrays = ", ".join(f"array_of({name}, {count}, 0, 0)" for name, count in _ARRAYS.items())
    prepare = ("double given[SETTINGS];", *assignments, f"prepare({arrays});")
    refused = [_REFUSED.format(condition, name.upper()) for condition, name in conditions_of_program(library)]
    words = {
        **run_words(library),
        "settings_type": "run_settings",
        "state_count": str(len(places_of(program.program.state_rows()))),
        "parameter_count": str(len(places_of(program.program.parameter_rows()))),
        "count_count": str(len(COUNTS)),
        "prepare": "\n".join(f"    {line}" for line in prepare),
        "needs_other": _COUNT.sub(lambda match: f"counts[COUNT_{match[1].upper()}]", "\n".join(refused)),
    }
    words |= {
        "prepared_run": filled(template(__name__, "prepared_run.c"), words),
        "functions": functions,
        "lanes": str(LANES),
        "go_on": _chosen_loop(program, ""),
        "go_on_together": _chosen_loop(program, TOGETHER),
        "members": "\n".join(f"    double {name};" for name in names),
        "conditions": "\n".join(_REFUSED.format(f"!({holds})", name.upper()) for holds, name in conditions_of(library)),
    }
    return filled(template(__name__, "module.c"), words)


_REFUSED = "    if ({}) {{\n        return SETTING_{};\n    }}"
_ARRAYS = {
    "given": "SETTINGS",
    "prepared->parameters": "PARAMETERS",
    "prepared->states": "STATES",
    "prepared->counts": "COUNTS",
}
"""Array arguments of the function ``prepare``, with their sizes."""


def _chosen_loop(program: ExportedProgram, ending: str) -> str:
    """Return the C lines that call the time-stepping loop selected by the clock."""
    if not program.program.chooses_parts:
        return f"GO_ON({WHOLE}{ending});"
    in_parts, whole = (f"        GO_ON({name}{ending});\n" for name in (IN_PARTS, WHOLE))
    return f"if (clock->needs_parts) {{\n{in_parts}    }} else {{\n{whole}    }}"


def digest_of(text: str) -> str:
    """Return the digest of a C text, which with the compiler determines the bytes of a module.

    Comments, line breaks and names of internal functions and types are ignored. These names contain the location of
    their Python source, and a bundled program remains valid if the source is moved.
    """
    code = _COMMENT.sub("", "\n".join([*FLAGS, template(__name__, "math.h"), text]))
    places = {name: f"n{number}" for number, name in enumerate(dict.fromkeys(_INSIDE.findall(code)))}
    renamed = re.sub(r"\w+", lambda match: places.get(match[0], match[0]), code)
    return hashlib.sha256(" ".join(renamed.split()).encode()).hexdigest()[:16]


def check_can_build() -> None:
    """Raise ProgramError unless ziglang is installed."""
    if importlib.util.find_spec("ziglang") is None:
        raise ProgramError(
            "this scenario needs a program that is not shipped with ppafo and must be built with ziglang: "
            f"{_HOW_TO_INSTALL}"
        )


def build(text: str) -> bytes:
    """Compile a translation unit to WebAssembly. Raises ProgramError if ziglang is missing or fails."""
    check_can_build()
    sources = {"module.c": text.encode(), "math.h": template(__name__, "math.h").encode()}
    with temporary_folder("ppafo", sources) as folder:
        line = [sys.executable, "-m", "ziglang", "cc", *FLAGS, "module.c", "-o", "module.wasm"]
        done, made = asked(line, _HOW_TO_INSTALL, folder, Path(folder)), Path(folder) / "module.wasm"
        if done.returncode != 0:
            raise ProgramError(f"ziglang failed to build the WebAssembly module: {complaint(done)}")
        if not made.is_file():
            raise ProgramError("ziglang reported success but wrote no WebAssembly module; reinstall ziglang")
        return made.read_bytes()


def compiler_version() -> str:
    """Return the version of the package ziglang; empty if not installed."""
    from importlib.metadata import version

    return version("ziglang") if importlib.util.find_spec("ziglang") is not None else ""


@final
@dataclass(frozen=True, slots=True)
class WasmModule:
    """WebAssembly module of a scenario or walk: bytes, and description as plain data (``description_of``)."""

    wasm: bytes
    description: dict[str, Any]


def module_of(scenario: Scenario) -> WasmModule:
    """Return the WebAssembly module of a scenario or walk.

    The bundled program is used if a bundled scenario or walk has the same one, with any numbers; otherwise it is
    compiled. Raises ProgramError if this needs the package ``ziglang`` and it is missing, or if code cannot be
    translated; ScenarioError for a walk that cannot be exported.
    """
    library = library_of(scenario)
    return WasmModule(program_of(library, scenario), description_of(scenario, library))
