"""Questions on the values by themselves: sources, gaps, statements, units, ranges, gas and constants of its flow."""

import ast
import contextlib
import math
import operator
from collections.abc import Callable, Iterator

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.errors import ParameterError, UnitError
from ppafo.model.gas import SECOND_VIRIAL, SPECIES, choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import subsonic_flow_constant
from ppafo.parameters.audit.evidence import AuditFinding, Evidence, identifier_of
from ppafo.parameters.building import contradictions_of_set, missing_values, read_device
from ppafo.parameters.declaration import is_within
from ppafo.parameters.graph import GAS_PATHS
from ppafo.parameters.parameter_set import entry_in_si, entry_text, number_in_si
from ppafo.parameters.publications.publication import FILE, read_publication
from ppafo.units import split_number, to_si
from ppafo.wording import count_of

_C1 = "reported.choked_flow_constant"
_EXPONENT = "reported.choked_flow_exponent"
_ROUNDING = 1e-3
"""Relative tolerance besides the reported digits [-], for other values of R, M and 273 or 273.15 K."""
# Largest number of characters of a formula, and largest magnitude of its value.
_LONGEST = 80
_LARGEST = 1e3
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_OF_THE_GAS = 0.02
"""Relative tolerance of a constant of the named gas [-]."""
# Temperature of the virial coefficients, and largest distance from it [K]: that of CO2 then changes by 15 %.
_TABULATED = 298.0
_ROOM = 20.0
_WORTH_A_WARNING = 0.05


def missing(evidence: Evidence) -> Iterator[AuditFinding]:
    """Warn of sources that are a template's, values that a device lacks, and coils that open their valve at once.

    Values may be missing where the set names a completed set.
    """
    parameter_set = evidence.parameter_set
    placeholders = [
        path
        for path, entry in parameter_set.entries().items()
        if entry.source.startswith("template") and not entry.note.startswith("follows")
    ]
    if placeholders:
        title = f"the source of {count_of(len(placeholders), 'value')} is the template's"
        yield evidence.finding("template-sources", title, (), why=f"{', '.join(placeholders)}.", severity="warning")
    if parameter_set.completed_by:
        return
    lacking = dict[str, None]()
    for valve in parameter_set.valve_kinds:
        # An orifice in two forms has a finding of its own.
        with contextlib.suppress(ParameterError):
            lacking |= dict.fromkeys(missing_values(parameter_set, valve))
    delays = {name: f"valves.{name}.opening_delay" for name in parameter_set.valve_kinds}
    ideal = [name for name, path in delays.items() if path in evidence.declared and path not in parameter_set.numbers]
    if lacking:
        yield evidence.finding(
            "missing-values",
            f"incomplete device: {count_of(len(lacking), 'value')} missing",
            (),
            why=f"Missing for a device: {', '.join(lacking)}. Checks that need missing values were skipped.",
            severity="warning",
        )
    elif ideal:
        yield evidence.finding(
            "ideal-opening",
            f"{', '.join(ideal)}: no opening_delay, so that a coil opens its valve at once",
            [f"valves.{name}.{key}" for name in ideal for key in ("closing_delay", "switching_interval")],
            why="The dead time of a loop then counts closing_delay and switching_interval alone.",
            severity="warning",
        )


