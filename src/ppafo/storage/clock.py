"""Logger clocks converted to seconds: times of day, with or without date and time zone, and 32-bit counters."""

import re
from collections.abc import Sequence
from datetime import date
from typing import Literal

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import Floats
from ppafo.wording import LONGEST_SHOWN, one_line

DateOrder = Literal["day month", "month day"]
"""Order of day and month in a date such as 03/04/2026."""
ClockForm = Literal["h:min", "min:s"]
"""Meaning of a time of day such as 08:10."""

_DAY = 86400.0
"""Seconds of a day."""
_TIME = re.compile(
    r"T?(?P<first>\d{1,4}):(?P<second>\d{2})(?::(?P<third>\d{2}))?(?:[.,:](?P<fraction>\d+))?"
    r"(?:\s*(?P<half>[AaPp])\.?\s?[Mm]\b\.?)?(?:\s*(?P<zone>Z\b|[+-]\d{2}:?(?:\d{2})?|[A-Z]{2,5}\b(?:[+-]\d{1,2})?))?"
    r"(?:\[[\w/]+\])?"
)
"""Pattern of a time of day: hours, minutes and seconds, or two of them; optional fraction, am or pm, time zone."""
_COMPACT = re.compile(r"(?P<date>\d{8})T(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2})(?P<rest>.*)")
"""Pattern of date and time in digits only, ``20260321T080010``."""
_OFFSET = re.compile(r"([+-])(\d{1,2}):?(\d{2})?$")
"""Pattern of an offset from UTC at the end of a time zone."""
_YEAR_FIRST = re.compile(r"(\d{4})[-/.]?(\d{2})[-/.]?(\d{2})|(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})")
_DOTTED = re.compile(r"(\d{1,2})\.\s?(\d{1,2})\.\s?(\d{2,4})")
_SLASHED = re.compile(r"(\d{1,2})[/-](\d{1,2})[/-](\d{2,4})")
_MONTHS = ("jan", "feb", "mar mär mrz", "apr", "may mai", "jun", "jul", "aug", "sep", "oct okt", "nov", "dec dez")
_MONTH = {name: number for number, names in enumerate(_MONTHS, start=1) for name in names.split()}
"""Month number by the first three letters of its name, in English and German."""
_PERIODS = (2.0**32 * 1.0e-6, 2.0**32 * 1.0e-3)
"""Periods [s] after which a 32-bit counter of microseconds or milliseconds wraps around."""
_LARGEST_STEP = 10.0
"""Largest step across a counter overflow, in usual intervals [-]; a longer step means a clock set back."""


def is_clock(cell: str) -> bool:
    """Return whether a cell contains a time of day, with or without a date, rather than a number."""
    text = cell.strip()
    return _COMPACT.fullmatch(text) is not None or _TIME.search(text) is not None


def clock_seconds(
    cells: Sequence[str],
    rows: Sequence[str],
    dates: Sequence[str] | None = None,
    order: DateOrder | None = None,
    form: ClockForm | None = None,
) -> Floats:
    """Convert times of day in ``cells`` to seconds since the first; ``rows`` are the row labels for messages.

    ``dates`` are the cells of a separate date column. Otherwise a date may stand in the cell itself; without any date,
    a decrease by more than half a day is taken as midnight. ``order`` is the order of day and month in a date, ``form``
    the meaning of 08:10. Raises DataError for a cell that is no time, for an ambiguous time or date, and for a clock
    that changes its time zone by name.
    """
    stamps = [_stamp(cell, form, row) for cell, row in zip(cells, rows, strict=True)]
    seconds_of_day, zone_texts, date_texts = zip(*stamps, strict=True)
    zones = dict.fromkeys(re.sub(r"[+-].*", "", zone) for zone in zone_texts)
    if len(zones) > 1:
        raise DataError(f"the times are in several time zones ({', '.join(zones)})")
    seconds = np.array(seconds_of_day)
    days_in_words = date_texts if dates is None else [cell.strip() for cell in dates]
    if any(days_in_words):
        days = _days(days_in_words, rows, seconds, order)
        return np.asarray(_DAY * (days - days[0]) + (seconds - seconds[0]))
    midnights = np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -0.5 * _DAY)))
    return np.asarray(seconds - seconds[0] + _DAY * midnights)


