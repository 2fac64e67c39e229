"""Writes the source of the lane loop of one program: loads, calls and stores, with the rows as literals."""

from ppafo.engine.lane_control import control_loop, follow_loop, remember_commands, remember_signals
from ppafo.engine.lane_meters import measure_loop
from ppafo.engine.lane_rows import LaneRows, indented, lanes_of
from ppafo.engine.lane_step import plant_loop
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector

HEADER = '''"""Generated from the functions of ppafo; their hash is in the file name. Not to be edited."""

import math
from collections import namedtuple

import numpy as np
from numba import njit

FAST = {"reassoc", "contract", "arcp", "nsz", "afn"}
'''
INLINE = '@njit(forceinline=True, fastmath=FAST, error_model="numpy")'
SIGNATURE = (
    '"void(float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], '
    'float64[:, :, ::1], int64, int64, int64, int64, int64, int64, int64, int64, int64)"'
)
COMPILED = f'@njit({SIGNATURE}, cache=True, nogil=True, fastmath=FAST, error_model="numpy")'
ARGUMENTS = (
    "states, parameters, signal_history, command_history, record, trace, "
    "first_step, step_count, steps_in_all, steps_per_sample, record_every, measure_every, trace_every, "
    "signal_delay, command_delay"
)


def lane_source(program: Program) -> str:
    """Source text of the module whose ``advance`` runs one block of this program."""
    collector = SourceCollector(INLINE)
    rows = LaneRows(program, collector)
    loop = measured_steps(rows) if program.is_metered else plain_steps(rows)
    body = [
        COMPILED,
        f"def advance({ARGUMENTS}):",
        *indented(
            [
                f"x = np.empty(({rows.count}, {lanes_of(program)}))",
                "width = states.shape[1]",
                *_copy("x", 0, "states", 0, len(rows.state_at)),
                *_copy("x", len(rows.state_at), "parameters", 0, len(rows.parameter_at)),
                *loop,
                *_copy("states", 0, "x", 0, len(rows.state_at)),
            ]
        ),
    ]
    return f"{HEADER}\n\n{collector.text()}\n\n\n" + "\n".join(body) + "\n"


def plain_steps(rows: LaneRows) -> list[str]:
    """The loop over steps."""
    return [
        "for step_index in range(first_step, first_step + step_count):",
        *indented([*begin_step(rows), *plant_loop(rows), *follow_loop(rows)]),
    ]


def measured_steps(rows: LaneRows) -> list[str]:
    """The loop over steps with meters; the last call goes round once more, for the sample at the end of the run."""
    return [
        "last_step = first_step + step_count",
        "for step_index in range(first_step, last_step + 1 if last_step == steps_in_all else last_step):",
        "    if step_index < steps_in_all:",
        *indented(begin_step(rows), 2),
        *indented(measure_loop(rows)),
        "    if step_index < steps_in_all:",
        *indented([*plant_loop(rows), *follow_loop(rows)], 2),
    ]


def begin_step(rows: LaneRows) -> list[str]:
    """What happens at the beginning of a step, before time goes on."""
    return [*remember_signals(rows), *control_loop(rows), *RECORD, *remember_commands(rows)]


RECORD = [
    "if record_every > 0 and step_index % record_every == 0:",
    "    for row in range(record.shape[1]):",
    "        for lane in range(record.shape[2]):",
    "            record[step_index // record_every, row, lane] = x[row, lane]",
]


def _copy(target: str, target_row: int, source: str, source_row: int, rows: int) -> list[str]:
    return [
        f"for row in range({rows}):",
        "    for lane in range(width):",
        f"        {target}[{target_row} + row, lane] = {source}[{source_row} + row, lane]",
    ]
