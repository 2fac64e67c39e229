"""A recording as evidence: read from its file, and refused or remarked on where it cannot carry a comparison."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, nearest_name
from ppafo.parameters.device import Device
from ppafo.signals import CHANNELS, Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.checks import check_absolute, check_command, check_gaps, usual_interval
from ppafo.simulation.recorded.inputs import COMMAND, EXTERNAL_TORQUE, SUPPLY
from ppafo.storage import read_recording
from ppafo.storage.files import read_bytes
from ppafo.storage.result_folder import NETCDF_FILE
from ppafo.validation.compared import ANGLE, COMPARED, PRESSURE_1, PRESSURE_2

_REMARKED_GAP = 3.0
_ABOVE_SUPPLY = 0.05
_MOST_RANGES = 20.0
_LEAST_CHANGE = 0.01
_CLIPPED_SAMPLES = 20
_NOISY_SHARE = 0.2


@dataclass(frozen=True, slots=True)
class Measured:
    """A recording with the name and the checksum of its file, and what is to be said of it."""

    file: str
    sha256: str
    recording: Recording
    remarks: tuple[str, ...]

    def has(self, name: str) -> bool:
        """True where the recording has this channel."""
        return name in self.recording


def read_measured(path: str | Path, device: Device) -> Measured:
    """Return the recording of a file or result folder; DataError where it cannot be compared with a model."""
    place = Path(path)
    recording = read_recording(place, device.supply.atmospheric_pressure)
    content = read_bytes(place / NETCDF_FILE if place.is_dir() else place)
    return checked(recording, device, str(path), hashlib.sha256(content).hexdigest())


def checked(recording: Recording, device: Device, file: str, sha256: str = "") -> Measured:
    """Return a recording as evidence with its remarks, or refuse it in one line that begins with ``file``."""
    _check_length(recording, file)
    unknown = _check_names(recording, file)
    check_gaps(recording, file)
    check_command(recording, file)
    _check_size(recording, device, file)
    _check_pressures(recording, device, file)
    _check_change(recording, device, file)
    remarks = (*unknown, *_gap_remarks(recording), *_clip_remarks(recording))
    return Measured(file, sha256, recording, remarks)


def _check_length(recording: Recording, file: str) -> None:
    if len(recording) < 2:
        raise DataError(f"{file}: has {len(recording)} sample; at least two are needed to replay anything")


def _check_names(recording: Recording, file: str) -> tuple[str, ...]:
    """Refuse a name that looks like a misspelt one of the channels in use; remark on any other unknown one."""
    used = (COMMAND, SUPPLY, EXTERNAL_TORQUE, *COMPARED)
    missing = [name for name in used if name not in recording]
    unknown = [name for name in recording.names if name not in CHANNELS]
    for name in unknown:
        hint = nearest_name(name, missing)
        if hint:
            raise DataError(f"{file}: channel '{name}' is not known{hint}")
    if COMMAND not in recording:
        names = ", ".join(recording.names)
        raise DataError(f"{file}: there is no channel '{COMMAND}', which the replay needs; there are {names}")
    if not any(name in recording for name in COMPARED):
        raise DataError(f"{file}: has none of the channels to compare: {', '.join(COMPARED)}")
    return tuple(f"channel '{name}' is not known and was not used" for name in unknown)


def _check_size(recording: Recording, device: Device, file: str) -> None:
    """Refuse values that no such device can have: a damaged line, or a unit that is off by powers of ten."""
    highest = max(device.supply.pressure, device.supply.dorsiflexion_pressure)
    for name in (name for name in (SUPPLY, *COMPARED) if name in recording):
        full_range = highest if name == SUPPLY else COMPARED[name].full_range(device, highest)
        worst = int(np.argmax(np.abs(recording[name])))
        if abs(recording[name][worst]) > _MOST_RANGES * full_range:
            where = f"{recording.time[worst]:.6g} s (sample {worst + 1})"
            raise DataError(
                f"{file}: '{name}' is {recording[name][worst]:.6g} {recording.unit(name)} at {where}, more than "
                f"{_MOST_RANGES:g} times what {device.name} can reach"
            )


def _check_pressures(recording: Recording, device: Device, file: str) -> None:
    """Refuse pressures that cannot be absolute, and chambers that stand above the supply they are fed from."""
    supply = device.supply
    check_absolute(recording, supply.atmospheric_pressure, file)
    given = recording[SUPPLY] if SUPPLY in recording else np.array([supply.pressure, supply.dorsiflexion_pressure])
    highest = float(given.max())
    allowed = highest + _ABOVE_SUPPLY * (highest - supply.atmospheric_pressure)
    for name in (name for name in (PRESSURE_1, PRESSURE_2) if name in recording):
        level = max(float(recording[name][0]), float(np.median(recording[name])))
        if level > allowed:
            raise DataError(_above_supply(file, name, level, highest, device, SUPPLY in recording))


def _above_supply(file: str, name: str, level: float, supply: float, device: Device, is_recorded: bool) -> str:
    from ppafo.units import from_si

    shown = [f"{from_si(p, 'psi_g', 'Pa_a', device.supply.atmospheric_pressure):.4g} psi_g" for p in (level, supply)]
    owner = f"the recorded '{SUPPLY}'" if is_recorded else f"the supply of {device.name}"
    remedy = "check both sensors" if is_recorded else f'record it, or give --set "supply.pressure={shown[0]}"'
    return f"{file}: '{name}' stands at {shown[0]}, above {owner}, {shown[1]}: {remedy}"


def _check_change(recording: Recording, device: Device, file: str) -> None:
    gauge = max(device.supply.pressure, device.supply.dorsiflexion_pressure) - device.supply.atmospheric_pressure
    compared = [name for name in COMPARED if name in recording]
    shares = [float(np.ptp(recording[name])) / COMPARED[name].full_range(device, gauge) for name in compared]
    if max(shares) < _LEAST_CHANGE:
        raise DataError(
            f"{file}: nothing happens in it: {', '.join(compared)} change by less than {_LEAST_CHANGE:.0%} of full "
            "range, so that it cannot tell a good model from a bad one"
        )


def _gap_remarks(recording: Recording) -> tuple[str, ...]:
    gaps = np.diff(recording.time)
    usual = usual_interval(recording.time)
    count = int((gaps > _REMARKED_GAP * usual).sum())
    if count == 0:
        return ()
    first = float(recording.time[int(np.argmax(gaps > _REMARKED_GAP * usual))])
    noun = "gap" if count == 1 else "gaps"
    return (f"{count} {noun} in time, the first after {first:.6g} s; inputs were carried across",)


def _clip_remarks(recording: Recording) -> tuple[str, ...]:
    """Remark on noisy channels that stay at exactly their largest or smallest value: a sensor at its limit."""
    remarks = []
    for name in (name for name in (ANGLE, PRESSURE_1, PRESSURE_2, SUPPLY) if name in recording):
        values = recording[name]
        for word, limit in (("largest", values.max()), ("smallest", values.min())):
            longest = _longest_run(values == limit)
            if longest >= _CLIPPED_SAMPLES and _is_noisy(values[values != limit]):
                remarks.append(
                    f"'{name}' stays at exactly its {word} value for {longest} samples: sensor at its limit?"
                )
    return tuple(remarks)


def _is_noisy(values: Floats) -> bool:
    """True where the values go up and down from sample to sample, as no smooth curve does."""
    ways = np.sign(np.diff(values))
    return ways.size > 1 and float((ways[1:] * ways[:-1] < 0.0).mean()) > _NOISY_SHARE


def _longest_run(flags: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))
