"""How good is each controller on a task, and how far is it from the best that is possible?"""

from ppafo.studies.league.bound_solver import Optimum
from ppafo.studies.league.entrants import ENTRANTS, Entrant
from ppafo.studies.league.learning import Learning, LearningLaw, learn
from ppafo.studies.league.lower_bound import LowerBound, lower_bound, played
from ppafo.studies.league.standing import League, Standing
from ppafo.studies.league.study import DRAWS, TASK, league

__all__ = [
    "DRAWS",
    "ENTRANTS",
    "TASK",
    "Entrant",
    "League",
    "Learning",
    "LearningLaw",
    "LowerBound",
    "Optimum",
    "Standing",
    "league",
    "learn",
    "lower_bound",
    "played",
]
