"""Composed module of an exported scenario: loop of a single run, metrics, and preparation from settings.

Preparation and metrics read settings by name, and numbers that may be columns of ``model.columns``. For a single run a
name becomes a field, every number is a scalar, and a function over runs is called directly.
"""

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ppafo.engine.entries import HEADER, INLINE, indent
from ppafo.engine.generator import StepText
from ppafo.engine.linking import link_program
from ppafo.engine.loop_text import LOOP_OF_RUN, run_loop
from ppafo.engine.rows import is_number, is_row, leaf_paths, members, taken
from ppafo.engine.source_text import SourceCollector, composed_lines
from ppafo.exports.c_library.library import COUNTS, IN_PARTS, WHOLE, ExportedProgram, Library
from ppafo.metrics.metric import ReadAt, Readings
from ppafo.model.columns import over_runs
from ppafo.translation.value_types import FLOAT, INT, Items, Row, RowReference, Type, declared_type

NameOf = Callable[[type], str]


def struct_of(name: str, groups: Mapping[str, type], name_of: NameOf) -> RowReference:
    """Return the C struct of groups of rows; groups without numbers are omitted."""
    # C has no empty structs.
    found = ((group, type_of(row, name_of)) for group, row in groups.items() if leaf_paths(row, group))
    return RowReference(Row(name, tuple(found)))


def struct_of_numbers(name: str, names: Iterable[str]) -> RowReference:
    """Return the C struct whose members are the named numbers."""
    return RowReference(Row(name, tuple((field, FLOAT) for field in names)))


def type_of(row: object, name_of: NameOf) -> Type:
    """Return the translated type of a NamedTuple, a tuple of fixed length or a float."""
    if is_number(row):
        return FLOAT
    inner = tuple((way.lstrip("."), type_of(kind, name_of)) for way, kind in members(row))
    # One that holds nothing is an empty tuple, as where rows are put together.
    if inner and is_row(row):
        assert isinstance(row, type)
        return Row(name_of(row), inner)
    # A tuple has no names in C either: its items are numbered.
    return Items(tuple(kind for _, kind in inner))


