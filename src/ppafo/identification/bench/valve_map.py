"""Valve map: command against opening; dead band, gain, saturation and hysteresis of a proportional valve.

    m = Cd A(u') C1 P_up psi(P_down / P_up),   Cd A = sign(u') k min(max(|u'| - u_0, 0), u_s - u_0)     (6), (7)
    u' = play(u; h):   y = max(u - h/2, min(u + h/2, y)),   u' = y / (1 - h/2)     effect ``spool_play``

m is the mass flow [kg/s], positive into chamber 1, u the command from -1 to 1, u_0 the dead band, u_s the command from
which the valve opens no further, h the width of the play, k the effective area per command [m^2]. Flow is over what the
pressures of the moment give, so that a supply that sags does not look like a valve that saturates. Temperature and law
of the gas, gains and zeros of the sensors are tolerances; the zero of the flow meter shows inside the dead band.
"""

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.flow import GasAt, flow_tolerances, orifice_shape, read_flow, true_pressure
from ppafo.identification.bench.law import Readings, Values, recordings_of, solve, sought
from ppafo.identification.bench.result import BenchResult, Reported, result_of
from ppafo.identification.source import Source, check_no_wrong_reading, check_sources, pool
from ppafo.identification.tolerances import DEFAULTS, Tolerances
from ppafo.model.effects.spool_play import spool_position
from ppafo.report.kind import Kind
from ppafo.report.residuals import curve_mark, readings_mark, with_residuals
from ppafo.signals.recording import Floats

PROCEDURE = "valve-map"
CHANNELS = ("command", "mass_flow", "upstream_pressure", "downstream_pressure")
MINIMUM_SAMPLES = 12
_MINIMUM_RANGE = 0.5
_SEEN_BEYOND = 0.02
_SMALL_COMMAND = 0.2
_GAIN, _PLAY, _SATURATION = "valve_map.gain", "effects.spool_play.width", "valve_map.saturation_command"


def valve_map(
    sources: tuple[Source, ...],
    gas: GasAt,
    path: str = "valve",
    confidence: float = 0.95,
    tolerances: Tolerances = DEFAULTS,
) -> BenchResult:
    """Return dead band [-], gain [m^2], saturation and hysteresis [-] from command and flow; equations (6), (7).

    ``path`` is the valve's in a set (``valves.main``).
    IdentificationError for recordings that cannot say it, with the file, the sample and the remedy.
    """
    names = CHANNELS[2:]
    areas = _areas(sources, gas)
    commands = [source.recording["command"] for source in sources]
    command, flow, upstream, downstream = (pool(sources, name) for name in CHANNELS)
    branch = np.concatenate([_branch(source) for source in sources])
    highest, largest = float(np.abs(command).max()), float(np.abs(areas).max())
    is_two_way = bool((branch > 0).any() and (branch < 0).any())
    band = f"{path}.dead_band"
    # The valve is neither shut nor fully open where it has half of the largest area.
    half = float(np.abs(command[np.abs(areas) > 0.5 * largest]).min())
    if not half > 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the valve has more than half of its largest flow at command 0; check the "
            "zero of channel 'command', or leave that reading out"
        )
    shut = np.abs(command[np.abs(areas) < 0.05 * largest])
    start = float(np.clip(np.median(shut) if shut.size else 0.0, 0.01 * half, 0.9 * half))
    numbers = (
        sought(band, start, 0.0, half, highest),
        sought(_GAIN, 0.5 * largest / (half - start), 0.0),
        # Just inside the highest command, beyond which no reading changes with it.
        sought(_SATURATION, 0.02 * half + 0.98 * highest, half, highest * (1.0 + 1e-9), highest),
        *((sought(_PLAY, 0.02, 0.0, 0.5, 0.1),) if is_two_way else ()),
        *flow_tolerances(gas, tolerances, names, float(np.abs(flow).max())),
    )

    def law(at: Values) -> Floats:
        before, behind = true_pressure(at, names[0], upstream), true_pressure(at, names[1], downstream)
        drawn = np.concatenate([spool_of(one, at[_PLAY]) for one in commands])
        area = area_of_command(drawn, at[band], at[_GAIN], at[_SATURATION])
        shape = np.abs(orifice_shape(before, behind, gas.heat_capacity_ratio))
        return read_flow(at, gas, area * gas.choked_flow_constant * shape)

    groups = (
        np.where(branch < 0.0, "falling commands", "rising commands").tolist(),
        np.where(command > 0.0, "commands to chamber 1", "commands to chamber 2").tolist(),
        np.where(np.abs(command) > 0.5 * highest, "large commands", "small commands").tolist(),
    )
    readings = Readings(flow, ["mass_flow"] * flow.size, recordings_of(sources), groups)
    found, model = solve(law, readings, numbers, confidence)
    values = found.by_name
    reported = [
        Reported(band, "", "Command below which nothing flows, in both directions", _SMALL_COMMAND),
        Reported(_GAIN, "m^2", "Effective area Cd A per command beyond the dead band"),
    ]
    if values[_SATURATION] < highest - _SEEN_BEYOND:
        reported.append(Reported(_SATURATION, "", "Command from which the valve opens no further"))
    if is_two_way:
        reported.append(Reported(_PLAY, "", "Width between a rising and a falling command", _SMALL_COMMAND))
    marks = []
    for role, sign in (("rising", 1.0), ("falling", -1.0)):
        on = branch == sign
        if on.any():
            marks.append(readings_mark(f"command {role}", command[on], flow[on], role))
            marks.append(curve_mark("fitted" if sign > 0 else "", command[on], model[on]))
    ways = bool((command > 0.1).any() and (command < -0.1).any())
    one_way = "only one direction was recorded: whether the other behaves the same is unknown"
    return result_of(
        PROCEDURE,
        sources,
        found,
        reported,
        f"{command.size} readings; dead band {values[band]:.3g}, {values[_GAIN] * 1e6:.4g} mm^2 per command; "
        f"scatter {np.std(flow - model) / np.abs(flow).max():.2%} of the largest flow",
        with_residuals("Valve map", Kind("Command"), Kind("Flow", "kg/s", "mass flow"), marks, command, flow - model),
        "the opening is not the same in both directions, or not linear in the command",
        () if ways else (one_way,),
    )


