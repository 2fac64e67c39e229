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
from typing import Literal, NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow import (
    VALVE,
    ZERO,
    FlowLaw,
    GasAt,
    flow_tolerances,
    orifice_shape,
    read_flow,
    true_pressure,
)
from ppafo.identification.bench.law import (
    BenchContext,
    BenchResult,
    PooledReadings,
    Values,
    recordings_of,
    reported,
    result_of,
    solve,
    sought,
)
from ppafo.identification.bench.readings import check_no_wrong_reading, check_sources, meter_readings
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.fit import SHAPE, Conflict
from ppafo.identification.least_squares import FitNumber, Flags
from ppafo.identification.source import RecordingSource, pool
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.opening import NODES
from ppafo.model.valves.proportional import spool_position
from ppafo.parameters.records import keyed
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats

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
_HYSTERESIS = reported(_PLAY, "", "Hysteresis: width between rising and falling command", _SMALL_COMMAND)
_ROUND, _ROUNDS = "valve_map.round_off", (0.05, 0.005, 0.5)
"""Range over which corners of the opening are rounded, tried beside sharp ones: name, start and bounds [-]."""
_BETTER = 5.4
"""Increase of the log-likelihood [-] by one more number that happens by chance in one fit of 1,000."""


class _Sweep(NamedTuple):
    """Readings of a valve: command [-], flow [kg/s], pressures [Pa], branch (1 rising, -1 falling), area [m^2].

    ``is_possible`` flags the readings that can be, ``remarks`` are on the others.
    """

    command: Floats
    flow: Floats
    upstream: Floats
    downstream: Floats
    branch: Floats
    areas: Floats
    is_two_way: bool
    is_possible: Flags
    remarks: tuple[str, ...]


def _swept(sources: tuple[RecordingSource, ...], gas: GasAt, zero: float) -> _Sweep:
    """Return the readings. Raises IdentificationError for those that do not determine a map.

    ``zero`` is the limit of the zero of the meter, as a fraction of its largest reading [-].
    """
    where = sources[0].where
    check_sources(sources, CHANNELS, MINIMUM_SAMPLES, ("command", "mass_flow"), absolute=PRESSURES)
    branches = []
    for source in sources:
        requested = source.recording["command"]
        wrong = np.flatnonzero(np.abs(requested) > 1.0 + 1e-9)
        if wrong.size:
            source.refuse(
                f"channel 'command' is {requested[wrong[0]]:g} at sample {wrong[0] + 1}; must be from -1 to 1"
            )
        # The direction of the command, 0 before its first change, is that of the last change unless recorded.
        signs = np.sign(np.diff(requested, prepend=requested[0]))
        last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
        branches.append(source.recording["direction"] if "direction" in source.recording else signs[last])
    command, upstream, downstream = (pool(sources, name) for name in CHANNELS if name != "mass_flow")
    direction = np.sign(command * (upstream - downstream))
    measured, is_possible, remarks = meter_readings(sources, direction, zero)
    branch, span = np.concatenate(branches), float(np.ptp(command))
    if span < _MINIMUM_RANGE:
        raise IdentificationError(f"{where}: the command covers a range of {span:.3g}, not {_MINIMUM_RANGE:g} or more")
    check_no_wrong_reading(sources, "mass_flow", (command, branch), np.ones(branch.size, dtype=bool))
    shape = np.abs(orifice_shape(upstream, downstream, gas.heat_capacity_ratio))
    if not shape.any():
        raise IdentificationError(f"{where}: both pressures are equal in all readings, so nothing drives a flow")
    # Flow over flow per area at the measured pressures, so that a sagging supply is no saturation.
    areas = np.where(shape > 0.0, measured / (gas.choked_flow_constant * np.maximum(shape, 1e-3)), 0.0)
    if float(command @ areas) <= 0.0:
        raise IdentificationError(
            f"{where}: the flow into chamber 1 falls as the command rises: a wrong sign of 'mass_flow' or 'command'"
        )
    # Backlash is seen where the command both rises and falls.
    is_two_way = bool((branch > 0).any() and (branch < 0).any())
    return _Sweep(command, measured, upstream, downstream, branch, areas, is_two_way, is_possible, remarks)


