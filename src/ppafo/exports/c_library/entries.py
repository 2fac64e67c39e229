"""Source of the exported functions that prepare a run, composed of the preparation functions."""

import ast
from collections.abc import Mapping, Sequence
from functools import partial

from ppafo.engine.definitions import place_of
from ppafo.engine.entries import indent, parse_expression, rewritten
from ppafo.engine.generator import StepText
from ppafo.engine.plain_python import stored_names
from ppafo.engine.rows import given, leaf_paths
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.exports.c_library.library import COUNTS, ExportParameter, Library, c_identifier
from ppafo.exports.c_library.preparation import Preparation
from ppafo.exports.c_library.settings import numbers_of_second_chamber
from ppafo.model.declaration import PlainFunction
from ppafo.parameters.graph import ATMOSPHERE_PATH, Graph, Link
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import LoopLink


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
    made = stored_names(lines)
    for name, row in (program.parameter_rows() | states).items():
        if name not in made and leaf_paths(row, name):
            last = place_of(functions[-1])
            raise ProgramError(f"{last}: no preparation function sets '{name}' ({row.__name__}) of the program")
    written = partial(_written, cells=cells_of(preparation.scenario, settings))
    body = [*map(written, lines), *given("parameters", program.parameter_rows())]
    body += given("states", states)
    body += [f"counts.{name} = {written(number)}" for name, number in zip(COUNTS, counts.value.elts, strict=True)]
    return "\n".join(["def prepare(settings, parameters, states, counts):", *indent(body)])


def check_entry(
    preparation: Preparation,
    rules: Sequence[PlainFunction],
    settings: Sequence[ExportParameter],
    collector: SourceCollector,
) -> str:
    """Return the source of the entry ``check_profiles``, which finds the setting that breaks one of the rules."""
    *lines, place = StepText(preparation.program, collector).joined(rules, preparation, ["settings"])
    assert isinstance(place, ast.Return), "the last function gives the place"
    assert place.value is not None
    written = partial(_written, cells=cells_of(preparation.scenario, settings))
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


def _written(node: ast.AST, cells: Mapping[str, str]) -> str:
    """Return the text of a statement or expression with each reduced ``settings[PATH]`` as its source in ``cells``."""

    def source(part: ast.expr) -> ast.expr | None:
        if isinstance(part, ast.Attribute) and ast.unparse(part.value) == "settings":
            return parse_expression(cells[part.attr])
        return None

    return ast.unparse(ast.fix_missing_locations(rewritten(node, source)))


def cells_of(scenario: Scenario, settings: Sequence[ExportParameter]) -> dict[str, str]:
    """Return the sources of settings by path; of a missing second chamber the atmosphere, or its constant numbers."""
    cells = {setting.path: f"settings.{setting.name}" for setting in settings}
    absent = numbers_of_second_chamber(scenario)
    return cells | {path: cells[ATMOSPHERE_PATH] if "pressure" in path else repr(absent[path]) for path in absent}


def follow_entry(
    preparation: Preparation, settings: Sequence[ExportParameter], links: Graph, collector: SourceCollector
) -> str:
    """Return the source of ``follow``, which computes settings left at their defaults from other settings.

    ``links`` are those of the scenario that hold, and of its times.
    """
    scenario = preparation.scenario
    values = {setting.path: setting.value for setting in settings}
    cells = cells_of(scenario, settings)
    lines = list[str]()
    of_loop = [link for follows in links.values() for link in follows if isinstance(link, LoopLink)]
    for path, follows in links.items():
        if of_loop and follows[0] is of_loop[0]:
            # All that defaults of the device have in common, before the first of them.
            parts = of_loop[0].parts
            groups = [name for link in of_loop for name in link.groups]
            functions = parts.functions(groups, partial(number_at, scenario))
            joined = StepText(preparation.program, collector).joined(functions, parts, ["settings"])
            lines += map(partial(_written, cells=cells), joined)
        name = c_identifier(path)
        own = cells[path]
        text = own
        # The first link that holds wins, so it is the outermost choice.
        for link in reversed(follows):
            number = _default(link, cells, collector)
            # Compared with the default to the bit: a value that was written again counts as not set.
            is_set = link.when and f"settings.{c_identifier(link.when)} != {values[link.when]!r}"
            text = f"({number} if {is_set} else {text})" if is_set else number
        lines += [f"{name} = {text} if {own} == {values[path]!r} else {own}", f"followed.{name} = {name}"]
        cells[path] = name
    return "\n".join(["def follow(settings, followed):", *indent(lines)])


def _default(link: Link, cells: Mapping[str, str], collector: SourceCollector) -> str:
    """Return the source of the default that a link gives."""
    groups = link.groups if isinstance(link, LoopLink) else ()
    numbers = [*groups, *(cells[path] for path in link.direct)]
    if link.function is None:
        text = " * ".join([*([] if link.factor == 1.0 else [repr(link.factor)]), *numbers])
    else:
        text = f"{collector.add(link.function)}({', '.join(numbers)})"
    return f"({text} + {link.gap!r})" if link.gap else f"({text})"
