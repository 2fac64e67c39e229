"""What a run takes from a recording: its inputs step by step, its start, its scenario, and what is refused."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.replay import RECORDED_ANGLE, StepInputs
from ppafo.engine.run import Run
from ppafo.errors import DataError
from ppafo.parameters.device import VANE, Device, Orifice
from ppafo.signals import Recording
from ppafo.signals.faults import longest_gap
from ppafo.signals.recording import Floats, between_samples
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Initial,
    Origin,
    PrescribedMotion,
    ProfileChoice,
    RunSettings,
    Scenario,
    Sensors,
)

COMMAND, SUPPLY, EXTERNAL_TORQUE = "command", "supply_pressure", "external_torque"
DORSIFLEXION_SUPPLY = "dorsiflexion_pressure"
ANGLE = "angle"
"""An angle that is an input: the vane follows it, in straight lines from sample to sample."""

LONGEST_STEP = 1.0e-3
"""Seconds over which a recorded pressure or torque is averaged, and the longest step of a replay."""

SHORTEST_SAMPLE = 1.0e-4
"""Seconds; irregular samples are placed on a grid no finer than this."""

_BEYOND_STOPS = 0.05
"""Fraction of the range by which a measured angle may exceed a stop; up to there it is set to the stop."""

_UNIFORM = 0.02
"""Fraction of a sample by which a time may be off a regular grid; clocks write rounded times."""

REST_WINDOW = 0.05
"""Seconds before the first command over which the start is averaged; short, so that no leak shows in it."""

_FEWEST_ON_LINE = 8
_SEEN_SLOPE = 4.0
"""Standard errors from which something moves: white noise at rest is that far off once in 16,000 times."""
_ROUNDING, _SPREAD_OF_MEDIAN = 1.0e-9, 1.4826
_LEAST_RANK = 1.0e-6
"""Singular value over the largest from which powers of time count as independent of each other."""

PRESSURES = ("pressure_1", "pressure_2", SUPPLY, DORSIFLEXION_SUPPLY)

LONGEST_GAP = 0.05
"""Seconds without a sample in which so much can happen that the inputs are not known any more, if it is a gap."""

_COMMAND_TOLERANCE = 1.0e-6
_SMALLEST_ABSOLUTE = 0.3
"""Fraction of the atmosphere; an absolute pressure below it is almost surely a gauge pressure under the wrong name."""

Motion = FreeMotion | PrescribedMotion


@dataclass(frozen=True, slots=True)
class RecordedInputs:
    """Channels ``names`` of a recording that a run follows; ``start`` [s] of the recording is time 0 of the run."""

    recording: Recording
    names: tuple[str, ...]
    start: float

    def has(self, name: str) -> bool:
        """True where the run follows this channel."""
        return name in self.names


def regular_interval(time: Floats) -> float | None:
    """Return the time between samples [s] where they are regular, else None."""
    interval = float(time[-1] - time[0]) / (time.size - 1)
    away = time - time[0] - interval * np.arange(time.size)
    return interval if float(np.abs(away).max()) < _UNIFORM * interval else None


def sample_period(time: Floats) -> float:
    """Return the time between samples [s], or of the grid on which irregular samples are placed."""
    shortest = min(max(float(np.diff(time).min()), SHORTEST_SAMPLE), LONGEST_STEP)
    return regular_interval(time) or shortest


def supply_paths(device: Device) -> tuple[str, ...]:
    """Return the parameters that follow a recorded supply: both regulators, unless they have two pressures."""
    supply = device.supply
    both = ("plant.supply_pressure", "plant.dorsiflexion_pressure")
    return both if supply.has_one_pressure else both[:1]


def step_inputs(inputs: RecordedInputs, device: Device, run: Run) -> StepInputs:
    """Return what a run follows at each of its steps; ``device`` says which regulators follow the supply.

    A run that follows the angle is one of ``with_prescribed_angle``.
    """
    command = _input_values(inputs, COMMAND, run) if inputs.has(COMMAND) else None
    # The parameters that follow a recording [SI], for every step.
    followed: dict[str, Floats] = {}
    if inputs.has(SUPPLY):
        followed |= dict.fromkeys(supply_paths(device), _input_values(inputs, SUPPLY, run))
    if inputs.has(DORSIFLEXION_SUPPLY):
        followed["plant.dorsiflexion_pressure"] = _input_values(inputs, DORSIFLEXION_SUPPLY, run)
    if inputs.has(EXTERNAL_TORQUE):
        followed["plant.external_torque"] = _input_values(inputs, EXTERNAL_TORQUE, run)
    if inputs.has(ANGLE):
        # The straight piece of the angle that holds at each step; after the last sample the vane stands still.
        time = inputs.recording.time - inputs.start
        angles = between_stops(inputs.recording[ANGLE], device, inputs.recording.label)
        rates = np.append(np.diff(angles) / np.diff(time), 0.0)
        begins = run.step * np.arange(run.step_count, dtype=np.float64)
        # By the middle of a step: rounding may put a sample a little behind the step that begins with it.
        piece = np.maximum(np.searchsorted(time, begins + 0.5 * run.step, side="right") - 1, 0)
        followed |= {"path.start": time[piece], "path.level": angles[piece], "path.rate": rates[piece]}
    return StepInputs(command, followed)


def with_prescribed_angle(run: Run, angle: float) -> Run:
    """Return the run with the vane on a recorded angle, which is ``angle`` [rad] at the start."""
    program = replace(run.program, angle=RECORDED_ANGLE)
    return replace(run, program=program, path=(0.0, angle, 0.0), needs_parts=True)


def between_stops(angles: Floats, device: Device, file: str) -> Floats:
    """Return angles [rad] as they are or, slightly beyond a stop, as the stop; DataError for those far beyond."""
    lowest, highest = device.actuator.angle_min, device.actuator.angle_max
    margin = _BEYOND_STOPS * (highest - lowest)
    worst = angles[int(np.argmax(np.maximum(lowest - angles, angles - highest)))]
    if not lowest - margin <= worst <= highest + margin:
        shown, low, high = np.degrees([worst, lowest, highest])
        is_negative = lowest - margin <= float(-angles.max()) and float(-angles.min()) <= highest + margin
        hint = "; with the other sign all angles would lie between them" if is_negative else ""
        raise DataError(
            f"{file}: 'angle' is {shown:.4g} deg, beyond the stops of {device.name}, {low:g} to {high:g} deg{hint}"
        )
    return np.clip(angles, lowest, highest)


def _input_values(inputs: RecordedInputs, name: str, run: Run) -> Floats:
    """Return an input [SI] at each step, as its recording declares it.

    A change of a held one falls on the nearest step. One on a line is a mean over a step or, so that there are fewer
    changes, a millisecond; a command over a step, as a valve answers within less.
    """
    if inputs.recording.is_held(name):
        middle = run.step * np.arange(run.step_count, dtype=np.float64) + 0.5 * run.step
    else:
        together = 1 if name == COMMAND else max(1, min(run.steps_per_sample, round(LONGEST_STEP / run.step)))
        first = (np.arange(run.step_count) // together * together).astype(np.float64)
        middle = run.step * (first + 0.5 * together)
    return between_samples(inputs.recording, name, middle, inputs.start)


@dataclass(frozen=True, slots=True)
class Start:
    """Angle [rad], angular velocity [rad/s] and pressures [Pa absolute] at the first sample."""

    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float


def samples_at_rest(recording: Recording) -> int:
    """Return the samples before the first command, at most 50 ms of them; 1 where the valve is open from the start."""
    command, time = recording[COMMAND], recording.time
    if command[0] != 0.0:
        return 1
    quiet = command.size if not command.any() else int(np.argmax(command != 0.0))
    return max(1, min(quiet, int((time < time[0] + REST_WINDOW).sum())))


def start_of(
    recording: Recording, device: Device, known: Mapping[str, float], file: str, remedies: Mapping[str, str]
) -> Start:
    """Return where the replay of a recording starts: ``known`` values [SI] go before what its samples at rest show.

    DataError, which begins with ``file``, for a channel that is not there, with the remedy for it.
    """
    count, values = samples_at_rest(recording), dict(known)
    for name in (ANGLE, "pressure_1", "pressure_2", "angular_velocity"):
        if name not in values and name in recording:
            values[name] = value_at_rest(recording.time[:count], recording[name][:count])
        elif name in remedies and name not in values:
            raise DataError(f"{file}: there is no channel '{name}' to start from; {remedies[name]}")
    angle = float(between_stops(np.array([values[ANGLE]]), device, file)[0])
    return Start(angle, values.get("angular_velocity", 0.0), values["pressure_1"], values["pressure_2"])


def value_at_rest(time: Floats, values: Floats, at_end: bool = False) -> float:
    """Return the value [SI] with which a stretch at rest begins, or ends: the mean of its samples if they do not move.

    A chamber that leaks does move while valve and vane rest. Where a straight line has a slope that is seen, the value
    is the line's; where the samples are seen to bend, the same of the half that is nearer.
    """
    while values.size >= _FEWEST_ON_LINE:
        away = (time - (time[-1] if at_end else time[0])) / (time[-1] - time[0])
        if not _is_seen(np.vander(away, 2), values):
            return float(np.mean(values))
        if not _is_seen(np.vander(away, 3), values):
            return float(np.linalg.lstsq(np.vander(away, 2), values)[0][-1])
        kept = slice(values.size // 2, None) if at_end else slice(None, values.size // 2)
        time, values = time[kept], values[kept]
    return float(values[-1 if at_end else 0])


def _is_seen(columns: Floats, values: Floats) -> bool:
    """Return whether the coefficient of the first column is far from 0 for the noise from sample to sample.

    By the median of second differences, which neither a slope nor a jump changes.
    """
    # Samples that lie together in time, but for one, tell no bend from a slope.
    if np.linalg.matrix_rank(columns, rtol=_LEAST_RANK) < columns.shape[1]:
        return False
    fitted = np.linalg.lstsq(columns, values)[0]
    # A second difference of white noise has the square root of 6 times its standard deviation: 1 + 4 + 1.
    noise = _SPREAD_OF_MEDIAN * float(np.median(np.abs(np.diff(values, n=2)))) / math.sqrt(6.0)
    error = noise * math.sqrt(float(np.linalg.inv(columns.T @ columns)[0, 0]))
    return bool(abs(fitted[0]) > _SEEN_SLOPE * error + _ROUNDING * float(np.abs(values).max()))


def usual_interval(time: Floats) -> float:
    """Return the median time between two samples [s]."""
    return float(np.median(np.diff(time)))


def check_gaps(recording: Recording, file: str) -> None:
    """Raise DataError for a recording with a gap in which its inputs are not known."""
    gap = longest_gap(recording.time)
    if gap is not None and gap.duration > LONGEST_GAP:
        raise DataError(
            f"{file}: there is a gap of {gap.duration:.4g} s after {recording.time[gap.index]:.6g} s (sample "
            f"{gap.index + 1}), in which the inputs are not known; cut the recording there"
        )


def check_command(recording: Recording, file: str) -> None:
    """Raise DataError for a command outside -1 to 1."""
    command = recording[COMMAND]
    worst = int(np.argmax(np.abs(command)))
    if abs(command[worst]) > 1.0 + _COMMAND_TOLERANCE:
        raise DataError(
            f"{file}: '{COMMAND}' is {command[worst]:.6g} at {recording.time[worst]:.6g} s (sample {worst + 1}); it "
            "must be from -1 to 1, the fraction of full opening"
        )


def check_absolute(recording: Recording, atmosphere: float, file: str) -> None:
    """Raise DataError for pressures that cannot be absolute; ``atmosphere`` [Pa absolute]."""
    for name in (name for name in PRESSURES if name in recording):
        lowest = int(np.argmin(recording[name]))
        if recording[name][lowest] < _SMALLEST_ABSOLUTE * atmosphere:
            raise DataError(
                f"{file}: '{name}' is {recording[name][lowest]:.6g} Pa absolute at {recording.time[lowest]:.6g} s "
                f"(sample {lowest + 1}), far below the atmosphere; is it a gauge pressure ('{name} [psi_g]')?"
            )


def locked_vane(angle: float) -> PrescribedMotion:
    """Return the motion of a vane that is held at an angle [rad]: both chambers are fixed volumes."""
    return PrescribedMotion(ProfileChoice("constant", {"level": angle}), "locked")


def with_fixed_volume(device: Device, volume: float) -> tuple[Device, dict[str, float]]:
    """Return the device with a fixed volume [m^3] in the place of chamber 1, whatever the actuator: nothing leaks.

    With it where a replay starts beside the pressure in the volume: the vane at the lower stop, chamber 2 as the room.
    """
    leak = device.actuator.leak
    shut = replace(leak, area=0.0) if isinstance(leak, Orifice) else replace(leak, sonic_conductance=0.0)
    fixed = replace(device.actuator, dead_volume_1=volume, leak=shut, kind=VANE, settings={}, table=None)
    start = {ANGLE: device.actuator.angle_min, "pressure_2": device.supply.atmospheric_pressure}
    return replace(device, actuator=fixed), start


def replay_scenario(
    recording: Recording, device: Device, start: Start, duration: float, file: str, motion: Motion | None = None
) -> Scenario:
    """Return a run of ``duration`` [s] on the clock of a recording, whose command the caller sets step by step.

    The vane moves freely from where it starts unless another motion is given.
    """
    period = sample_period(recording.time)
    return Scenario(
        name=recording.label,
        description="replay of a recording",
        device=device,
        run=RunSettings(duration, min(period, LONGEST_STEP), period),
        motion=motion or FreeMotion(start.angle, start.angular_velocity),
        initial=Initial(start.pressure_1, start.pressure_2),
        controller=replay_control(recording),
        reference=ProfileChoice("constant", {"level": 0.0}),
        sensors=Sensors(),
        assumptions=(),
        origin=Origin(file, device.name, device.valve_name, (), {}),
    )


def replay_control(recording: Recording) -> Control:
    """Return the control of a run whose command comes from a recording: no controller, the period of the samples."""
    return Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))


def with_highest_supply(device: Device, recording: Recording, followed: Collection[str]) -> Device:
    """Return the device with the highest supply of the channels followed, for which the steps must be fine enough."""
    supply = device.supply
    recorded = {name: float(recording[name].max()) for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in followed}
    highest = max(supply.pressure, recorded.get(SUPPLY, 0.0))
    both = supply.has_one_pressure
    other = max(highest if both else supply.dorsiflexion_pressure, recorded.get(DORSIFLEXION_SUPPLY, 0.0))
    return replace(device, supply=replace(supply, pressure=highest, dorsiflexion_pressure=other))
