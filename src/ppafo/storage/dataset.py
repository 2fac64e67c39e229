"""A recording as an xarray Dataset, and the attributes that NetCDF files share with it."""

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ppafo.signals import CHANNELS, Recording
from ppafo.signals.channels import PLAIN_NUMBER, TIME, TIME_UNIT

if TYPE_CHECKING:
    import xarray

_PLAIN_NUMBER_IN_NETCDF = "1"


def dataset_of(recording: Recording, scenario: Mapping[str, Any] | None = None) -> "xarray.Dataset":
    """Return the recording as a Dataset over time [s]; ``scenario`` goes into an attribute as JSON."""
    import xarray

    variables = {name: (TIME, recording[name], channel_attributes(recording, name)) for name in recording.names}
    coordinates = {TIME: (TIME, recording.time, time_attributes())}
    return xarray.Dataset(variables, coordinates, global_attributes(recording, scenario))


def global_attributes(recording: Recording, scenario: Mapping[str, Any] | None) -> dict[str, str]:
    """Return what a NetCDF file says of the whole recording."""
    attributes = {"title": recording.label, "kind": recording.kind}
    if scenario is not None:
        attributes["scenario"] = json.dumps(scenario, ensure_ascii=False, allow_nan=False)
    return attributes


def time_attributes() -> dict[str, str]:
    """Return the attributes of the time."""
    return {"units": TIME_UNIT, "long_name": "time"}


def channel_attributes(recording: Recording, name: str) -> dict[str, str]:
    """Return unit and long name of a channel; a plain number has the unit 1, as the NetCDF conventions ask."""
    unit = recording.unit(name)
    summary = CHANNELS[name].summary if name in CHANNELS else name.replace("_", " ")
    return {"units": _PLAIN_NUMBER_IN_NETCDF if unit == PLAIN_NUMBER else unit, "long_name": summary}


def unit_of_attribute(text: str) -> str:
    """Return the unit that ``channel_attributes`` wrote as this text."""
    return PLAIN_NUMBER if text == _PLAIN_NUMBER_IN_NETCDF else text
