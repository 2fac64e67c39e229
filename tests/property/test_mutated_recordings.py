"""A damaged recording is compared or refused in one line; nothing else ever comes of it."""

from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from ppafo.errors import PpafoError
from ppafo.parameters import load_device
from ppafo.parameters.records import record_from
from ppafo.storage.column_map import ColumnMap
from ppafo.validation.agreement import compare_recording
from ppafo.validation.measured import read_measured
from ppafo.validation.settings import MOTIONS, ReplaySettings
from tests.repeatable import TOO_SLOW

DEVICE = load_device("ppafo2011")
HEADER = "time [s],command [-],supply_pressure [psi_g],angle [deg],pressure_1 [psi_g],pressure_2 [psi_g]"
ROWS = [f"{0.001 * n:.3f},{0 if n < 5 else 1},{50.1},{60 + n},{min(n, 45)},{45 - min(n, 45)}" for n in range(50)]
TEXT = "\n".join([HEADER, *ROWS, ""])
UNITS = dict(cell.removesuffix("]").split(" [") for cell in HEADER.split(","))
MAP = record_from(
    ColumnMap,
    {"channels": {name: {"column": number, "unit": unit} for number, (name, unit) in enumerate(UNITS.items(), 1)}},
)
CELLS = st.sampled_from(["", "nan", "inf", "-1", "1e300", "-1e-300", "0", "130", "1e9", "x", '"', "\0", "½", ",", "\n"])


@given(st.integers(0, len(TEXT) - 1), st.integers(0, 40), CELLS, st.sampled_from(MOTIONS), st.booleans())
@example(len(HEADER) + 1, 5, "-1e300", "free", False)
@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture, TOO_SLOW])
def test_a_damaged_recording_is_compared_or_refused_in_one_line(
    tmp_path: Path, start: int, length: int, cell: str, motion: str, through_map: bool
) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(TEXT[:start] + cell + TEXT[start + length :], encoding="utf-8")
    try:
        measured = read_measured(path, DEVICE, MAP if through_map else None)
        agreement = compare_recording(measured, DEVICE, ReplaySettings(motion=motion))
    except PpafoError as error:
        assert str(error).startswith(str(path))
        assert "\n" not in str(error)
        return
    for channel in agreement.channels:
        assert np.isfinite([channel.rms, channel.bias, channel.largest]).all()
