"""Any recording comes back from a file exactly as it went in."""

import tempfile
from pathlib import Path
from typing import get_args

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.signals import CHANNELS, Channel, Recording, RecordingKind
from ppafo.storage import read_csv, write_csv
from ppafo.storage.netcdf import netcdf_bytes, read_netcdf

FINITE = st.floats(allow_nan=False, allow_infinity=False)
UNITS = {
    **{name: kind.unit for name, kind in CHANNELS.items()},
    "residual": "N m",
    "ratio": "-",
    "limb_temperature": "K",
}
LABELS = st.text(min_size=1, max_size=20).filter(str.isprintable)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    times = sorted(draw(st.sets(FINITE, min_size=1, max_size=8)))
    names = draw(st.lists(st.sampled_from(sorted(UNITS)), unique=True, max_size=5))
    columns = st.lists(FINITE, min_size=len(times), max_size=len(times))
    channels = {name: Channel(np.array(draw(columns)), UNITS[name]) for name in names}
    return Recording(draw(LABELS), np.array(times), channels, draw(st.sampled_from(get_args(RecordingKind))))


@given(recordings())
@settings(max_examples=25)
def test_a_netcdf_file_gives_back_the_same_recording(recording: Recording) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "any.nc"
        path.write_bytes(netcdf_bytes(recording))
        assert read_netcdf(path) == recording


@given(recordings())
@settings(max_examples=40)
def test_a_csv_file_gives_back_the_same_recording(recording: Recording) -> None:
    with tempfile.TemporaryDirectory() as folder:
        assert read_csv(write_csv(Path(folder) / "any.csv", recording), recording.label) == recording
