"""A scenario or a walk as a functional mock-up unit for co-simulation: sources inside, no Python at run time."""

import hashlib
import html
import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from importlib.resources import files

from ppafo.errors import ScenarioError, nearest_name
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.fmu import component
from ppafo.exports.fmu.binaries import FLAGS, PLATFORMS, Platform, build
from ppafo.exports.fmu.description import build_description_of_fmi3, description_of_fmi2, description_of_fmi3
from ppafo.exports.fmu.variables import Interface, change_of, variability_of
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__
from ppafo.walking.configuration import Configuration

_MARK = re.compile(r"@(\w+)@")
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
    chosen = {name: _platform(name, fmi) for name in platforms}
    identifier = interface.library.name
    sources = _sources(interface, fmi)
    token = hashlib.sha256(b"".join(sources.values())).hexdigest()[:32]
    sources = {name: content.replace(b"@token@", token.encode()) for name, content in sources.items()}
    main = f"fmi{fmi}.c"
    said = _said(interface, chosen)
    contents = {
        "modelDescription.xml": _DESCRIBED[fmi](interface, identifier, token, said),
        "documentation/index.html": _page(interface, chosen, main),
        "documentation/licenses/license.txt": files("ppafo.exports.c_library")
        .joinpath("templates", "LICENSE")
        .read_bytes(),
        **{f"sources/{name}": content for name, content in sources.items()},
    }
    if fmi == 3:
        contents["sources/buildDescription.xml"] = build_description_of_fmi3(identifier, " ".join(FLAGS[1:]))
    if "wasm32" in chosen:
        contents[f"{component.FOLDER}/manifest.xml"] = component.MANIFEST
    for name, item in chosen.items():
        folder = item.folder_2 if fmi == 2 else item.folder_3
        contents[f"binaries/{folder}/{identifier}{item.suffix}"] = build(name, sources, main)
    return {f"{identifier}.fmu": _archive(contents)}


def closed_loop(item: Scenario | Configuration) -> Interface:
    """The whole scenario or walk, its controller within: no inputs."""
    library = library_of(item)
    times = {setting.path: setting.value for setting in library.settings}
    return Interface(
        name=item.name,
        library=library,
        template="closed_loop.c",
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


def _platform(name: str, fmi: int) -> Platform:
    found = PLATFORMS.get(name)
    if found is None:
        hint = nearest_name(name, PLATFORMS)
        raise ScenarioError(f"platform '{name}' is not known{hint}; available: {', '.join(PLATFORMS)}")
    if fmi == 2 and found.folder_2 is None:
        raise ScenarioError(f"platform {name} has no name in FMI 2: take --fmi 3")
    return found


def _sources(interface: Interface, fmi: int) -> dict[str, bytes]:
    """The sources by name, with a mark where the token will be."""
    library = interface.library
    name = library.name
    written = library_files(library)
    paths = "\n".join(f'    "{item.path}",' for item in library.settings)
    words = {
        "name": name,
        "NAME": name.upper(),
        "title": library.title,
        "version": __version__,
        "input_count": str(len(interface.inputs)),
        "paths": paths,
        "changes": "".join(change_of(interface, item) for item in library.settings),
        "first_inputs": ", ".join([*(repr(item.start) for item in interface.inputs), "0.0"]),
        "output_changes": "".join(variability_of(name)[0] for name in library.program.outputs),
        "token": "@token@",
        "has_clock": "true" if interface.clock else "false",
        **interface.words,
    }
    unit = "\n".join(_filled(file, words) for file in ("unit.c", interface.template))
    headers = files("ppafo.exports.fmu").joinpath("headers")
    return {
        f"{name}.h": written[f"{name}.h"],
        f"{name}.c": written[f"{name}.c"],
        "unit.c": unit.encode(),
        f"fmi{fmi}.c": _filled(f"fmi{fmi}.c", words).encode(),
        **{file: headers.joinpath(file).read_bytes() for file in _HEADERS[fmi]},
    }


def _filled(file: str, words: Mapping[str, str]) -> str:
    """A template with its marks replaced."""
    text = files("ppafo.exports.fmu").joinpath("templates", file).read_text(encoding="utf-8")
    return _MARK.sub(lambda found: words[found[1]], text)


def _page(interface: Interface, platforms: Mapping[str, Platform], main: str) -> bytes:
    """The page inside a unit: what it is, how it goes on, how its binaries were tried."""
    rows = "".join(f"<tr><td>{name}</td><td>{item.tried}</td></tr>" for name, item in platforms.items())
    words = {
        "title": html.escape(interface.name),
        "description": html.escape(interface.library.description),
        "version": __version__,
        "time": interface.time,
        "tuning": interface.tuning,
        "binaries": rows or "<tr><td>none</td><td></td></tr>",
        "main": main,
        "flags": " ".join(FLAGS),
    }
    return _filled("index.html", words).encode()


def _said(interface: Interface, platforms: Mapping[str, Platform]) -> str:
    """The description, with what nobody has run."""
    not_run = [name for name, item in platforms.items() if item.tried == "not run"]
    said = interface.library.description
    return f"{said} Not run: {', '.join(not_run)}." if not_run else said


def _archive(contents: Mapping[str, bytes]) -> bytes:
    """A zip file of these files, the same bytes on every day."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            item = zipfile.ZipInfo(name, _FIRST_DAY)
            item.compress_type = zipfile.ZIP_DEFLATED
            item.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(item, content)
    return target.getvalue()
