"""FMU file: description, documentation page, sources, and compiled libraries of its platforms."""

import hashlib
import html
import io
import zipfile
from collections.abc import Sequence
from importlib.resources import files

from ppafo.errors import ScenarioError
from ppafo.exports import filled, template
from ppafo.exports.c_library.files import library_files
from ppafo.exports.fmu.description import build_description_of_fmi3, description_of_fmi2, description_of_fmi3
from ppafo.exports.fmu.interface import Interface
from ppafo.exports.fmu.platforms import FLAGS, PLATFORMS, build, host_platform
from ppafo.exports.fmu.trial import check_unit
from ppafo.exports.fmu.variables import tuning_of, variability_of
from ppafo.version import __version__
from ppafo.wording import argument_text, known_names

_FIRST_DAY = (1980, 1, 1, 0, 0, 0)
"""Earliest date of a zip entry, so that a unit does not depend on its date of creation."""
_HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
_DESCRIBED = {2: description_of_fmi2, 3: description_of_fmi3}
_CALLS = {2: ("fmi2.c", "fmi2_steps.c"), 3: ("fmi3.c",)}
"""Templates of the functions of FMI, by version."""


def functional_unit(interface: Interface, fmi: int, platforms: Sequence[str]) -> dict[str, bytes]:
    """Return the content of a unit by file name; ``fmi`` is the version, 2 or 3.

    Raises ScenarioError for an unknown platform, ProgramError for code that cannot be translated or compiled, and for a
    unit of this computer whose results differ from Python.
    """
    # Before anything is built: a misspelt platform should not cost a compilation.
    for name in platforms:
        if name not in PLATFORMS:
            raise ScenarioError(f"platform '{name}' is unknown{known_names(name, PLATFORMS)}")
        if fmi == 2 and PLATFORMS[name].folder_2 is None:
            raise ScenarioError(f"platform {name} is not defined in FMI 2: give {argument_text('fmi')} 3")
    chosen = {name: PLATFORMS[name] for name in platforms}
    identifier = interface.library.name
    sources = _sources(interface, fmi)
    token = hashlib.sha256(b"".join(sources.values())).hexdigest()[:32]
    # The token is the hash of the sources before it stands in them.
    sources = {name: content.replace(b"@token@", token.encode()) for name, content in sources.items()}
    main = f"fmi{fmi}.c"
    trials = "".join(f"<tr><td>{name}</td><td>{platform.trial}</td></tr>" for name, platform in chosen.items())
    words = {
        "title": html.escape(interface.library.title),
        "description": html.escape(interface.library.description),
        "version": __version__,
        "time": interface.time,
        "tuning": interface.tuning,
        "binaries": trials or "<tr><td>none</td><td></td></tr>",
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
    for name, platform in chosen.items():
        folder = platform.folder_2 if fmi == 2 else platform.folder_3
        library = build(name, sources, main)
        if name == host_platform():
            check_unit(interface, fmi, token, library)
        contents[f"binaries/{folder}/{identifier}{platform.suffix}"] = library
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, _FIRST_DAY)
            entry.compress_type = zipfile.ZIP_DEFLATED
            # Permissions of Unix in the upper half; a library must be executable for some tools.
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, content)
    return {f"{identifier}.fmu": target.getvalue()}


def _sources(interface: Interface, fmi: int) -> dict[str, bytes]:
    """Return the sources by name, with a placeholder for the token."""
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
        "units": "\n".join(f'    "{setting.quantity.unit}",' for setting in library.settings),
        "changes": "".join(tuning_of(interface, setting)[0] for setting in library.settings),
        "first_inputs": ", ".join([*(repr(variable.start) for variable in interface.inputs), "0.0"]),
        "output_changes": "".join(variability_of(name)[0] for name in library.program.outputs),
        "token": "@token@",
        "has_clock": "true" if interface.clock else "false",
        "checked": "inertia, volumes and areas",
        **interface.words,
    }
    unit = "\n".join(filled(template("ppafo.exports.fmu", file), words) for file in ("unit.c", *interface.templates))
    headers = files("ppafo.exports.fmu").joinpath("headers")
    return {
        f"{name}.h": written[f"{name}.h"],
        f"{name}.c": written[f"{name}.c"],
        "unit.c": unit.encode(),
        f"fmi{fmi}.c": "".join(filled(template("ppafo.exports.fmu", file), words) for file in _CALLS[fmi]).encode(),
        **{file: headers.joinpath(file).read_bytes() for file in _HEADERS[fmi]},
    }
