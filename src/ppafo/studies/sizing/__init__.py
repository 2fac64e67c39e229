"""The inverse question: a torque profile and hours of use in, the smallest valve, pressure and bottle out."""

from ppafo.studies.sizing.problem import SizingProblem, load_sizing
from ppafo.studies.sizing.result import SizedValve, Sizing
from ppafo.studies.sizing.study import run_sizing

__all__ = ["SizedValve", "Sizing", "SizingProblem", "load_sizing", "run_sizing"]
