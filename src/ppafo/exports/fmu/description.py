"""modelDescription.xml of FMI 2 and 3: variables, units and capabilities of an FMU."""

from collections.abc import Iterable
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


def model_description(interface: Interface, fmi: int, identifier: str, token: str) -> bytes:
    """Return modelDescription.xml of FMI 2.0 or 3.0.

    ``identifier`` names the library, ``token`` identifies its sources.
    """
    variables = variables_of(interface)
    is_alone = interface.plant is not None
    root = Xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{fmi}.0",
            "modelName": interface.library.title,
            "guid" if fmi == 2 else "instantiationToken": token,
            "description": interface.library.description,
            "version": __version__,
            "license": "MIT",
            "generationTool": f"ppafo {__version__}",
            "variableNamingConvention": "structured",
        },
    )
    state = "state" if fmi == 2 else "State"
    is_loop = str(not is_alone).lower()
    able = {"modelIdentifier": identifier, f"canGetAndSetFMU{state}": "true", f"canSerializeFMU{state}": "true"}
    able |= {"canNotUseMemoryManagementFunctions": "true"} if fmi == 2 else {}
    able["canHandleVariableCommunicationStepSize"] = is_loop
    if fmi == 3:
        able |= {"hasEventMode": is_loop, "mightReturnEarlyFromDoStep": is_loop}
        able |= {"fixedInternalStepSize": repr(interface.step)} if is_alone else {}
    kind = Xml.SubElement(root, "CoSimulation", able)
    if fmi == 2:
        # One file that takes the others in: tools that build from source need no list.
        Xml.SubElement(Xml.SubElement(kind, "SourceFiles"), "File", name="fmi2.c")
    _add_units_and_experiment(root, interface, variables)
    table = Xml.SubElement(root, "ModelVariables")
    # Clock and time get numbers behind all variables of the C.
    clock = 1 + max(variable.number for variable in variables)
    if fmi == 3:
        if not is_alone:
            ticks = {"valueReference": str(clock), "description": _CLOCK, "causality": "output"}
            Xml.SubElement(table, "Clock", {"name": "controller.clock", **ticks, "intervalVariability": "triggered"})
        time = {"name": "time", "valueReference": str(clock + 1), "description": "time", "causality": "independent"}
        Xml.SubElement(table, "Float64", {**time, "variability": "continuous", "unit": "s"})
    for variable in variables:
        of_variable, of_number = _attributes(variable)
        if fmi == 2:
            Xml.SubElement(Xml.SubElement(table, "ScalarVariable", of_variable), "Real", of_number)
        else:
            Xml.SubElement(table, "Float64", of_variable | of_number)
    # FMI 2 counts variables by their place in the list, from 1.
    places = enumerate(variables, start=1)
    outputs = [at if fmi == 2 else one.number for at, one in places if one.causality == "output"]
    outputs += [clock] if fmi == 3 and not is_alone else []
    structure = Xml.SubElement(root, "ModelStructure")
    # Outputs of a step depend on no input of that instant.
    for name, known in {"Output": {"dependencies": ""}, "InitialUnknown": {}}.items():
        section = Xml.SubElement(structure, f"{name}s") if fmi == 2 and outputs else structure
        for number in outputs:
            reference = {"index" if fmi == 2 else "valueReference": str(number)}
            Xml.SubElement(section, "Unknown" if fmi == 2 else name, reference | known)
    return _text(root)


def build_description_of_fmi3(identifier: str, flags: str) -> bytes:
    """Return buildDescription.xml of FMI 3.0: sources to compile, with the compiler ``flags``."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    built = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    sources = Xml.SubElement(built, "SourceFileSet", language="C99", compilerOptions=flags)
    Xml.SubElement(sources, "SourceFile", name="fmi3.c")
    return _text(root)


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
