"""Text of the functions of a step in the compiled module of one program."""

import ast
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, field
from types import FunctionType
from typing import Any

from ppafo.engine.composer import Composer, is_step_function
from ppafo.engine.definitions import emitted_name
from ppafo.engine.linking import link_program
from ppafo.engine.plain_python import check_flow, check_grammar, refusal, stored_names
from ppafo.engine.program import Program
from ppafo.engine.reduction import (
    HISTORIES,
    NUMBER,
    Effects,
    Reduction,
    definition_of,
    uses_of_group,
)
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.declaration import PlainFunction
from ppafo.wording import nearest_name


@dataclass(slots=True)
class ComposedFunction:
    """Function of the step as written into the module."""

    function: FunctionType
    name: str
    """Name of the function in the module."""
    effects: Effects
    """Groups that the function reads and sets."""
    handed: tuple[str, ...]
    """Parameters before the function's own parameters: groups of a run, and the index of the run."""
    ending: str
    """Suffix of the name, used if another program has a different function of the same name."""

    @property
    def own(self) -> str:
        """Name of the returned row, if the function returns a row."""
        return f"after_{self.function.__name__}{self.ending if self.name.endswith(self.ending) else ''}"


@dataclass(slots=True)
class StepText:
    """Collection of the step functions of one program in a collector that also has the functions of the model.

    A collector may contain the steps of two programs; functions that both have in common are stored once.
    """

    parts: Program
    collector: SourceCollector
    ending: str = ""
    """Suffix for the names of functions that another program has in a different form."""
    states: dict[str, Any] = field(init=False)
    parameters: dict[str, Any] = field(init=False)
    of_step: dict[str, Any] = field(init=False)
    rows: dict[str, Any] = field(init=False)
    """Classes of all groups that have rows."""
    composed: dict[FunctionType, ComposedFunction] = field(default_factory=dict)
    placeholders: dict[str, Any] = field(default_factory=dict)
    given: set[str] = field(default_factory=set)
    """Groups of intermediate values that the phases composed so far have set."""

    def __post_init__(self) -> None:
        """Look up the groups of the program, and link the functions of its components."""
        self.states = self.parts.state_rows()
        self.parameters = self.parts.parameter_rows()
        self.of_step = self.parts.step_rows()
        self.rows = {**self.parameters, **self.states, **self.of_step}
        link_program(self.parts, self.collector.replacements)

    def effects_of(self, function: FunctionType) -> Effects:
        """Return the groups that an added function of the step reads and sets."""
        return self.composed[function].effects

    def phase(self, function: PlainFunction) -> ComposedFunction:
        """Add a function called by the loop over steps; the function returns the groups that later phases may read.

        Raises ProgramError if the function reads a group that no earlier phase has stored.
        """
        assert isinstance(function, FunctionType), "it is no other callable"
        phase = self._composed(function, is_phase=True)
        for name in phase.handed:
            if name not in self.rows and name not in (NUMBER, *HISTORIES):
                raise self.refuse_read(name, phase)
        # Where a loop of one run has whole steps too, phases that divide a step are written out of their order.
        for name in phase.effects.reads if not self.ending else ():
            if name in self.of_step and name not in self.given:
                raise self.refuse_read(name, phase)
        self.given.update(phase.effects.groups)
        return phase

    def add_called(self, inside: FunctionType, called: FunctionType) -> str:
        """Add a function called by another function; return its name in the module."""
        if is_step_function(called):
            return self._composed(called, is_phase=False).name
        return self.collector.add_inside(inside, called)

    def add_inside(self, function: FunctionType, called: Any) -> str:
        """Add a function called inside another, unless it is a composed step; return its name in the module."""
        return self.composed[called].name if called in self.composed else self.collector.add_inside(function, called)

    def refuse_read(self, name: str, asking: ComposedFunction) -> ProgramError:
        """Return the error for a phase that reads a group which no phase before it sets: the line, and the remedy."""
        known = [function for function, composed in self.composed.items() if name in composed.effects.reads]
        reads = ((item, node) for item in [asking.function, *known] for node in uses_of_group(item, name))
        # A phase that only sets the group must be handed what it was before.
        function, node = next(reads, (asking.function, definition_of(asking.function).tree))
        problem = (
            f"may be unset here: no phase before '{asking.function.__name__}' sets it; set it earlier, on every path"
        )
        if name not in self.rows:
            hint = nearest_name(name, self.rows) or f"; declare it: '{name}': handed(CLASS), of float or a NamedTuple"
            problem = f"is not handed on by an earlier phase and is not a group of any component{hint}"
        return refusal(function.__code__.co_filename, node, f"'lane.{name}' {problem}")

    def joined(self, functions: Sequence[PlainFunction], parts: Any, takes: Sequence[str]) -> list[ast.stmt]:
        """Return the statements of several functions, concatenated into one function with the parameters ``takes``.

        Groups of these functions become names. Their ``parts`` are other parts than the parts of the step.
        """
        plain = [function for function in functions if isinstance(function, FunctionType)]
        reduced = [(function, Reduction(self, function, parts).reduced()) for function in plain]
        local = stored_names(tree for _, tree in reduced)
        found: list[ast.stmt] = []
        for function, tree in reduced:
            check_grammar(tree, function.__code__.co_filename)
            names = [*local, *takes]
            composer = Composer(function, self.collector, self.add_inside, names, self.placeholders)
            found += [composer.visit(statement) for statement in tree.body]
        return found

    def _composed(self, function: FunctionType, is_phase: bool) -> ComposedFunction:
        """Compose a function of the step once; the reduced function returns the groups that it sets.

        Raises ProgramError if the function both returns a value and sets groups.
        """
        if function in self.composed:
            return self.composed[function]
        reduction = Reduction(self, function)
        tree = reduction.reduced()
        effects = reduction.effects
        if is_phase:
            # A group without rows lives in this phase alone.
            effects.groups = {name: fields for name, fields in effects.groups.items() if name in self.rows}
        if not any(isinstance(node, ast.Return) for node in ast.walk(tree)):
            # A single result is returned as it is.
            results: list[ast.expr] = [ast.Name(name, ast.Load()) for name in effects.results]
            value: ast.expr = results[0] if len(results) == 1 else ast.Tuple(results, ast.Load())
            if len(results) > 1:
                value = ast.Call(reduction.placeholder(self._result_row(function, tuple(effects.results))), results, [])
            tree.body = [*tree.body, ast.copy_location(ast.Return(value), tree)]
        elif effects.results:
            raise reduction.refuse(
                tree, f"function '{function.__name__}' both returns a value and sets 'lane' groups; do only one"
            )
        parameters = [argument.arg for argument in tree.args.args]
        # The groups that it reads come before its own parameters.
        handed = tuple(name for name in parameters if name in effects.reads or name == NUMBER)
        self.composed[function] = ComposedFunction(
            function=function,
            name=self._written(function, tree, handed, {*effects.reads, *effects.groups}),
            effects=effects,
            handed=handed,
            ending=self.ending,
        )
        return self.composed[function]

    def _written(self, function: FunctionType, tree: ast.FunctionDef, handed: tuple[str, ...], groups: set[str]) -> str:
        """Write the text of a reduced function into the module; return its name in the module."""
        file = function.__code__.co_filename
        ast.fix_missing_locations(tree)
        check_grammar(tree, file)
        local = stored_names([tree]) | {argument.arg for argument in tree.args.args}
        check_flow(tree, file, local)
        # A local name may be that of a group which this function does not ask for.
        rows = {name: kind for name, kind in self.rows.items() if name in groups}
        composer = Composer(function, self.collector, self.add_inside, local, self.placeholders, rows)
        tree.returns = None
        tree.decorator_list = []
        tree.body = [composer.visit(statement) for statement in tree.body]
        ast.fix_missing_locations(tree)
        tree.name = emitted_name(function)
        text = self.collector.decorated(tree, file)
        if self.ending and text != self.collector.definitions.get(tree.name, ""):
            tree.name += self.ending
            text = self.collector.decorated(tree, file)
        self.collector.owners[tree.name] = function
        self.collector.definitions[tree.name] = text
        if handed:
            self.collector.needs[tree.name] = handed
        return tree.name

    def _result_row(self, function: FunctionType, names: tuple[str, ...]) -> Any:
        """Return the NamedTuple class of the groups set by a function of the step."""
        make: Any = namedtuple
        own = f"{function.__name__}_result"
        row = make(own, names)
        row.__module__ = function.__module__
        row.__qualname__ = own
        row.__doc__ = f"What ``{function.__name__}`` sets."
        known = self.collector.owners.get(emitted_name(row))
        if known is None or known._fields == names:
            return row if known is None else known
        row.__qualname__ += self.ending
        return row
