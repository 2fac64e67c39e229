"""FMU file: description, documentation page, sources, and compiled libraries of its platforms.

It is loaded and compared with Python before delivery.
"""

import ctypes
import hashlib
import html
import io
import zipfile
from collections.abc import Sequence
from contextlib import closing
from ctypes import c_bool, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from importlib.resources import files
from pathlib import Path
from typing import Any

from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports import filled, template
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.plant import EXAMPLE, follow_lines
from ppafo.exports.fmu.description import build_description_of_fmi3, model_description
from ppafo.exports.fmu.interface import Interface, tuning_of, variability_of, variables_of
from ppafo.exports.fmu.platforms import FLAGS, PLATFORMS, build, host_platform
from ppafo.storage.files import temporary_folder
from ppafo.version import __version__
from ppafo.wording import argument_text, check_known

_FIRST_DAY = (1980, 1, 1, 0, 0, 0)
"""Earliest date of a zip entry, so that a unit does not depend on its date of creation."""
_HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
_CALLS = {2: ("fmi2.c", "fmi2_steps.c"), 3: ("fmi3.c",)}
"""Templates of the functions of FMI, by version."""
_LOOP = (
    "Outputs are samples taken every <code>run.output_interval</code>; the latest one is shown. Any "
    "communication step is accepted. The run ends at <code>run.duration</code>; set a longer one before the start.",
    "The controller reads them at its next sample, the plant one engine step later. If the reference changes during "
    "the run, the metrics of ramp and hold keep the times of the initial reference.",
)
_PLANT = (
    "Inputs are read at the beginning of a communication step, a multiple of <code>{steps}</code>. {motion} There "
    "is no stop time.",
    "They take effect at the next communication step.",
)
"""Time stepping of a closed loop and of a plant, and when changed parameters take effect, for the page of the unit."""
_NAME = b"trial"
_CO_SIMULATION = 1
"""Instance type fmi2CoSimulation of FMI 2."""


class _Instance:
    """Instance of a unit, in FMI 3 without event mode; calls return the status, 0 for success."""

    def __init__(self, library: ctypes.CDLL, fmi: int, token: str) -> None:
        self.library = library
        self.fmi = fmi
        name = c_char_p(_NAME)
        word = c_char_p(token.encode())
        none = c_void_p(None)
        words: tuple[Any, ...] = (name, word, none, *(c_bool(False),) * 4, none, c_size_t(0), none, none, none)
        if fmi == 2:
            words = (name, c_int(_CO_SIMULATION), word, none, none, c_int(0), c_int(0))
        make = library["fmi2Instantiate" if fmi == 2 else "fmi3InstantiateCoSimulation"]
        make.restype = c_void_p
        self.instance = c_void_p(make(*words))

    def call(self, function: str, *arguments: Any) -> int:
        """Call a function of the instance."""
        return int(self.library[f"fmi{self.fmi}{function}"](self.instance, *arguments))

    def begin(self, numbers: Any, values: Any) -> int:
        """Set the inputs and initialise up to the first sample."""
        experiment = (c_int(0), c_double(0.0), c_double(0.0), c_int(0), c_double(0.0))
        begun = (
            self.call("SetupExperiment", *experiment) or self.call("EnterInitializationMode")
            if self.fmi == 2
            else self.call("EnterInitializationMode", *experiment)
        )
        return begun or self.exchange("Set", numbers, values) or self.call("ExitInitializationMode")

    def advance(self, time: float, length: float) -> int:
        """Perform one communication step of ``length`` [s] from ``time`` [s]."""
        found = [*(ctypes.byref(c_bool()) for _ in range(3)), ctypes.byref(c_double())] if self.fmi == 3 else []
        return self.call("DoStep", c_double(time), c_double(length), c_int(1), *found)

    def exchange(self, verb: str, numbers: Any, values: Any) -> int:
        """Set inputs, or get outputs into ``values``."""
        count = c_size_t(len(numbers))
        if self.fmi == 2:
            return self.call(f"{verb}Real", numbers, count, values)
        return self.call(f"{verb}Float64", numbers, count, values, count)

    def close(self) -> None:
        """Free the instance."""
        self.call("FreeInstance")


