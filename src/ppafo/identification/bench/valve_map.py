"""Valve map: flow over command; dead band, gain, saturation and hysteresis of a proportional valve.

    m = Cd A(u') C1 P_up psi(P_down / P_up),   Cd A = sign(u') k min(max(|u'| - u_0, 0), u_s - u_0)     (6), (7)
    u' = play(u; h):   y = max(u - h/2, min(u + h/2, y)),   u' = y / (1 - h/2)     ``spool_position``

m is the mass flow [kg/s], positive into chamber 1, u the command from -1 to 1, u_0 the dead band, u_s the command from
which the valve opens no further, h the width of the backlash, k the effective area per command [m^2]. The flow is
divided by the flow per area at the measured pressures, so that a sagging supply does not look like saturation.
Temperature and law of the gas, gains and zeros of the sensors are tolerances; the zero of the flow meter is observable
inside the dead band.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow import ZERO, GasAt, flow_tolerances, orifice_shape, read_flow, true_pressure
from ppafo.identification.bench.law import (
    BenchResult,
    PooledReadings,
    ReportedNumber,
    Values,
    recordings_of,
    result_of,
    solve,
    sought,
)
from ppafo.identification.bench.readings import check_no_wrong_reading, check_sources, meter_readings
from ppafo.identification.estimate import Verdict
from ppafo.identification.fit import SHAPE, Conflict
from ppafo.identification.least_squares import FitVariable, Flags
from ppafo.identification.source import RecordingSource, pool
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.opening import NODES
from ppafo.model.valves.proportional import spool_position
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats

PROCEDURE = "valve-map"
CHANNELS = ("command", "mass_flow", "upstream_pressure", "downstream_pressure")
PRESSURES = ("upstream_pressure", "downstream_pressure")
MINIMUM_SAMPLES = 12
"""Least number of readings to separate the unknowns of a map."""
_MINIMUM_RANGE = 0.5
"""Least range of the command [-] to separate dead band and gain."""
_SHUT, _HALF_OPEN = 0.05, 0.5
"""Fractions of the largest area [-]: below the first the valve is shut, above the second at least half open."""
_SATURATES = 0.02
"""Least distance of the saturation from the highest command [-] to be identified."""
_SMALL_COMMAND = 0.2
"""Typical magnitude [-] of a dead band or backlash, which may be 0."""
_FEWEST_BETWEEN = 2
"""Least number of readings between two nodes of a table."""
_FULL = "valve_map.full_area"
_NEARLY_FULL = 0.95
"""Least highest command [-] from which the area at full command is found."""
_GAIN, _PLAY, _SATURATION = "valve_map.gain", "valve_map.hysteresis", "valve_map.saturation_command"
_ROUND, _ROUNDS = "valve_map.round_off", (0.05, 0.005, 0.5)
"""Range over which corners of the opening are rounded, tried beside sharp ones: name, start and bounds [-]."""
_BETTER = 5.4
"""Increase of the log-likelihood [-] by one more number that happens by chance in one fit of 1,000."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sweep:
    """Readings of a valve, each (readings,): command [-], flow [kg/s], upstream and downstream pressure [Pa absolute].

    ``branch`` is 1 where the command rises, -1 where it falls. ``commands`` has the commands of each recording; the
    backlash is reset at the start of each.
    """

    commands: tuple[Floats, ...]
    command: Floats
    flow: Floats
    upstream: Floats
    downstream: Floats
    branch: Floats

    @property
    def highest_command(self) -> float:
        """Largest magnitude of a command [-]."""
        return float(np.abs(self.command).max())

    @property
    def is_two_way(self) -> bool:
        """True if the command both rises and falls, so that backlash is observable."""
        return bool((self.branch > 0).any() and (self.branch < 0).any())