class _ForOneRun(ast.NodeTransformer):
    """Rewriter of one function definition for a single run; ``scope`` contains the visible names."""

    def __init__(self, scope: dict[str, Any]) -> None:
        self.scope = scope

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Replace ``settings["delay"]`` by a field access."""
        self.generic_visit(node)
        name = self.value_of(node.slice)
        return ast.copy_location(ast.Attribute(node.value, name, node.ctx), node) if isinstance(name, str) else node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Replace a call over runs by a direct call."""
        self.generic_visit(node)
        # For one run no number is a column, so the function itself is what is meant.
        if self.value_of(node.func) is not over_runs:
            return node
        return ast.copy_location(ast.Call(node.args[0], node.args[1:], node.keywords), node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        """Leave out what is done with columns."""
        self.generic_visit(node)
        return node.orelse if self.asks_for_columns(node.test) else node

    def visit_If(self, node: ast.If) -> Any:
        """Leave out what is done with columns."""
        self.generic_visit(node)
        return node.orelse if self.asks_for_columns(node.test) else node

    def asks_for_columns(self, test: ast.expr) -> bool:
        """Return whether a condition asks whether numbers are columns."""
        return any(isinstance(node, ast.Attribute) and self.value_of(node) is np.ndarray for node in ast.walk(test))

    def value_of(self, node: ast.expr) -> Any:
        """Value of a constant, a name or an attribute; None for any other expression."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name):
            return self.scope.get(node.id)
        return getattr(self.value_of(node.value), node.attr, None) if isinstance(node, ast.Attribute) else None


_ENDINGS = {WHOLE: "", IN_PARTS: "_in_parts"}


def c_text_of_run(library: Library, title: str, around: str) -> str:
    """Return all functions of an exported program as readable C, for a single run and with structs.

    The text ``around`` declares the structs of settings and metrics, with the name of the library as prefix.
    """
    # Array functions are specialised for a single run.
    collector = SourceCollector(
        INLINE,
        lambda function, tree: ast.fix_missing_locations(_ForOneRun(function.__globals__).visit(tree)),
    )
    exported = library.program
    program = library.program.program
    name = library.name
    link_program(program, collector.replacements)
    entries = [metrics_entry(exported, collector)] if exported.metrics else []
    entries += [add(collector) for add in (library.further, library.following, library.checking) if add is not None]
    # Functions that both loops have in common are written once.
    steps = {name: StepText(each, collector, _ENDINGS[name]) for name, each in exported.loops.items()}
    loop = run_loop(steps[WHOLE], f"{name}_outputs", steps.get(IN_PARTS))
    composed = "\n\n".join([HEADER, collector.text(), loop, *entries, ""])
    states = struct_of("run_states", program.state_rows(), collector.add)
    parameters = struct_of("run_parameters", program.parameter_rows(), collector.add)
    settings_row = struct_of_numbers(f"{name}_settings", [setting.name for setting in library.settings])
    outputs = struct_of_numbers(f"{name}_outputs", ["time", *exported.outputs])
    samples = RowReference(Row("run_samples", (("last", outputs.row), ("before", outputs.row))))
    metrics_row = struct_of_numbers(f"{name}_metrics", [kind.name for kind in exported.metrics])
    chooses = [INT] if program.chooses_parts else []
    types: dict[str, tuple[Type, ...]] = {
        WHOLE: (states, parameters, samples, *map(declared_type, LOOP_OF_RUN.values()), *chooses),
        "metrics": (states, INT, metrics_row),
        "prepare": (settings_row, parameters, states, struct_of_numbers("run_counts", COUNTS)),
        "follow": (settings_row, settings_row),
        "reach": (parameters, FLOAT, struct_of_numbers("run_reach", ["low", "high"])),
        "check_profiles": (settings_row, struct_of_numbers("run_fault", ["place"])),
    }
    return readable_c(library, collector, composed, types, (settings_row, outputs, metrics_row), title, around)


def readable_c(
    library: Library,
    collector: SourceCollector,
    composed: str,
    types: Mapping[str, tuple[Type, ...]],
    declared: Iterable[RowReference],
    title: str,
    around: str,
) -> str:
    """Return the C of the ``composed`` functions, with short names and the comments of their sources.

    ``types`` has the parameter types of the entries; the text ``around`` declares the structs ``declared``.
    """
    from ppafo.translation.c99 import c_source, documents_of
    from ppafo.translation.c_terms import is_free
    from ppafo.translation.walk import walk_module

    documents = {name: library.worded(text) for name, text in (documents_of(collector) | _DOCUMENTS).items()}
    # A short name is taken only where it is unambiguous and C leaves it free; all others keep their module's path.
    own = {name: re.sub(r"\W", "_", owner.__qualname__).strip("_") for name, owner in collector.owners.items()}
    # Functions of the step that divide it have their ending beside those that do not.
    ending = _ENDINGS[IN_PARTS]
    own |= {name: f"{word.removesuffix(ending)}{ending}" for name, word in own.items() if name.endswith(ending)}
    counts = Counter(own.values())
    taken = _names_around()
    short = {name: word for name, word in own.items() if counts[word] == 1 and word not in taken and is_free(word)}
    return c_source(
        # Functions of the C library have last bits of their own: a run must not call any.
        walk_module(composed, types),
        documents,
        title,
        names=short,
        declared={kind.row.name: kind.row.name for kind in declared},
        around=around,
    )


_DOCUMENTS = {
    "Readings": Readings.__doc__ or "",
    "run_states": "State of a run, by group.",
    "run_parameters": "Parameters of a run, constant over the run.",
    "run_counts": "Step counts and intervals, in engine steps.",
    "advance": "Advance a run by some steps and record the samples that are due.",
    "run_samples": "The last two samples.",
    "metrics": "Metrics of a run, from its final state.",
    "prepare": "Parameters of a run from settings in SI units.",
    "run_fault": "Place of a setting, counted from 1; 0 for none.",
    "run_reach": "Range of a quantity.",
    "reach": "Lowest and highest torque of the actuator at an angle.",
    "check_profiles": "Setting that breaks a rule on profiles.",
    "decide": "Next state of the law, with its command, from settings, state, reference and measurement.",
    "observe": "Torque of a measurement, from its angle and pressures.",
    "follow": "Update settings at their default that depend on other settings.",
}


@cache
def _names_around() -> frozenset[str]:
    """Names of C functions in the template files of a library, which its other functions must not have."""
    folders = [folder.joinpath("templates") for folder in files("ppafo.exports").iterdir()]
    texts = [
        [file.read_text(encoding="utf-8") for file in folder.iterdir() if file.name.endswith(".c")]
        for folder in folders
        if folder.is_dir()
    ]
    # Functions around a library have the name of that library in theirs.
    found = (
        _FUNCTION.findall(text)
        for of_folder in texts
        if any("@name@" in text for text in of_folder)
        for text in of_folder
    )
    return frozenset(("advance", "metrics", "prepare", "follow", "check_profiles", "reach", "decide", "observe")).union(
        *found
    )


_FUNCTION = re.compile(r"^(?:static )?[\w ]+\b\*?(\w+)\(", re.MULTILINE)


def metrics_entry(exported: ExportedProgram, collector: SourceCollector) -> str:
    """Return the source of the entry ``metrics``: metrics of a run from its final states."""
    program = exported.program
    groups = exported.program.state_rows()
    names = [kind.name for kind in program.meters]
    course, *of_meters = (taken("states", name, groups[name]) for name in ("course", *program.meter_groups))
    meters = ", ".join(f"{name}={value}" for name, value in zip(names, of_meters, strict=True))
    lines = [f"readings = Readings(meters=Meters({meters}), course={course}, samples=samples)"]
    for metric in exported.metrics:
        if isinstance(metric.read, ReadAt):
            value = ", ".join(f"readings.{path}" for path in metric.read.places)
            value = value if metric.read.function is None else f"{collector.add(metric.read.function)}({value})"
        else:
            value = f"{collector.add(metric.read)}(readings)"
        lines.append(f"found.{metric.name} = {value}")
    rows = [
        f"Meters = namedtuple('Meters', {names!r})",
        "Readings = namedtuple('Readings', ['meters', 'course', 'samples'])",
    ]
    return "\n".join([*rows, "def metrics(states, samples, found):", *indent(composed_lines(lines, collector.needs))])
