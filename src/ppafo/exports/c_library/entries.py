"""Source of the exported functions that prepare a run, composed of the preparation functions."""

import ast
from collections.abc import Mapping, Sequence

from ppafo.engine.definitions import place_of
from ppafo.engine.entries import indent, parse_expression
from ppafo.engine.generator import StepText
from ppafo.engine.reduction import names_in
from ppafo.engine.rows import leaf_paths
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.exports.c_library.exported import COUNTS
from ppafo.exports.c_library.library import ExportParameter, Library, c_identifier
from ppafo.exports.c_library.prepared import Preparation
from ppafo.exports.c_library.profile_rules import PROFILE_RULES
from ppafo.exports.c_library.settings import second_chamber
from ppafo.exports.c_library.structs import given
from ppafo.model.declaration import PlainFunction, quantities_of
from ppafo.parameters.graph import Graph, LinkFunction
from ppafo.simulation.scenario import Scenario


def prepare_entry(
    preparation: Preparation,
    functions: Sequence[PlainFunction],
    settings: Sequence[ExportParameter],
    collector: SourceCollector,
) -> str:
    """Return the source of the entry ``prepare`` of an exported module, composed of preparation functions.

    Arguments:
        preparation: scenario and program
        functions: functions of preparation, lane and settings in their order; the last one gives the numbers of steps
        settings: settings of the library
        collector: functions of the module

    Raises:
        ProgramError: a group of the program that no function sets
    """
    program = preparation.program
    *lines, counts = StepText(program, collector).joined(functions, preparation, ["settings"])
    assert isinstance(counts, ast.Return), "the last function gives the numbers of the steps"
    assert isinstance(counts.value, ast.Tuple), "as many as there are names"
    # Meters begin with the first sample.
    later = {"course", *program.meter_groups}
    states = {name: row for name, row in program.state_rows().items() if name not in later}
    made = {name.id for line in lines for name in names_in(line) if isinstance(name.ctx, ast.Store)}
    for name, row in (program.parameter_rows() | states).items():
        if name not in made and leaf_paths(row, name):
            last = place_of(functions[-1])
            raise ProgramError(f"{last}: no preparation function sets '{name}' ({row.__name__}) of the program")
    written = _FromSettings(preparation.scenario, settings).written
    body = [*map(written, lines), *given("parameters", program.parameter_rows())]
    body += given("states", states)
    body += [f"counts.{name} = {written(number)}" for name, number in zip(COUNTS, counts.value.elts, strict=True)]
    return "\n".join(["def prepare(settings, parameters, states, counts):", *indent(body)])


def check_entry(preparation: Preparation, settings: Sequence[ExportParameter], collector: SourceCollector) -> str:
    """Return the source of the entry ``check_profiles``, which finds the setting that breaks a rule on profiles."""
    *lines, place = StepText(preparation.program, collector).joined(PROFILE_RULES, preparation, ["settings"])
    assert isinstance(place, ast.Return), "the last function gives the place"
    assert place.value is not None
    written = _FromSettings(preparation.scenario, settings).written
    body = [*map(written, lines), f"found.place = {written(place.value)}"]
    return "\n".join(["def check_profiles(settings, found):", *indent(body)])


def with_reach(library: Library, collector: SourceCollector) -> str:
    """Return the entry ``prepare`` of a library, and ``reach``: the torques with one chamber supplied, one vented."""
    assert library.further is not None, "a library has a preparation"
    torque = collector.add(library.program.program.actuator.torque)
    lines = [
        "plant = parameters.plant",
        f"one = {torque}(plant, angle, plant.supply_pressure, plant.atmospheric_pressure)",
        f"other = {torque}(plant, angle, plant.atmospheric_pressure, plant.dorsiflexion_pressure)",
        "found.low = min(one, other)",
        "found.high = max(one, other)",
    ]
    return "\n".join([library.further(collector), "", "def reach(parameters, angle, found):", *indent(lines)])


class _FromSettings(ast.NodeTransformer):
    """Rewriter of settings as fields of their struct; numbers of an absent chamber as what stands for them."""

    def __init__(self, scenario: Scenario, settings: Sequence[ExportParameter]) -> None:
        self.cells = {setting.name: f"settings.{setting.name}" for setting in settings}
        self.cells |= {name: self.cells.get(text, text) for name, text in second_chamber(scenario).items()}

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Rewrite a setting."""
        if isinstance(node.value, ast.Name) and node.value.id == "settings":
            return parse_expression(self.cells[node.attr])
        self.generic_visit(node)
        return node

    def written(self, node: ast.AST) -> str:
        """Return the text of a rewritten statement or expression."""
        return ast.unparse(ast.fix_missing_locations(self.visit(node)))


def follow_entry(
    settings: Sequence[ExportParameter],
    links: Graph,
    absent: Mapping[str, str],
    collector: SourceCollector,
) -> str:
    """Return the source of ``follow``, which computes settings left at their defaults from other settings.

    ``links`` maps these settings to their sources (``Graph``). ``absent`` maps sources that are no settings of the
    library to their values, as C text.
    """
    values = {setting.path: setting.value for setting in settings}

    used = {source for follows in links.values() for link in follows for source in link.sources}
    used |= {path for path in values if c_identifier(path) in absent.values()}
    rows: list[str] = []
    lines = [f"{c_identifier(path)} = settings.{c_identifier(path)}" for path in values if path in used - set(links)]
    lines += [f"{name} = {text}" for name, text in absent.items()]
    for path, follows in links.items():
        name, own = c_identifier(path), f"settings.{c_identifier(path)}"
        text = own
        # The first link that holds wins, so it is the outermost choice.
        for link in reversed(follows):
            number = " + ".join([*(_term(term, rows, collector) for term in link.terms), repr(link.gap)])
            text_of_link, source = f"({number})", link.sources[0]
            if link.when_set:
                # Compared with the default to the bit: a value that was written again counts as not set.
                is_set = f"settings.{c_identifier(source)} != {values[source]!r}"
                text_of_link = f"({text_of_link} if {is_set} else {text})"
            text = text_of_link
        lines.append(f"{name} = {text} if {own} == {values[path]!r} else {own}")
        lines.append(f"followed.{name} = {name}")
    return "\n".join([*rows, "def follow(settings, followed):", *indent(lines)])


def _term(term: LinkFunction, rows: list[str], collector: SourceCollector) -> str:
    """Return the source of one term in the sum for a dependent setting; its structs are appended to ``rows``."""

    def filled(row: type, numbers: Sequence[str]) -> str:
        name = f"Followed{len(rows)}"
        rows.append(f"{name} = namedtuple({name!r}, {[quantity.name for quantity in quantities_of(row)]!r})")
        return f"{name}({', '.join(numbers)})"

    arguments = term.arguments([c_identifier(source) for source in term.sources], filled)
    return f"{collector.add(term.function)}({', '.join(arguments)})"