def valve_map(
    sources: tuple[RecordingSource, ...],
    gas: GasAt,
    path: str = "valve",
    confidence: float = 0.95,
    tolerances: Tolerances = DEFAULTS,
    nodes: Sequence[float] = (),
) -> BenchResult:
    """Identify dead band [-], gain [m^2], saturation [-] and hysteresis [-] from command and flow; (6), (7).

    With ``nodes`` the opening is a table over the command in place of dead band, gain and saturation.

    Arguments:
        sources: recordings of command, mass flow, upstream and downstream pressure
        gas: gas of the bench
        path: path of the valve in a set, ``valves.main``
        confidence: confidence level of the intervals [-]
        tolerances: limits of the errors of the bench
        nodes: commands of the table between 0 and 1 [-], rising; none for a straight line beyond a dead band

    Returns:
        the estimates with intervals and verdicts, a summary and two panels

    Raises:
        IdentificationError: recordings that do not determine the map; names file, sample and remedy
    """
    sweep, is_possible, remarks = _swept(sources, tolerances)
    band = f"{path}.dead_band"
    openings = [f"{SECTION}.opening.opening_{number:02}" for number in range(1, len(nodes) + 1)]
    unknowns = _sought(sources, sweep, gas, band, nodes, openings)
    numbers = (
        *unknowns,
        *flow_tolerances(gas, tolerances, PRESSURES, float(np.abs(sweep.flow).max())),
    )

    def law(at: Values) -> Floats:
        true_upstream = true_pressure(at, "upstream_pressure", sweep.upstream)
        true_downstream = true_pressure(at, "downstream_pressure", sweep.downstream)
        spool = np.concatenate([spool_of(command, at[_PLAY]) for command in sweep.commands])
        if nodes:
            area = at[_FULL] * np.sign(spool) * table_of(nodes, [at[name] for name in openings], np.abs(spool))
        else:
            area = area_of_command(spool, at[band], at[_GAIN], at[_SATURATION], at[_ROUND])
        shape = np.abs(orifice_shape(true_upstream, true_downstream, gas.heat_capacity_ratio))
        flow = read_flow(at, gas, area * gas.choked_flow_constant * shape)
        # A play needs every command, so that readings that cannot be drop out of the flow alone.
        return np.where(is_possible, flow, sweep.flow)

    groups = (
        np.where(sweep.branch < 0.0, "falling commands", "rising commands").tolist(),
        np.where(sweep.command > 0.0, "commands to chamber 1", "commands to chamber 2").tolist(),
        np.where(np.abs(sweep.command) > 0.5 * sweep.highest_command, "large commands", "small commands").tolist(),
    )
    readings = PooledReadings(sweep.flow, ["mass_flow"] * sweep.flow.size, recordings_of(sources), groups)
    fitted, model = solve(law, readings, numbers, confidence)
    remedy = f"the opening is not the same in both directions, or not {'piece by piece ' if nodes else ''}linear"
    # Corners are refuted where an opening with rounded ones, tried in its place, explains the readings better.
    if not nodes and (fitted.conflict is None or fitted.conflict.number == SHAPE):
        free = [number for number in numbers if math.isinf(number.deviation) or number.name == ZERO]
        rounded, _ = solve(law, readings, (*free, sought(_ROUND, *_ROUNDS)), confidence)
        gain = rounded.log_likelihood - fitted.log_likelihood
        if gain > _BETTER:
            remedy = (
                f"an opening whose corners are rounded over {rounded.by_name[_ROUND]:.2g} of the command, through "
                "which gas flows from the first command on, explains them better; with nodes = [0.05, 0.1, ...] the "
                "opening is a table"
            )
            fitted = replace(fitted, conflict=Conflict("mass_flow", SHAPE, math.sqrt(2.0 * gain), 0.0))
    values, residuals = fitted.by_name, sweep.flow - model
    scatter = np.std(residuals) / np.abs(sweep.flow).max()
    no_play = "the command was swept in one direction only: the dead band includes half the width of any hysteresis"
    if nodes:
        reported = [ReportedNumber(_FULL, "m^2", "Effective area Cd A at full command")]
        reported += [
            ReportedNumber(name, "", f"Opening at a command of {node:g}", 1.0)
            for name, node in zip(openings, nodes, strict=True)
        ]
        found = f"a table of {len(nodes)} nodes, {1e6 * values[_FULL]:.4g} mm^2 at full command"
    else:
        reported = [
            ReportedNumber(band, "", "Dead band: command below which no gas flows, in both directions", _SMALL_COMMAND),
            ReportedNumber(_GAIN, "m^2", "Effective area Cd A per command beyond the dead band"),
        ]
        found = f"dead band {values[band]:.3g}, {1e6 * values[_GAIN]:.4g} mm^2 per command"
    # Near the highest command there is no saturation to be seen, and no backlash in commands of one direction.
    if not nodes and values[_SATURATION] < sweep.highest_command - _SATURATES:
        reported.append(ReportedNumber(_SATURATION, "", "Saturation: command beyond which the opening is constant"))
    if sweep.is_two_way:
        width = "Hysteresis: width between rising and falling command"
        reported.append(ReportedNumber(_PLAY, "", width, _SMALL_COMMAND))
    marks = []
    for role, name, on in (("rising", "fitted", sweep.branch == 1.0), ("falling", "", sweep.branch == -1.0)):
        if on.any():
            marks.append(readings_mark(f"command {role}", sweep.command[on], sweep.flow[on], role))
            marks.append(curve_mark(name, sweep.command[on], model[on]))
    axes = Kind("Command"), Kind("Flow", "kg/s", "mass flow")
    result = result_of(
        PROCEDURE,
        sources,
        fitted,
        reported,
        f"{sweep.command.size} readings; {found}; scatter {scatter:.2%} of the largest flow",
        with_residuals("Valve map", *axes, marks, sweep.command, residuals),
        remedy,
        (*remarks, *(() if sweep.is_two_way or nodes else (no_play,))),
    )
    return _with_nodes(result, band, nodes, openings) if nodes else result


