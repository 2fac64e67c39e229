"""Bench procedures of a problem file: the laws in their order, their runs, and other units tried on their recordings.

The recommended order matters where one procedure uses results of another: torque and friction come first because they
need no others, the flow of the open valve comes before the valve map, and the leak comes last, because its chambers
must be known to be closed.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import get_args

from ppafo.errors import Faults, IdentificationError
from ppafo.identification.bench.flow import LARGEST_COEFFICIENT, FlowLaw, OpenValveFlowProblem
from ppafo.identification.bench.free_decay import FreeDecayProblem
from ppafo.identification.bench.law import BenchContext, BenchLaw, BenchResult
from ppafo.identification.bench.static_torque import FORCE, TORQUE, StaticTorqueProblem
from ppafo.identification.bench.valve_map import ValveMapProblem
from ppafo.identification.bench.vane_leak import SteadyLeakProblem, VaneLeakProblem
from ppafo.identification.estimate import WRONG_UNIT
from ppafo.identification.source import RecordingReader, RecordingSource, UsedRecording, double_use
from ppafo.parameters.parameter_set import atmospheric_pressure
from ppafo.signals.recording import CHANNELS, TIME
from ppafo.simulation.recorded.usual_errors import misread_units
from ppafo.units import split_pressure_kind
from ppafo.wording import nearest_name, percentage

_ROW_TIME = 1.0
"""Time between the rows of a table of steady readings without times [s]."""
_NEAR = 1.5
"""Largest ratio [-] of a discharge coefficient in another unit to the value of the set, for the unit to be accused."""
_FAR = 5.0
"""Ratio to the value of the set that another device may have, but a misread pressure too: psi as kPa makes 6.89 [-]."""
# Ratio to the value of the set that no device of its kind has [-], and units that are tried only for such a value.
_IMPOSSIBLE = 300.0
_OTHER_UNITS = ("N m", "Pa_d")
# Scatter of readings from which another unit is tried, and its ratio to the scatter with that unit to report it [-].
# The zero of a gauge pressure and the choked flow make a law of the absolute pressure fit one unit only.
_LARGE_SCATTER = 0.01
_SMOOTHER = 5.0
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
    that of the set, and in the other unit one near that of the set with no more scatter; or a value far from that of
    the set, and in the other unit one near it with far less scatter. Far less scatter alone is a remark, since another
    law may scatter less as well, and another device has other values. ``run`` repeats the procedure with other
    recordings.
    """
    channels = {name: channel for source in sources for name, channel in source.recording.channels.items()}
    # Recordings of a load or of a difference, which tell their unit by no scatter, have no meter beside them.
    others = [name for name, channel in channels.items() if channel.unit in _OTHER_UNITS]
    impossible = []
    far = []
    for estimate in result.estimates:
        ratio = estimate.value / (context.number(estimate.path) or math.inf) or 1.0
        is_coefficient = estimate.path.endswith(".discharge_coefficient") and estimate.value > LARGEST_COEFFICIENT
        if is_coefficient or (others and not 1.0 / _IMPOSSIBLE < ratio < _IMPOSSIBLE):
            impossible.append(estimate.path)
        elif not 1.0 / _FAR < ratio < _FAR:
            far.append(estimate.path)
    scatters = result.scatter > _LARGE_SCATTER
    if not (impossible or scatters):
        return result
    atmosphere = atmospheric_pressure(context.parameter_set)
    pressures = tuple(name for name, channel in channels.items() if channel.unit == "Pa")
    # Accusations first, then the least scatter.
    first = (True, math.inf)
    found = result
    # All absolute pressures together, then each one.
    for names in dict.fromkeys((pressures, *((name,) for name in (*pressures, *others)))):
        unit = channels[names[0]].unit.removesuffix("_d") if names else ""
        for mistake, factor in misread_units(unit, [channels[name].stated for name in names]):
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
            near = [
                path
                for path in (*impossible, *far)
                if 1.0 / _NEAR < tried[path].value / (context.number(path) or math.inf) < _NEAR
            ]
            is_smoother = scatters and _SMOOTHER * tried.scatter < result.scatter
            is_accused = bool(near) and (
                is_smoother or (near[0] in impossible and not tried.scatter > result.scatter + _ROUNDING)
            )
            rank = not is_accused, tried.scatter
            if not (is_accused or is_smoother) or rank >= first:
                continue
            first = rank
            text = f"with {' and '.join(names)} as {mistake}, a factor of {max(factor, 1.0 / factor):.4g}, "
            if is_accused and math.isnan(result.scatter):
                text += f"{impossible[0]} is near that of the set"
            else:
                shares = [percentage(each.scatter, 2) for each in (tried, result)]
                text += f"the scatter is {shares[0]} of the largest reading instead of {shares[1]}"
            found = replace(result, remarks=(*result.remarks, text))
            if is_accused:
                doubted = (replace(estimate, verdict=WRONG_UNIT, explanation=text) for estimate in result.estimates)
                found = replace(result, estimates=tuple(doubted))
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


