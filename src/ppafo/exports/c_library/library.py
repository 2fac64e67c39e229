"""Record of an exported library: settings and how they relate, program, names in C."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ppafo.exports.c_library.exported import ExportedProgram, Further
from ppafo.model.declaration import Quantity
from ppafo.parameters.graph import Graph

_OWN_FILES = {"main", "expected", "unit", "plugin", "fmi2", "fmi3", "makefile", "readme", "license"}
_OWN_TARGETS = {"all", "check", "clean", "test"}
_OF_BOARDS = {"board", "board_simulated", "start_cortex"}
_OF_CMAKE = {"help", "install", "package", "m"}
_WITH_ANOTHER_END = {"prepare", "prepared", "is", "begin", "ppafo_whole", "at_result", "at_step_aside_result"}
"""Names that become another function or type with ``_run``, ``_size`` or ``_TOO_MANY_PARTS`` behind them."""
_OF_WINDOWS = {"con", "aux", "nul", "prn"}
_HEADERS_1 = {"assert", "complex", "ctype", "errno", "fenv", "float", "inttypes", "iso646", "limits", "locale", "math"}
_HEADERS_2 = {"setjmp", "signal", "stdarg", "stdbool", "stddef", "stdint", "stdio", "stdlib", "string", "tgmath"}
_OF_C = _HEADERS_1 | _HEADERS_2 | {"time", "wchar", "wctype"}
_TAKEN = _OWN_FILES | _OWN_TARGETS | _OF_BOARDS | _OF_CMAKE | _OF_WINDOWS | _OF_C | _WITH_ANOTHER_END
"""Names that a library cannot have: of its other files and types, of targets in make files, of headers of C."""


@dataclass(frozen=True, slots=True)
class ExportParameter:
    """Something that can be chosen before a run: its name in C and in ppafo, what it is, and what the scenario has."""

    name: str
    path: str
    quantity: Quantity
    value: float


@dataclass(frozen=True, slots=True)
class Relation:
    """A setting that must be ``below``, ``at most``, ``at least`` or ``above`` another, but for a ``tolerance``.

    The tolerance is in the unit of both, or a share of the other where it ``is_share``.
    """

    name: str
    relation: str
    other: str
    tolerance: float = 0.0
    is_share: bool = False


Rule = tuple[str, str, tuple[str, ...]]
"""A rule of settings: the setting that is named, the condition as text in C, the settings that it holds in order."""


Switch = tuple[Sequence[str], bool]
"""Settings of which any is above 0, where True, or none: the other case is another program."""


@dataclass(frozen=True, slots=True)
class LibraryApi:
    """API variant of an exported library: header, example, README and source templates; ``words`` fill them.

    The settings ``as_step`` are ``step`` whatever they are.
    """

    header: str
    main: str
    page: str
    source: str
    words: Mapping[str, str] = field(default_factory=dict)
    step: str = ""
    as_step: tuple[str, ...] = ()


LOOP = LibraryApi("interface.h", "main.c", "README.md", "loop.c")
"""The closed loop, which goes from sample to sample."""


@dataclass(frozen=True, slots=True)
class Library:
    """Library to be written: program, parameters, outputs, metrics and texts.

    ``further`` adds the function that makes the numbers of a run from the settings. ``switches`` choose the program,
    ``other_program`` has further conditions in C under which another would be needed, with the setting that is named;
    ``rules`` are between its times, as in a file. ``following`` adds the function that lets settings follow others,
    None where none does, and ``defaults`` names the settings whose default does so, which has no range; ``links`` say
    what follows what. ``words`` fill the page. ``api`` is how it is called.
    """

    title: str
    description: str
    program: ExportedProgram
    settings: tuple[ExportParameter, ...]
    relations: tuple[Relation, ...]
    switches: tuple[Switch, ...]
    other_program: tuple[tuple[str, str], ...]
    words: Mapping[str, str]
    further: Further | None = None
    following: Further | None = None
    defaults: frozenset[str] = frozenset()
    links: Graph = field(default_factory=dict)
    api: LibraryApi = LOOP
    rules: tuple[Rule, ...] = ()

    @property
    def name(self) -> str:
        """Name of the library in C, and of its files."""
        name = c_identifier(self.title)
        # A scenario may be called "main" or "math"; C, make and the board's files already are.
        return f"run_{name}" if name in _TAKEN else name


def c_identifier(name: str) -> str:
    """Return a name as C can have it."""
    # A name in C begins with a letter here: those that begin with an underscore belong to compilers.
    identifier = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").lower()
    return identifier if identifier[:1].isalpha() else f"run_{identifier}"
