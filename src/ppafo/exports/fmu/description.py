"""The description of a unit that a tool reads before it loads it: modelDescription.xml of FMI 2 and 3."""

from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree as Xml

from ppafo.exports.fmu.variables import Interface, Variable, variables_of
from ppafo.units import dimension
from ppafo.version import __version__

BASE_UNITS = {
    "[mass]": "kg",
    "[length]": "m",
    "[time]": "s",
    "[temperature]": "K",
    "[substance]": "mol",
    "[angle]": "rad",
}
TOOL = f"ppafo {__version__}"


def description_of_fmi2(interface: Interface, identifier: str, token: str, said: str) -> bytes:
    """The description for FMI 2.0."""
    variables = variables_of(interface)
    root = Xml.Element("fmiModelDescription", _head("2.0", interface, said, guid=token))
    kind = Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize=_truth(not interface.is_step_fixed),
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        canNotUseMemoryManagementFunctions="true",
    )
    Xml.SubElement(Xml.SubElement(kind, "SourceFiles"), "File", name="fmi2.c")
    _units(root, variables)
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError", description="why a call failed")
    _experiment(root, interface)
    table = Xml.SubElement(root, "ModelVariables")
    for item in variables:
        row = Xml.SubElement(table, "ScalarVariable", _scalar(item))
        Xml.SubElement(row, "Real", _real(item))
    structure = Xml.SubElement(root, "ModelStructure")
    for name, known in {"Outputs": {"dependencies": ""}, "InitialUnknowns": {}}.items():
        section = Xml.SubElement(structure, name)
        for place, item in enumerate(variables, start=1):
            if item.causality == "output":
                Xml.SubElement(section, "Unknown", {"index": str(place), **known})
    return _text(root)


def description_of_fmi3(interface: Interface, identifier: str, token: str, said: str) -> bytes:
    """The description for FMI 3.0."""
    variables = variables_of(interface)
    root = Xml.Element("fmiModelDescription", _head("3.0", interface, said, instantiationToken=token))
    has_clock = interface.clock is not None
    internal: dict[str, Any] = {"fixedInternalStepSize": repr(interface.step)} if interface.is_step_fixed else {}
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize=_truth(not interface.is_step_fixed),
        hasEventMode=_truth(has_clock),
        mightReturnEarlyFromDoStep=_truth(has_clock),
        **internal,
    )
    _units(root, variables)
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError", description="why a call failed")
    _experiment(root, interface)
    table = Xml.SubElement(root, "ModelVariables")
    first = 1 + max(item.number for item in variables)
    if interface.clock is not None:
        clock = {"valueReference": str(first), "description": interface.clock, "causality": "output"}
        Xml.SubElement(table, "Clock", {"name": "controller.clock", **clock, "intervalVariability": "triggered"})
    time = {"name": "time", "valueReference": str(first + 1), "description": "time", "causality": "independent"}
    Xml.SubElement(table, "Float64", {**time, "variability": "continuous", "unit": "s"})
    for item in variables:
        Xml.SubElement(table, "Float64", {**_scalar(item), **_real(item)})
    structure = Xml.SubElement(root, "ModelStructure")
    outputs = [item.number for item in variables if item.causality == "output"] + [first] * has_clock
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


def _head(version: str, interface: Interface, said: str, **further: str) -> dict[str, str]:
    return {
        "fmiVersion": version,
        "modelName": interface.name,
        **further,
        "description": said,
        "version": __version__,
        "license": "MIT",
        "generationTool": TOOL,
        "variableNamingConvention": "structured",
    }


def _experiment(root: Xml.Element, interface: Interface) -> None:
    given = {"startTime": 0.0, "stopTime": interface.duration, "stepSize": interface.step}
    Xml.SubElement(root, "DefaultExperiment", {name: repr(value) for name, value in given.items()})


def _scalar(item: Variable) -> dict[str, str]:
    initial = {"parameter": {"initial": "exact"}, "input": {}}.get(item.causality, {"initial": "calculated"})
    return {
        "name": item.name,
        "valueReference": str(item.number),
        "description": item.summary,
        "causality": item.causality,
        "variability": item.variability,
        **initial,
    }


def _real(item: Variable) -> dict[str, str]:
    limits = {"min": item.minimum, "max": item.maximum, "start": item.start}
    unit = _shown(item.unit)
    found = {"unit": unit} if unit else {}
    return found | {name: repr(float(value)) for name, value in limits.items() if value is not None}


def _shown(unit: str) -> str:
    """A unit of ppafo without the kind of a pressure, which FMI does not tell apart; empty for a plain number."""
    bare = unit.removesuffix("_a").removesuffix("_d")
    return "" if bare in ("", "-", "1") else bare


def _units(root: Xml.Element, variables: Iterable[Variable]) -> None:
    table = Xml.SubElement(root, "UnitDefinitions")
    for name in sorted({_shown(item.unit) for item in variables} - {""}):
        exponents = {BASE_UNITS[base]: str(power) for base, power in dimension(name).items()}
        Xml.SubElement(Xml.SubElement(table, "Unit", name=name), "BaseUnit", exponents)


def _truth(value: bool) -> str:
    return "true" if value else "false"


def _text(root: Xml.Element) -> bytes:
    Xml.indent(root)
    text: str = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()
