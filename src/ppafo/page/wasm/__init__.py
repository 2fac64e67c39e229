"""WebAssembly modules of scenarios and walks, for pages that simulate: interface and description.

``module_of(scenario)`` returns the ``wasm`` bytes and a ``description``, plain data for JSON on each setting, channel
and metric. A module imports nothing. It needs 128-bit vectors, which every browser in use supports; without them
``WebAssembly.validate`` returns false. All numbers are 64-bit floats in SI units, pressures absolute. All arguments
and results are 32-bit integers; pointers are byte offsets from the start of ``memory``.

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

Description of a module as plain data for JSON: settings with range, unit and origin, channels and metrics.

::

    {"name": ..., "title": ..., "version": ..., "kind": "scenario" or "walk",
     "document": the scenario or walk as its file has it, without overrides,
     "overrides": overrides of the scenario or walk,
     "settings": [{"key": "valve.area", "group": "valve", "name": "area", "unit": "m^2", "value": 1.26e-05,
                   "minimum": 0.0 or null, "is_minimum_allowed": true, "maximum": 0.01 or null, "is_whole": false,
                   "display": {"unit": "mm^2", "factor": 1e-06, "zero": 0.0}, "description": ..., "origin": "published",
                   "source": ..., "note": ..., "half_width": 95 % interval in SI or null,
                   "follows": key or null,
                   "made": {"terms": [{"rule": ..., "sources": [keys]}], "gap": ..., "when_set": false} or null,
                   "kept": "zero", "above zero" or null}, ...],
     "channels": [{"name": "time", "unit": "s", "display": {...}, "description": ...}, ...],
     "metrics": [{"name": ..., "unit": ..., "display": {...}, "description": ...}, ...],
     "relations": [{"key": ..., "relation": "below", "at most", "at least" or "above", "other": key,
                    "tolerance": 0.0, "is_share": true for a tolerance that is a fraction of the other}, ...]}

``key=value unit`` is an override of the scenario, as in ``ppafo simulate --set``. A value in SI is ``zero`` plus
``factor`` times the displayed value. ``origin`` is the origin stated by the parameter set (published, datasheet,
derived, identified, fitted, assumed), ``task`` for a number of the scenario itself, ``default`` for a number that is
not given, or ``changed`` for a number set by an override or a caller. A setting with ``follows`` equals the named
setting until changed itself. A setting with ``made`` is the sum of a gap and of rules applied to other settings.
``kept`` requires a setting to stay 0, or above 0; otherwise another program would be needed.
"""

import contextlib
import hashlib
import importlib.util
import json
import math
import re
import sys
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, final

from ppafo.engine.cache.texts import kept_bytes
from ppafo.engine.package_key import COMPOSED, Key, package_key
from ppafo.errors import PpafoError, ProgramError
from ppafo.exports import filled, template
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.conditions import conditions_of, conditions_of_program
from ppafo.exports.c_library.exported import COUNTS, IN_PARTS, TOGETHER, WHOLE, ExportedProgram, places_of
from ppafo.exports.c_library.files import OUTPUTS, run_words
from ppafo.exports.c_library.library import ExportParameter, Library, c_identifier
from ppafo.model.controlled import CONTROLLED
from ppafo.parameters import ParameterSet
from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, itself
from ppafo.parameters.overrides import one_path, read_overrides
from ppafo.parameters.parameter_set import SOURCE, atmospheric_pressure, entry_in_si
from ppafo.report.display_units import display_unit
from ppafo.simulation.clock import TIMES
from ppafo.simulation.declaration import LOCKED_ANGLE, SEED
from ppafo.simulation.document import value_at
from ppafo.simulation.hardware import parameter_set_of
from ppafo.simulation.motion_kind import VANE, WALK
from ppafo.simulation.overrides import is_of_device
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import temporary_folder
from ppafo.translation.compiling import asked, complaint
from ppafo.units import split_pressure_kind, to_si
from ppafo.units.shown import quantity_of_unit
from ppafo.version import __version__

