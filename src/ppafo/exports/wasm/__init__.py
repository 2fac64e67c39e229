"""A scenario or a walk as a WebAssembly module, for a page that simulates; this is how such a module is called.

``module_of(item)`` gives the ``wasm`` bytes and a ``description``, plain data for JSON that tells of each setting,
channel and metric what a person and a page must know. A module imports nothing. It needs 128-bit vectors, which
every browser in use has; without them ``WebAssembly.validate`` says false. All numbers are 64-bit floats in SI units,
pressures absolute; all arguments and results are 32-bit integers, and pointers are bytes from the start of ``memory``.

Memory
    ``reserve(bytes)`` gives the place of so many bytes, or 0 where there are no more; places are multiples of 16. The
    memory may grow in ``reserve``, ``run`` and ``ensemble``: views (``Float64Array``) are made anew after each of
    them. ``release(place)`` gives back everything that was reserved from that place on.

One run, with S settings, C channels (the first is ``time``) and M metrics as listed in the description
    ``check(settings)`` is -1 where the S numbers at ``settings`` are good, the place of the first one that is out of
    range or contradicts another, or S where they need other functions than there are here: what is ``kept`` was not,
    or samples come more often than steps.
    ``samples(settings)`` is the number of samples N of the run, 0 where ``check`` is not -1.
    ``run(settings, columns, metrics, good)`` returns a status. It writes C columns of N numbers, one after the other,
    and M metrics, NaN where one has no value, and all of them where the run was not completed. ``good`` is the place of
    one 32-bit integer: the number of samples from the first on that hold, N where the run was completed.

Many runs
    ``ensemble(settings, runs, metrics, statuses, channel, every, places, traces)`` takes ``runs`` times S settings,
    writes ``runs`` times M metrics and ``runs`` 32-bit statuses, and returns 0, or 4 where memory does not suffice.
    With ``channel`` -1 the last three are 0. Otherwise it also writes ``runs`` times ``places`` numbers: every
    ``every``-th sample of a channel, from the first on. Channels count as in the description without ``time``, so
    that 0 is the first after it; with ``channel`` -2 it writes all of them, for each run ``places`` numbers of one
    after those of the other. Beyond the last sample of a run, and in runs that were not completed, there is NaN, as
    in the metrics of the latter. Runs are quickest eight at a time with the same ``run``, delay and
    ``controller.period``.

Statuses: 0 completed, 1 diverged, 2 diverged in too many parts of a step, 3 refused by ``check``, 4 no memory.

What a module gives has the bits of ``ppafo.simulate`` for the same settings, in every sample of every channel; metrics
differ by rounding, as those of an ensemble do. Each instance has a memory of its own: one for each worker. The bytes
are those of a translation unit in C, built by ziglang, or what was built of the same one before.
"""

import hashlib
import importlib.util
import json
import re
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, final

from ppafo.engine.cache import kept_bytes
from ppafo.engine.outline import file_hash
from ppafo.errors import ProgramError
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import Library, conditions_of, run_words
from ppafo.exports.c_library.program import IN_PARTS, TOGETHER, WHOLE, ExportedProgram, c_text, outline_of
from ppafo.exports.templates import filled, template
from ppafo.exports.wasm.description import description_of
from ppafo.simulation.scenario import Scenario
from ppafo.translation.native import asked, complaint
from ppafo.version import __version__

