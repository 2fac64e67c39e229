"""Writes the source of the loop of a single run, for exports: the lanes' loop for one, with the same bits.

Groups are NamedTuples under their own names. They are taken from what a run is made of once, and its state is written
back at the end; between them stands what happens in a step, in the order in which it happens.
"""

import re

from ppafo.engine.lane_rows import KEPT, RunRows, indent
from ppafo.engine.lane_samples import control_loop, remember_commands, signals_before_start
from ppafo.engine.lane_source import at_sample, between_samples
from ppafo.engine.lane_step import find_begin, plant_loop
from ppafo.engine.program import Program, link_program
from ppafo.engine.rows import leaf_paths, row_expression
from ppafo.engine.source_text import Collector

LOOP_ARRAYS = {"signal_history": 3, "command_history": 2}
"""Arrays of a loop behind its states, parameters and samples, with how many extents they have; the last one is 1."""
LOOP_NUMBERS = {
    **dict.fromkeys(("first_step", "step_count", "steps_in_all", "steps_per_sample"), "int64"),
    "interval": "float64",
    **dict.fromkeys(("last_record", "next_record", "signal_delay", "command_delay"), "int64"),
}
NEEDS_PARTS = "needs_parts"
"""The last argument of a loop that has both steps: 1 where the error decides about the parts of a step, else 0."""


def run_loop(program: Program, collector: Collector, outputs: str, in_parts: Program | None) -> str:
    """The function ``advance`` that takes one run of a program through its steps, and the row ``outputs`` of a sample.

    Its ``states`` and ``parameters`` have the groups of a run, ``samples`` has the ``last`` sample and that ``before``.
    It is for translation alone, as it writes into these. With ``in_parts``, the same program with steps that their
    error divides, it has both, and ``needs_parts`` chooses.
    """
    link_program(program, collector)
    rows = RunRows(program, collector, outputs)
    others = [] if in_parts is None else [RunRows(in_parts, collector, outputs)]
    body = [repr("What the run is made of, and where it stands.")]
    for given, groups in (("parameters", program.parameter_rows()), ("states", program.state_rows())):
        # A group without numbers is not in the row of all.
        body += [f"{name} = {f'{given}.{name}' if leaf_paths(row, name) else '()'}" for name, row in groups.items()]
    body += [*find_begin(rows), *_all_steps(rows, others), repr("Where it stands now.")]
    body += [f"states.{name} = {name}" for name, row in program.state_rows().items() if leaf_paths(row, name)]
    text = "\n".join(body)
    # C wants a struct to exist before one of its members is set.
    first = []
    for item in (rows, *others):
        for group, row in item.program.step_rows().items():
            if re.search(rf"{KEPT}\.{group}\.[\w.]+(\[\d+\])? = ", text):
                zeros = dict.fromkeys(leaf_paths(row, group), "0.0")
                first.append(f"{group} = {row_expression(row, group, zeros, collector.add)}")
    arguments = ["states", "parameters", "samples", *LOOP_ARRAYS, *LOOP_NUMBERS, *([NEEDS_PARTS] if others else [])]
    sample = f"{outputs} = namedtuple({outputs!r}, {['time', *program.traced]!r})"
    whole = "\n".join([sample, f"def advance({', '.join(arguments)}):", *indent([*dict.fromkeys(first), *body])])
    # A single run is lane 0 of the histories, and its groups are local names.
    return re.sub(r"\blane\b", "0", re.sub(rf"\b{KEPT}\.", "", whole))


def _all_steps(rows: RunRows, others: list[RunRows]) -> list[str]:
    """The loop over steps, with the sample at the end of the run as an iteration without a step."""
    program = rows.program
    control = [repr("Sense and decide."), *control_loop(rows)] if control_loop(rows) else []
    begin = [*signals_before_start(rows), *control, *remember_commands(rows)]
    if program.is_parted or others:
        begin.append(f"{rows.before} = 0.0")
    sample = [] if program.samples_inside else at_sample(rows, "step_index")
    whole, *in_parts = [
        between_samples(item) if program.samples_inside else plant_loop(item) for item in (rows, *others)
    ]
    step = [repr("A step of valve, gas and vane."), *whole]
    if in_parts:
        parted = [repr("A step of valve, gas and vane, in parts that its error allows."), *in_parts[0]]
        once = [repr("A step of valve, gas and vane as a whole."), *whole]
        step = [f"if {NEEDS_PARTS} == 1:", *indent(parted), "else:", *indent(once)]
    at_end = at_sample(rows, "step_index")
    return [
        "due = next_record * interval",
        "goal = 1.0",
        "beyond = first_step + step_count",
        "for step_index in range(first_step, beyond + (1 if beyond == steps_in_all else 0)):",
        "    if step_index < beyond:",
        *indent(begin, 2),
        "    " + repr("A sample, if one is due."),
        *indent(sample or ["if step_index == beyond:", *indent(at_end)]),
        "    if step_index < beyond:",
        *indent(step, 2),
    ]
