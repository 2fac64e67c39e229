"""Which uncertain value matters? Morris screening, Sobol indices and Shapley effects."""

from ppafo.studies.sensitivity.analyse import Sensitivity, Settings, analyse
from ppafo.studies.sensitivity.methods import METHODS, Indices
from ppafo.studies.sensitivity.study import sensitivity

__all__ = ["METHODS", "Indices", "Sensitivity", "Settings", "analyse", "sensitivity"]