def check_unit(interface: Interface, fmi: int, token: str, library: bytes) -> None:
    """Load the library of a unit on this computer and compare its outputs with the Python run, to the bit.

    Raises ProgramError if it cannot be loaded, a call fails, or an output differs.
    """
    head, *lines = interface.table().decode().splitlines()
    rows = [[float(text) for text in line.split(",")] for line in lines]
    numbers = {variable.name: variable.number for variable in variables_of(interface)}
    columns = head.split(",")[1:]
    inputs = {item.name: EXAMPLE if item.name == "command" else item.start for item in interface.inputs}
    outputs = [name for name in columns if name not in inputs]
    with temporary_folder("ppafo-unit", {"unit": library}) as folder:
        try:
            functions = ctypes.CDLL(str(Path(folder, "unit")))
        except OSError as error:
            raise ProgramError(
                f"{interface.library.title}: the FMU was built but cannot be loaded here: {error}"
            ) from error
        with closing(_Instance(functions, fmi, token)) as instance:
            output_numbers = _array(c_uint, [numbers[name] for name in outputs])
            values = (c_double * len(outputs))()
            input_numbers = _array(c_uint, [numbers[name] for name in inputs])
            status = instance.begin(input_numbers, _array(c_double, list(inputs.values())))
            previous_time = 0.0
            for time, *row in rows:
                of_row = dict(zip(columns, row, strict=True))
                expected = [of_row[name] for name in outputs]
                inputs |= {name: of_row[name] for name in inputs if name in of_row}
                if time > 0.0:
                    status = status or instance.exchange("Set", input_numbers, _array(c_double, list(inputs.values())))
                    status = status or instance.advance(previous_time, time - previous_time)
                status = status or instance.exchange("Get", output_numbers, values)
                previous_time = time
                for name, value, python_value in zip(outputs, values, expected, strict=True):
                    if status or value != python_value:
                        problem = f"{name} is {value!r}, Python has {python_value!r}" if not status else "a call fails"
                        raise ProgramError(
                            f"{interface.library.title}: the FMU differs from the Python run at {time:g} s: "
                            f"{problem}; no file was written"
                        )


def _array(kind: Any, values: Sequence[Any]) -> Any:
    return (kind * len(values))(*values)


def functional_unit(interface: Interface, fmi: int, platforms: Sequence[str]) -> dict[str, bytes]:
    """Return the content of a unit by file name; ``fmi`` is the version, 2 or 3.

    Raises ScenarioError for an unknown platform, ProgramError for code that cannot be translated or compiled, and for a
    unit of this computer whose results differ from Python.
    """
    # Before anything is built: a misspelt platform should not cost a compilation.
    for name in platforms:
        check_known(name, PLATFORMS, ScenarioError, f"platform '{name}' is unknown")
        if fmi == 2 and PLATFORMS[name].folder_2 is None:
            raise ScenarioError(f"platform {name} is not defined in FMI 2: give {argument_text('fmi')} 3")
    chosen = {name: PLATFORMS[name] for name in platforms}
    identifier = interface.library.name
    sources = _sources(interface, fmi)
    token = hashlib.sha256(b"".join(sources.values())).hexdigest()[:32]
    # The token is the hash of the sources before it stands in them.
    sources = {name: content.replace(b"@token@", token.encode()) for name, content in sources.items()}
    main = f"fmi{fmi}.c"
    plant = interface.plant
    time, tuning = (
        _LOOP
        if plant is None
        else (
            _PLANT[0].format(motion=plant.drive.motion, steps=plant.drive.steps),
            _PLANT[1],
        )
    )
    trials = "".join(f"<tr><td>{name}</td><td>{platform.trial}</td></tr>" for name, platform in chosen.items())
    words = {
        "title": html.escape(interface.library.title),
        "description": html.escape(interface.library.description),
        "version": __version__,
        "time": time,
        "tuning": tuning,
        "binaries": trials or "<tr><td>none</td><td></td></tr>",
        "main": main,
        "flags": " ".join(FLAGS),
    }
    contents = {
        "modelDescription.xml": model_description(interface, fmi, identifier, token),
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
    plant = interface.plant
    name = library.name
    written = library_files(library)
    paths = "\n".join(f'    "{setting.path}",' for setting in library.settings)
    words = {
        **library.api.words,
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
        "has_clock": "true" if plant is None else "false",
        "checked": "inertia, volumes and areas",
    }
    templates = ["unit.c", "stepped.c", "closed_loop.c"]
    if plant is not None:
        # A law has no run of its own, in which a unit could hold what it is at.
        templates = [*([] if library.api.functions is None else ["law_run.c"]), "unit.c", "stepped.c"]
        templates += ["plant_inputs.c", "plant.c"]
        words["step_path"] = plant.drive.steps
        places = {variable.name: f"inputs[{index}]" for index, variable in enumerate(plant.inputs)}
        words["inputs"] = ", ".join(places.values())
        words["follow"] = follow_lines(plant, "settings", places)
        words["checked"] = "the limits of the inputs, inertia, volumes and areas"
    unit = "\n".join(filled(template("ppafo.exports.fmu", file), words) for file in templates)
    headers = files("ppafo.exports.fmu").joinpath("headers")
    return {
        f"{name}.h": written[f"{name}.h"],
        f"{name}.c": written[f"{name}.c"],
        "unit.c": unit.encode(),
        f"fmi{fmi}.c": "".join(filled(template("ppafo.exports.fmu", file), words) for file in _CALLS[fmi]).encode(),
        **{file: headers.joinpath(file).read_bytes() for file in _HEADERS[fmi]},
    }
