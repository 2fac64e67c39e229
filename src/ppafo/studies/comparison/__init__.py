"""Which configuration is better, by how much, and how surely?"""

from ppafo.studies.comparison.paired import Paired
from ppafo.studies.comparison.study import Case, Comparison, compare

__all__ = ["Case", "Comparison", "Paired", "compare"]
