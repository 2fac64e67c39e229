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
from typing import Literal

import numpy as np

from ppafo.identification.bench import flow, readings
from ppafo.identification.bench import law as bench
from ppafo.identification.bench.flow import VALVE, VALVE_PRESSURES, ZERO
from ppafo.identification.estimate import Verdict
from ppafo.identification.fit import SHAPE, FitNumber, other_shape
from ppafo.identification.source import RecordingSource, Sources, pool
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.opening import NODES
from ppafo.model.valves.proportional import spool_position
from ppafo.parameters.records import keyed
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark
from ppafo.report.residuals import curve_mark, with_residuals
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.channels import check_command

_MINIMUM_SAMPLES = 12
_MINIMUM_RANGE = 0.5
"""Least range of the command [-] to separate dead band and gain."""
# Fractions of the largest area [-]: below the first the valve is shut, above the second at least half open.
_SHUT = 0.05
_HALF_OPEN = 0.5
_SATURATES = 0.02
"""Least distance of the saturation from the highest command [-] to be identified."""
_SMALL_COMMAND = 0.2
"""Typical magnitude [-] of a dead band or backlash, which may be 0."""
_FEWEST_BETWEEN = 2
_NEARLY_FULL = 0.95
"""Least highest command [-] from which the area at full command is found."""
_FULL = "valve_map.full_area"
_GAIN = "valve_map.gain"
_PLAY = "valve_map.hysteresis"
_SATURATION = "valve_map.saturation_command"
# Range over which corners of the opening are rounded, tried beside sharp ones: name, start and bounds [-].
_ROUND = "valve_map.round_off"
_ROUNDS = (0.05, 0.005, 0.5)
_BETTER = 5.4
"""Increase of the log-likelihood [-] by one more number that happens by chance in one fit of 1,000."""


