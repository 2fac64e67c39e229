"""A scenario or a walk as a WebAssembly module, for a page that simulates; this is how such a module is called.

``module_of(item)`` gives the ``wasm`` bytes and a ``description``, plain data for JSON that tells of each setting,
channel and metric what a person and a page must know. A module imports nothing. It needs 128-bit vectors, which
every browser in use has; without them ``WebAssembly.validate`` says false. All numbers are 64-bit floats in SI units,
pressures absolute; all arguments and results are 32-bit integers, and pointers are bytes from the start of ``memory``.

Memory
    ``reserve(bytes)`` gives the place of so many bytes, or 0 where there are no more; places are multiples of 16. The
    memory may grow in ``reserve``, ``run`` and ``ensemble``: views (``Float64Array``) are made anew after each of
    them. ``release(place)`` gives back everything that was reserved from that place on.

One run, with S settings, C channels (the first is ``time``) and M metrics as listed in the description
    ``check(settings)`` is -1 where the S numbers at ``settings`` are good, the place of the first one that is out of
    range or contradicts another, or S where they need other functions than there are here: what is ``kept`` was not,
    or samples come more often than steps.
    ``samples(settings)`` is the number of samples N of the run, 0 where ``check`` is not -1.
    ``run(settings, columns, metrics, good)`` returns a status. It writes C columns of N numbers, one after the other,
    and M metrics, NaN where one has no value, and all of them where the run was not completed. ``good`` is the place of
    one 32-bit integer: the number of samples from the first on that hold, N where the run was completed.

Many runs
    ``ensemble(settings, runs, metrics, statuses, channel, every, places, traces)`` takes ``runs`` times S settings,
    writes ``runs`` times M metrics and ``runs`` 32-bit statuses, and returns 0, or 4 where memory does not suffice.
    With ``channel`` -1 the last three are 0. Otherwise it also writes ``runs`` times ``places`` numbers: every
    ``every``-th sample of a channel, from the first on. Channels count as in the description without ``time``, so
    that 0 is the first after it; with ``channel`` -2 it writes all of them, for each run ``places`` numbers of one
    after those of the other. Beyond the last sample of a run, and in runs that were not completed, there is NaN, as
    in the metrics of the latter. Runs are quickest eight at a time with the same ``run``, delay and
    ``controller.period``.

Statuses: 0 completed, 1 diverged, 2 diverged in too many parts of a step, 3 refused by ``check``, 4 no memory.

What a module gives has the bits of ``ppafo.simulate`` for the same settings, in every sample of every channel; metrics
differ by rounding, as those of an ensemble do. Each instance has a memory of its own: one for each worker.
"""

from dataclasses import dataclass
from typing import Any, final

from ppafo.exports.c_library import library_of
from ppafo.exports.loading import Exportable
from ppafo.exports.wasm.building import program_of
from ppafo.exports.wasm.description import description_of


@final
@dataclass(frozen=True, slots=True)
class WasmModule:
    """The bytes of a module, and the description of what it simulates (plain data, see ``description.py``)."""

    wasm: bytes
    description: dict[str, Any]


def module_of(item: Exportable) -> WasmModule:
    """A scenario or a walk as a module.

    Its program comes with the package where a shipped scenario or walk has the same one, whatever its numbers are, and
    is built otherwise. ProgramError where that needs the package ``ziglang``, which is not there, or where something in
    it cannot be translated; ScenarioError for a walk that cannot be exported.
    """
    library = library_of(item)
    return WasmModule(program_of(library), description_of(item, library))