def _stamp(cell: str, form: ClockForm | None, row: str) -> tuple[float, str, str]:
    """Return the time of day in a cell [s], its time zone, and the other text, which may be a date.

    The time is in UTC if the time zone states its offset; texts are empty if absent. Raises DataError, with ``row``
    first, if the time is absent or ambiguous.
    """
    text = one_line(cell.strip())
    compact = _COMPACT.fullmatch(text)
    if compact is not None:
        text = f"{compact['date']} {compact['hour']}:{compact['minute']}:{compact['second']}{compact['rest']}"
    shown = repr(text[:LONGEST_SHOWN])
    match = _TIME.search(text)
    if match is None:
        raise DataError(f"{row}: {shown} is not a time of day such as '08:00:10,5'")
    first = int(match["first"])
    second = int(match["second"])
    third = match["third"]
    if third is not None:
        hour = first
        minute = second
        whole_seconds = int(third)
    # 00:10.5 has a fraction, which minutes have not.
    elif form == "min:s" or (form is None and match["fraction"] is not None):
        hour = 0
        minute = first
        whole_seconds = second
    elif form == "h:min":
        hour = first
        minute = second
        whole_seconds = 0
    else:
        raise DataError(
            f'{row}: {shown} may be hours and minutes or minutes and seconds; give clock = "h:min" or clock = "min:s" '
            "in the column map"
        )
    half_of_day = (match["half"] or "").lower()
    # A leap second is the 60th; a logger that writes minutes and seconds alone may count minutes beyond 59.
    if (third is not None and minute > 59) or whole_seconds > 60 or (half_of_day and not 1 <= hour <= 12):
        raise DataError(f"{row}: {shown} is not a time of day")
    if half_of_day:
        hour = hour % 12 + (12 if half_of_day == "p" else 0)
    fraction = float(f"0.{match['fraction']}") if match["fraction"] else 0.0
    beside = f"{text[: match.start()]} {text[match.end() :]}".strip(" T,;")
    seconds = 3600.0 * hour + 60.0 * minute + whole_seconds + fraction
    zone = match["zone"] or ""
    offset = _OFFSET.search(zone)
    if offset is not None:
        seconds -= (-1.0 if offset[1] == "-" else 1.0) * (3600.0 * int(offset[2]) + 60.0 * int(offset[3] or 0))
    return seconds, zone, beside


def _days(words: Sequence[str], rows: Sequence[str], seconds: Floats, order: DateOrder | None) -> Floats:
    """Convert dates to day numbers. Raises DataError if the order of day and month is ambiguous."""
    orders: tuple[DateOrder, ...] = ("day month", "month day") if order is None else (order,)
    readings: list[Floats] = []
    unread_row = 0
    for possible in orders:
        # Many rows have one date.
        day_of = {word: _ordinal(word, possible) for word in dict.fromkeys(words)}
        days = [day_of[word] for word in words]
        if None in days:
            unread_row = days.index(None)
        else:
            readings.append(np.array(days, dtype=np.float64))
    if not readings:
        shown = words[unread_row][:LONGEST_SHOWN]
        raise DataError(
            f"{rows[unread_row]}: {shown!r} is not a date such as '2026-03-21', '21.03.2026' or '03/21/2026'"
        )
    # The days between two rows count, not the date; one that goes backwards is none.
    growing = [days for days in readings if (np.diff(_DAY * days + seconds) > 0.0).all()] or readings
    since_first = [days - days[0] for days in growing]
    if len(since_first) > 1 and not np.array_equal(since_first[0], since_first[1]):
        raise DataError(
            f'{rows[0]}: the date {words[0][:LONGEST_SHOWN]!r} is ambiguous; give date_order = "day month" or '
            'date_order = "month day" in the column map'
        )
    return growing[0]


def _ordinal(word: str, order: DateOrder) -> int | None:
    """Convert a date to its ordinal day number, None if the text is no date; names of weekdays are ignored."""
    text = word.strip(" ,")
    if match := _YEAR_FIRST.fullmatch(text):
        year, month, day = (int(part) for part in match.groups() if part is not None)
    elif match := _DOTTED.fullmatch(text):
        day, month, year = (int(part) for part in match.groups())
    elif match := _SLASHED.fullmatch(text):
        first, second, year = (int(part) for part in match.groups())
        day, month = (first, second) if order == "day month" else (second, first)
    else:
        parts = [part for part in re.split(r"[\s,./-]+", text) if part]
        months = [_MONTH[part[:3].lower()] for part in parts if part[:3].lower() in _MONTH]
        numbers = sorted(
            (int(part) for part in parts if part.isascii() and part.isdigit()), key=lambda number: number > 31
        )
        if len(months) != 1 or len(numbers) != 2:
            return None
        month = months[0]
        day, year = numbers
    try:
        return date(year + 2000 if year < 100 else year, month, day).toordinal()
    except ValueError:
        return None


def counted_on(time: Floats) -> Floats:
    """Remove overflows of a 32-bit counter (``micros()``, ``millis()``) from a time [s]; other times are unchanged."""
    steps = np.diff(time)
    falls = steps < 0.0
    if not falls.any() or not (steps > 0.0).any():
        return time
    usual_step = float(np.median(steps[steps > 0.0]))
    for period in _PERIODS:
        across_falls = steps[falls] + period
        if (across_falls > 0.0).all() and (across_falls <= _LARGEST_STEP * usual_step).all():
            return np.asarray(time + period * np.concatenate(([0.0], np.cumsum(falls))))
    return time
