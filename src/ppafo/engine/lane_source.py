"""Writes the source of the lane loop of one program."""

from ppafo.engine.generator import StepText
from ppafo.engine.loop_text import lane_loop
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector

HEADER = '''"""Generated from the functions of ppafo; their hash is in the file name. Not to be edited."""

import math
from collections import namedtuple

import numpy as np
from numba import njit, types
from numba.extending import intrinsic


@intrinsic(prefer_literal=True)
def empty_rows(typing, rows, lanes):
    """An array (rows, lanes) that begins on a line of the cache, in a function that takes the widest vectors."""

    def write(context, builder, signature, arguments):
        from numba.np.arrayobj import make_array, populate_array

        def number(value):
            return context.get_constant(types.intp, value)

        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        height, width = rows.literal_value, lanes.literal_value
        line = context.get_constant(types.uint32, 64)
        memory = context.nrt.meminfo_alloc_aligned(builder, number(8 * width * height), line)
        array = make_array(signature.return_type)(context, builder)
        data = builder.bitcast(context.nrt.meminfo_data(builder, memory), array.data.type)
        populate_array(array, data, [number(height), number(width)], [number(8 * width), number(8)], number(8), memory)
        return array._getvalue()

    return types.float64[:, ::1](rows, lanes), write
'''
"""What a program begins with. By itself Numba lets an array begin where a vector of 512 bits lies on two lines of the
cache, and takes half of such a vector. ``empty_rows`` asks for both; C compilers are told in other words."""
INLINE = '@njit(forceinline=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)'
"""How what the loop calls is compiled: into it, and not to be called from Python, which would take a third longer."""

SIGNATURE = (
    '"void(float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], '
    'float64[:, :, ::1], int64, int64, int64, int64, float64, int64, int64, int64, int64, int64)"'
)
COMPILED = f'@njit({SIGNATURE}, cache=True, nogil=True, error_model="numpy")'
ARGUMENTS = (
    "states, parameters, signal_history, command_history, record, trace, "
    "first_step, step_count, steps_in_all, steps_per_sample, interval, last_record, next_record, trace_every, "
    "signal_delay, command_delay"
)


def lane_source(program: Program) -> str:
    """Source text of the module whose ``advance`` runs one block of this program."""
    return write_lanes(program, SourceCollector(INLINE))


def write_lanes(program: Program, collector: SourceCollector, lanes: int = 0) -> str:
    """Source text of a program of some lanes, 0 for as many as fit; ``collector`` then has all that it is made from."""
    advance = lane_loop(StepText(program, collector), COMPILED, "advance", ARGUMENTS, lanes)
    return f"{HEADER}\n\n{collector.text()}\n\n\n{advance}\n"