@dataclass(frozen=True, kw_only=True)
class ValveMapProblem(FlowLaw):
    """Table of procedure valve-map: dead band, gain, saturation and hysteresis from flow over command."""

    needed = CHANNELS
    steady = ("valve-map",)
    kind: Literal["valve-map"]
    valve: str | None = keyed(VALVE, None)
    nodes: tuple[float, ...] = keyed("commands of a table of openings; default: straight beyond a dead band", ())

    def run(self, sources: tuple[RecordingSource, ...], context: BenchContext) -> BenchResult:
        """Identify dead band [-], gain [m^2], saturation [-] and hysteresis [-] from command and flow; (6), (7).

        With nodes the opening is a table over the command in place of dead band, gain and saturation. Raises
        IdentificationError for recordings that do not determine the map.
        """
        gas, path = self.gas_of(sources, context), context.valve_path(self.valve)
        sweep = _swept(sources, gas, context.tolerances.zero_of_flow)
        command, measured, branch, is_two_way = sweep.command, sweep.flow, sweep.branch, sweep.is_two_way
        highest = float(np.abs(command).max())
        band = f"{path}.dead_band"
        openings = [f"{SECTION}.opening.opening_{number:02}" for number in range(1, len(self.nodes) + 1)]
        numbers = (
            *self._unknowns(sources[0].where, np.abs(command), np.abs(sweep.areas), band, openings),
            # There is no backlash in commands of one direction.
            *((sought(_HYSTERESIS, 0.02, 0.0, 0.5, 0.1),) if is_two_way else ()),
            *flow_tolerances(gas, context.tolerances, PRESSURES, float(np.abs(measured).max())),
        )

        def law(at: Values) -> Floats:
            true_upstream = true_pressure(at, "upstream_pressure", sweep.upstream)
            true_downstream = true_pressure(at, "downstream_pressure", sweep.downstream)
            spool = np.concatenate([spool_of(item.recording["command"], at[_PLAY]) for item in sources])
            if self.nodes:
                area = at[_FULL] * np.sign(spool) * table_of(self.nodes, [at[name] for name in openings], np.abs(spool))
            else:
                area = area_of_command(spool, at[band], at[_GAIN], at[_SATURATION], at[_ROUND])
            shape = np.abs(orifice_shape(true_upstream, true_downstream, gas.heat_capacity_ratio))
            flow = read_flow(at, gas, area * gas.choked_flow_constant * shape)
            # A play needs every command, so that readings that cannot be drop out of the flow alone.
            return np.where(sweep.is_possible, flow, measured)

        groups = (
            np.where(branch < 0.0, "falling commands", "rising commands").tolist(),
            np.where(command > 0.0, "commands to chamber 1", "commands to chamber 2").tolist(),
            np.where(np.abs(command) > 0.5 * highest, "large commands", "small commands").tolist(),
        )
        readings = PooledReadings(measured, ["mass_flow"] * measured.size, recordings_of(sources), groups)
        fitted, model = solve(law, readings, numbers, self.confidence)
        reason = ""
        # Corners are refuted where an opening with rounded ones, tried in its place, explains the readings better.
        if not self.nodes and (fitted.conflict is None or fitted.conflict.number == SHAPE):
            free = [number for number in numbers if math.isinf(number.deviation) or number.name == ZERO]
            rounded, _ = solve(law, readings, (*free, sought(_ROUND, *_ROUNDS)), self.confidence)
            gain = rounded.log_likelihood - fitted.log_likelihood
            if gain > _BETTER:
                reason = (
                    f"an opening whose corners are rounded over {rounded.by_name[_ROUND]:.2g} of the command, through "
                    "which gas flows from the first command on, explains them better (nodes make a table of it)"
                )
                fitted = replace(fitted, conflict=Conflict("mass_flow", SHAPE, math.sqrt(2.0 * gain), 0.0))
        values, residuals = fitted.by_name, measured - model
        scatter = np.std(residuals) / np.abs(measured).max()
        no_play = "the command was swept in one direction only: the dead band includes half the width of any hysteresis"
        if self.nodes:
            found = f"a table of {len(self.nodes)} nodes, {1e6 * values[_FULL]:.4g} mm^2 at full command"
        else:
            found = f"dead band {values[band]:.3g}, {1e6 * values[_GAIN]:.4g} mm^2 per command"
        marks = []
        for role, name, on in (("rising", "fitted", branch == 1.0), ("falling", "", branch == -1.0)):
            if on.any():
                marks.append(readings_mark(f"command {role}", command[on], measured[on], role))
                marks.append(curve_mark(name, command[on], model[on]))
        axes = Kind("Command"), Kind("Flow", "kg/s", "mass flow")
        result = result_of(
            sources,
            fitted,
            f"{command.size} readings; {found}; scatter {scatter:.2%} of the largest flow",
            with_residuals("Valve map", *axes, marks, command, residuals),
            reason,
            (*sweep.remarks, *(() if is_two_way or self.nodes else (no_play,))),
        )
        if not self.nodes:
            # Near the highest command there is no saturation to be seen.
            seen = [item for item in result.estimates if item.path != _SATURATION or item.value < highest - _SATURATES]
            return replace(result, estimates=tuple(seen))
        result = _with_nodes(result, band, self.nodes, openings)
        remark = _of_full_opening(path, result.estimates[0], context, gas)
        return replace(result, remarks=(*result.remarks, *filter(None, [remark])))

    def _unknowns(
        self, where: str, size: Floats, areas: Floats, band: str, openings: Sequence[str]
    ) -> tuple[FitNumber, ...]:
        """Return the unknowns of the opening with first guesses from sizes of commands [-] and areas [m^2].

        ``band`` and ``openings`` are paths of the straight line or the table. Raises IdentificationError, beginning
        with ``where``, if the readings do not determine them.
        """
        largest, highest = float(areas.max()), float(size.max())
        if self.nodes:
            ends = [0.0, *self.nodes, 1.0]
            if highest < _NEARLY_FULL:
                raise IdentificationError(f"{where}: nodes need readings up to full command, not to {highest:.3g}")
            rises = min(np.diff(ends)) > 0.0
            if len(self.nodes) > NODES or not rises or np.histogram(size, ends)[0].min() < _FEWEST_BETWEEN:
                raise IdentificationError(
                    f"{where}: nodes = {list(self.nodes)}: must rise from above 0 to below 1, at most "
                    f"{NODES}, with {_FEWEST_BETWEEN} readings or more between two of them and the ends 0 and 1"
                )
            near = [float(np.median(areas[np.argsort(np.abs(size - node))[:3]])) for node in self.nodes]
            starts = np.clip(np.array(near) / largest, 0.0, 1.0).tolist()
            full = reported(_FULL, "m^2", "Effective area Cd A at full command")
            return sought(full, largest, 0.0), *(
                sought(reported(name, "", f"Opening at a command of {node:g}", 1.0), start, 0.0, 1.0, 1.0)
                for name, node, start in zip(openings, self.nodes, starts, strict=True)
            )
        half = float(size[areas > _HALF_OPEN * largest].min())
        if not half > 0.0:
            raise IdentificationError(f"{where}: at command 0, the valve has more than half of its largest flow")
        shut = size[areas < _SHUT * largest]
        # Inside the bounds, so that the search can go either way.
        start = float(np.clip(np.median(shut) if shut.size else 0.0, 0.01 * half, 0.9 * half))
        shut_below = "Dead band: command below which no gas flows, in both directions"
        gain = reported(_GAIN, "m^2", "Effective area Cd A per command beyond the dead band")
        saturation = reported(_SATURATION, "", "Saturation: command beyond which the opening is constant")
        return (
            sought(reported(band, "", shut_below, _SMALL_COMMAND), start, 0.0, half, highest),
            sought(gain, 0.5 * largest / (half - start), 0.0),
            # Just inside the highest command, beyond which no reading changes with it.
            sought(saturation, 0.02 * half + 0.98 * highest, half, highest * (1.0 + 1e-9), highest),
        )


def _of_full_opening(path: str, full: Estimate, context: BenchContext, gas: GasAt) -> str:
    """Return a remark on the number of the set that the full opening of a table contradicts or confirms, or ""."""
    coefficient = context.number(f"{path}.discharge_coefficient")
    conductance = context.number(f"{path}.sonic_conductance")
    if not full.is_usable or not (coefficient or conductance):
        return ""
    if coefficient:
        # The set has area and coefficient, of which the map knows the product alone.
        area, own = 1e6 * full.value / coefficient, 1e6 * (context.number(f"{path}.area") or 0.0)
        read, has = f"with the Cd of the set {path}.area = {area:.4g} mm^2", f"{own:.4g} mm^2"
    else:
        measured = 1e8 * full.value * gas.choked_flow_constant / gas.flow_per_sonic_conductance
        read, has = f"{path}.sonic_conductance = {measured:.4g} L/(s bar)", f"{1e8 * (conductance or 0.0):.4g}"
    return (
        f"the opening is a share of the full one: {read}, and the set has {has}, which stays; no interval counts that "
        "the opening is straight between two nodes"
    )


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
