"""Metrics of a recording: named values with units, equal for measured and simulated data.

To add a metric: a function and its MetricKind in a module of this folder, listed in its METRICS.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ppafo.kinds import Kinds
from ppafo.metrics import command, gas, motion, strides, switching, tracking
from ppafo.metrics.metric import Metric, MetricKind
from ppafo.metrics.settled import VERDICT_METRICS
from ppafo.signals import Recording
from ppafo.signals.recording import OF_SECOND_CHAMBER

if TYPE_CHECKING:
    from ppafo.engine.program import Program

__all__ = ["METRICS", "Metric", "MetricKind", "evaluate", "has_channels", "metric_kind", "missing_channels"]


METRICS: Kinds[MetricKind] = Kinds(
    "ppafo.metrics",
    "metric",
    MetricKind,
    {
        kind.name: kind
        for kind in (
            *tracking.METRICS,
            *gas.METRICS,
            *switching.METRICS,
            *command.METRICS,
            *motion.METRICS,
            *strides.METRICS,
        )
    },
)


def metric_kind(name: str) -> MetricKind | None:
    """Return a metric by name, including metrics used only for verdicts; None for an unknown name."""
    # A name that is none of the package's has METRICS look for a metric of another package.
    return VERDICT_METRICS.get(name) or METRICS.get(name)


def evaluate(recording: Recording, kinds: Iterable[MetricKind] | None = None) -> dict[str, Metric]:
    """Compute metrics for which a recording has the channels, by default all; none for a single sample."""
    if kinds is None:
        METRICS.load_all()
        kinds = METRICS.values()
    metrics: dict[str, Metric] = {}
    names = frozenset(recording.names)
    for kind in kinds:
        if kind.compute is None or len(recording) < 2 or not names.issuperset(kind.channels):
            continue
        value = kind.compute(recording)
        if value is not None:
            metrics[kind.name] = Metric(value, kind.unit, kind.summary)
    return metrics


def missing_channels(program: "Program") -> frozenset[str]:
    """Return the channels absent from runs of a program: of an energy balance, or of a second chamber."""
    of_gas: frozenset[str] = frozenset() if program.is_thermal else gas.WITH_ENERGY_BALANCE
    return of_gas | OF_SECOND_CHAMBER if program.has_one_chamber else of_gas


def has_channels(program: "Program", kind: MetricKind) -> bool:
    """Return whether runs of a program have the channels and other requirements of a metric."""
    return (
        missing_channels(program).isdisjoint(kind.channels)
        and kind.of_reference in ("", program.followed)
        and program.offers.issuperset(kind.needs)
    )
