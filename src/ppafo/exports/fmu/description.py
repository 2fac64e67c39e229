"""The description of a unit: its variables, and modelDescription.xml of FMI 2 and 3."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as Xml

from ppafo.exports.c_library.files import OUTPUTS, Library, Setting
from ppafo.exports.c_library.plant import Input
from ppafo.model.controlled import CONTROLLED
from ppafo.units import base_value, dimension
from ppafo.version import __version__

FIXED_SECTIONS = ("run", "initial", "gas", "actuator", "foot_plate", "wearer", "motion", "motion.profile")
"""Settings that the start of a run is made of: they cannot change under way."""
FIXED_NAMES = ("period", "delay", "seed")
"""Names of further settings that cannot change under way: they count steps or begin the noise."""
TUNABLE_OF_WEARER = ("residual_share", "ankle_stiffness", "ankle_rest_angle", "ankle_damping")
"""Settings of the wearer that may change: the weight of a leg stays."""
REFERENCES = tuple(kind.reference for kind in CONTROLLED.values())
STEPPED = ("command", *REFERENCES, "strides", "contact", "controller_phase", "safe_state")
"""Outputs that jump from sample to sample."""


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable of a unit: name, number, unit and meaning; ``causality`` and ``variability`` in words of FMI.

    ``start`` None is calculated, limits None are none.
    """

    name: str
    number: int
    unit: str
    summary: str
    causality: str
    variability: str
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True, slots=True)
class Interface:
    """The interface of a unit: inputs, outputs, metrics, settings that are none of its variables.

    ``templates`` have the C that moves it on, ``words`` what is filled in there. ``time`` says for people how it goes
    on, ``tuning`` when a changed parameter is taken. ``step`` is the communication step that it takes by default [s],
    ``is_step_fixed`` true where others must be multiples of it. ``clock`` is what the clock of the controller says.
    """

    name: str
    library: Library
    templates: tuple[str, ...]
    time: str
    tuning: str
    step: float
    duration: float
    outputs: tuple[str, ...]
    shows_metrics: bool
    is_step_fixed: bool
    clock: str | None
    hidden: frozenset[str]
    inputs: tuple[Input, ...]
    words: dict[str, str]


def change_of(interface: Interface, setting: Setting) -> str:
    """``h`` for a setting that is no variable, ``t`` for one that may change under way, else ``f``."""
    if setting.path in interface.hidden:
        return "h"
    section, _, name = setting.path.rpartition(".")
    if section == "wearer" and name in TUNABLE_OF_WEARER:
        return "t"
    return "f" if section in FIXED_SECTIONS or name in FIXED_NAMES else "t"


def variables_of(interface: Interface) -> tuple[Variable, ...]:
    """All variables, in the order of their numbers, which are also the C's."""
    library = interface.library
    first_metric = len(library.settings) + len(library.program.outputs)
    first_input = first_metric + len(library.program.metrics)
    variables = []
    for number, setting in enumerate(interface.library.settings):
        change, quantity = change_of(interface, setting), setting.quantity
        if change == "h":
            continue
        # The largest floats stand for no limit; XML would show them as one.
        low, high = (limit if abs(limit) < 1e308 else None for limit in (quantity.minimum, quantity.maximum))
        said = quantity.summary or quantity.name
        kind = "tunable" if change == "t" else "fixed"
        variables.append(
            Variable(setting.path, number, quantity.unit, said, "parameter", kind, setting.value, low, high)
        )
    return (
        *variables,
        *(
            Variable(name, len(library.settings) + index, *OUTPUTS[name], "output", variability_of(name))
            for index, name in enumerate(library.program.outputs)
            if name in interface.outputs
        ),
        *(
            Variable(f"metrics.{kind.name}", first_metric + index, kind.unit, kind.summary, "local", "continuous")
            for index, kind in enumerate(library.program.metrics if interface.shows_metrics else ())
        ),
        *(
            Variable(
                variable.name,
                first_input + index,
                variable.unit,
                variable.summary,
                "input",
                "continuous",
                variable.start,
                variable.minimum,
                variable.maximum,
            )
            for index, variable in enumerate(interface.inputs)
        ),
    )


def variability_of(name: str) -> str:
    """Whether an output jumps, ``discrete``, or goes on, ``continuous``."""
    return "discrete" if name in STEPPED else "continuous"


BASE_UNITS = {
    "[mass]": "kg",
    "[length]": "m",
    "[time]": "s",
    "[temperature]": "K",
    "[substance]": "mol",
    "[angle]": "rad",
}
DISPLAY_UNITS = {
    "Pa": "psi",
    "kg": "g",
    "m^2": "mm^2",
    "m^3": "cm^3",
    "m^3/rad": "cm^3/rad",
    "rad": "deg",
    "rad/s": "deg/s",
}
"""What a tool shows in place of an SI unit, whose values it exchanges: units of the bench, as in the files of ppafo."""
TOOL = f"ppafo {__version__}"


