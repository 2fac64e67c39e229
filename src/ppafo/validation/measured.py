"""Recordings for validation: reading from file, and checks that a recording can be compared with the model."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ppafo.errors import DataError
from ppafo.parameters.device import Device
from ppafo.signals import CHANNELS, Recording
from ppafo.signals.faults import lasting_change
from ppafo.simulation.recorded.channels import (
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    SUPPLY,
    check_absolute,
    check_command,
    check_gaps,
)
from ppafo.storage.column_map import ColumnMap, column_map_of
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import read_foreign
from ppafo.storage.reading import read_recording
from ppafo.storage.result_folder import NETCDF_FILE
from ppafo.units.shown import in_units, shown_text
from ppafo.validation.settings import COMPARED, full_range
from ppafo.wording import count_of, nearest_name

MINIMUM_SAMPLES = 10
"""Least number of samples of a recording."""

_REMARKED_GAP = 3.0
"""Time gap from which a remark is made, in usual sample intervals [-]."""
_MAXIMUM_RANGES = 20.0
"""Largest plausible reading in full ranges [-]; a larger reading means a damaged line or a wrong unit."""
_MINIMUM_CHANGE = 0.01
"""Least change in at least one channel, as a fraction of the full range [-]."""

if TYPE_CHECKING:
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset


@dataclass(frozen=True, slots=True)
class MeasuredRecording:
    """Measured recording with name and SHA-256 checksum of its file, and remarks on its quality."""

    file: str
    sha256: str
    recording: Recording
    remarks: tuple[str, ...]


def read_measured(
    source: "Recording | DataFrame | Dataset | str | Path",
    device: Device,
    columns: "ColumnMap | str | Path | None" = None,
) -> MeasuredRecording:
    """Read and check a recording, given as an object, a file or a result folder.

    With ``columns``, a file is read through this column map. Raises DataError if the recording cannot be compared with
    a model.
    """
    # Read for a folder too, which needs none: a name that is wrong is said whatever else is read.
    atmosphere = device.supply.atmospheric_pressure
    mapped = None if columns is None else column_map_of(columns)
    if not isinstance(source, str | Path):
        recording = source if isinstance(source, Recording) else read_recording(source, atmosphere=atmosphere)
        file = recording.label
        content = np.concatenate([recording.time, *(recording[name] for name in sorted(recording.names))]).tobytes()
    else:
        file = str(source)
        place = Path(source)
        if mapped is None or place.is_dir():
            recording = read_recording(place, atmosphere=atmosphere)
        else:
            column_map, map_name = mapped
            gas = f"{device.gas.molar_mass!r} kg/mol"
            recording = read_foreign(place, column_map, atmosphere, map_name, gas)
        content = read_bytes(place / NETCDF_FILE if place.is_dir() else place)
    return check_recording(recording, device, file, hashlib.sha256(content).hexdigest())


@in_units(lambda _recording, device, *_: device.shown)
def check_recording(recording: Recording, device: Device, file: str, sha256: str = "") -> MeasuredRecording:
    """Check that a recording suits validation. Raises DataError, starting with ``file``, if it does not."""
    count = len(recording)
    if count < MINIMUM_SAMPLES:
        raise DataError(f"{file}: has {count_of(count, 'sample')}; at least {MINIMUM_SAMPLES} are needed")
    known = (COMMAND, SUPPLY, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, *COMPARED)
    unknown = [name for name in recording.names if name not in CHANNELS]
    for name in unknown:
        if hint := nearest_name(name, [absent for absent in known if absent not in recording]):
            raise DataError(f"{file}: channel '{name}' is unknown{hint}")
    if COMMAND not in recording:
        names = ", ".join(recording.names)
        raise DataError(f"{file}: there is no channel '{COMMAND}', which the replay needs; available: {names}")
    compared = [name for name in COMPARED if name in recording]
    if not compared:
        raise DataError(f"{file}: has none of the channels to compare: {', '.join(COMPARED)}")
    remarks = [f"channel '{name}' is unknown and was ignored" for name in unknown]
    check_gaps(recording, file)
    check_command(recording, file)
    # Values out of reach of the device are a damaged line, or a unit wrong by powers of ten.
    supply = device.supply
    supplies = (SUPPLY, DORSIFLEXION_SUPPLY)
    highest = max(supply.pressure, supply.dorsiflexion_pressure)
    for name in (name for name in (*supplies, *COMPARED) if name in recording):
        most = highest if name in supplies else full_range(name, device, highest)
        values = recording[name]
        worst = int(np.argmax(np.abs(values)))
        if abs(values[worst]) > _MAXIMUM_RANGES * most:
            raise DataError(
                f"{file}: '{name}' is {shown_text(values[worst], recording.unit(name))} at {recording.time[worst]:.6g} "
                f"s (sample {worst + 1}), more than {_MAXIMUM_RANGES:g} times what {device.name} can reach"
            )
    check_absolute(recording, supply.atmospheric_pressure, file)
    gauge = supply_gauge(recording, device)
    if gauge <= 0.0:
        owner = f"the recorded '{SUPPLY}'" if SUPPLY in recording else f"the supply of {device.name}"
        raise DataError(
            f"{file}: {owner} must be above atmospheric pressure, because errors of pressure are fractions of its "
            "gauge pressure"
        )
    # Every model would agree with a recording in which no channel changes.
    fractions = [lasting_change(recording[name]) / full_range(name, device, gauge) for name in compared]
    if max(fractions) < _MINIMUM_CHANGE:
        raise DataError(
            f"{file}: {', '.join(compared)} change by less than {_MINIMUM_CHANGE:.0%} of full range, which is too "
            "little to test a model"
        )
    intervals = np.diff(recording.time)
    wide = np.flatnonzero(intervals > _REMARKED_GAP * np.median(intervals))
    if wide.size:
        gaps = count_of(wide.size, "gap")
        first = float(recording.time[wide[0]])
        remarks.append(f"{gaps} in time, the first after {first:.6g} s; inputs were constant across gaps")
    return MeasuredRecording(file, sha256, recording, tuple(remarks))


def supply_gauge(recording: Recording, device: Device) -> float:
    """Return the gauge supply pressure [Pa]: the median of the recording, or the higher supply pressure of the set."""
    supply = device.supply
    if SUPPLY in recording:
        return float(np.median(recording[SUPPLY])) - supply.atmospheric_pressure
    return max(supply.pressure, supply.dorsiflexion_pressure) - supply.atmospheric_pressure