LANES = 8
"""Runs that go on together: with more of them their numbers leave the registers of today's browsers."""
TARGET = ("--target=wasm32-freestanding", "-mcpu=generic+simd128+bulk_memory")
STRICT = ("-std=c99", "-Os", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
_FREESTANDING = ("-nostdlib", "-fno-sanitize=undefined", "-fvisibility=hidden", "-Wno-pass-failed", "-I.")
STACK = 262144
"""Bytes for the numbers of a run under way."""
_LINKED = ("-Wl,--no-entry", "-Wl,--strip-all", f"-Wl,-z,stack-size={STACK}")
FLAGS = (*TARGET, *STRICT, *_FREESTANDING, *_LINKED)
INDEX = "index.json"
"""File of the prebuilt programs that says of which text each was made, and by which version of the compiler."""
_TITLE = "The functions that a run is made of, from ppafo."
_RULES_OF_TIMES = (
    ("run_output_interval", "is_whole({} / {})", ("run_duration", "run_output_interval")),
    ("run_duration", "{} / {} <= 1.0e8", ("run_duration", "run_step")),
    ("run_duration", "{} / {} <= 5.0e6", ("run_duration", "run_output_interval")),
    ("sensors_delay", "{} / {} <= 1.0e5", ("sensors_delay", "run_step")),
)
"""What the file of a scenario must keep of its times too (``simulation/clock.py``): setting named, rule, of what."""
_COMMENT = re.compile(r"\s*/\*.*?\*/\s*", re.DOTALL)
_INSIDE = re.compile(r"(?:PPAFO_INLINE\s[\w\s*]*?\b|^\} )(\w+)(?=[(;])", re.MULTILINE)
"""Names of functions and types that nobody sees outside a module, where they are declared."""
_HOW_TO_INSTALL = "pip install 'ppafo[workbench]'"


def program_of(library: Library) -> bytes:
    """The module of a library: the one that comes with the package where the text is the same, else a new one.

    Neither the text nor a module is made twice on a computer.
    """
    # What decides the translation unit: what its functions are made from, and what translates them.
    names = [item.name for item in library.settings]
    outline = _unit(library, outline_of(library.program, names, library.further, LANES))
    translators = [*(files("ppafo.translation").iterdir()), *(files("ppafo.exports.c_library").iterdir()), __file__]
    hashes = sorted(f"{Path(str(file)).name} {file_hash(str(file))}" for file in translators)
    digest = kept_bytes(
        "digest",
        "\n".join([__version__, *hashes, *FLAGS, template("wasm", "math.h"), outline]),
        lambda: digest_of(source_of(library)).encode(),
    ).decode()
    prebuilt = prebuilt_programs().get(digest)
    if prebuilt is not None:
        return _programs().joinpath(prebuilt).read_bytes()
    check_can_build()
    return kept_bytes("wasm", f"{digest} {compiler_version()}", lambda: build(source_of(library)))


def source_of(library: Library) -> str:
    """The translation unit of a library. Values of settings are not in it: other numbers, same program."""
    names = [item.name for item in library.settings]
    return _unit(library, c_text(library.program, _TITLE, names, library.further, LANES))


def _unit(library: Library, functions: str) -> str:
    """The translation unit around functions."""
    program, names = library.program, [item.name for item in library.settings]
    refused = "    if (!({})) {{\n        return SETTING_{};\n    }}"
    words = {
        **run_words(library, "run_settings"),
        "functions": functions,
        "lanes": str(LANES),
        "go_on": _chosen_loop(program, ""),
        "go_on_together": _chosen_loop(program, TOGETHER),
        "members": "\n".join(f"    double {name};" for name in names),
        "conditions": "\n".join(refused.format(holds, name.upper()) for holds, name in _conditions(library)),
    }
    return filled(template("wasm", "module.c"), words)


def _conditions(library: Library) -> list[tuple[str, str]]:
    """What settings must keep in C, with the one that is named where it is not kept."""
    rules = () if library.program.program.walks else _RULES_OF_TIMES
    of_times = [(rule.format(*(f"settings->{name}" for name in names)), named) for named, rule, names in rules]
    return [*conditions_of(library), *of_times]


def _chosen_loop(program: ExportedProgram, ending: str) -> str:
    """Lines that call the lane loop that the clock asks for."""
    if not program.chooses_parts:
        return f"GO_ON({WHOLE}{ending});"
    in_parts, whole = (f"        GO_ON({name}{ending});\n" for name in (IN_PARTS, WHOLE))
    return f"if (clock->needs_parts) {{\n{in_parts}    }} else {{\n{whole}    }}"


def digest_of(text: str) -> str:
    """A short name of everything that decides the bytes of a module but the compiler.

    Comments do not, nor lines, nor what functions and types inside are called: those have the place of their Python
    in their names, and a program of the package stays good where that is moved.
    """
    code = _COMMENT.sub("", "\n".join([*FLAGS, template("wasm", "math.h"), text]))
    places = {name: f"n{place}" for place, name in enumerate(dict.fromkeys(_INSIDE.findall(code)))}
    renamed = re.sub(r"\w+", lambda found: places.get(found[0], found[0]), code)
    return hashlib.sha256(" ".join(renamed.split()).encode()).hexdigest()[:16]


def check_can_build() -> None:
    """Raise ProgramError where ziglang is not there."""
    if importlib.util.find_spec("ziglang") is None:
        raise ProgramError(
            "this scenario needs functions that no program of the package has, and ziglang to build them: "
            f"{_HOW_TO_INSTALL}"
        )


def build(text: str) -> bytes:
    """A module of a translation unit. ProgramError where ziglang is not there, or refuses."""
    check_can_build()
    with tempfile.TemporaryDirectory() as folder:
        for name, content in {"module.c": text, "math.h": template("wasm", "math.h")}.items():
            (Path(folder) / name).write_text(content, encoding="utf-8")
        line = [sys.executable, "-m", "ziglang", "cc", *FLAGS, "module.c", "-o", "module.wasm"]
        done, made = asked(line, _HOW_TO_INSTALL, folder), Path(folder) / "module.wasm"
        if done.returncode != 0:
            raise ProgramError(f"ziglang does not build the module: {complaint(done)}")
        if not made.is_file():
            raise ProgramError("ziglang says that all is well, but made no module")
        return made.read_bytes()


def compiler_version() -> str:
    """Version of the package ziglang; empty where it is not there."""
    from importlib.metadata import version

    return version("ziglang") if importlib.util.find_spec("ziglang") is not None else ""


def _programs() -> Path:
    return Path(str(files("ppafo.exports.wasm").joinpath("programs")))


@cache
def prebuilt_programs() -> dict[str, str]:
    """Names of the files of prebuilt programs by the digest of their text."""
    found: dict[str, str] = json.loads(_programs().joinpath(INDEX).read_text(encoding="utf-8"))["programs"]
    return found


@final
@dataclass(frozen=True, slots=True)
class WasmModule:
    """The bytes of a module, and the description of what it simulates (plain data, see ``description.py``)."""

    wasm: bytes
    description: dict[str, Any]


def module_of(item: Scenario) -> WasmModule:
    """A scenario or a walk as a module.

    Its program comes with the package where a shipped scenario or walk has the same one, whatever its numbers are, and
    is built otherwise. ProgramError where that needs the package ``ziglang``, which is not there, or where something in
    it cannot be translated; ScenarioError for a walk that cannot be exported.
    """
    library = library_of(item)
    return WasmModule(program_of(library), description_of(item, library))
