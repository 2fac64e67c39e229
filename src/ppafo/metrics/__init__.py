"""What a recording says in numbers: named values with units, the same for measured and simulated data."""

from ppafo.metrics.catalog import METRICS, evaluate
from ppafo.metrics.metric import Metric, MetricKind

__all__ = ["METRICS", "Metric", "MetricKind", "evaluate"]