@dataclass(frozen=True, kw_only=True)
class ValveMapProblem(flow.FlowLaw):
    """Table of procedure valve-map: dead band, gain, saturation and hysteresis from flow over command."""

    needed = ("command", "mass_flow", *VALVE_PRESSURES)
    steady = ("valve-map",)
    kind: Literal["valve-map"]
    valve: str | None = keyed(VALVE, None)
    nodes: tuple[float, ...] = keyed("commands of a table of openings; default: straight beyond a dead band", ())

    def run(self, sources: Sources, context: bench.BenchContext) -> bench.BenchResult:
        """Identify dead band [-], gain [m^2], saturation [-] and hysteresis [-] from command and flow; (6), (7).

        With nodes the opening is a table over the command in place of dead band, gain and saturation. Raises
        IdentificationError for recordings that do not determine the map.
        """
        gas = self.gas_of(sources, context)
        path = context.valve_path(self.valve)
        readings.check_sources(sources, _MINIMUM_SAMPLES, ("command", "mass_flow"), absolute=VALVE_PRESSURES)
        command, upstream, downstream = (pool(sources, name) for name in ("command", *VALVE_PRESSURES))
        is_read = np.ones(command.size, dtype=bool)
        measured, is_possible, remarks = readings.meter_readings(
            sources, np.sign(command * (upstream - downstream)), context.tolerances.zero_of_flow, is_read
        )
        branch = np.concatenate([_branch_of(source) for source in sources])
        size = np.abs(command)
        span = np.ptp(command)
        if span < _MINIMUM_RANGE:
            sources[0].refuse(f"the command covers a range of {span:.3g}, not {_MINIMUM_RANGE:g} or more")
        readings.check_no_wrong_reading(sources, "mass_flow", (command, branch), is_read)
        shape = np.abs(flow.orifice_shape(upstream, downstream, gas.heat_capacity_ratio))
        if not shape.any():
            sources[0].refuse("both pressures are equal in all readings, so nothing drives a flow")
        # Flow over flow per area at the measured pressures, so that a sagging supply is no saturation.
        areas = np.where(shape > 0.0, measured / (gas.choked_flow_constant * np.maximum(shape, 1e-3)), 0.0)
        if command @ areas <= 0.0:
            sources[0].refuse("the flow into chamber 1 falls as the command rises: a wrong sign of one of them")
        # Backlash is seen where the command both rises and falls.
        is_two_way = (branch > 0).any() and (branch < 0).any()
        band = f"{path}.dead_band"
        openings = [f"{SECTION}.opening.opening_{number:02}" for number in range(1, len(self.nodes) + 1)]
        pressures = dict(zip(VALVE_PRESSURES, (upstream, downstream), strict=True))
        between = "Hysteresis: width between rising and falling command"
        play = bench.sought(_PLAY, 0.02, 0.0, 0.5, 0.1, text=between, size=_SMALL_COMMAND)
        numbers = (
            *self._unknowns(sources[0], size, np.abs(areas), band, openings),
            *((play,) if is_two_way else ()),
            *flow.flow_tolerances(gas, context.tolerances, pressures, measured),
        )

        def shown(at: bench.Values) -> Floats:
            spool = np.concatenate([spool_of(item.recording["command"], at[_PLAY]) for item in sources])
            if self.nodes:
                # Within the noise an opening may not fall.
                rising = np.clip(np.maximum.accumulate([at[name] for name in openings]), 0.0, 1.0)
                opening = np.interp(np.abs(spool), [0.0, *self.nodes, 1.0], [0.0, *rising.tolist(), 1.0])
                area = at[_FULL] * np.sign(spool) * opening
            else:
                area = area_of_command(spool, at[band], at[_GAIN], at[_SATURATION], at[_ROUND])

            # A play needs every command, so that readings that cannot be drop out of the flow alone.
            per_shape = area * gas.choked_flow_constant
            through = flow.shown_flow(
                at,
                gas,
                pressures,
                lambda first, second: per_shape * np.abs(flow.orifice_shape(first, second, gas.heat_capacity_ratio)),
            )
            return np.asarray(np.where(is_possible, through, measured))

        groups = (
            bench.recordings_of(sources),
            "mass_flow",
            np.where(branch < 0.0, "falling commands", "rising commands"),
            np.where(command > 0.0, "commands to chamber 1", "commands to chamber 2"),
            np.where(size > 0.5 * size.max(), "large commands", "small commands"),
        )
        fitted, model = bench.solve(shown, measured, groups, numbers, self.confidence)
        reason = ""
        # Corners are refuted where an opening with rounded ones, tried in its place, explains the readings better.
        if not self.nodes and (fitted.conflict is None or fitted.conflict.number == SHAPE):
            free = [number for number in numbers if math.isinf(number.deviation) or number.name == ZERO]
            free.append(bench.sought(_ROUND, *_ROUNDS))
            rounded, _ = bench.solve(shown, measured, groups, free, self.confidence)
            gain = rounded.log_likelihood - fitted.log_likelihood
            if gain > _BETTER:
                reason = (
                    f"an opening whose corners are rounded over {rounded.by_name[_ROUND]:.2g} of the command explains "
                    "them better (nodes make a table of it)"
                )
                fitted = replace(fitted, conflict=other_shape("mass_flow", math.sqrt(2.0 * gain)))
        if not (is_two_way or self.nodes):
            no_play = (
                "the command was swept in one direction only: the dead band includes half the width of any hysteresis"
            )
            remarks = (*remarks, no_play)
        series = []
        curves = list[Mark]()
        for role, on in (("falling", branch == -1.0), ("rising", branch == 1.0)):
            if on.any():
                series.append((f"command {role}", role, command[on], measured[on], model[on]))
                curves.append(curve_mark("" if curves else "fitted", command[on], model[on]))
        axes = Kind("Command"), Kind("Flow", "kg/s", "mass flow")
        scatter = np.std(measured - model) / np.abs(measured).max()
        result = bench.result_of(
            sources,
            fitted,
            f"{command.size} readings; scatter {scatter:.2%} of the largest flow",
            with_residuals("Valve map", *axes, series, curves),
            reason,
            remarks,
        )
        if self.nodes:
            return self._as_table(result, band)
        # Near the highest command there is no saturation to be seen.
        seen = [item for item in result.estimates if item.path != _SATURATION or item.value < size.max() - _SATURATES]
        return replace(result, estimates=tuple(seen))

    def _unknowns(
        self, source: RecordingSource, size: Floats, areas: Floats, band: str, openings: Sequence[str]
    ) -> tuple[FitNumber, ...]:
        """Return the unknowns of the opening with first guesses from sizes of commands [-] and areas [m^2].

        ``band`` and ``openings`` are paths of the straight line or the table. Raises IdentificationError,
        with the name of ``source``, if the readings do not determine them.
        """
        largest = float(areas.max())
        highest = float(size.max())
        if self.nodes:
            ends = [0.0, *self.nodes, 1.0]
            if highest < _NEARLY_FULL:
                source.refuse(f"nodes need readings up to full command, not to {highest:.3g}")
            rises = min(np.diff(ends)) > 0.0
            if len(self.nodes) > NODES or not rises or np.histogram(size, ends)[0].min() < _FEWEST_BETWEEN:
                source.refuse(
                    f"nodes = {list(self.nodes)}: must rise from above 0 to below 1, at most {NODES}, with "
                    f"{_FEWEST_BETWEEN} readings or more between two of them and the ends 0 and 1"
                )
            of_full = "Effective area Cd A at full command"
            unknowns = [bench.sought(_FULL, largest, 0.0, unit="m^2", text=of_full)]
            for name, node in zip(openings, self.nodes, strict=True):
                near = float(np.median(areas[np.argsort(np.abs(size - node))[:3]]))
                start = min(max(near / largest, 0.0), 1.0)
                text = f"Opening at a command of {node:g}"
                unknowns.append(bench.sought(name, start, 0.0, 1.0, 1.0, text=text, size=1.0))
            return tuple(unknowns)
        half = float(size[areas > _HALF_OPEN * largest].min())
        if not half > 0.0:
            source.refuse("at command 0, the valve has more than half of its largest flow")
        shut = size[areas < _SHUT * largest]
        # Inside the bounds, so that the search can go either way.
        start = float(np.clip(np.median(shut) if shut.size else 0.0, 0.01 * half, 0.9 * half))
        # Just inside the highest command, beyond which no reading changes with it.
        inside = 0.02 * half + 0.98 * highest
        end = highest * (1.0 + 1e-9)
        of_band = "Dead band: command below which no gas flows, in both directions"
        of_gain = "Effective area Cd A per command beyond the dead band"
        of_end = "Saturation: command beyond which the opening is constant"
        return (
            bench.sought(band, start, 0.0, half, highest, text=of_band, size=_SMALL_COMMAND),
            bench.sought(_GAIN, 0.5 * largest / (half - start), 0.0, unit="m^2", text=of_gain),
            bench.sought(_SATURATION, inside, half, end, highest, text=of_end),
        )

    def _as_table(self, result: bench.BenchResult, band: str) -> bench.BenchResult:
        """Return the result with openings that do not fall, and beside them commands and no dead band, for a set."""
        count = 1 + len(self.nodes)
        nodes = result.estimates[1:count]
        usable = [node.verdict for node in nodes if node.is_usable]
        # Shut and fully open are what a node may be; a table without one of its nodes is none.
        is_whole = all(node.is_usable or node.verdict == "at its bound" for node in nodes)
        of_bound: Verdict = (*usable, "at its bound")[0] if is_whole else "not identifiable"
        highest = 0.0
        table = []
        for number, (node, command) in enumerate(zip(nodes, self.nodes, strict=True), 1):
            highest = max(highest, node.value)
            verdict = node.verdict if is_whole and node.is_usable else of_bound
            beside = {f"{SECTION}.opening.command_{number:02}": command, band: 0.0}
            low = min(node.low, highest)
            high = max(node.high, highest)
            table.append(replace(node, value=highest, low=low, high=high, beside=beside, verdict=verdict))
        remark = (
            f"the openings are shares of {_FULL}, and the size of the valve in the set stays; no interval counts that "
            "the opening is straight between two nodes"
        )
        estimates = (result.estimates[0], *table, *result.estimates[count:])
        return replace(result, estimates=estimates, remarks=(*result.remarks, remark))


