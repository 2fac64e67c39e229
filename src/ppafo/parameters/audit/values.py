"""Checks of the values of a parameter set: dimensions, ranges, gas, constants of its flow, ideal-gas error."""

import ast
import contextlib
import math
import operator
from collections.abc import Callable, Iterator

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.errors import ParameterError, UnitError
from ppafo.model.gas import SECOND_VIRIAL, SPECIES, choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import subsonic_flow_constant
from ppafo.parameters.audit.evidence import GAS_PATHS, AuditFinding, ComparedNumber, Evidence
from ppafo.parameters.building import contradictions_of_set, missing_values, read_device
from ppafo.parameters.declaration import is_within
from ppafo.parameters.device import Gas
from ppafo.parameters.parameter_set import entry_in_si, entry_text, number_in_si
from ppafo.parameters.publications.publication import FILE, read_publication
from ppafo.units import to_si
from ppafo.wording import count_of

# Is every value that has the key of a published statement the number that this states?
_C1 = "reported.choked_flow_constant"
_EXPONENT = "reported.choked_flow_exponent"
_ROUNDING = 1e-3
"""Relative tolerance besides the reported digits [-], for other values of R, M and 273 or 273.15 K."""

_LONGEST, _LARGEST = 80, 1e3
"""Largest number of characters of a formula, and largest magnitude of its value."""
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_SWITCHING = ("closing_delay", "switching_interval")
_TOLERANCE = 0.02
_TABULATED_TEMPERATURE = 298.0

# The coefficient of CO2 changes by about 15 % over 20 K: the estimate stays one.
_TEMPERATURE_ROOM = 20.0
_WORTH_A_WARNING = 0.05
_SUPPLY = "supply.pressure"


