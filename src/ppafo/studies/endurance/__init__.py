"""How long a bottle of gas lasts, how cold it gets, and why it ends."""

from ppafo.studies.endurance.bottle import Bottle, list_bottles, load_bottle
from ppafo.studies.endurance.discharge import Discharge, discharge
from ppafo.studies.endurance.draw import Draw, Schedule, draw_of_numbers, draw_of_recording
from ppafo.studies.endurance.of_walk import endurance_of_walk, endurance_of_walked
from ppafo.studies.endurance.reuse import Reuse, ReusePlan, parse_reuse, reuse
from ppafo.studies.endurance.study import Endurance, endurance
from ppafo.studies.endurance.walked import Walked, is_walk_folder, read_walked, walked

__all__ = [
    "Bottle",
    "Discharge",
    "Draw",
    "Endurance",
    "Reuse",
    "ReusePlan",
    "Schedule",
    "Walked",
    "discharge",
    "draw_of_numbers",
    "draw_of_recording",
    "endurance",
    "endurance_of_walk",
    "endurance_of_walked",
    "is_walk_folder",
    "list_bottles",
    "load_bottle",
    "parse_reuse",
    "read_walked",
    "reuse",
    "walked",
]
