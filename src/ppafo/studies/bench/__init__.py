"""How fast the engine is, as ratios to other solvers measured in the same run on the same cores."""

from ppafo.studies.bench.report import BenchReport
from ppafo.studies.bench.study import FULL, QUICK, BenchSize, measure_speed

__all__ = ["FULL", "QUICK", "BenchReport", "BenchSize", "measure_speed"]