def check_channels(where: str, problem: BenchProblem, read: Sequence[str]) -> None:
    """Raise IdentificationError with all channels that a law needs beside those ``read``; a force is a torque."""
    needed = [FORCE if name == TORQUE and FORCE in read and TORQUE not in read else name for name in problem.needed]
    spare = [name for name in read if name not in needed]
    asked = [
        f"a channel '{name} [{CHANNELS[name].unit}]', {CHANNELS[name].summary}{nearest_name(name, spare)}"
        for name in needed
        if name not in read
    ]
    if asked:
        has = f"channels read: {', '.join(read) or 'only time'}"
        raise IdentificationError(f"{where}: {problem.kind}: needs {' and '.join(asked)}; {has}")


def read_tasks(
    procedures: Sequence[BenchProblem], reader: RecordingReader
) -> tuple[list[tuple[BenchProblem, tuple[RecordingSource, ...], str]], tuple[UsedRecording, ...]]:
    """Return procedures in the recommended order, each with recordings and label, and the use of each recording.

    A recording may serve two different procedures. Raises IdentificationError if a procedure uses a recording twice.
    """
    tasks = []
    used = []
    for number, procedure in enumerate(procedures, start=1):
        kind = procedure.kind
        gas = getattr(procedure, "gas", None)
        row_time = _ROW_TIME if kind in procedure.steady else None
        # Steady readings have no times: each counts by itself.
        first, last = (getattr(procedure, name, None) for name in ("start", "end"))
        window = -math.inf if first is None else first, math.inf if last is None else last
        sources: list[RecordingSource] = []
        for recording in procedure.recordings:
            wrong = Faults()
            with wrong:
                sources += reader.read(recording, procedure.columns, row_time, gas)
            if wrong and procedure.columns is not None:
                # Missing channels of the map are said with what is wrong in it.
                mapped = reader.columns[procedure.columns]
                names = [name for name in mapped.channels if name != TIME]
                with wrong:
                    check_channels(recording, procedure, [*names, *(["direction"] if mapped.direction else [])])
            wrong.raise_all()
        tasks.append((procedure, tuple(sources), f"{reader.file}: procedure {number}, {kind}"))
        used += [
            UsedRecording(f"recording {at} of procedure {kind}", each.trace, each.recording, frozenset(), *window, kind)
            for at, each in enumerate(sources, start=1)
        ]
    if used_twice := double_use(used):
        raise IdentificationError(f"{reader.file}: {used_twice}")
    return sorted(tasks, key=lambda task: [*LAWS].index(task[0].kind)), tuple(used)


def run_procedure(sources: tuple[RecordingSource, ...], problem: BenchProblem, context: BenchContext) -> BenchResult:
    """Run a bench law on its recordings.

    Raises IdentificationError, with the name of the recording or the label of the procedure first.
    """
    wrong = Faults()
    sources = tuple(replace(source, user=problem.kind) for source in sources)
    for source in sources:
        with wrong:
            check_channels(source.name, problem, source.recording.names)
    gas_used = ""
    if isinstance(problem, FlowLaw):
        with wrong:
            gas_used = problem.gas_used(problem.gas_of(sources, context))
    wrong.raise_all()
    try:
        result = problem.run(sources, context)
    except IdentificationError as error:
        # An error of a file names the file; an error of a procedure names the label of the procedure in the problem.
        if str(error).startswith((context.label, *(source.name for source in sources))):
            raise
        raise IdentificationError(f"{context.label}: {error}") from error
    result = with_tried_units(result, sources, context, lambda again: problem.run(again, context))
    remarks = [*result.remarks]
    idle = [f"'{name}'" for name in context.tolerances.each_recording if name not in problem.own_errors]
    if idle and len(sources) > 1:
        remarks.append(f"bench.each_recording: {' and '.join(idle)} has no effect in {problem.kind}: one value for all")
    return replace(result, summary=f"{result.summary}{gas_used}", remarks=tuple(remarks))
