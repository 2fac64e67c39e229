"""Exported part of a program: time-stepping loops, metrics and outputs, with their C names."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.metrics import METRICS, has_channels, missing_channels
from ppafo.metrics.metric import MetricKind
from ppafo.model.controlled import CONTROLLED
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
