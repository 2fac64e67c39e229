"""Writes the source of the lane loop of one program."""

from ppafo.engine.entries import HEADER, INLINE
from ppafo.engine.generator import StepText
from ppafo.engine.lane_rows import ARGUMENTS, COMPILED
from ppafo.engine.loop_text import lane_loop
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector


def lane_source(program: Program) -> str:
    """Source text of the module whose ``advance`` runs one block of this program."""
    return write_lanes(program, SourceCollector(INLINE))


def write_lanes(program: Program, collector: SourceCollector, lanes: int = 0) -> str:
    """Source text of a program of some lanes, 0 for as many as fit; ``collector`` then has all that it is made from."""
    advance = lane_loop(StepText(program, collector), COMPILED, "advance", ARGUMENTS, lanes)
    return f"{HEADER}\n\n{collector.text()}\n\n\n{advance}\n"
