"""modelDescription.xml of FMI 2 and 3: variables, units and capabilities of an FMU."""

from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree as Xml

from ppafo.exports.fmu.interface import FmuVariable, Interface, variables_of
from ppafo.units import base_value
from ppafo.units.spelling import read_unit
from ppafo.version import __version__

_BASE_UNITS = {
    "[mass]": "kg",
    "[length]": "m",
    "[time]": "s",
    "[temperature]": "K",
    "[substance]": "mol",
    "[angle]": "rad",
}
"""Base unit of FMI for each base dimension."""
_DISPLAY_UNITS = {
    "Pa": "psi",
    "kg": "g",
    "m^2": "mm^2",
    "m^3": "cm^3",
    "m^3/rad": "cm^3/rad",
    "rad": "deg",
    "rad/s": "deg/s",
}
"""Display unit of each exchanged SI unit: bench units, as in the files of ppafo."""
_CLOCK = "clock of the controller, ticks every controller.period"


def description_of_fmi2(interface: Interface, identifier: str, token: str) -> bytes:
    """Return modelDescription.xml of FMI 2.0; ``identifier`` names the library, ``token`` identifies its sources."""
    variables = variables_of(interface)
    root = Xml.Element("fmiModelDescription", _head("2.0", interface, guid=token))
    kind = Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        canNotUseMemoryManagementFunctions="true",
        canHandleVariableCommunicationStepSize=str(interface.plant is None).lower(),
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
    """Return modelDescription.xml of FMI 3.0; ``identifier`` names the library, ``token`` identifies its sources."""
    variables = variables_of(interface)
    root = Xml.Element("fmiModelDescription", _head("3.0", interface, instantiationToken=token))
    has_clock = str(interface.plant is None).lower()
    internal: dict[str, Any] = {"fixedInternalStepSize": repr(interface.step)} if interface.plant is not None else {}
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize=str(interface.plant is None).lower(),
        hasEventMode=has_clock,
        mightReturnEarlyFromDoStep=has_clock,
        **internal,
    )
    _add_units_and_experiment(root, interface, variables)
    table = Xml.SubElement(root, "ModelVariables")
    # Clock and time get numbers behind all variables of the C.
    first = 1 + max(variable.number for variable in variables)
    if interface.plant is None:
        clock = {"valueReference": str(first), "description": _CLOCK, "causality": "output"}
        Xml.SubElement(table, "Clock", {"name": "controller.clock", **clock, "intervalVariability": "triggered"})
    time = {"name": "time", "valueReference": str(first + 1), "description": "time", "causality": "independent"}
    Xml.SubElement(table, "Float64", {**time, "variability": "continuous", "unit": "s"})
    for variable in variables:
        of_variable, of_number = _attributes(variable)
        Xml.SubElement(table, "Float64", of_variable | of_number)
    structure = Xml.SubElement(root, "ModelStructure")
    outputs = [variable.number for variable in variables if variable.causality == "output"]
    outputs += [first] if interface.plant is None else []
    for name, known in {"Output": {"dependencies": ""}, "InitialUnknown": {}}.items():
        for number in outputs:
            Xml.SubElement(structure, name, {"valueReference": str(number), **known})
    return _text(root)


def build_description_of_fmi3(identifier: str, flags: str) -> bytes:
    """Return buildDescription.xml of FMI 3.0: sources to compile, with the compiler ``flags``."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    built = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    sources = Xml.SubElement(built, "SourceFileSet", language="C99", compilerOptions=flags)
    Xml.SubElement(sources, "SourceFile", name="fmi3.c")
    return _text(root)


def _head(version: str, interface: Interface, **further: str) -> dict[str, str]:
    return {
        "fmiVersion": version,
        "modelName": interface.library.title,
        **further,
        "description": interface.library.description,
        "version": __version__,
        "license": "MIT",
        "generationTool": f"ppafo {__version__}",
        "variableNamingConvention": "structured",
    }


def _attributes(variable: FmuVariable) -> tuple[dict[str, str], dict[str, str]]:
    """Return the XML attributes of a variable, and of its numeric type."""
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
    if unit in _DISPLAY_UNITS:
        of_number["displayUnit"] = _DISPLAY_UNITS[unit]
    of_number |= {name: repr(float(value)) for name, value in limits.items() if value is not None}
    return of_variable, of_number


def _shown(unit: str) -> str:
    """Return a ppafo unit without the pressure suffix (gauge, absolute), unknown to FMI; empty for a plain number."""
    bare = unit.removesuffix("_a").removesuffix("_d")
    return "" if bare in ("", "-", "1") else bare


def _add_units_and_experiment(root: Xml.Element, interface: Interface, variables: Iterable[FmuVariable]) -> None:
    """Add units, log categories and default experiment, which are the same in FMI 2 and 3."""
    table = Xml.SubElement(root, "UnitDefinitions")
    for name in sorted({_shown(variable.unit) for variable in variables} - {""}):
        exponents = {_BASE_UNITS[base]: str(power) for base, power in read_unit(name).dimensions.items()}
        unit = Xml.SubElement(table, "Unit", name=name)
        Xml.SubElement(unit, "BaseUnit", exponents)
        if name in _DISPLAY_UNITS:
            factor = 1.0 / base_value(1.0, _DISPLAY_UNITS[name]) * base_value(1.0, name)
            Xml.SubElement(unit, "DisplayUnit", name=_DISPLAY_UNITS[name], factor=repr(factor))
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError", description="why a call failed")
    times = {"startTime": 0.0, "stopTime": interface.duration, "stepSize": interface.step}
    Xml.SubElement(root, "DefaultExperiment", {name: repr(value) for name, value in times.items()})


def _text(root: Xml.Element) -> bytes:
    Xml.indent(root)
    text: str = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()