def _branch_of(source: RecordingSource) -> Floats:
    """Return the direction of the command, 1 rising and -1 falling; unless recorded, it is that of the last change."""
    check_command(source.recording, source.where)
    if "direction" in source.recording:
        return source.recording["direction"]
    requested = source.recording["command"]
    # Before the first change it is 0.
    signs = np.sign(np.diff(requested, prepend=requested[0]))
    return np.asarray(signs[np.maximum.accumulate(np.arange(signs.size) * (signs != 0.0))])


def area_of_command(
    command: Floats, dead_band: float, gain: float, saturation: float, round_off: float = 0.0
) -> Floats:
    """Return the effective area [m^2] for a spool command [-], positive towards chamber 1.

    With ``round_off`` [-] both corners are rounded over about this range of the command, and gas flows from 0 on.
    """
    size = np.abs(command)
    ends = np.array([[dead_band], [saturation]])
    if round_off > 0.0:
        rounded = round_off * np.logaddexp(0.0, (size - ends) / round_off)
        first, second = rounded - round_off * np.logaddexp(0.0, -ends / round_off)
        beyond = first - second
    else:
        beyond = np.clip(size - dead_band, 0.0, max(saturation - dead_band, 0.0))
    return np.asarray(np.sign(command) * gain * beyond)


def spool_of(command: Floats, width: float) -> Floats:
    """Return the spool command [-] after backlash of full ``width`` [-]; the spool starts at the first command."""
    if width <= 0.0:
        return command
    position = float(command[0])
    positions = []
    for requested in command.tolist():
        position = spool_position(position, requested, width)
        positions.append(position)
    return np.array(positions)
