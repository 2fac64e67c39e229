"""Recordings as NetCDF files and as xarray Datasets.

NetCDF files are written without xarray, whose import takes longer than a simulation.
"""

import io
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ArgumentError
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.signals import CHANNELS, Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT
from ppafo.units import conversion

if TYPE_CHECKING:
    import xarray

PLAIN_NUMBER_IN_NETCDF = "1"
"""Unit of a plain number in the NetCDF conventions."""
BETWEEN = "between_samples"
"""Channel attribute for an unusual interpolation between samples."""
_TIME_ATTRIBUTES = {"units": TIME_UNIT, "long_name": "time"}


def dataset_of(
    recording: Recording,
    scenario: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
) -> "xarray.Dataset":
    """Return a recording as a Dataset over time [s], with ``scenario`` as a JSON attribute.

    ``units`` maps channels to units other than SI; gauge pressures in them are relative to ``atmosphere`` [Pa
    absolute]. Raises DataError for an unknown channel, UnitError for a unit that does not fit.
    """
    import xarray

    if not isinstance(units, Mapping | None):
        raise ArgumentError(f"units={units!r}: must be units by channel, such as {{'pressure_1': 'psi_g'}}")
    joint = joint_of(scenario)
    variables = {name: (TIME, recording[name], channel_attributes(recording, name, joint)) for name in recording.names}
    for name, unit in (units or {}).items():
        attributes = channel_attributes(recording, name, joint) | {"units": unit}
        if recording.unit(name) == "Pa" and conversion(unit, "Pa_a")[2]:
            attributes["long_name"] = attributes["long_name"].replace("absolute", "gauge")
        variables[name] = (TIME, recording.in_unit(name, unit, atmosphere), attributes)
    coordinates = {TIME: (TIME, recording.time, _TIME_ATTRIBUTES)}
    return xarray.Dataset(variables, coordinates, global_attributes(recording, scenario))


def global_attributes(recording: Recording, scenario: Mapping[str, Any] | None) -> dict[str, str]:
    """Return the global attributes of a NetCDF file: label, kind, and the scenario document as JSON."""
    attributes = {"title": recording.label, "kind": recording.kind}
    if scenario is not None:
        attributes["scenario"] = json.dumps(scenario, ensure_ascii=False, allow_nan=False)
    return attributes


def joint_of(scenario: Mapping[str, Any] | None) -> JointNames:
    """Return the joint names of a scenario document, by default of the ankle."""
    device = (scenario or {}).get("device")
    joint = device.get("joint") if isinstance(device, Mapping) else None
    return JointNames(**joint) if isinstance(joint, Mapping) else ANKLE


def channel_attributes(recording: Recording, name: str, joint: JointNames = ANKLE) -> dict[str, str]:
    """Return unit and long name of a channel at a joint; a plain number has the unit 1 by the NetCDF conventions."""
    unit = recording.unit(name)
    summary = joint.said(CHANNELS[name].summary) if name in CHANNELS else name.replace("_", " ")
    between = recording.channels[name].between
    declared = {} if between is None else {BETWEEN: between}
    return {"units": PLAIN_NUMBER_IN_NETCDF if unit == PLAIN_NUMBER else unit, "long_name": summary, **declared}


def netcdf_bytes(recording: Recording, scenario: Mapping[str, Any] | None = None) -> bytes:
    """Return the NetCDF file of a recording as bytes; equal recordings give equal bytes."""
    import h5netcdf

    buffer = io.BytesIO()
    # Nothing in the file depends on when it was made, so that equal recordings are equal bytes.
    with h5netcdf.File(buffer, "w") as file:
        file.dimensions = {TIME: len(recording)}
        file.attrs.update(global_attributes(recording, scenario))
        time = file.create_variable(TIME, (TIME,), data=recording.time)
        time.attrs.update(_TIME_ATTRIBUTES)
        for name in recording.names:
            variable = file.create_variable(name, (TIME,), data=recording[name])
            variable.attrs.update(channel_attributes(recording, name, joint_of(scenario)))
    return buffer.getvalue()