def description_of_fmi2(interface: Interface, identifier: str, token: str) -> bytes:
    """The description for FMI 2.0."""
    variables = variables_of(interface)
    head = _head("2.0", interface, guid=token)
    root = Xml.Element("fmiModelDescription", head)
    kind = Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        canNotUseMemoryManagementFunctions="true",
        canHandleVariableCommunicationStepSize=str(not interface.is_step_fixed).lower(),
    )
    # One file that takes the others in: tools that build from source need no list.
    Xml.SubElement(Xml.SubElement(kind, "SourceFiles"), "File", name="fmi2.c")
    _add_units_and_experiment(root, interface, variables)
    table = Xml.SubElement(root, "ModelVariables")
    # FMI 2 counts variables by their place in the list, from 1.
    places = {variable.number: index for index, variable in enumerate(variables, start=1)}
    for variable in variables:
        of_variable, of_number = _attributes(variable)
        Xml.SubElement(Xml.SubElement(table, "ScalarVariable", of_variable), "Real", of_number)
    outputs = [places[variable.number] for variable in variables if variable.causality == "output"]
    structure = Xml.SubElement(root, "ModelStructure")
    # Outputs of a step depend on no input of that instant.
    for name, known in (("Outputs", {"dependencies": ""}), ("InitialUnknowns", {})):
        section = Xml.SubElement(structure, name) if outputs else structure
        for index in outputs:
            Xml.SubElement(section, "Unknown", {"index": str(index), **known})
    return _text(root)


def description_of_fmi3(interface: Interface, identifier: str, token: str) -> bytes:
    """The description for FMI 3.0."""
    variables = variables_of(interface)
    root = Xml.Element("fmiModelDescription", _head("3.0", interface, instantiationToken=token))
    has_clock = str(interface.clock is not None).lower()
    internal: dict[str, Any] = {"fixedInternalStepSize": repr(interface.step)} if interface.is_step_fixed else {}
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize=str(not interface.is_step_fixed).lower(),
        hasEventMode=has_clock,
        mightReturnEarlyFromDoStep=has_clock,
        **internal,
    )
    _add_units_and_experiment(root, interface, variables)
    table = Xml.SubElement(root, "ModelVariables")
    # Clock and time get numbers behind all variables of the C.
    first = 1 + max(variable.number for variable in variables)
    if interface.clock is not None:
        clock = {"valueReference": str(first), "description": interface.clock, "causality": "output"}
        Xml.SubElement(table, "Clock", {"name": "controller.clock", **clock, "intervalVariability": "triggered"})
    time = {"name": "time", "valueReference": str(first + 1), "description": "time", "causality": "independent"}
    Xml.SubElement(table, "Float64", {**time, "variability": "continuous", "unit": "s"})
    for variable in variables:
        of_variable, of_number = _attributes(variable)
        Xml.SubElement(table, "Float64", of_variable | of_number)
    structure = Xml.SubElement(root, "ModelStructure")
    outputs = [variable.number for variable in variables if variable.causality == "output"]
    outputs += [] if interface.clock is None else [first]
    for name, known in {"Output": {"dependencies": ""}, "InitialUnknown": {}}.items():
        for number in outputs:
            Xml.SubElement(structure, name, {"valueReference": str(number), **known})
    return _text(root)


def build_description_of_fmi3(identifier: str, flags: str) -> bytes:
    """How the sources of a unit of FMI 3.0 are built."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    built = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    sources = Xml.SubElement(built, "SourceFileSet", language="C99", compilerOptions=flags)
    Xml.SubElement(sources, "SourceFile", name="fmi3.c")
    return _text(root)


def _head(version: str, interface: Interface, **further: str) -> dict[str, str]:
    return {
        "fmiVersion": version,
        "modelName": interface.name,
        **further,
        "description": interface.library.description,
        "version": __version__,
        "license": "MIT",
        "generationTool": TOOL,
        "variableNamingConvention": "structured",
    }


def _attributes(variable: Variable) -> tuple[dict[str, str], dict[str, str]]:
    """Attributes of a variable, and of the number that it is."""
    initial = {"parameter": {"initial": "exact"}, "input": {}}.get(variable.causality, {"initial": "calculated"})
    of_variable = {
        "name": variable.name,
        "valueReference": str(variable.number),
        "description": variable.summary,
        "causality": variable.causality,
        "variability": variable.variability,
        **initial,
    }
    limits = {"min": variable.minimum, "max": variable.maximum, "start": variable.start}
    unit = _shown(variable.unit)
    of_number = {"unit": unit} if unit else {}
    if unit in DISPLAY_UNITS:
        of_number["displayUnit"] = DISPLAY_UNITS[unit]
    of_number |= {name: repr(float(value)) for name, value in limits.items() if value is not None}
    return of_variable, of_number


def _shown(unit: str) -> str:
    """A unit of ppafo without the kind of a pressure, which FMI does not distinguish; empty for a plain number."""
    bare = unit.removesuffix("_a").removesuffix("_d")
    return "" if bare in ("", "-", "1") else bare


def _add_units_and_experiment(root: Xml.Element, interface: Interface, variables: Iterable[Variable]) -> None:
    """Add what stands between the kind of a unit and its variables, in FMI 2 and 3 alike."""
    table = Xml.SubElement(root, "UnitDefinitions")
    for name in sorted({_shown(variable.unit) for variable in variables} - {""}):
        exponents = {BASE_UNITS[base]: str(power) for base, power in dimension(name).items()}
        unit = Xml.SubElement(table, "Unit", name=name)
        Xml.SubElement(unit, "BaseUnit", exponents)
        if name in DISPLAY_UNITS:
            factor = 1.0 / base_value(1.0, DISPLAY_UNITS[name]) * base_value(1.0, name)
            Xml.SubElement(unit, "DisplayUnit", name=DISPLAY_UNITS[name], factor=repr(factor))
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError", description="why a call failed")
    times = {"startTime": 0.0, "stopTime": interface.duration, "stepSize": interface.step}
    Xml.SubElement(root, "DefaultExperiment", {name: repr(value) for name, value in times.items()})


def _text(root: Xml.Element) -> bytes:
    Xml.indent(root)
    text: str = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()
