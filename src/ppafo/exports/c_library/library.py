"""Data of an exported library: settings with their relations, program, and names in C."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.metrics import METRICS, has_channels, missing_channels
from ppafo.metrics.metric import MetricKind
from ppafo.model.controlled import CONTROLLED
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import VANE
from ppafo.parameters.graph import Graph
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.signals.meter import WALK

COUNTS = ("interval", "steps", "steps_per_sample", "signal_delay", "command_delay", "needs_parts")
"""Step counts of a run: steps per sample, in total, and per controller sample; delays in steps.

The last number is 1 for error control of the parts of a step, else 0.
"""
Further = Callable[[SourceCollector], str]
"""Function that returns the source of a further composed function, after collecting the functions it calls."""

# C names of the time-stepping loops: with whole steps (or the only loop), and with steps in parts.
WHOLE = "advance"
IN_PARTS = "advance_in_parts"


@dataclass(frozen=True, slots=True)
class ExportedProgram:
    """Program with meters for all its metrics, and traces of all its outputs."""

    program: Program
    metrics: tuple[MetricKind, ...]

    @property
    def loops(self) -> dict[str, Program]:
        """Programs of the time-stepping loops by C name.

        There are two loops if the settings decide on error control of the parts of a step.
        """
        if not self.program.chooses_parts:
            return {WHOLE: self.program}
        return {WHOLE: replace(self.program, is_adaptive=False), IN_PARTS: replace(self.program, is_adaptive=True)}

    @property
    def outputs(self) -> tuple[str, ...]:
        """Output channels at each sample, in order."""
        return self.program.traced


def exported(program: Program) -> ExportedProgram:
    """Return the program as exported; metrics that need all samples of a channel are left out."""
    missing = missing_channels(program) | {
        kind.reference for name, kind in CONTROLLED.items() if name != program.wanted
    }
    offered = (kind for kind in METRICS.values() if has_channels(program, kind) and not kind.traced)
    # Metrics of a walk are about its strides.
    metrics = tuple(kind for kind in offered if (WALK in program.offers) == (WALK in kind.needs))
    # By name: the same metrics in another order are the same program.
    meters = dict(sorted({meter.name: meter for kind in metrics for meter in kind.meters}.items()))
    outputs = tuple(name for name in program.traces if name not in missing)
    return ExportedProgram(replace(program, meters=tuple(meters.values()), traced=outputs), metrics)


_OWN_FILES = {"main", "expected", "unit", "plugin", "fmi2", "fmi3", "makefile", "readme", "license"}
_OWN_TARGETS = {"all", "check", "clean", "test"}
_OF_CMAKE = {"help", "install", "package", "m"}
_WITH_ANOTHER_END = {"prepare", "prepared", "is", "begin", "ppafo_whole", "at_result", "at_step_aside_result"}
"""Names that would collide with another function or type after adding ``_run``, ``_size`` or ``_TOO_MANY_PARTS``."""
_OF_WINDOWS = {"con", "aux", "nul", "prn"}
_HEADERS_1 = {"assert", "complex", "ctype", "errno", "fenv", "float", "inttypes", "iso646", "limits", "locale", "math"}
_HEADERS_2 = {"setjmp", "signal", "stdarg", "stdbool", "stddef", "stdint", "stdio", "stdlib", "string", "tgmath"}
_OF_C = _HEADERS_1 | _HEADERS_2 | {"time", "wchar", "wctype"}
_TAKEN = _OWN_FILES | _OWN_TARGETS | _OF_CMAKE | _OF_WINDOWS | _OF_C | _WITH_ANOTHER_END
"""Reserved names of a library: its other files and types, targets in make files, and C headers."""


@dataclass(frozen=True, slots=True)
class ExportParameter:
    """Setting of an exported library: name in C, path in ppafo, declaration, and value in the scenario."""

    name: str
    path: str
    quantity: Quantity
    value: float


_SIGNS = {"below": "<", "at most": "<=", "at least": ">=", "above": ">"}


@dataclass(frozen=True, slots=True)
class Relation:
    """Required relation between two settings: ``below``, ``at most``, ``at least`` or ``above``, with ``tolerance``.

    Settings are given by path. The tolerance is in the unit of both, or a fraction of the other if ``is_share``.
    ``unless`` is a C condition under which the relation is not required.
    """

    path: str
    relation: str
    other: str
    tolerance: float = 0.0
    is_share: bool = False
    unless: str = ""

    @property
    def condition(self) -> tuple[str, str]:
        """C condition, and the setting to report if it is not met."""
        other = f"settings->{c_identifier(self.other)}"
        sign = "-" if self.relation == "at least" else "+"
        if self.tolerance:
            # With the tolerance of files, or a setting that a file accepts would be refused in C.
            slack = repr(self.tolerance)
            other = f"{other} * (1.0 {sign} {slack})" if self.is_share else f"{other} {sign} {slack}"
        name = c_identifier(self.path)
        required = f"settings->{name} {_SIGNS[self.relation]} {other}"
        return f"{required} || ({self.unless})" if self.unless else required, name


Condition = tuple[str, str]
"""Condition between settings as C text, and the setting to report."""


Switch = tuple[Sequence[str], bool]
"""Settings that select a program, and True if any of them is above 0; the opposite case needs another program."""


@dataclass(frozen=True, slots=True)
class LibraryApi:
    """API variant of an exported library: header, example, README, source and check templates; ``words`` fill them.

    ``functions(library, title, around)`` returns the C behind the sources; None for the functions of a run.
    """

    header: str
    main: str
    page: str
    sources: tuple[str, ...]
    words: Mapping[str, str] = field(default_factory=dict)
    check: str = "check.c"
    functions: Callable[["Library", str, str], str] | None = None


LOOP = LibraryApi("interface.h", "main.c", "README.md", ("interface.c", "loop.c"))
"""API of the closed loop, which advances from sample to sample."""


_VANE = re.compile(r"\b(?P<article>[Aa] )?vane\b")
"""Word for the actuator in summaries and comments, with its article."""


@dataclass(frozen=True, slots=True)
class Library:
    """Library to be written: program, settings, outputs, metrics and texts.

    ``further`` adds the function that computes the numbers of a run from the settings. ``switches`` are settings that
    select the program. ``other_program`` has further C conditions under which another program would be needed, each
    with the setting to report. ``rules`` are conditions between times, as in a file. ``following`` adds the function by
    which settings follow others, ``checking`` that which checks the profiles; None if there is nothing to do.
    ``defaults`` names the settings whose default follows others; these have no range. ``links`` maps followers to their
    sources. ``words`` are template variables of the README. ``api`` is the interface of the library. ``joint`` and
    ``actuator`` are the names of the joint and of the kind of actuator.
    """

    title: str
    description: str
    program: ExportedProgram
    settings: tuple[ExportParameter, ...]
    relations: tuple[Relation, ...] = ()
    switches: tuple[Switch, ...] = ()
    other_program: tuple[Condition, ...] = ()
    words: Mapping[str, str] = field(default_factory=dict)
    further: Further | None = None
    following: Further | None = None
    checking: Further | None = None
    defaults: frozenset[str] = frozenset()
    links: Graph = field(default_factory=dict)
    api: LibraryApi = LOOP
    rules: tuple[Condition, ...] = ()
    joint: JointNames = ANKLE
    actuator: str = VANE

    def worded(self, summary: str) -> str:
        """Return a summary or comment about a vane on an ankle in the words of this actuator and joint."""
        if self.actuator == VANE:
            return self.joint.said(summary)
        return self.joint.said(_VANE.sub(lambda found: f"{(found[1] or '').replace(' ', 'n ')}actuator", summary))

    @property
    def name(self) -> str:
        """Name of the library in C, and of its files."""
        name = c_identifier(self.title)
        # A scenario may be called "main" or "math"; C, make and the board's files already are.
        return f"run_{name}" if name in _TAKEN else name


def c_identifier(name: str) -> str:
    """Return a name converted to a C identifier."""
    # A name in C begins with a letter here: those that begin with an underscore belong to compilers.
    identifier = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").lower()
    return identifier if identifier[:1].isalpha() else f"run_{identifier}"