def _swept(sources: tuple[RecordingSource, ...], tolerances: Tolerances) -> tuple[_Sweep, Flags, tuple[str, ...]]:
    """Return the readings, flags of those that are possible, and remarks on the others.

    Raises IdentificationError for channels that are missing or do not move, and for a command beyond 1.
    """
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES, moving=("command", "mass_flow"), absolute=PRESSURES)
    branches = []
    for source in sources:
        requested = source.recording["command"]
        wrong = np.flatnonzero(np.abs(requested) > 1.0 + 1e-9)
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'command' is {requested[wrong[0]]:g} at sample {wrong[0] + 1}; "
                f"must be from -1 to 1: scale the channel in a column map"
            )
        # The direction of the command, 0 before its first change, is that of the last change unless it was recorded.
        signs = np.sign(np.diff(requested, prepend=requested[0]))
        last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
        branches.append(source.recording["direction"] if "direction" in source.recording else signs[last])
    command, upstream, downstream = (pool(sources, name) for name in CHANNELS if name != "mass_flow")
    direction = np.sign(command * (upstream - downstream))
    measured, is_possible, remarks = meter_readings(sources, PROCEDURE, direction, tolerances.zero_of_flow)
    commands = tuple(source.recording["command"] for source in sources)
    sweep = _Sweep(commands, command, measured, upstream, downstream, np.concatenate(branches))
    return sweep, is_possible, remarks


def table_of(nodes: Sequence[float], openings: Sequence[float], size: Floats) -> Floats:
    """Return the opening [-] of a table for sizes of the command [-]; within the noise an opening may not fall."""
    rising = np.clip(np.maximum.accumulate(openings), 0.0, 1.0)
    return np.asarray(np.interp(size, [0.0, *nodes, 1.0], [0.0, *rising.tolist(), 1.0]))


def _with_nodes(result: BenchResult, band: str, nodes: Sequence[float], openings: Sequence[str]) -> BenchResult:
    """Return the result with openings that do not fall, and beside them commands and no dead band, for a set."""
    highest, estimates = 0.0, {estimate.path: estimate for estimate in result.estimates}
    usable = [estimates[path].verdict for path in openings if estimates[path].is_usable]
    # Shut and fully open are what a node may be; a table without one of its nodes is none.
    is_whole = all(estimates[path].is_usable or estimates[path].verdict == "at its bound" for path in openings)
    of_bound: Verdict = usable[0] if usable else "at its bound"
    unknown: Verdict = "not identifiable"
    for number, (path, node) in enumerate(zip(openings, nodes, strict=True), 1):
        found = estimates[path]
        highest = max(highest, found.value)
        beside = {f"{SECTION}.opening.command_{number:02}": node, band: 0.0}
        verdict = found.verdict if found.is_usable else of_bound
        low, high = min(found.low, highest), max(found.high, highest)
        found = replace(found, value=highest, low=low, high=high, beside=beside)
        estimates[path] = replace(found, verdict=verdict if is_whole else unknown)
    return replace(result, estimates=tuple(estimates.values()))