def area_of_command(command: Floats, dead_band: float, gain: float, saturation: float) -> Floats:
    """Return the effective area [m^2] of a command of the spool [-], positive towards chamber 1."""
    beyond = np.clip(np.abs(command) - dead_band, 0.0, max(saturation - dead_band, 0.0))
    return np.asarray(np.sign(command) * gain * beyond)


def spool_of(command: Floats, width: float) -> Floats:
    """Return the command [-] that a spool with play of a whole ``width`` [-] follows; it begins at the first one."""
    if width <= 0.0:
        return command
    position, drawn = float(command[0]), []
    for one in command.tolist():
        position = spool_position(position, one, width)
        drawn.append(position)
    return np.array(drawn)


def _areas(sources: tuple[Source, ...], gas: GasAt) -> Floats:
    """Return the effective area [m^2] of each reading; IdentificationError for readings that cannot say it."""
    check_sources(sources, PROCEDURE, CHANNELS, MINIMUM_SAMPLES, moving=CHANNELS[:2], absolute=CHANNELS[2:])
    for source in sources:
        command = source.recording["command"]
        wrong = np.flatnonzero(np.abs(command) > 1.0 + 1e-9)
        if wrong.size:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'command' is {command[wrong[0]]:g} at sample {wrong[0] + 1}; "
                f"it goes from -1 to 1: scale it in a column map"
            )
    command, flow, upstream, downstream = (pool(sources, name) for name in CHANNELS)
    if np.ptp(command) < _MINIMUM_RANGE:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: the command covers a range of only {np.ptp(command):.3g}; "
            f"{_MINIMUM_RANGE:g} or more is needed to identify dead band and gain"
        )
    drivers = command, np.concatenate([_branch(source) for source in sources])
    check_no_wrong_reading(sources, PROCEDURE, "mass_flow", drivers, np.ones(flow.size, dtype=bool))
    shape = np.abs(orifice_shape(upstream, downstream, gas.heat_capacity_ratio))
    if not shape.any():
        raise IdentificationError(f"{sources[0].name}: {PROCEDURE}: both pressures are equal throughout")
    # Over what the pressures would let pass, so that a supply that sags is no valve that saturates.
    areas = np.where(shape > 0.0, flow / (gas.choked_flow_constant * np.maximum(shape, 1e-3)), 0.0)
    if float(command @ areas) <= 0.0:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE}: flow into chamber 1 falls with the command; "
            f"reverse the sign of one of them"
        )
    return np.asarray(areas)


def _branch(source: Source) -> Floats:
    """Return the direction of the command: what the recording says, else from the command's own last change."""
    if "direction" in source.recording:
        return source.recording["direction"]
    signs = np.sign(np.diff(source.recording["command"], prepend=source.recording["command"][0]))
    last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
    return signs[last]
