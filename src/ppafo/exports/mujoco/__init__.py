"""A scenario's device as an engine plugin of MuJoCo: library, example model, numbers; no Python in the step."""

import hashlib
import importlib.util
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.engine.lanes import prescribe_recorded_angle
from ppafo.errors import ScenarioError, nearest_name
from ppafo.exports import filled, template
from ppafo.exports.c_library import commanded, scenario_library
from ppafo.exports.c_library.files import OUTPUTS, Library, Setting, library_files, steps_source
from ppafo.exports.c_library.preparation import preparation_of
from ppafo.exports.c_library.program import ExportedProgram
from ppafo.exports.fmu import HIDDEN, PLATFORMS, build_library
from ppafo.simulation.recorded import held_vane
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, Scenario
from ppafo.version import __version__

BUILT_FOR = ("linux64", "win64")
"""Computers that a plugin is built for, by their names in an FMU."""
NUMBERS = "device.json"
"""The file of the numbers of a plugin, in its folder."""
NEUTRAL = "neutral"
"""The attribute that says where the device stands with the joint at 0 [rad]."""
OLDEST, NEWEST = (3, 4), (4, 0)
"""Versions of MuJoCo, first two numbers, that a plugin can be built for."""
_PROPORTIONAL = "-1 to 1, the opening of the valve: above 0 feeds chamber 1, at 0 both chambers are shut"
_PAIR = "-1, 0 or 1: above 0 energises valve A (it feeds chamber 1), below 0 valve B, 0 neither: both chambers vent"
_VALVES = {"solenoid": _PAIR, "solenoid_recycling": f"{_PAIR}, after the chambers were joined"}
_NEUTRAL_ANGLE = 0.5 * math.pi
_VERSION = re.compile(r"#define mjVERSION_HEADER (\d+)")
_OF_LOADER = {"linux64": ("-ldl",), "win64": ()}
_NOT_OF_THE_GAS = ("run.duration", "run.output_interval", "controller.", "sensors.", "motion.", "reference.")
_OF_THE_JOINT = ("foot_plate.", "friction.")


@dataclass(frozen=True, slots=True)
class Headers:
    """The headers of one version of MuJoCo: the folder that includes are looked for in, and the version."""

    include: Path
    version: str

    @property
    def has_outputs_apart(self) -> bool:
        """True where an actuator has addresses of its own for its controls and its forces."""
        return "actuator_outadr" in (self.include / "mujoco" / "mjmodel.h").read_text(encoding="utf-8")


def installed_headers() -> Headers:
    """Headers of the MuJoCo that is installed; ScenarioError where there is none, or another version."""
    found = importlib.util.find_spec("mujoco")
    places = [] if found is None else [Path(place) / "include" for place in found.submodule_search_locations or ()]
    include = next((place for place in places if (place / "mujoco" / "mujoco.h").is_file()), None)
    if include is None:
        raise ScenarioError("the plugin needs the headers of MuJoCo: pip install 'ppafo[mujoco]'")
    stated = _VERSION.search((include / "mujoco" / "mujoco.h").read_text(encoding="utf-8"))
    number = int(stated[1]) if stated else 0
    # Since 3.5 three digits for each number, before one.
    radix = 1000 if number >= 1000000 else 10
    version = number // radix**2, number // radix % radix, number % radix
    said = ".".join(map(str, version))
    if not OLDEST <= version[:2] <= NEWEST:
        allowed = " to ".join(".".join(map(str, item)) for item in (OLDEST, NEWEST))
        raise ScenarioError(f"MuJoCo {said} is installed; a plugin is built for {allowed}")
    return Headers(include, said)


def plugin_files(scenario: Scenario, platforms: Sequence[str], mujoco: Headers) -> dict[str, bytes]:
    """The files of a plugin's folder by name, for one version of MuJoCo.

    ProgramError where no compiler is there for a platform, ScenarioError for a platform that is not known.
    """
    for name in platforms:
        if name not in BUILT_FOR:
            hint = nearest_name(name, BUILT_FOR)
            raise ScenarioError(f"platform '{name}' is not known{hint}; available: {', '.join(BUILT_FOR)}")
    if not platforms:
        raise ScenarioError(f"no plugin is built on this computer for itself; --platforms {' or '.join(BUILT_FOR)}")
    library = plugin_library(scenario)
    sources, identity = _sources(library, mujoco)
    # The file of the plugin on a platform.
    binaries = {name: f"{'' if name == 'win64' else 'lib'}{library.name}{PLATFORMS[name].suffix}" for name in platforms}
    numbers = {"identity": identity, **_numbers(scenario, library, mujoco, binaries)}
    # What fills the example and the page.
    device = scenario.device
    low, high = (angle - _NEUTRAL_ANGLE for angle in (device.actuator.angle_min, device.actuator.angle_max))
    rows = "".join(
        f"| `{item.path}` | {item.value!r} | {item.quantity.unit} | {item.quantity.summary or item.quantity.name} |\n"
        for item in attributes_of(library)
    )
    outputs = "".join(
        f"| {place} | `{name}` | {OUTPUTS[name][0]} | {OUTPUTS[name][1]} |\n"
        for place, name in enumerate(library.program.outputs)
    )
    libraries = numbers["libraries"]
    assert isinstance(libraries, dict)
    words = {
        "title": scenario.name,
        "plugin": plugin_name(library),
        "version": __version__,
        "mujoco": mujoco.version,
        "library": next(iter(libraries.values())),
        "libraries": ", ".join(f"`{file}` ({name})" for name, file in libraries.items()),
        "pressure": repr(device.supply.pressure),
        "low": repr(low),
        "high": repr(high),
        "armature": repr(device.foot_plate.inertia),
        "damping": repr(device.friction.viscous_damping),
        "frictionloss": repr(device.friction.dynamic_torque),
        "valve": _VALVES.get(device.valve.kind, _PROPORTIONAL),
        "attributes": rows,
        "outputs": outputs,
    }
    include = ("-I", str(mujoco.include))
    return {
        **{
            file: build_library(name, sources, "plugin.c", (*HIDDEN, *include, *_OF_LOADER[name]))
            for name, file in binaries.items()
        },
        NUMBERS: f"{json.dumps(numbers, indent=2)}\n".encode(),
        **{
            path: filled(template("mujoco", path.rpartition("/")[2]), words).encode()
            for path in ("example.xml", "README.md", "assist_sim/L1config.yaml", "assist_sim/L1model.xml")
        },
        **{f"sources/{name}": content for name, content in sources.items()},
    }