def contradictions(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each contradiction between values that are each in order, which prevents a run."""
    parameter_set = evidence.parameter_set
    found = dict[str, tuple[str, ...]]()
    for valve in parameter_set.valve_kinds:
        # A value that is missing or wrong by itself has a finding of its own.
        with contextlib.suppress(ParameterError):
            device = read_device(parameter_set, valve, {})
            found |= {line: paths for paths, line in contradictions_of_set(parameter_set, device)}
    for line, paths in found.items():
        title = "contradictory values prevent a run"
        why = f"No run is possible: {line}."
        yield evidence.finding(identifier_of(paths[0]), title, paths, why=why)


def statements(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each value whose key names no published number, or a different published number."""
    for path, entry in evidence.parameter_set.numbers.items():
        name, _, identifier = entry.key.partition("/")
        stated = {}
        for claim in read_publication(name)[0].claims if name in FILE.names() else ():
            if claim.published is not None:
                stated[claim.id] = (claim.published, claim.unit)
            for argument, text in claim.arguments.items():
                with contextlib.suppress(UnitError):  # The name of chambers.
                    stated[f"{claim.id}.{argument}"] = split_number(text)
        number, unit = stated.get(identifier, (math.nan, ""))
        if not entry.key or (number == entry.value and unit == entry.unit):
            continue
        stated_number = f"{number:g} {unit}".rstrip() if identifier in stated else "no number of that name"
        yield evidence.finding(
            f"{identifier_of(path)}-against-statement",
            f"{path} differs from the statement '{entry.key}'",
            [path],
            why=f"{path} is {entry_text(entry)} and refers to '{entry.key}', which has {stated_number}: for a value of "
            f"another origin, delete the line 'key' of [{path}].",
        )


def dimensions(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each value in the unit of its reciprocal, and all other values whose unit does not fit their equation."""
    foreign = {}
    for path, entry in evidence.parameter_set.numbers.items():
        quantity = evidence.declared[path]
        value = 0.0
        inverse = f"1/({quantity.unit})" if " " in quantity.unit or "/" in quantity.unit else f"1/{quantity.unit}"
        try:
            entry_in_si(entry, quantity, evidence.atmosphere())
            continue
        except UnitError as error:
            foreign[path] = error
        with contextlib.suppress(UnitError):
            value = to_si(entry.value, entry.unit, inverse)
        # A value of 0 has no inverse, whatever its unit.
        if value != 0.0:
            del foreign[path]
            yield evidence.finding(
                f"{identifier_of(path.rpartition('.')[2])}-upside-down",
                f"{path} is inverted: its unit belongs to the reciprocal",
                [path],
                {"as reported": (value, inverse), "taken literally": (1.0 / value, quantity.unit)},
                f"{path} is declared as: {quantity.summary} [{quantity.unit}].",
            )
    if foreign:
        described = "; ".join(f"{path}: {error}" for path, error in foreign.items())
        why = f"{described}. The other checks use the number unchanged."
        title = "values with a unit that does not fit the equation"
        yield evidence.finding("dimensions", title, list(foreign), why=why)


def ranges(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name each value outside the limits of its declaration, which any device keeps."""
    for path in evidence.parameter_set.numbers:
        quantity = evidence.declared[path]
        value = number_in_si(evidence.parameter_set, path)
        if value is not None and not is_within(value, quantity):
            ends = {"in the set": value, "lower limit": quantity.minimum, "upper limit": quantity.maximum}
            yield evidence.finding(
                f"range-of-{identifier_of(path)}",
                f"{path} is out of range",
                [path],
                {label: (number, quantity.unit) for label, number in ends.items()},
                f"{quantity.summary[:1].upper()}{quantity.summary[1:]}.",
            )


def gas_data(evidence: Evidence) -> Iterator[AuditFinding]:
    """Name a gas without data, and each constant that deviates more than 2 % from the named gas."""
    name = evidence.text("gas.species")
    species = SPECIES.get(name)
    if species is None and name:
        why = f"Available: {', '.join(SPECIES)}."
        yield evidence.finding("gas-species", f"no data for the gas '{name}'", ["gas.species"], why=why)
    for key in ("molar_mass", "heat_capacity_ratio") if species else ():
        path = f"gas.{key}"
        expected = getattr(species, key)
        value = evidence.number(path)
        unit = evidence.declared[path].unit
        if species and value is not None and abs(value / expected - 1.0) > _OF_THE_GAS:
            yield evidence.finding(
                identifier_of(path),
                f"{path} does not belong to the named gas",
                ["gas.species", path],
                {"in the set": (value, unit), "of the gas": (expected, unit)},
                f"Source: {species.source}.",
            )


def flow_constants(evidence: Evidence) -> Iterator[AuditFinding]:
    """Compare each reported constant of flow with the gas, a note if it agrees, and the reported exponent of C1.

    The paper states the critical ratio as upstream over downstream.
    """
    gas = evidence.gas()
    k = gas.heat_capacity_ratio
    properties = (gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature)
    expected = {
        _C1: choked_flow_constant(*properties),
        "reported.subsonic_flow_constant": subsonic_flow_constant(*properties),
        "reported.critical_pressure_ratio": 1.0 / critical_pressure_ratio(k),
    }
    for path, value in expected.items():
        if (digits := evidence.magnitude(path)) is not None:
            agrees = digits.low * (1.0 - _ROUNDING) <= value <= digits.high * (1.0 + _ROUNDING)
            quantity = evidence.declared[path]
            (reported,) = evidence.numbers(path)
            yield evidence.finding(
                identifier_of(path.rpartition(".")[2]),
                f"{quantity.summary} {'follows' if agrees else 'does not follow'} from the gas data",
                [path, *GAS_PATHS],
                {"reported": (reported, quantity.unit), "from the gas data": (value, quantity.unit)},
                severity="note" if agrees else "error",
            )
    formula = evidence.text(_EXPONENT)
    correct = (k + 1.0) / (k - 1.0)
    exponent = evaluate(formula, k)
    if not formula or (exponent is not None and math.isclose(exponent, correct, rel_tol=1e-9)):
        return
    title = "the reported exponent in C1 is not the exponent of choked flow"
    paths = [_EXPONENT, _C1, *GAS_PATHS]
    if exponent is None:
        why = f"The formula '{formula}' is not an arithmetic expression in k; the correct exponent is (k + 1)/(k - 1)."
        yield evidence.finding("choked-flow-exponent", title, paths, why=why, severity="warning")
    else:
        # C1 contains the square root of the power, hence half the difference of the exponents.
        literal = expected[_C1] * (2.0 / (k + 1.0)) ** (0.5 * (exponent - correct))
        sides = {
            f"reported exponent {formula}": (exponent, ""),
            "C1 with the reported exponent": (literal, "s/m"),
            "C1 with (k+1)/(k-1)": (expected[_C1], "s/m"),
        }
        yield evidence.finding("choked-flow-exponent", title, paths, sides)


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


def ideal_gas(evidence: Evidence) -> Iterator[AuditFinding]:
    """Note the error of the ideal gas law at supply pressure, a warning above 5 %; equation (3)."""
    gas = evidence.gas()
    (pressure,) = evidence.numbers("supply.pressure")
    virial = SECOND_VIRIAL.get(evidence.text("gas.species"))
    if virial is None or abs(gas.temperature - _TABULATED) > _ROOM:
        return
    compressibility = 1.0 + virial * pressure / (UNIVERSAL_GAS_CONSTANT * gas.temperature)
    if compressibility > 0.0:
        error = 1.0 - 1.0 / compressibility
        counts = "under-counts" if error < 0.0 else "over-counts"
        yield evidence.finding(
            "ideal-gas",
            f"the ideal gas law {counts} {gas.species} by {100.0 * abs(error):.2g} % at supply pressure",
            ["gas.species", "gas.temperature", "supply.pressure"],
            {"real-gas factor, ideal": (1.0, ""), "real-gas factor, real": (compressibility, "")},
            f"The second virial coefficient is {1e6 * virial:.3g} cm^3/mol.",
            "warning" if abs(error) > _WORTH_A_WARNING else "note",
        )
