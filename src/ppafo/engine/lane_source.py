"""Writes the source of the lane loop of one program: loads, calls and stores, with the rows as literals."""

from ppafo.engine.entries import ENTRY, HEADER, INLINE
from ppafo.engine.lane_rows import VECTOR, LaneRows, Rows, RunRows, indent
from ppafo.engine.lane_samples import control_loop, measure_sample, remember_commands, signals_before_start
from ppafo.engine.lane_step import find_begin, over_rows, plant_loop
from ppafo.engine.program import Program, link_program
from ppafo.engine.source_text import Collector, SourceCollector

SIGNATURE = (
    "float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], "
    "float64[:, :, ::1], int64, int64, int64, int64, float64, int64, int64, int64, int64, int64"
)
COMPILED = ENTRY.format(SIGNATURE)
SAME_MOMENT = 1.0e-9
"""Fractions of a step that are taken to be one instant."""
ARGUMENTS = (
    "states, parameters, signal_history, command_history, record, trace, "
    "first_step, step_count, steps_in_all, steps_per_sample, interval, last_record, next_record, trace_every, "
    "signal_delay, command_delay"
)


def lane_source(program: Program) -> str:
    """Source text of the module whose ``advance`` runs one block of this program."""
    return write_lanes(program, SourceCollector(INLINE))


def write_lanes(program: Program, collector: Collector, lanes: int = 0) -> str:
    """Source text of a program of some lanes, 0 for as many as fit; ``collector`` then has all that it is made from."""
    advance = lane_loop(program, collector, "advance", lanes)
    return f"{HEADER}\n\n{collector.text()}\n\n\n{advance}\n"


def lane_loop(program: Program, collector: Collector, name: str, lanes: int = 0) -> str:
    """The function that runs one block of a program, of some lanes, 0 for as many as fit.

    The function of one lane takes the first column of its arrays, however many there are. Samples are ``interval``
    steps apart, the first at 0 and the last with number ``last_record``.
    """
    link_program(program, collector)
    rows = LaneRows(program, collector, lanes)
    begin = find_begin(rows)
    # Most programs meet samples at the beginning of a step; others do a step from one sample to the next.
    step = between_samples(rows) if program.samples_inside else [*at_sample(rows, "step_index"), *plant_loop(rows)]
    start = rows.over_lanes([f"{rows.before} = 0.0"]) if program.is_parted else []
    body = [
        f"x = empty_rows({rows.count}, {rows.lanes})",
        # A literal width lets the compiler unroll the loops of a small block.
        f"width = {rows.lanes if rows.lanes <= VECTOR else 'states.shape[1]'}",
        *over_rows(len(rows.state_at), "x[row, lane] = states[row, lane]"),
        *over_rows(len(rows.parameter_at), f"x[{len(rows.state_at)} + row, lane] = parameters[row, lane]"),
        *begin,
        "due = next_record * interval",
        "goal = 1.0",
        "for step_index in range(first_step, first_step + step_count):",
        *indent([*signals_before_start(rows), *control_loop(rows), *remember_commands(rows), *start, *step]),
        # The sample at the end of the run.
        "if first_step + step_count == steps_in_all:",
        "    step_index = steps_in_all",
        *indent(at_sample(rows, "step_index")),
        *over_rows(len(rows.state_at), "states[row, lane] = x[row, lane]"),
    ]
    return "\n".join([COMPILED, f"def {name}({ARGUMENTS}):", *indent(body)])


def between_samples(rows: Rows) -> list[str]:
    """A step in which samples may be due at any time."""
    return [
        "reached = 0.0",
        "while reached < 1.0:",
        *indent(at_sample(rows, "(step_index + reached)")),
        f"    goal = due - step_index if due < step_index + {1.0 - SAME_MOMENT!r} else 1.0",
        *indent(plant_loop(rows)),
        "    reached = goal",
    ]


def at_sample(rows: Rows, moment: str) -> list[str]:
    """What is done at a sample, if one is due at ``moment``, counted in steps."""
    is_metered = bool(rows.program.meters or rows.program.traced)
    # A program without meters takes no more samples than there is room for.
    last = "last_record" if is_metered else "record.shape[0] - 1"
    if is_metered or isinstance(rows, RunRows):
        take = measure_sample(rows, moment)
    else:
        take = [
            "for row in range(record.shape[1]):",
            f"    for lane in range({'1' if rows.lanes == 1 else 'record.shape[2]'}):",
            "        record[next_record, row, lane] = x[row, lane]",
        ]
    return [
        f"if next_record <= {last} and due <= {moment} + {SAME_MOMENT!r}:",
        *indent(take),
        "    next_record += 1",
        "    due = next_record * interval",
    ]
