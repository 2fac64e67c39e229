"""Bench procedures of a problem file: the laws in their order, their runs, and other units tried on their recordings.

The recommended order matters where one procedure uses results of another: torque and friction come first because they
need no others, the flow of the open valve comes before the valve map, and the leak comes last, because its chambers
must be known to be closed.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, get_args

from ppafo.errors import IdentificationError, PpafoError, noted_in, raise_noted
from ppafo.identification.bench.flow import LARGEST_COEFFICIENT, FlowLaw, OpenValveFlowProblem
from ppafo.identification.bench.free_decay import FreeDecayProblem
from ppafo.identification.bench.law import BenchContext, BenchLaw, BenchResult
from ppafo.identification.bench.readings import check_channels
from ppafo.identification.bench.static_torque import FORCE, TORQUE, StaticTorqueProblem
from ppafo.identification.bench.valve_map import ValveMapProblem
from ppafo.identification.bench.vane_leak import SteadyLeakProblem, VaneLeakProblem
from ppafo.identification.estimate import WRONG_UNIT
from ppafo.identification.source import RecordingReader, RecordingSource, UsedRecording, double_use
from ppafo.parameters.parameter_set import atmospheric_pressure
from ppafo.signals.recording import TIME
from ppafo.simulation.recorded.usual_errors import misread_units
from ppafo.units import split_pressure_kind
from ppafo.wording import percentage

_ROW_TIME = 1.0
"""Time between the rows of a table of steady readings without times [s]."""
_NEAR = 1.5
"""Largest ratio [-] of a discharge coefficient in another unit to the value of the set, for the unit to be accused."""
_IMPOSSIBLE, _OTHER_UNITS = 300.0, ("N m", "Pa_d")
"""Ratio to the value of the set that no device of its kind has [-], and units that are tried only for such a value."""
_LARGE_SCATTER, _SMOOTHER = 0.01, 5.0
"""Scatter of readings from which another unit is tried, and its ratio to the scatter with that unit to report it [-].

