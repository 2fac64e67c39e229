"""How sure is a number? Draws until the interval of a statistic is narrow enough."""

from ppafo.studies.monte_carlo.estimate import Look, MonteCarlo, StoppingRule, draw_until
from ppafo.studies.monte_carlo.study import monte_carlo

__all__ = ["Look", "MonteCarlo", "StoppingRule", "draw_until", "monte_carlo"]
