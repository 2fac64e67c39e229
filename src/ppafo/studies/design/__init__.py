"""Which valve, actuator, pressure and gains: the designs that no other beats in error, gas and mass at once."""

from ppafo.studies.design.problem import DesignProblem, load_design
from ppafo.studies.design.result import Design, DesignPoint
from ppafo.studies.design.study import run_design

__all__ = ["Design", "DesignPoint", "DesignProblem", "load_design", "run_design"]