_KINDS = {VANE: "scenario", WALK: "walk"}
"""Name of each kind of simulation on a page."""
_TASK = {"origin": "task", "source": "", "note": "", "half_width": None}
_CHANGED = {**_TASK, "origin": "changed"}
_DEFAULT = {**_TASK, "origin": "default"}


def description_of(scenario: Scenario, library: Library) -> dict[str, Any]:
    """Return the description of the module of a scenario or walk, in the form given in the module docstring."""
    keys = {setting.name: setting.path for setting in library.settings}
    origins, kept = _origins(scenario, library), _kept(library)
    # Settings that have the number of another until they are changed by themselves.
    follows = {path: links[0].sources[0] for path, links in library.links.items() if links[0].is_same}
    # Settings that rules make of others until they are changed by themselves; a rule has the name of its function.
    # The page has the rules of a loop of torque: gains in 1/Pa have others under these names, and stay as they are.
    own = f"{scenario.controlled}." if CONTROLLED[scenario.controlled].unit.startswith("Pa") else ""
    made = {
        path: {
            "terms": [
                {
                    "rule": f"{own}{term.function.__module__.rpartition('.')[2]}.{term.function.__name__}",
                    "sources": list(term.sources),
                }
                for term in links[0].terms
            ],
            "gap": links[0].gap,
            "when_set": links[0].when_set,
        }
        for path, links in library.links.items()
        if any(term.function is not itself for term in links[0].terms)
    }
    program, atmosphere = library.program, scenario.device.supply.atmospheric_pressure
    channels = {"time": ("s", "since the start"), **{name: OUTPUTS[name] for name in program.outputs}}
    return {
        "name": library.title,
        "title": library.description,
        "version": __version__,
        "kind": _KINDS[scenario.motion.motion_kind.layout],
        "document": dict(scenario.origin.content),
        "overrides": list(scenario.origin.overrides),
        "settings": [
            {
                **_setting(setting, atmosphere),
                **origins[setting.path],
                "follows": follows.get(setting.path),
                "made": made.get(setting.path),
                "kept": kept.get(setting.name),
            }
            for setting in library.settings
        ],
        "channels": [_shown(name, unit, said, atmosphere) for name, (unit, said) in channels.items()],
        "metrics": [_shown(kind.name, kind.unit, kind.summary, atmosphere) for kind in program.metrics],
        "relations": [
            {
                "key": keys[rule.name],
                "relation": rule.relation,
                "other": keys[rule.other],
                "tolerance": rule.tolerance,
                "is_share": rule.is_share,
            }
            for rule in library.relations
        ],
    }


def _kept(library: Library) -> dict[str, str]:
    """Settings, by C name, that must stay zero or above zero: the only positive setting of a switch is fixed."""
    values = {setting.name: setting.value for setting in library.settings}
    kept: dict[str, str] = {}
    for names, is_above in library.switches:
        above = [name for name in names if values[name] > 0.0]
        if not is_above:
            kept |= dict.fromkeys(names, "zero")
        elif len(above) == 1:
            kept[above[0]] = "above zero"
    return kept


def _setting(setting: ExportParameter, atmosphere: float) -> dict[str, Any]:
    quantity = setting.quantity
    group, _, name = setting.path.rpartition(".")
    return {
        "key": setting.path,
        "group": group,
        "name": name,
        "unit": quantity.unit,
        "value": setting.value,
        "minimum": quantity.minimum if math.isfinite(quantity.minimum) else None,
        "is_minimum_allowed": quantity.minimum_allowed,
        "maximum": quantity.maximum if math.isfinite(quantity.maximum) else None,
        "is_whole": name == SEED.name,
        "display": display_of(quantity.unit, atmosphere, is_absolute=setting.path == ATMOSPHERE_PATH),
        "description": quantity.summary or quantity.name,
    }


def _shown(name: str, unit: str, said: str, atmosphere: float) -> dict[str, Any]:
    bare = "" if unit in ("-", "1") else unit
    return {"name": name, "unit": bare, "display": display_of(bare, atmosphere, "gas mass"), "description": said}