def area_of_command(
    command: Floats, dead_band: float, gain: float, saturation: float, round_off: float = 0.0
) -> Floats:
    """Return the effective area [m^2] for a spool command [-], positive towards chamber 1.

    With ``round_off`` [-] both corners are rounded over about this range of the command, and gas flows from 0 on.
    """
    size = np.abs(command)
    if round_off > 0.0:
        ends = [round_off * np.logaddexp(0.0, (size - end) / round_off) for end in (dead_band, saturation)]
        at_zero = [round_off * float(np.logaddexp(0.0, -end / round_off)) for end in (dead_band, saturation)]
        beyond = (ends[0] - at_zero[0]) - (ends[1] - at_zero[1])
    else:
        beyond = np.clip(size - dead_band, 0.0, max(saturation - dead_band, 0.0))
    return np.asarray(np.sign(command) * gain * beyond)


def spool_of(command: Floats, width: float) -> Floats:
    """Return the spool command [-] after backlash of full ``width`` [-]; the spool starts at the first command."""
    if width <= 0.0:
        return command
    position, positions = float(command[0]), []
    for requested in command.tolist():
        position = spool_position(position, requested, width)
        positions.append(position)
    return np.array(positions)


def _sought(
    sources: tuple[RecordingSource, ...],
    sweep: _Sweep,
    gas: GasAt,
    band: str,
    nodes: Sequence[float],
    openings: Sequence[str],
) -> tuple[FitVariable, ...]:
    """Return the unknowns with first guesses; ``band`` and ``openings`` are paths of the straight line or the table.

    Raises IdentificationError if the readings do not determine them.

    The effective area is flow divided by flow per area at the measured pressures, so that a sagging supply is not
    saturation.
    """
    span = float(np.ptp(sweep.command))
    if span < _MINIMUM_RANGE:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the command covers a range of {span:.3g}, not {_MINIMUM_RANGE:g} or more"
        )
    drivers = sweep.command, sweep.branch
    check_no_wrong_reading(sources, PROCEDURE, "mass_flow", drivers, np.ones(sweep.flow.size, dtype=bool))
    shape = np.abs(orifice_shape(sweep.upstream, sweep.downstream, gas.heat_capacity_ratio))
    if not shape.any():
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: both pressures are equal in all readings, so nothing drives a flow"
        )
    areas = np.where(shape > 0.0, sweep.flow / (gas.choked_flow_constant * np.maximum(shape, 1e-3)), 0.0)
    if float(sweep.command @ areas) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the flow into chamber 1 falls as the command rises; reverse the sign of "
            "'mass_flow' or 'command'"
        )
    size, largest, highest = np.abs(sweep.command), float(np.abs(areas).max()), sweep.highest_command
    play = (sought(_PLAY, 0.02, 0.0, 0.5, 0.1),) if sweep.is_two_way else ()
    if nodes:
        ends = [0.0, *nodes, 1.0]
        if highest < _NEARLY_FULL:
            raise IdentificationError(
                f"{sources[0].name}: {PROCEDURE}: nodes need readings up to full command, not to {highest:.3g}"
            )
        rises = min(np.diff(ends)) > 0.0
        if len(nodes) > NODES or not rises or np.histogram(size, ends)[0].min() < _FEWEST_BETWEEN:
            raise IdentificationError(
                f"{sources[0].name}: {PROCEDURE}: nodes = {list(nodes)}: must rise from above 0 to below 1, at most "
                f"{NODES}, with {_FEWEST_BETWEEN} readings or more between two of them and the ends 0 and 1"
            )
        near = [float(np.median(np.abs(areas[np.argsort(np.abs(size - node))[:3]]))) for node in nodes]
        starts = zip(openings, np.clip(np.array(near) / largest, 0.0, 1.0).tolist(), strict=True)
        return (sought(_FULL, largest, 0.0), *(sought(name, start, 0.0, 1.0, 1.0) for name, start in starts), *play)
    half = float(size[np.abs(areas) > _HALF_OPEN * largest].min())
    if not half > 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: at command 0, the valve has more than half of its largest flow; check "
            "the zero of channel 'command', or omit the reading at command 0"
        )
    shut = size[np.abs(areas) < _SHUT * largest]
    # Inside the bounds, so that the search can go either way.
    start = float(np.clip(np.median(shut) if shut.size else 0.0, 0.01 * half, 0.9 * half))
    return (
        sought(band, start, 0.0, half, highest),
        sought(_GAIN, 0.5 * largest / (half - start), 0.0),
        # Just inside the highest command, beyond which no reading changes with it.
        sought(_SATURATION, 0.02 * half + 0.98 * highest, half, highest * (1.0 + 1e-9), highest),
        *play,
    )
