"""Exported part of a program: lane loops, metrics and outputs, with their names in C."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths
from ppafo.engine.source_text import SourceCollector
from ppafo.exports.c_library.boundary import Boundary
from ppafo.metrics import METRICS, has_channels, missing_channels
from ppafo.metrics.metric import MetricKind
from ppafo.model.controlled import CONTROLLED
from ppafo.signals.meter import WALK

COUNTS = ("interval", "steps", "steps_per_sample", "signal_delay", "command_delay", "needs_parts")
"""Numbers of the steps of a run: steps from one sample to the next, in all, to a sample of the controller; delays.

The last one is 1 where the error decides about the parts of a step, else 0.
"""
Further = Callable[[SourceCollector, Boundary], str]
"""Writes a further composed function, once it has gathered what that calls."""

WHOLE, IN_PARTS = "advance", "advance_in_parts"
"""Names of the lane loops in C: of whole steps or of the one there is, and of steps in parts where there are both."""
TOGETHER = "_together"
"""Stands behind the name of a lane loop of several runs at once."""


@dataclass(frozen=True, slots=True)
class ExportedProgram:
    """A program with meters for all its metrics, and traces of all its outputs."""

    program: Program
    metrics: tuple[MetricKind, ...]

    @property
    def loops(self) -> dict[str, Program]:
        """Programs of its lane loops, by their names in C.

        There are two where the settings decide whether the error decides about the parts of a step.
        """
        if not self.program.chooses_parts:
            return {WHOLE: self.program}
        return {WHOLE: replace(self.program, is_adaptive=False), IN_PARTS: replace(self.program, is_adaptive=True)}

    @property
    def outputs(self) -> tuple[str, ...]:
        """Channels that it gives at each sample, in order."""
        return self.program.traced


def exported(program: Program) -> ExportedProgram:
    """The program as it is exported; a metric that needs all samples of a channel is left out."""
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


def places_of(groups: Mapping[str, type]) -> dict[str, str]:
    """Names in C of the places of all numbers of some groups of rows, by path."""
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: f"AT_{re.sub(r'[^A-Za-z0-9]+', '_', path).strip('_').upper()}" for path in paths}