def plugin_library(scenario: Scenario) -> Library:
    """The library of the plant alone, whose vane follows straight pieces of an angle as in a replay.

    ScenarioError for any other actuator.
    """
    scenario.device.check_vane("a plugin of MuJoCo")
    chosen = replace(commanded(scenario), motion=held_vane(_angle_at_start(scenario)))
    library = scenario_library(chosen)
    program = prescribe_recorded_angle(replace(library.program.program, meters=(), is_adaptive=True))
    return replace(
        library,
        title=scenario.name,
        program=ExportedProgram(program, tuple(kind for kind in library.program.metrics if not kind.meters)),
        further=lambda collector, boundary: preparation_of(chosen, program, collector, boundary),
    )


def attributes_of(library: Library) -> tuple[Setting, ...]:
    """Settings that a model may give to the plugin, in SI units; others are MuJoCo's, or of no use to the gas."""
    unused = (*_NOT_OF_THE_GAS, *_OF_THE_JOINT)
    return tuple(item for item in library.settings if not item.path.startswith(unused))


def plugin_name(library: Library) -> str:
    """The name under which a model asks for the plugin."""
    return f"ppafo.{library.name}"


def _angle_at_start(scenario: Scenario) -> float:
    motion = scenario.motion
    if isinstance(motion, FreeMotion):
        return motion.angle
    assert isinstance(motion, PrescribedMotion)
    return min(max(_NEUTRAL_ANGLE, scenario.device.actuator.angle_min), scenario.device.actuator.angle_max)


def _sources(library: Library, mujoco: Headers) -> tuple[dict[str, bytes], str]:
    """The source files of a plugin by name, without MuJoCo's headers, and a hash that identifies the export."""
    name, written = library.name, library_files(library)
    identity = hashlib.sha256(written[f"{name}.c"] + f"{mujoco.version} {__version__}".encode()).hexdigest()[:16]
    chosen = attributes_of(library)
    places = [item.path for item in library.settings]
    words = {
        "name": name,
        "NAME": name.upper(),
        "title": library.title,
        "plugin": plugin_name(library),
        "version": __version__,
        "mujoco": mujoco.version,
        "apart": str(int(mujoco.has_outputs_apart)),
        "attributes": "".join(f'    "{item.path}",\n' for item in chosen) + f'    "{NEUTRAL}",',
        "places": ", ".join(str(places.index(item.path)) for item in chosen),
        "neutral": repr(_NEUTRAL_ANGLE),
        "torque": str(library.program.outputs.index("torque")),
        "steps": steps_source(library),
        "identity": identity,
    }
    program = {file: written[file] for file in (f"{name}.c", f"{name}.h", "LICENSE")}
    return {**program, "plugin.c": filled(template("mujoco", "plugin.c"), words).encode()}, identity


def _numbers(scenario: Scenario, library: Library, mujoco: Headers, binaries: Mapping[str, str]) -> dict[str, object]:
    """What programs may want to know of a plugin: its names, and numbers in SI units."""
    device = scenario.device
    return {
        "plugin": plugin_name(library),
        "scenario": scenario.name,
        "device": device.name,
        "ppafo": __version__,
        "mujoco": mujoco.version,
        "libraries": dict(binaries),
        "outputs": [
            {"name": name, "unit": OUTPUTS[name][0], "summary": OUTPUTS[name][1]} for name in library.program.outputs
        ],
        "attributes": [
            {
                "name": item.path,
                "unit": item.quantity.unit,
                "summary": item.quantity.summary or item.quantity.name,
                "value": item.value,
            }
            for item in attributes_of(library)
        ]
        + [
            {
                "name": NEUTRAL,
                "unit": "rad",
                "summary": "angle of the device with the joint at 0",
                "value": _NEUTRAL_ANGLE,
            }
        ],
        "joint": {
            "lowest_angle": device.actuator.angle_min,
            "highest_angle": device.actuator.angle_max,
            "armature": device.foot_plate.inertia,
            "damping": device.friction.viscous_damping,
            "frictionloss": device.friction.dynamic_torque,
        },
    }
