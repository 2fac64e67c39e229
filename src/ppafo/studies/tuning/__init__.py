"""Which gains are best? A search over bounds, for a weighted objective with constraints, robust where asked."""

from ppafo.studies.tuning.loading import list_tunings, load_tuning
from ppafo.studies.tuning.problem import Effort, Problem
from ppafo.studies.tuning.study import Tuning, tune

__all__ = ["Effort", "Problem", "Tuning", "list_tunings", "load_tuning", "tune"]
