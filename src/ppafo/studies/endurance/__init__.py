"""How long a bottle of gas lasts, how cold it gets, and why it ends."""

from ppafo.studies.endurance.bottle import Bottle, list_bottles, load_bottle
from ppafo.studies.endurance.discharge import Discharge, discharge
from ppafo.studies.endurance.draw import Draw, Schedule, draw_of_numbers, draw_of_recording
from ppafo.studies.endurance.reuse import Reuse, parse_reuse, reuse
from ppafo.studies.endurance.study import Endurance, endurance

__all__ = [
    "Bottle",
    "Discharge",
    "Draw",
    "Endurance",
    "Reuse",
    "Schedule",
    "discharge",
    "draw_of_numbers",
    "draw_of_recording",
    "endurance",
    "list_bottles",
    "load_bottle",
    "parse_reuse",
    "reuse",
]
