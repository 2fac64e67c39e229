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
from ppafo.exports.c_library.boundary import Boundary
from ppafo.exports.c_library.exported import COUNTS
from ppafo.exports.c_library.library import ExportParameter, c_identifier
from ppafo.exports.c_library.prepared import Preparation
from ppafo.exports.c_library.settings import second_chamber
from ppafo.model.declaration import PlainFunction, quantities_of
from ppafo.parameters.graph import Graph, LinkFunction


def prepare_entry(
    preparation: Preparation,
    functions: Sequence[PlainFunction],
    settings: Sequence[ExportParameter],
    collector: SourceCollector,
    boundary: Boundary,
) -> str:
    """Return the source of the entry ``prepare`` of an exported module, composed of preparation functions.

    Arguments:
        preparation: scenario and program
        functions: functions of preparation, lane and settings in their order; the last one gives the numbers of steps
        settings: settings of the library, in the order of their places
        collector: functions of the module
        boundary: interface between the entry and its callers

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
    cells = {setting.name: boundary.cell("settings", place, setting.name) for place, setting in enumerate(settings)}
    cells |= {name: cells.get(text, text) for name, text in second_chamber(preparation.scenario).items()}

    class FromSettings(ast.NodeTransformer):
        def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
            if isinstance(node.value, ast.Name) and node.value.id == "settings":
                return parse_expression(cells[node.attr])
            self.generic_visit(node)
            return node

    def written(node: ast.AST) -> str:
        return ast.unparse(ast.fix_missing_locations(FromSettings().visit(node)))

    body = [*map(written, lines), *boundary.given("parameters", program.parameter_rows())]
    body += boundary.given("states", states)
    body += [
        f"{boundary.cell('counts', place, name)} = {written(number)}"
        for place, (name, number) in enumerate(zip(COUNTS, counts.value.elts, strict=True))
    ]
    head = boundary.head("prepare", dict.fromkeys(("settings", "parameters", "states", "counts"), "float64[::1]"))
    return "\n".join([head, *indent(body)])


def follow_entry(
    settings: Sequence[ExportParameter],
    links: Graph,
    absent: Mapping[str, str],
    collector: SourceCollector,
    boundary: Boundary,
) -> str:
    """Return the source of ``follow``, which computes settings left at their defaults from other settings.

    ``links`` maps these settings to their sources (``Graph``). ``absent`` maps sources that are no settings of the
    library to their values, as C text.
    """
    places = {setting.path: index for index, setting in enumerate(settings)}

    def cell(array: str, path: str) -> str:
        return boundary.cell(array, places[path], c_identifier(path))

    used = {source for follows in links.values() for link in follows for source in link.sources}
    used |= {path for path in places if c_identifier(path) in absent.values()}
    rows: list[str] = []
    lines = [f"{c_identifier(path)} = {cell('settings', path)}" for path in places if path in used - set(links)]
    lines += [f"{name} = {text}" for name, text in absent.items()]
    for path, follows in links.items():
        name, own = c_identifier(path), cell("settings", path)
        text = own
        # The first link that holds wins, so it is the outermost choice.
        for link in reversed(follows):
            number = " + ".join([*(_term(term, rows, collector) for term in link.terms), repr(link.gap)])
            text_of_link, source = f"({number})", link.sources[0]
            if link.when_set:
                # Compared with the default to the bit: a value that was written again counts as not set.
                is_set = f"{cell('settings', source)} != {settings[places[source]].value!r}"
                text_of_link = f"({text_of_link} if {is_set} else {text})"
            text = text_of_link
        lines.append(f"{name} = {text} if {own} == {settings[places[path]].value!r} else {own}")
        lines.append(f"{cell('followed', path)} = {name}")
    head = boundary.head("follow", dict.fromkeys(("settings", "followed"), "float64[::1]"))
    return "\n".join([*rows, head, *indent(lines)])


def _term(term: LinkFunction, rows: list[str], collector: SourceCollector) -> str:
    """Return the source of one term in the sum for a dependent setting; its structs are appended to ``rows``."""

    def filled(row: type, numbers: Sequence[str]) -> str:
        name = f"Followed{len(rows)}"
        rows.append(f"{name} = namedtuple({name!r}, {[quantity.name for quantity in quantities_of(row)]!r})")
        return f"{name}({', '.join(numbers)})"

    arguments = term.arguments([c_identifier(source) for source in term.sources], filled)
    return f"{collector.add(term.function)}({', '.join(arguments)})"