def check_choked_flow(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a finding for each reported flow constant, a note if it agrees, and for the reported exponent."""
    gas = evidence.gas()
    if gas is None:
        return
    k, constant = gas.heat_capacity_ratio, gas.specific_gas_constant
    # The paper states the critical ratio as upstream over downstream.
    expected = {
        _C1: choked_flow_constant(k, constant, gas.temperature),
        "reported.subsonic_flow_constant": subsonic_flow_constant(k, constant, gas.temperature),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    for path, value in expected.items():
        reported, digits = evidence.number(path), evidence.magnitude(path)
        if reported is None or digits is None:
            continue
        agrees = digits.low * (1.0 - _ROUNDING) <= value <= digits.high * (1.0 + _ROUNDING)
        quantity = evidence.declared[path]
        yield AuditFinding(
            id=path.rpartition(".")[2].replace("_", "-"),
            severity="note" if agrees else "error",
            title=f"{quantity.summary} {'follows' if agrees else 'does not follow'} from the gas data",
            values=evidence.values_of(path, *GAS_PATHS),
            sides=(
                ComparedNumber("reported", reported, quantity.unit),
                ComparedNumber("from the gas data", value, quantity.unit),
            ),
        )
    yield from _exponent(evidence, gas)


def _exponent(evidence: Evidence, gas: Gas) -> Iterator[AuditFinding]:
    """Yield a finding if the reported exponent in C1 differs from (k + 1)/(k - 1)."""
    formula = evidence.text(_EXPONENT)
    k = gas.heat_capacity_ratio
    exponent = None if formula is None else evaluate(formula, k)
    expected = (k + 1.0) / (k - 1.0)
    if formula is None or (exponent is not None and math.isclose(exponent, expected, rel_tol=1e-9)):
        return
    correct = choked_flow_constant(k, gas.specific_gas_constant, gas.temperature)
    values = evidence.values_of(_EXPONENT, _C1, *GAS_PATHS)
    title = "the reported exponent in C1 is not the exponent of choked flow"
    if exponent is None:
        text = f"The formula '{formula}' is not an arithmetic expression in k; the correct exponent is (k + 1)/(k - 1)."
        yield AuditFinding(id="choked-flow-exponent", severity="warning", title=title, values=values, why=text)
        return
    # C1 contains the square root of the power, hence half the difference of the exponents.
    literal = correct * (2.0 / (k + 1.0)) ** (0.5 * (exponent - expected))
    yield AuditFinding(
        id="choked-flow-exponent",
        title=title,
        values=values,
        sides=(
            ComparedNumber(f"reported exponent {formula}", exponent, ""),
            ComparedNumber("C1 with the reported exponent", literal, "s/m"),
            ComparedNumber("C1 with (k+1)/(k-1)", correct, "s/m"),
        ),
    )


def evaluate(formula: str, heat_capacity_ratio: float) -> float | None:
    """Return the value of a formula such as ``(k + 1)/(k - 1)``; None for any other text."""
    # A formula of a file must not slow down the audit, whatever its length and value.
    if len(formula) > _LONGEST:
        return None
    try:
        # Parsed and walked, never evaluated by Python: a set is data.
        value = _value(ast.parse(formula, mode="eval").body, heat_capacity_ratio)
    except (SyntaxError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return value if abs(value) < _LARGEST else None


def _value(node: ast.expr, k: float) -> float:
    """Return the value of a syntax tree of arithmetic in k. Raises ValueError for any other tree."""
    match node:
        case ast.BinOp(left, operation, right) if type(operation) in _BINARY:
            return _BINARY[type(operation)](_value(left, k), _value(right, k))
        case ast.UnaryOp(ast.USub(), operand):
            return -_value(operand, k)
        case ast.Name("k"):
            return k
        case ast.Constant(int() | float() as number) if not isinstance(number, bool):
            return float(number)
    raise ValueError("a formula may contain only numbers, the heat capacity ratio k and arithmetic")


def check_statements(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each value whose key names no published number, or a different published number."""
    for path, entry in evidence.parameter_set.numbers.items():
        name, _, identifier = entry.key.partition("/")
        if not entry.key:
            continue
        stated = _stated_numbers(name) if name in FILE.names() else {}
        number, unit = stated.get(identifier, (math.nan, ""))
        if number == entry.value and unit == entry.unit:
            continue
        stated_number = f"{number:g} {unit}".rstrip() if identifier in stated else "no number of that name"
        yield AuditFinding(
            id=f"{path.replace('.', '-').replace('_', '-')}-against-statement",
            title=f"{path} differs from the statement '{entry.key}'",
            values=evidence.values_of(path),
            why=(
                f"{path} is {entry_text(entry)} and refers to '{entry.key}', which has {stated_number}: for a value of "
                f"another origin, delete the line 'key' of [{path}]."
            ),
        )


def _stated_numbers(name: str) -> dict[str, tuple[float, str]]:
    """Return number and unit of each statement of a publication, by id, or by ``ID.ARGUMENT`` for an argument."""
    numbers = {}
    for claim in read_publication(name)[0].claims:
        if claim.published is not None:
            numbers[claim.id] = (claim.published, claim.unit)
        for argument, text in claim.arguments.items():
            number, _, unit = text.partition(" ")
            try:
                numbers[f"{claim.id}.{argument}"] = (float(number), unit)
            except ValueError:
                continue  # The name of chambers.
    return numbers


# Does a device lack a value, or count as ideal without one?


def check_missing(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a warning on sources that are a template's, values that a device lacks, and ideal valves.

    Values may be missing where the set names a completed set.
    """
    parameter_set = evidence.parameter_set
    placeholders = [
        path
        for path, entry in parameter_set.entries().items()
        if entry.source.startswith("template") and not entry.note.startswith("follows")
    ]
    if placeholders:
        yield AuditFinding(
            id="template-sources",
            severity="warning",
            title=f"the source of {count_of(len(placeholders), 'value')} is the template's",
            why=f"{', '.join(placeholders)}.",
        )
    if parameter_set.completed_by:
        return
    missing: list[str] = []
    for valve in parameter_set.valve_kinds:
        # An orifice in two forms has a finding of its own.
        with contextlib.suppress(ParameterError):
            missing += missing_values(parameter_set, valve)
    if missing:
        paths = tuple(dict.fromkeys(missing))
        yield AuditFinding(
            id="missing-values",
            severity="warning",
            title=f"incomplete device: {count_of(len(paths), 'value')} missing",
            why=f"Missing for a device: {', '.join(paths)}. Checks that need missing values were skipped.",
        )
    ideal = [name for name in parameter_set.valve_kinds if f"valves.{name}.opening_delay" in evidence.declared]
    ideal = [name for name in ideal if f"valves.{name}.opening_delay" not in parameter_set.numbers]
    if ideal and not missing:
        yield AuditFinding(
            id="ideal-opening",
            severity="warning",
            title=f"{', '.join(ideal)}: no opening_delay, so that a coil opens its valve at once",
            values=evidence.values_of(*(f"valves.{name}.{key}" for name in ideal for key in _SWITCHING)),
            why="The dead time of a loop then counts closing_delay and switching_interval alone.",
        )


# Does a run refuse the device for values that are each in order, and contradict each other?


def check_contradictions(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each contradiction between values that prevents a run."""
    parameter_set, found = evidence.parameter_set, dict[str, tuple[str, ...]]()
    for valve in parameter_set.valve_kinds:
        # A value that is missing or wrong by itself has a finding of its own.
        with contextlib.suppress(ParameterError):
            device = read_device(parameter_set, valve, {})
            found |= {line: paths for paths, line in contradictions_of_set(parameter_set, device)}
    for line, paths in found.items():
        yield AuditFinding(
            id=paths[0].replace(".", "-").replace("_", "-"),
            title="contradictory values prevent a run",
            values=evidence.values_of(*paths),
            why=f"No run is possible: {line}.",
        )


# Does every value have the dimension that its equation needs?


def check_dimensions(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a finding on values of a wrong dimension, and a finding on each value in the unit of its inverse."""
    foreign = dict[str, UnitError]()
    for path, entry in evidence.parameter_set.numbers.items():
        quantity = evidence.declared[path]
        unit = quantity.unit
        inverse_unit = f"1/({unit})" if " " in unit or "/" in unit else f"1/{unit}"
        try:
            entry_in_si(entry, quantity, evidence.atmosphere())
            continue
        except UnitError as error:
            why = error
        value = 0.0
        with contextlib.suppress(UnitError):
            value = to_si(entry.value, entry.unit, inverse_unit)
        # A value of 0 has no inverse, whatever its unit.
        if value == 0.0:
            foreign[path] = why
            continue
        name = path.rpartition(".")[2].replace("_", "-")
        yield AuditFinding(
            id=f"{name}-upside-down",
            title=f"{path} is inverted: its unit belongs to the reciprocal",
            values=evidence.values_of(path),
            sides=(
                ComparedNumber("as reported", value, inverse_unit),
                ComparedNumber("taken literally", 1.0 / value, quantity.unit),
            ),
            why=f"{path} is declared as: {quantity.summary} [{quantity.unit}].",
        )
    if foreign:
        described = "; ".join(f"{path}: {error}" for path, error in foreign.items())
        yield AuditFinding(
            id="dimensions",
            title="values with a unit that does not fit the equation",
            values=evidence.values_of(*foreign),
            why=f"{described}. The other checks use the number unchanged.",
        )


# Is every value within the limits of its declaration, which any device keeps?


def check_ranges(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each value outside its declared range."""
    for path in evidence.parameter_set.numbers:
        quantity, value = evidence.declared[path], number_in_si(evidence.parameter_set, path)
        if value is None or is_within(value, quantity):
            continue
        yield AuditFinding(
            id=f"range-of-{path.replace('.', '-').replace('_', '-')}",
            title=f"{path} is out of range",
            values=evidence.values_of(path),
            sides=(
                ComparedNumber("in the set", value, quantity.unit),
                ComparedNumber("lower limit", quantity.minimum, quantity.unit),
                ComparedNumber("upper limit", quantity.maximum, quantity.unit),
            ),
            why=f"{quantity.summary[:1].upper()}{quantity.summary[1:]}.",
        )


# Do molar mass and heat capacity ratio belong to the gas that the set names?


def check_gas_data(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield an error for each gas constant that deviates more than 2 % from the named gas."""
    name = evidence.text("gas.species")
    if name is None:
        return
    species = SPECIES.get(name)
    if species is None:
        yield AuditFinding(
            id="gas-species",
            title=f"no data for the gas '{name}'",
            values=evidence.values_of("gas.species"),
            why=f"Available: {', '.join(SPECIES)}.",
        )
        return
    tabulated = {"gas.molar_mass": species.molar_mass, "gas.heat_capacity_ratio": species.heat_capacity_ratio}
    for path, expected in tabulated.items():
        value = evidence.number(path)
        if value is not None and abs(value / expected - 1.0) > _TOLERANCE:
            unit = evidence.declared[path].unit
            yield AuditFinding(
                id=path.replace(".", "-").replace("_", "-"),
                title=f"{path} does not belong to the named gas",
                values=evidence.values_of("gas.species", path),
                sides=(ComparedNumber("in the set", value, unit), ComparedNumber("of the gas", expected, unit)),
                why=f"Source: {species.source}.",
            )


# How large is the error of the ideal gas law at supply pressure? Equation (3).


def check_ideal_gas(evidence: Evidence) -> Iterator[AuditFinding]:
    """Yield a note on the ideal gas law error at supply pressure, a warning above 5 %."""
    gas, pressure = evidence.gas(), evidence.number(_SUPPLY)
    virial = SECOND_VIRIAL.get(evidence.text("gas.species") or "")
    if gas is None or pressure is None or virial is None:
        return
    if abs(gas.temperature - _TABULATED_TEMPERATURE) > _TEMPERATURE_ROOM:
        return
    compressibility = 1.0 + virial * pressure / (UNIVERSAL_GAS_CONSTANT * gas.temperature)
    if compressibility <= 0.0:
        return
    error = 1.0 - 1.0 / compressibility
    counts = "under-counts" if error < 0.0 else "over-counts"
    yield AuditFinding(
        id="ideal-gas",
        severity="warning" if abs(error) > _WORTH_A_WARNING else "note",
        title=f"the ideal gas law {counts} {gas.species} by {100.0 * abs(error):.2g} % at supply pressure",
        values=evidence.values_of("gas.species", "gas.temperature", _SUPPLY),
        sides=(
            ComparedNumber("real-gas factor, ideal", 1.0, ""),
            ComparedNumber("real-gas factor, real", compressibility, ""),
        ),
        why=f"The second virial coefficient is {1e6 * virial:.3g} cm^3/mol.",
    )