The zero of a gauge pressure and the choked flow make a law of the absolute pressure fit one unit only.
"""
_ROUNDING = 1.0e-6
"""Difference of scatter [-] of readings that are computed, in two units, for flow that is choked throughout."""


def with_tried_units(
    result: BenchResult,
    sources: tuple[RecordingSource, ...],
    context: BenchContext,
    run: Callable[[tuple[RecordingSource, ...]], BenchResult],
) -> BenchResult:
    """Return the result, with the verdict of a wrong unit where a repetition in another unit does better.

    A unit is accused if the readings give a discharge coefficient that no orifice has, or a value hundreds of times
    that of the set, and in the other unit one near that of the set with no more scatter. Far less scatter in another
    unit of pressure is a remark, since another law may scatter less as well, and so is a value less far from the set,
    which may be of another device. ``run`` repeats the procedure with other recordings.
    """
    impossible = list[str]()
    channels = {name: channel for source in sources for name, channel in source.recording.channels.items()}
    # Recordings of a load or of a difference, which tell their unit by no scatter, have no meter beside them.
    others = [name for name, channel in channels.items() if channel.unit in _OTHER_UNITS]
    for estimate in result.estimates:
        ratio = estimate.value / (context.number(estimate.path) or math.inf)
        is_coefficient = estimate.path.endswith(".discharge_coefficient") and estimate.value > LARGEST_COEFFICIENT
        if is_coefficient or (others and not 1.0 / _IMPOSSIBLE < (ratio or 1.0) < _IMPOSSIBLE):
            impossible.append(estimate.path)
    if not (impossible or result.scatter > _LARGE_SCATTER):
        return result
    atmosphere = atmospheric_pressure(context.parameter_set)
    pressures = tuple(name for name, channel in channels.items() if channel.unit == "Pa")
    # All absolute pressures together, then each one.
    groups = dict.fromkeys((pressures, *((name,) for name in (*pressures, *others))))
    # Accusations first, then the least scatter.
    first, found = (True, math.inf), result
    for names, (mistake, factor) in (
        (group, each)
        for group in groups
        for each in misread_units(
            channels[group[0]].unit.removesuffix("_d") if group else "", [channels[name].stated for name in group]
        )
    ):
        again = []
        for source in sources:
            recording = source.recording
            for name in names:
                # From the zero of the stated unit.
                channel = recording.channels[name]
                zero = atmosphere if split_pressure_kind(channel.stated)[1] == "g" else 0.0
                recording = recording.with_channel(name, zero + (channel.values - zero) / factor, channel.unit)
            again.append(replace(source, recording=recording))
        try:
            tried = run(tuple(again))
        except IdentificationError:
            continue
        expected = [(tried[path].value, context.number(path) or math.inf) for path in impossible]
        is_near = any(1.0 / _NEAR < value / number < _NEAR for value, number in expected)
        is_accused = is_near and not tried.scatter > result.scatter + _ROUNDING
        is_smoother = result.scatter > _LARGE_SCATTER and _SMOOTHER * tried.scatter < result.scatter
        rank = not is_accused, tried.scatter
        if not (is_accused or is_smoother) or rank >= first:
            continue
        first = rank
        text = f"with {' and '.join(names)} as {mistake}, a factor of {max(factor, 1.0 / factor):.4g}, "
        text += (
            f"{impossible[0]} is near that of the set"
            if is_accused and math.isnan(result.scatter)
            else (
                f"the scatter is {percentage(tried.scatter, 2)} of the largest reading instead of "
                f"{percentage(result.scatter, 2)}"
            )
        )
        if is_accused:
            doubted = (replace(estimate, verdict=WRONG_UNIT, explanation=text) for estimate in result.estimates)
            found = replace(result, estimates=tuple(doubted))
        else:
            found = replace(result, remarks=(*result.remarks, text))
    return found


BenchProblem = (
    StaticTorqueProblem
    | FreeDecayProblem
    | OpenValveFlowProblem
    | ValveMapProblem
    | VaneLeakProblem
    | SteadyLeakProblem
)
"""Bench laws in the recommended order: each after those whose results it uses."""
LAWS: dict[str, type[BenchLaw]] = {get_args(law.__annotations__["kind"])[0]: law for law in get_args(BenchProblem)}
"""Bench laws by kind, in the recommended order."""


def check_needed_channels(where: str, problem: BenchProblem, read: Sequence[str]) -> None:
    """Raise IdentificationError for channels that a law needs beside those ``read``; a force is a torque."""
    needed = [FORCE if name == TORQUE and FORCE in read and TORQUE not in read else name for name in problem.needed]
    check_channels(f"{where}: {problem.kind}", needed, read)


class BenchTask(NamedTuple):
    """Identification procedure with its recordings, and the name used in error messages."""

    procedure: BenchProblem
    sources: tuple[RecordingSource, ...]
    label: str


def read_tasks(
    procedures: Sequence[BenchProblem], reader: RecordingReader
) -> tuple[list[BenchTask], tuple[UsedRecording, ...]]:
    """Read the recordings of procedures; return them in the recommended order, and the use of each recording.

    A recording may serve two different procedures. Raises IdentificationError if a procedure uses a recording twice.
    """
    tasks, used = list[BenchTask](), list[UsedRecording]()
    for number, procedure in enumerate(procedures, start=1):
        kind, gas = procedure.kind, getattr(procedure, "gas", None)
        row_time = _ROW_TIME if kind in procedure.steady else None
        sources: list[RecordingSource] = []
        for recording in procedure.recordings:
            wrong = list[PpafoError]()
            with noted_in(wrong):
                sources += reader.read(recording, procedure.columns, row_time, gas)
            if wrong and procedure.columns is not None:
                # Missing channels of the map are said with what is wrong in it.
                mapped = reader.columns[procedure.columns]
                names = [name for name in mapped.channels if name != TIME]
                with noted_in(wrong):
                    check_needed_channels(recording, procedure, [*names, *(["direction"] if mapped.direction else [])])
            raise_noted(wrong)
        tasks.append(BenchTask(procedure, tuple(sources), f"{reader.file}: procedure {number}, {kind}"))
    tasks.sort(key=lambda task: [*LAWS].index(task.procedure.kind))
    for task in tasks:
        kind = task.procedure.kind
        # Steady readings have no times: each counts by itself.
        first, last = (getattr(task.procedure, name, None) for name in ("start", "end"))
        window = -math.inf if first is None else first, math.inf if last is None else last
        for number, source in enumerate(task.sources, start=1):
            name = f"recording {number} of procedure {kind}"
            used.append(UsedRecording(name, source.trace, source.recording, frozenset(), *window, kind))
    if used_twice := double_use(used):
        raise IdentificationError(f"{reader.file}: {used_twice}")
    return tasks, tuple(used)


def run_procedure(sources: tuple[RecordingSource, ...], problem: BenchProblem, context: BenchContext) -> BenchResult:
    """Run a bench law on its recordings.

    Raises IdentificationError, with the name of the recording or the label of the procedure first.
    """
    wrong: list[PpafoError] = []
    sources = tuple(replace(source, user=problem.kind) for source in sources)
    for source in sources:
        with noted_in(wrong):
            check_needed_channels(source.name, problem, source.recording.names)
    gas_used = ""
    if isinstance(problem, FlowLaw):
        with noted_in(wrong):
            gas_used = problem.gas_used(problem.gas_of(sources, context))
    raise_noted(wrong)
    try:
        result = problem.run(sources, context)
    except IdentificationError as error:
        # An error of a file names the file; an error of a procedure names the label of the procedure in the problem.
        if str(error).startswith((context.label, *(source.name for source in sources))):
            raise
        raise IdentificationError(f"{context.label}: {error}") from error
    result = with_tried_units(result, sources, context, lambda again: problem.run(again, context))
    result = replace(result, summary=f"{result.summary}{gas_used}")
    idle = [f"'{name}'" for name in context.tolerances.each_recording if name not in problem.own_errors]
    if not idle or len(sources) == 1:
        return result
    remark = f"bench.each_recording: {' and '.join(idle)} has no effect in {problem.kind}: one value for all"
    return replace(result, remarks=(*result.remarks, remark))