def display_of(unit: str, atmosphere: float, kilograms: str = "mass", is_absolute: bool = False) -> dict[str, Any]:
    """Return the display unit of a quantity and its conversion: SI value = ``zero`` + ``factor`` * displayed value.

    Pressures are gauge pressures relative to ``atmosphere`` [Pa], unless ``is_absolute``; ``kilograms`` is the kind of
    quantity of a mass.
    """
    quantity = kilograms if unit == "kg" else quantity_of_unit(unit)
    if not quantity:
        return {"unit": unit, "factor": 1.0, "zero": 0.0}
    shown = display_unit(quantity)
    if quantity.startswith("pressure"):
        is_change = quantity == "pressure change"
        bare, kind = (shown, "") if is_change else split_pressure_kind(shown)
        factor, is_absolute = to_si(1.0, f"{bare}_d", "Pa_d"), is_absolute or kind == "a"
        return {
            "unit": bare if is_change else f"{bare}_a" if is_absolute else f"{bare}_g",
            "factor": factor,
            "zero": 0.0 if is_change or is_absolute else atmosphere,
        }
    zero = to_si(0.0, shown, unit)
    return {"unit": shown, "factor": to_si(1.0, shown, unit) - zero, "zero": zero}


def _origins(scenario: Scenario, library: Library) -> dict[str, dict[str, Any]]:
    """Return the origin of each setting's value, by path."""
    origin, device = scenario.origin, scenario.device
    # None where the set cannot be read any more.
    parameter_set: ParameterSet | None = None
    with contextlib.suppress(PpafoError):
        parameter_set = parameter_set_of(origin)
    assumed = {assumption.path: assumption.note for assumption in scenario.assumptions}
    changed = {
        c_identifier(one_path(override.typed, device.valve_name)) for override in read_overrides(origin.overrides)
    }
    origins: dict[str, dict[str, Any]] = {}
    for setting in library.settings:
        if setting.name in changed:
            origins[setting.path] = dict(_CHANGED)
        elif is_of_device(setting.path):
            origins[setting.path] = dict(_of_set(parameter_set, device, setting, follows=setting.path in library.links))
        else:
            # Times and the angle of a locked vane have no key of their own in every file, and are the task's anyway.
            is_given = value_at(origin.content, setting.path) is not None or setting.path in (*TIMES, LOCKED_ANGLE)
            origins[setting.path] = dict(_TASK if is_given else _DEFAULT)
        if setting.path in assumed and setting.name not in changed:
            origins[setting.path] |= {"origin": "assumed", "note": assumed[setting.path]}
    return origins


def _of_set(
    parameter_set: ParameterSet | None, device: Device, setting: ExportParameter, *, follows: bool
) -> dict[str, Any]:
    """Return the origin of a device number: from the set if unchanged, ``default`` if it ``follows`` another."""
    if parameter_set is None:
        return _CHANGED
    path = setting.path
    if path.startswith("valve."):
        path = f"valves.{device.valve_name}.{path.removeprefix('valve.')}"
    entry, declared = parameter_set.numbers.get(path), parameter_set.declarations().get(path)
    if entry is None or declared is None:
        return _DEFAULT if follows or setting.value == setting.quantity.default else _CHANGED
    if entry_in_si(entry, declared, atmospheric_pressure(parameter_set)) != setting.value:
        return _CHANGED
    if entry.source == SOURCE:
        return _TASK
    unit, si, half = entry.unit, setting.quantity.unit, None
    if si == "Pa_a":
        # Half of an interval is a difference, also of a level.
        unit, si = f"{unit[:-2]}_d", "Pa_d"
    if entry.uncertainty is not None:
        half = to_si(entry.uncertainty, unit, si)
    return {"origin": entry.origin, "source": entry.source, "note": entry.note, "half_width": half}


