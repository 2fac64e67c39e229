"""A scenario or a walk as a functional mock-up unit: sources inside, no Python at run time.

The unit holds the closed loop, or the plant alone: valve, gas and supply under a command, on a vane that is
unconstrained or moved. It is for co-simulation.
"""

import hashlib
import html
import importlib.util
import io
import platform
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from ppafo.errors import ProgramError, ScenarioError, nearest_name
from ppafo.exports import filled, template
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.plant import follow_lines, plant_of, surfaced
from ppafo.exports.fmu.description import (
    Interface,
    build_description_of_fmi3,
    change_of,
    description_of_fmi2,
    description_of_fmi3,
    variability_of,
)
from ppafo.simulation.scenario import Scenario
from ppafo.translation.compiling import asked, complaint
from ppafo.version import __version__

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
_ANOTHER = "install gcc, clang or 'pip install ppafo[native]' anew"
HIDDEN = ("-shared", "-fPIC", "-fvisibility=hidden")


@dataclass(frozen=True, slots=True)
class Platform:
    """A kind of computer: its folder in a unit of FMI 2 (None: there is none) and of FMI 3, and how it is built for.

    ``tried`` says what the binary of this platform was run on by the authors.
    """

    folder_2: str | None
    folder_3: str
    target: str
    suffix: str
    tried: str


PLATFORMS = {
    "linux64": Platform("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so", "run in the tests"),
    "win64": Platform("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll", "run under Wine"),
    "linux-aarch64": Platform(None, "aarch64-linux", "aarch64-linux-gnu.2.17", ".so", "run under qemu"),
}
"""Platforms by the names under which they are requested."""


def host_platform() -> str | None:
    """The platform of this computer, None where a unit has none for it."""
    machine = {"x86_64": "64", "amd64": "64", "aarch64": "-aarch64", "arm64": "-aarch64"}.get(
        platform.machine().lower()
    )
    system = {"Linux": "linux", "Windows": "win"}.get(platform.system())
    name = f"{system}{machine}"
    return name if name in PLATFORMS else None


def build(name: str, sources: Mapping[str, bytes], main: str) -> bytes:
    """The library of a unit for a platform. ProgramError where no compiler is there for it, or it refuses."""
    # No -march: a unit runs on processors that nobody here has seen.
    command = [*compiler_for(name), *FLAGS, *HIDDEN]
    with tempfile.TemporaryDirectory(prefix="ppafo-", ignore_cleanup_errors=True) as folder:
        for file, content in sources.items():
            (Path(folder) / file).write_bytes(content)
        library = Path(folder) / f"unit{PLATFORMS[name].suffix}"
        # Windows has the mathematics in its C library.
        mathematics = [] if name == "win64" else ["-lm"]
        done = asked([*command, main, "-o", library.name, *mathematics], _ANOTHER, folder, Path(folder))
        if done.returncode != 0:
            raise ProgramError(f"{command[0]} does not build the library for {name}: {complaint(done)}")
        if not library.is_file():
            raise ProgramError(f"{command[0]} says that all is well, but made no library for {name}; {_ANOTHER}")
        return library.read_bytes()


def compiler_for(name: str) -> Sequence[str]:
    """The words of a compiler for a platform. ProgramError where there is none."""
    if importlib.util.find_spec("ziglang") is not None:
        return [
            sys.executable,
            "-m",
            "ziglang",
            "cc",
            "-target",
            PLATFORMS[name].target,
            "-s",
            # zig turns undefined behaviour into traps in what it calls a debug build.
            "-fno-sanitize=undefined",
        ]
    compiler = next(filter(None, map(shutil.which, ("gcc", "clang"))), None)
    # A library of this system's gcc runs on systems that are at least as new; zig links against an old one.
    if name == host_platform() == "linux64" and compiler is not None:
        return [compiler, "-s"]
    needed = "gcc, clang or the package ziglang" if name == "linux64" else "the package ziglang"
    raise ProgramError(f"platform {name} needs {needed} (pip install 'ppafo[native]')")


# The earliest date of a zip file: a unit does not depend on the day on which it was made.
_FIRST_DAY = (1980, 1, 1, 0, 0, 0)
_HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
_DESCRIBED = {2: description_of_fmi2, 3: description_of_fmi3}


_LOOP_TIME = (
    "The unit goes from sample to sample, <code>run.output_interval</code> apart, and shows the last one that is due. "
    "Any communication step is taken. The run ends at <code>run.duration</code>: a longer one is set before the start."
)

_LOOP_TUNING = (
    "The controller takes them at its next sample, the plant one step of the engine later. Of a reference that changes "
    "under way, metrics of ramp and hold keep the times of the first one."
)


