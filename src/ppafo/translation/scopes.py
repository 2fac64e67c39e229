"""Scopes of local names: removal of unused assignments, innermost block of each declaration."""

import ast
from dataclasses import dataclass, field, replace

from ppafo.translation import typed
from ppafo.translation.typed import Function, Statement, Term
from ppafo.translation.value_types import INT, Type

Block = tuple[Statement, ...]


@dataclass(slots=True)
class Scopes:
    """Analysis of the local names of a function: uses, types and declarations.

    ``read`` are names that are read at all, ``types`` the types of assigned names. ``before`` has the names declared at
    the start of a block, ``first`` the keyword of statements that declare a name with their assignment, ``counted`` the
    loops whose variable is used only inside them. ``direct`` has the names mentioned by a statement itself, ``inside``
    also by its blocks, and ``changes`` the number of assignments to each name in a block. Blocks and statements are
    keyed by ``id``.
    """

    function: Function
    read: set[str] = field(default_factory=set)
    types: dict[str, Type] = field(default_factory=dict)
    before: dict[int, list[str]] = field(default_factory=dict)
    first: dict[int, str] = field(default_factory=dict)
    counted: set[int] = field(default_factory=set)
    direct: dict[int, set[str]] = field(default_factory=dict)
    inside: dict[int, set[str]] = field(default_factory=dict)
    changes: dict[int, dict[str, int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Determine the block in which each local name of the function is declared."""
        body = self.function.body
        self.look(body)
        # In order of names: the order of a set changes from process to process, and an export has one text.
        for name in sorted(self.types.keys() - {name for name, _ in self.function.parameters}):
            self.place(name, body)

    def look(self, body: Block) -> tuple[set[str], dict[str, int]]:
        """Record the names that each statement mentions, and the assignments to each name in each block."""
        every: set[str] = set()
        changes: dict[str, int] = {}
        for statement in body:
            terms = _names_of(statement)
            self.read |= terms
            made = _made(statement)
            own = set(terms) | ({made[0]} if made else set())
            within = set(own)
            if made:
                # Types were joined in the walk: each assignment of a name has the same one.
                self.types[made[0]] = made[1]
                changes[made[0]] = changes.get(made[0], 0) + 1
            if isinstance(statement, typed.Store) and statement.element.kind != "element":
                # A row of which a field is set changes too.
                for name in statement.element.reads:
                    changes[name] = changes.get(name, 0) + 1
            for inner in _blocks(statement):
                names, inner_changes = self.look(inner)
                within |= names
                for name, count in inner_changes.items():
                    changes[name] = changes.get(name, 0) + count
            self.direct[id(statement)] = own
            self.inside[id(statement)] = within
            every |= within
        self.changes[id(body)] = changes
        return every, changes

    def mentions(self, name: str, body: Block) -> Block:
        """Return the statements of a block that mention a name, directly or in nested blocks."""
        return tuple(statement for statement in body if name in self.inside[id(statement)])

    def place(self, name: str, body: Block) -> None:
        """Declare a name in the innermost block that contains all its mentions."""
        mentions = self.mentions(name, body)
        if isinstance(mentions[0], typed.LocalArray):
            return
        if _begins(mentions[0], name):
            # A name that changes once is const: a reader of exported C need not look for more.
            self.first[id(mentions[0])] = "const " if self.changes[id(body)][name] == 1 else "let "
        # As far in as it goes: each block with a value of its own declares it for itself.
        elif not self.is_own(name, body):
            self.before.setdefault(id(body), []).append(name)
        else:
            loops = {id(statement) for statement in mentions if self.counts(name, statement)}
            self.counted |= loops
            for inner in self.blocks(name, tuple(mention for mention in mentions if id(mention) not in loops)):
                self.place(name, inner)

    def is_own(self, name: str, body: Block) -> bool:
        """Return whether a block, or each nested block with a name, assigns the name before it reads it."""
        mentions = self.mentions(name, body)
        return _begins(mentions[0], name) or all(
            self.counts(name, statement)
            or (
                name not in self.direct[id(statement)]
                and all(self.is_own(name, inner) for inner in self.blocks(name, (statement,)))
            )
            for statement in mentions
        )

    def counts(self, name: str, statement: Statement) -> bool:
        """Return whether a statement is a counted loop over a name that is not assigned otherwise."""
        return (
            isinstance(statement, typed.CountedLoop)
            and statement.name == name
            and name not in self.changes[id(statement.body)]
            and name not in _names_of(statement)
        )

    def blocks(self, name: str, mentions: Block) -> list[Block]:
        """Return the nested blocks of statements that mention a name."""
        return [inner for statement in mentions for inner in _blocks(statement) if self.mentions(name, inner)]


def needed(body: Block, after: frozenset[str], leaving: frozenset[str] = frozenset()) -> tuple[Block, frozenset[str]]:
    """Return a block without unused assignments, and the names that the block reads.

    ``after`` are the names that are read later, ``leaving`` the names read after ``break`` and ``continue``.
    """
    kept: list[Statement] = []
    live = after
    # Backwards, so that what is read later is known.
    for statement in reversed(body):
        # A name that is not read later needs no assignment: expressions have no other effect.
        if isinstance(statement, typed.Assign) and statement.name not in live:
            continue
        if isinstance(statement, typed.If):
            (yes, read), (no, others) = (needed(inner, live, leaving) for inner in _blocks(statement))
            kept.append(replace(statement, body=yes, otherwise=no))
            live = read | others | _names_of(statement)
        elif isinstance(statement, typed.CountedLoop | typed.While):
            # An iteration may read names that the one before left: repeat until no further name is read.
            live |= _names_of(statement)
            turn, read = needed(statement.body, live, live)
            while not live >= read:
                live |= read
                turn, read = needed(statement.body, live, live)
            kept.append(replace(statement, body=turn))
        else:
            made = _made(statement)
            live = leaving if isinstance(statement, typed.LoopExit) else live
            live = (live - {made[0]} if made else live) | _names_of(statement)
            kept.append(statement)
    return tuple(kept[::-1]), live


def _begins(statement: Statement, name: str) -> bool:
    """Return whether a statement assigns a name without reading it."""
    return isinstance(statement, typed.Assign) and statement.name == name and name not in statement.value.reads


def _made(statement: Statement) -> tuple[str, Type] | None:
    """Return the name assigned by a statement, with its type; None without assignment."""
    if isinstance(statement, typed.Assign):
        return statement.name, statement.value.type
    if isinstance(statement, typed.LocalArray):
        return statement.name, statement.type
    return (statement.name, INT) if isinstance(statement, typed.CountedLoop) else None


def _blocks(statement: Statement) -> list[Block]:
    """Return the nested blocks of a statement."""
    if isinstance(statement, typed.If):
        return [statement.body, statement.otherwise]
    return [statement.body] if isinstance(statement, typed.CountedLoop | typed.While) else []


def _names_of(statement: Statement) -> frozenset[str]:
    """Return the names read by a statement itself, without nested blocks."""
    terms: tuple[Term, ...] = ()
    if isinstance(statement, typed.Assign | typed.Return):
        terms = (statement.value,)
    elif isinstance(statement, typed.Store):
        terms = statement.element, statement.value
    elif isinstance(statement, typed.ProcedureCall):
        terms = statement.given
    elif isinstance(statement, typed.CountedLoop):
        terms = statement.start, statement.stop
    elif isinstance(statement, typed.If | typed.While):
        terms = (statement.test,)
    return frozenset().union(*(term.reads for term in terms))


@dataclass(frozen=True, slots=True)
class ScopeNames:
    """Names in a function definition: all names, names that are read, and pure loop counters."""

    every: frozenset[str]
    read: frozenset[str]
    counters: frozenset[str]

    @classmethod
    def of(cls, definition: ast.FunctionDef) -> "ScopeNames":
        """Collect the names of a function definition."""
        nodes = list(ast.walk(definition))
        named = [node for node in nodes if isinstance(node, ast.Name)]
        every = {node.id for node in named}
        read = {node.id for node in named if isinstance(node.ctx, ast.Load)}
        # A counting variable holds only the numbers of loops that count up from 0 or more.
        loops = [node for node in nodes if isinstance(node, ast.For) and _counts_up(node)]
        counting = [node.target.id for node in loops if isinstance(node.target, ast.Name)]
        stored = [node.id for node in named if isinstance(node.ctx, ast.Store)]
        parameters = {node.arg for node in nodes if isinstance(node, ast.arg)}
        counters = {name for name in counting if counting.count(name) == stored.count(name)} - parameters
        return cls(frozenset(every | parameters), frozenset(read), frozenset(counters))


def _counts_up(node: ast.For) -> bool:
    """Return whether a loop runs over ``range`` with non-negative literal start and step."""
    if not isinstance(node.iter, ast.Call) or ast.unparse(node.iter.func) != "range":
        return False
    bounds = node.iter.args
    literals = [bounds[0], *bounds[2:]] if len(bounds) > 1 else []
    return all(isinstance(literal, ast.Constant) for literal in literals)