LANES = 8
"""Number of runs computed together; with more, their numbers would not fit the registers used by current browsers."""
TARGET = ("--target=wasm32-freestanding", "-mcpu=generic+simd128+bulk_memory")
# -O2 makes modules 14 % larger and no quicker.
STRICT = ("-std=c99", "-Os", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
_FREESTANDING = ("-nostdlib", "-fno-sanitize=undefined", "-fvisibility=hidden", "-Wno-pass-failed", "-I.")
STACK = 262144
"""Stack size [bytes] for a run."""
_LINKED = ("-Wl,--no-entry", "-Wl,--strip-all", f"-Wl,-z,stack-size={STACK}")
FLAGS = (*TARGET, *STRICT, *_FREESTANDING, *_LINKED)
INDEX = "index.json"
"""Index file of the prebuilt programs: digest of the C text of each, and version of the compiler."""
_TITLE = "The functions that a run is made of, from ppafo."
_COMMENT = re.compile(r"\s*/\*.*?\*/\s*", re.DOTALL)
_INSIDE = re.compile(r"(?:PPAFO_INLINE\s[\w\s*]*?\b|^\} )(\w+)(?=[(;])", re.MULTILINE)
"""Declarations of functions and types that are not visible outside a module."""
_COUNT = re.compile(r"counts\.(\w+)")
_HOW_TO_INSTALL = "pip install 'ppafo[workbench]'"


_WRITERS = ("exports", "gait", "page", "parameters", "simulation", "translation", "walking")
"""Package folders that contribute to the C text of a module, in addition to the folders of a program."""
WRITTEN_BY = (*COMPOSED, *_WRITERS)
SHIPPED_KEYS = "shipped.json"
"""File with the program digest of each bundled scenario and walk, and the package files for which it is valid."""
_OF_THE_COMPUTER = "ppafo.translation.native"
"""Module whose values depend on the compilers and processor of this computer and enter no C text."""


def program_of(library: Library, scenario: Scenario) -> bytes:
    """Return the WebAssembly of a scenario's library: the bundled one if identical, else compiled now.

    C text and module are cached on disk.
    """
    key = package_key(scenario, WRITTEN_BY)
    if key is None:
        digest = _known_digest(library)
    elif not (digest := _shipped_digest(key)):
        words = "\n".join([__version__, *FLAGS, key.words])
        digest = kept_bytes("module", words, lambda: _known_digest(library).encode()).decode()
    prebuilt = prebuilt_programs().get(digest)
    if prebuilt is not None:
        return _PROGRAMS.joinpath(prebuilt).read_bytes()
    check_can_build()
    return kept_bytes("wasm", f"{digest} {compiler_version()}", lambda: build(source_of(library)))


def _shipped_digest(key: Key) -> str:
    """Return the stored digest of a bundled scenario's C text; empty for others, and after any change of code."""
    shipped = _shipped_keys()
    is_as_shipped = key.files == shipped["files"] and all(
        shipped["values"].get(module) == value for module, value in key.values.items() if module != _OF_THE_COMPUTER
    )
    return str(shipped["digests"].get(short_digest(key.described), "")) if is_as_shipped else ""


def short_digest(described: str) -> str:
    """Return a short hash of a scenario description."""
    return hashlib.sha256(described.encode()).hexdigest()[:16]


@cache
def _shipped_keys() -> dict[str, Any]:
    """Return the digests of bundled scenarios and walks, with the package files and values for which they are valid."""
    keys: dict[str, Any] = json.loads(files("ppafo.page.wasm").joinpath(SHIPPED_KEYS).read_text(encoding="utf-8"))
    return keys


def _known_digest(library: Library) -> str:
    """Return the digest of a library's C text, which does not depend on the values of its settings."""
    from ppafo.exports.c_library.program import outline_of  # most digests are kept

    # What decides the translation unit: what its functions are made from, and what translates them.
    names = [setting.name for setting in library.settings]
    outline = _unit(library, outline_of(library.program, names, library.further, LANES))
    translators = [*(files("ppafo.translation").iterdir()), *(files("ppafo.exports.c_library").iterdir()), __file__]
    contents = {Path(str(file)).name: Path(str(file)).read_bytes() for file in translators if Path(str(file)).is_file()}
    hashes = [f"{name} {hashlib.sha256(content).hexdigest()}" for name, content in sorted(contents.items())]
    return kept_bytes(
        "digest",
        "\n".join([__version__, *hashes, *FLAGS, template(__name__, "math.h"), outline]),
        lambda: digest_of(source_of(library)).encode(),
    ).decode()


def source_of(library: Library) -> str:
    """Return the C translation unit of a library, which does not contain the values of settings."""
    from ppafo.exports.c_library.program import c_text

    names = [setting.name for setting in library.settings]
    return _unit(library, c_text(library.program, _TITLE, names, library.further, LANES))


def _unit(library: Library, functions: str) -> str:
    """Return the C translation unit that wraps the given functions."""
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
"""Array arguments of the function ``prepare``, with the size of each."""


def _chosen_loop(program: ExportedProgram, ending: str) -> str:
    """Return C lines that call the lane loop selected by the clock."""
    if not program.program.chooses_parts:
        return f"GO_ON({WHOLE}{ending});"
    in_parts, whole = (f"        GO_ON({name}{ending});\n" for name in (IN_PARTS, WHOLE))
    return f"if (clock->needs_parts) {{\n{in_parts}    }} else {{\n{whole}    }}"


def digest_of(text: str) -> str:
    """Return the digest of a C text, for everything but the compiler that determines the bytes of a module.

    Comments, line breaks and names of internal functions and types are ignored. These names contain the location of
    their Python source, and a bundled program remains valid if the source is moved.
    """
    code = _COMMENT.sub("", "\n".join([*FLAGS, template(__name__, "math.h"), text]))
    places = {name: f"n{number}" for number, name in enumerate(dict.fromkeys(_INSIDE.findall(code)))}
    renamed = re.sub(r"\w+", lambda match: places.get(match[0], match[0]), code)
    return hashlib.sha256(" ".join(renamed.split()).encode()).hexdigest()[:16]


def check_can_build() -> None:
    """Raise ProgramError if ziglang is not installed."""
    if importlib.util.find_spec("ziglang") is None:
        raise ProgramError(
            "this scenario needs functions that no program of the package has, and ziglang to build them: "
            f"{_HOW_TO_INSTALL}"
        )


def build(text: str) -> bytes:
    """Compile a translation unit to WebAssembly; ProgramError if ziglang is missing or fails."""
    check_can_build()
    sources = {"module.c": text.encode(), "math.h": template(__name__, "math.h").encode()}
    with temporary_folder("ppafo", sources) as folder:
        line = [sys.executable, "-m", "ziglang", "cc", *FLAGS, "module.c", "-o", "module.wasm"]
        done, made = asked(line, _HOW_TO_INSTALL, folder, Path(folder)), Path(folder) / "module.wasm"
        if done.returncode != 0:
            raise ProgramError(f"ziglang does not build the module: {complaint(done)}")
        if not made.is_file():
            raise ProgramError("ziglang returned 0 but made no module")
        return made.read_bytes()


def compiler_version() -> str:
    """Return the version of the package ziglang; empty if not installed."""
    from importlib.metadata import version

    return version("ziglang") if importlib.util.find_spec("ziglang") is not None else ""


_PROGRAMS = files("ppafo.page.wasm").joinpath("programs")


@cache
def prebuilt_programs() -> dict[str, str]:
    """Return the file names of prebuilt programs by the digest of their C text."""
    programs: dict[str, str] = json.loads(_PROGRAMS.joinpath(INDEX).read_text(encoding="utf-8"))["programs"]
    return programs


@final
@dataclass(frozen=True, slots=True)
class WasmModule:
    """Bytes of a WebAssembly module, and its description as plain data (``description_of``)."""

    wasm: bytes
    description: dict[str, Any]


def module_of(scenario: Scenario) -> WasmModule:
    """Return a scenario or walk as a WebAssembly module.

    The bundled program is used if a bundled scenario or walk has the same one, with any numbers; otherwise it is
    compiled. Raises ProgramError if this needs the package ``ziglang`` and it is missing, or if code cannot be
    translated; ScenarioError for a walk that cannot be exported.
    """
    library = library_of(scenario)
    return WasmModule(program_of(library, scenario), description_of(scenario, library))
