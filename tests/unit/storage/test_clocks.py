"""Times of loggers: time of day in every spelling, over midnight, with dates, counters that begin again, and rates."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.parameters.records import record_from
from ppafo.storage.clock import clock_seconds, counted_on
from ppafo.storage.column_map import ColumnMap
from ppafo.storage.foreign import read_foreign

# Three instants, 0, 10.5 and 70.25 s.
SPELLINGS = {
    "seconds": ["08:00:00", "08:00:10.5", "08:01:10.25"],
    "fraction comma": ["08:00:00,000", "08:00:10,500", "08:01:10,250"],
    "fraction colon": ["08:00:00:000", "08:00:10:500", "08:01:10:250"],
    "one digit": ["8:00:00", "8:00:10.5", "8:01:10.25"],
    "am and pm": ["11:59:50 AM", "12:00:00.5 PM", "12:01:00.25 PM"],
    "a.m.": ["11:59:50a.m.", "12:00:00.5p.m.", "12:01:00.25p.m."],
    "twelve at night": ["12:00:00 am", "12:00:10.5 am", "12:01:10.25 am"],
    "midnight": ["23:59:55", "00:00:05.5", "00:01:05.25"],
    "midnight with am and pm": ["11:59:55 PM", "12:00:05.5 AM", "12:01:05.25 AM"],
    "over a day": ["123:00:00", "123:00:10.5", "123:01:10.25"],
    "Z": ["08:00:00Z", "08:00:10.5Z", "08:01:10.25Z"],
    "zone": ["08:00:00+01:00", "08:00:10.5+01:00", "08:01:10.25+01:00"],
    "zone that changes": ["02:59:55+02:00", "02:00:05.5+01:00", "02:01:05.25+01:00"],
    "zone by name": ["08:00:00 CET", "08:00:10.5 CET", "08:01:10.25 CET"],
    "ISO 8601": ["2026-03-21T08:00:00.000", "2026-03-21T08:00:10.500", "2026-03-21T08:01:10.250"],
    "ISO 8601 with a zone": ["2026-03-21T08:00:00Z", "2026-03-21T08:00:10.5Z", "2026-03-21T08:01:10.25Z"],
    "ISO 8601, compact": ["20260321T080000", "20260321T080010.5", "20260321T080110.25"],
    "blank": ["2026-03-21 08:00:00", "2026-03-21 08:00:10.5", "2026-03-21 08:01:10.25"],
    "slashes, year first": ["2026/03/21 08:00:00", "2026/03/21 08:00:10.5", "2026/03/21 08:01:10.25"],
    "German": ["21.03.2026 08:00:00", "21.03.2026 08:00:10,5", "21.03.2026 08:01:10,25"],
    "German, short": ["21.3.26 08:00:00", "21.3.26 08:00:10,5", "21.3.26 08:01:10,25"],
    "American": ["03/21/2026 8:00:00 AM", "03/21/2026 8:00:10.5 AM", "03/21/2026 8:01:10.25 AM"],
    "one day of either order": ["03/04/2026 08:00:00", "03/04/2026 08:00:10.5", "03/04/2026 08:01:10.25"],
    "MATLAB": ["21-Mar-2026 08:00:00", "21-Mar-2026 08:00:10.5", "21-Mar-2026 08:01:10.25"],
    "asctime": ["Sat Mar 21 08:00:00 2026", "Sat Mar 21 08:00:10.5 2026", "Sat Mar 21 08:01:10.25 2026"],
    "Okt": ["3. Okt 2026, 08:00:00", "3. Okt 2026, 08:00:10,5", "3. Okt 2026, 08:01:10,25"],
    "month's end": ["2026-02-28T23:59:55", "2026-03-01T00:00:05.5", "2026-03-01T00:01:05.25"],
    "the month must be first": ["12/31/2026 23:59:55", "01/01/2027 00:00:05.5", "01/01/2027 00:01:05.25"],
    "the day must be first": ["31/01/2026 23:59:55", "01/02/2026 00:00:05.5", "01/02/2026 00:01:05.25"],
}


def rows(count: int) -> list[str]:
    return [f"line {number}" for number in range(2, 2 + count)]


@pytest.mark.parametrize("cells", SPELLINGS.values(), ids=SPELLINGS)
def test_a_time_of_day_is_seconds_since_the_first_row(cells: list[str]) -> None:
    assert np.allclose(clock_seconds(cells, rows(3)), [0.0, 10.5, 70.25], rtol=0, atol=1e-9)


def test_two_midnights_are_two_days() -> None:
    cells = ["20:00:00", "04:00:00", "12:00:00", "20:00:00", "04:00:00"]
    assert clock_seconds(cells, rows(5)).tolist() == [0.0, 28800.0, 57600.0, 86400.0, 115200.0]


@pytest.mark.parametrize(("form", "step"), [("h:min", 60.0), ("min:s", 1.0)])
def test_two_numbers_are_asked_about_and_the_answer_is_taken(form: Any, step: float) -> None:
    cells = ["08:10", "08:11", "08:12"]
    with pytest.raises(DataError, match=r'line 2: .08:10. may be .* give clock = "h:min" or clock = "min:s"'):
        clock_seconds(cells, rows(3))
    assert clock_seconds(cells, rows(3), form=form).tolist() == [0.0, step, 2 * step]


def test_minutes_have_no_fraction() -> None:
    assert clock_seconds(["00:10.5", "00:11.0"], rows(2)).tolist() == [0.0, 0.5]


@pytest.mark.parametrize(("order", "days"), [("day month", 1.0), ("month day", 31.0)])
def test_dates_of_either_order_are_asked_about_where_it_matters(order: Any, days: float) -> None:
    cells = ["03/04/2026 08:00:00", "04/04/2026 08:00:00"]
    with pytest.raises(DataError, match='give date_order = "day month" or date_order = "month day"'):
        clock_seconds(cells, rows(2))
    expected = days if order == "day month" else 31.0
    assert clock_seconds(cells, rows(2), order=order)[1] == expected * 86400.0


@pytest.mark.parametrize(
    "cells",
    [
        ["25:61:00", "25:62:00"],
        ["08:00:00", "noon"],
        ["13:00:00 PM", "13:00:01 PM"],
        ["2026-13-41 08:00:00", "2026-13-41 08:00:01"],
        ["08:00:00 CEST", "07:30:00 CET"],
    ],
)
def test_what_is_no_time_is_refused(cells: list[str]) -> None:
    with pytest.raises(DataError, match=r"is not a time of day|is not a date|several time zones"):
        clock_seconds(cells, rows(2))


@pytest.mark.parametrize("period", [2**32 * 1e-6, 2**32 * 1e-3], ids=["micros", "millis"])
def test_a_counter_of_32_bits_is_counted_on(period: float) -> None:
    time = np.arange(0.0, 2.0, 0.01) + period - 1.0
    wrapped = np.where(time >= period, time - period, time)
    assert np.allclose(counted_on(wrapped), time, rtol=0, atol=1e-7)
    # Signed, it falls to below 0 in the middle.
    signed = np.where(time - 0.5 * period >= 0.5 * period, time - period, time)
    assert np.allclose(np.diff(counted_on(signed)), 0.01, atol=1e-6)


@pytest.mark.parametrize("fall", [1.0, 60.0, 4000.0])
def test_a_clock_that_was_set_back_is_no_counter(fall: float) -> None:
    time = np.concatenate((np.arange(5000.0, 5100.0), np.arange(5100.0 - fall, 5200.0 - fall)))
    assert counted_on(time) is time


def read(folder: Path, text: str, time: dict[str, Any], **keys: Any) -> Any:
    path = folder / "log.txt"
    path.write_text(text, encoding="utf-8")
    channels = {"time": time, "torque": keys.pop("torque", {"column": "M", "unit": "Nm"})}
    return read_foreign(path, record_from(ColumnMap, {"channels": channels, **keys}))


def test_a_date_and_a_time_in_two_columns(tmp_path: Path) -> None:
    text = "Date;Time;M;\n31.12.2026;23:59:59,5;1,5;\n01.01.2027;00:00:00,5;2,5;\n"
    found = read(tmp_path, text, {"column": "Time", "date": "Date"}, delimiter="semicolon", decimal="comma")
    assert found.time.tolist() == [0.0, 1.0]
    assert found["torque"].tolist() == [1.5, 2.5]


def test_a_rate_stands_for_a_column_of_time(tmp_path: Path) -> None:
    for rate in ("100 Hz", "100 1/s", "6000 1/min"):
        assert np.allclose(read(tmp_path, "M\n1\n2\n3\n", {"rate": rate}).time, [0.0, 0.01, 0.02])


def test_many_rows_in_a_second_are_answered_with_a_rate_that_works(tmp_path: Path) -> None:
    text = "t,M\n" + "".join(f"08:00:{10 + row // 10},{row}\n" for row in range(31))
    with pytest.raises(DataError, match=r'time = \{ rate = "10 Hz" \}') as caught:
        read(tmp_path, text, {"column": "t"})
    assert "channels.time" in str(caught.value)
    assert read(tmp_path, text, {"rate": "10 Hz"}).duration == pytest.approx(3.0)


def test_a_log_of_the_serial_monitor(tmp_path: Path) -> None:
    text = "".join(f"12:00:0{row}.250 -> {line}\n" for row, line in enumerate(["us,M", "100,1", "5100,2", "10100,3"]))
    found = read(tmp_path, text, {"column": "us", "unit": "us"})
    assert np.allclose(np.diff(found.time), 0.005)
    assert read(tmp_path, text, {"column": "timestamp"}).time.tolist() == [0.0, 1.0, 2.0]
