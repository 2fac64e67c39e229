"""How good is each controller on a leg that walks, and how far is it from the best that is possible?"""

from ppafo.studies.league.walking.bound import Reached, WalkingBound, walking_bound
from ppafo.studies.league.walking.entrants import WALKING_ENTRANTS, WalkingEntrant
from ppafo.studies.league.walking.measures import MEASURES
from ppafo.studies.league.walking.playing import PlayedStride, played
from ppafo.studies.league.walking.search import SearchGrid
from ppafo.studies.league.walking.standing import WalkingLeague, WalkingStanding
from ppafo.studies.league.walking.study import walking_league
from ppafo.studies.league.walking.task import WalkingTask, walking_task

__all__ = [
    "MEASURES",
    "WALKING_ENTRANTS",
    "PlayedStride",
    "Reached",
    "SearchGrid",
    "WalkingBound",
    "WalkingEntrant",
    "WalkingLeague",
    "WalkingStanding",
    "WalkingTask",
    "played",
    "walking_bound",
    "walking_league",
    "walking_task",
]