def functional_unit(interface: Interface, fmi: int, platforms: Sequence[str]) -> dict[str, bytes]:
    """A unit by the name of its file. ProgramError for what cannot be translated or built."""
    # Before anything is built: a misspelt platform should not cost a compilation.
    chosen = {}
    for name in platforms:
        platform = PLATFORMS.get(name)
        if platform is None:
            hint = nearest_name(name, PLATFORMS)
            raise ScenarioError(f"platform '{name}' is not known{hint}; available: {', '.join(PLATFORMS)}")
        if fmi == 2 and platform.folder_2 is None:
            raise ScenarioError(f"platform {name} has no name in FMI 2: take --fmi 3")
        chosen[name] = platform
    identifier = interface.library.name
    sources = _sources(interface, fmi)
    token = hashlib.sha256(b"".join(sources.values())).hexdigest()[:32]
    # The token is the hash of the sources before it stands in them.
    sources = {name: content.replace(b"@token@", token.encode()) for name, content in sources.items()}
    main = f"fmi{fmi}.c"
    tried = "".join(f"<tr><td>{name}</td><td>{library.tried}</td></tr>" for name, library in chosen.items())
    words = {
        "title": html.escape(interface.name),
        "description": html.escape(interface.library.description),
        "version": __version__,
        "time": interface.time,
        "tuning": interface.tuning,
        "binaries": tried or "<tr><td>none</td><td></td></tr>",
        "main": main,
        "flags": " ".join(FLAGS),
    }
    contents = {
        "modelDescription.xml": _DESCRIBED[fmi](interface, identifier, token),
        "documentation/index.html": filled(template("ppafo.exports.fmu", "index.html"), words).encode(),
        "documentation/licenses/license.txt": template("ppafo.exports.c_library", "LICENSE").encode(),
        **{f"sources/{name}": content for name, content in sources.items()},
    }
    if fmi == 3:
        contents["sources/buildDescription.xml"] = build_description_of_fmi3(identifier, " ".join(FLAGS[1:]))
    for name, library in chosen.items():
        folder = library.folder_2 if fmi == 2 else library.folder_3
        contents[f"binaries/{folder}/{identifier}{library.suffix}"] = build(name, sources, main)
    return {f"{identifier}.fmu": _archive(contents)}


def closed_loop(scenario: Scenario) -> Interface:
    """The whole scenario or walk, its controller within: no inputs."""
    library = library_of(scenario)
    times = {setting.path: setting.value for setting in library.settings}
    return Interface(
        name=scenario.name,
        library=library,
        templates=("stepped.c", "closed_loop.c"),
        time=_LOOP_TIME,
        tuning=_LOOP_TUNING,
        step=times["run.output_interval"],
        duration=times["run.duration"],
        outputs=library.program.outputs,
        shows_metrics=True,
        is_step_fixed=False,
        clock="ticks when the controller decides, every controller.period",
        hidden=frozenset(),
        inputs=(),
        words={},
    )


def _sources(interface: Interface, fmi: int) -> dict[str, bytes]:
    """The sources by name, with a mark where the token will be."""
    library = interface.library
    name = library.name
    written = library_files(library)
    paths = "\n".join(f'    "{setting.path}",' for setting in library.settings)
    words = {
        "name": name,
        "NAME": name.upper(),
        "title": library.title,
        "version": __version__,
        "input_count": str(len(interface.inputs)),
        "paths": paths,
        "changes": "".join(change_of(interface, setting) for setting in library.settings),
        "first_inputs": ", ".join([*(repr(variable.start) for variable in interface.inputs), "0.0"]),
        "output_changes": "".join(variability_of(name)[0] for name in library.program.outputs),
        "token": "@token@",
        "has_clock": "true" if interface.clock else "false",
        "checked": "inertia, volumes and areas",
        **interface.words,
    }
    unit = "\n".join(filled(template("ppafo.exports.fmu", file), words) for file in ("unit.c", *interface.templates))
    calls = {3: ["fmi3.c"], 2: ["fmi2.c", "fmi2_steps.c"]}
    headers = files("ppafo.exports.fmu").joinpath("headers")
    return {
        f"{name}.h": written[f"{name}.h"],
        f"{name}.c": written[f"{name}.c"],
        "unit.c": unit.encode(),
        f"fmi{fmi}.c": "".join(filled(template("ppafo.exports.fmu", file), words) for file in calls[fmi]).encode(),
        **{file: headers.joinpath(file).read_bytes() for file in _HEADERS[fmi]},
    }


def _archive(contents: Mapping[str, bytes]) -> bytes:
    """A zip file of these files, the same bytes on every day."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, _FIRST_DAY)
            entry.compress_type = zipfile.ZIP_DEFLATED
            # Permissions of Unix in the upper half; a library must be executable for some tools.
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, content)
    return target.getvalue()


PLANT_TIME = (
    "Inputs are taken at the beginning of a communication step. It is a multiple of <code>run.step</code>; the engine "
    "divides it further where its error asks for that. {motion} There is no end."
)
PLANT_TUNING = "They are taken at the next communication step."


def plant_alone(scenario: Scenario) -> Interface:
    """The plant; an unconstrained vane takes an external torque, one with a prescribed angle takes angle and rate.

    For a walk it is the device on its walking leg, which takes the command alone. ``export c`` writes the same plant.
    """
    alone = surfaced(plant_of(scenario))
    library = alone.library
    inputs = ", ".join(f"inputs[{index}]" for index in range(len(alone.inputs)))
    numbers = {name.name: f"inputs[{index}]" for index, name in enumerate(alone.inputs)}
    return Interface(
        name=library.title,
        library=library,
        templates=("stepped.c", "plant_inputs.c", "plant.c"),
        time=PLANT_TIME.format(motion=alone.motion),
        tuning=PLANT_TUNING,
        step=alone.step,
        duration=scenario.run.duration,
        outputs=library.program.outputs,
        shows_metrics=False,
        is_step_fixed=True,
        clock=None,
        hidden=alone.hidden,
        inputs=alone.inputs,
        words={
            "inputs": inputs,
            "follow": follow_lines(alone, "settings", numbers),
            "checked": "the limits of the inputs, inertia, volumes and areas",
        },
    )
