"""Signals of the curves over time: sums of columns in SI units, gaps, low-pass filter, and the knee from its hip."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import DataError, Faults, UnitError, refused_as
from ppafo.gait.gait import HARMONICS
from ppafo.gait.recorded.mapping import KneeMap, column_names, setting_text, unsigned_names
from ppafo.gait.recorded.table import COORDINATES, MotionTable, marker_of
from ppafo.signals.recording import Floats
from ppafo.units import parse_quantity, to_si
from ppafo.wording import nearest_name, one_line

_MINIMUM_SAMPLES = 20
"""Least number of samples for the low pass."""
_ORDER = 2
"""Order of the Butterworth low pass, which is applied twice."""
_DOUBLE_PASS = (2.0**0.5 - 1.0) ** 0.25
"""Ratio of the -3 dB frequencies of two passes and of a single pass (Winter, Biomechanics, section 2.4)."""
LOADS = ("ankle_moment", "vertical_force", "centre_of_pressure")
"""Curves that are undefined while the foot is off a force plate, which does not count as a gap."""
_RATE = "rad/s"
_NOT_INTEGRATED = "; integrate it over each stride, less its mean over the stride, and set the zero while standing"
# Limits of an error message: number of column names, and characters of the names and of a remark.
_MOST_NAMES = 12
_LONGEST_TEXT = 160
THIGH_FRACTION = 0.245
"""Thigh length as a fraction of the stature: figure 4.1 of Winter, Biomechanics and Motor Control of Human Movement,
4th ed. 2009."""
_LENGTHS = (0.2, 0.7)
"""Plausible lengths of a thigh [m]."""
_HIP_HEIGHT = 0.3
"""Depth of the hip below the origin [m] above which the sign is wrong; laboratories have no origin above the hip."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Signal over time [s] from one file, with nearly uniform sampling.

    ``is_position`` marks a position [m], whose acceleration is a curve of the gait. ``columns`` are the columns of the
    file that were used. ``absent`` marks samples of a load that were not measured and are set to 0, None if complete.
    ``lost`` marks samples of a motion that were not recorded and are interpolated linearly, None if complete.
    """

    file: str
    time: Floats
    values: Floats
    is_position: bool = False
    columns: tuple[str, ...] = ()
    absent: NDArray[np.bool_] | None = None
    lost: NDArray[np.bool_] | None = None

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))


def without_ends(signal: Signal) -> Signal:
    """Return a motion from its first to its last valid sample, with gaps interpolated linearly and marked as lost."""
    valid = np.flatnonzero(np.isfinite(signal.values))
    inside = slice(int(valid[0]), int(valid[-1]) + 1)
    time = signal.time[inside]
    values = signal.values[inside]
    gaps = ~np.isfinite(values)
    if not gaps.any():
        return replace(signal, time=time, values=values)
    return replace(signal, time=time, values=np.interp(time, time[~gaps], values[~gaps]), lost=gaps)


def with_absence(signal: Signal) -> Signal:
    """Return a load set to 0 where it was not measured, with these samples marked as absent."""
    absent = ~np.isfinite(signal.values)
    return signal if not absent.any() else replace(signal, values=np.where(absent, 0.0, signal.values), absent=absent)


def low_pass(signal: Signal, cut_off: float) -> Signal:
    """Return the signal filtered forwards and backwards by a Butterworth low pass, -3 dB at ``cut_off`` [Hz].

    Raises DataError for a signal with too few samples.
    """
    from scipy.signal import butter, sosfiltfilt

    if signal.time.size < _MINIMUM_SAMPLES:
        raise DataError(f"{signal.file}: {signal.time.size} rows are too few for a stride")
    # A filter needs even samples; the jitter of a clock is small beside a stride.
    even = np.linspace(signal.time[0], signal.time[-1], signal.time.size)
    relative = cut_off / _DOUBLE_PASS / (0.5 * signal.rate)
    if relative >= 1.0:
        raise DataError(
            f"{signal.file}: has {signal.rate:.4g} samples per second, so a cut-off frequency must be below "
            f"{0.5 * signal.rate * _DOUBLE_PASS:.3g} Hz, not {cut_off:g} Hz"
        )
    sections = butter(_ORDER, relative, output="sos")
    values = sosfiltfilt(sections, np.interp(even, signal.time, signal.values))
    return replace(signal, time=even, values=np.asarray(values, dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class CurveColumns:
    """Columns of a curve: unit key in a gait map, table, and terms as pairs of sign and column name."""

    unit_key: str
    table: MotionTable
    terms: tuple[tuple[float, str], ...]

    def in_unit(self, stated: str | None, si_units: Sequence[str]) -> tuple[Floats, str]:
        """Return the sum of the terms in the first SI unit that fits, and this unit; raises DataError if none fits."""
        total = np.zeros(self.table.time.size)
        chosen = si_units[0]
        wrong = Faults()
        for sign, name in self.terms:
            if self.unit_key.partition(".")[0] not in LOADS:
                with wrong:
                    check_recorded(self.table.columns[name], f"{self.table.file}: column {name!r}")
            where = f"{self.table.file}: column {name!r}"
            unit = stated or self.table.units[name]
            problem = f" [{unit}]: " if unit else f" has no unit, in the file or as {self.unit_key} of a gait map"
            for si_unit in (*si_units, _RATE) if unit else ():
                try:
                    # Units are affine: two conversions give scale and zero for a whole column.
                    zero, one = (to_si(number, "" if unit == "-" else unit, si_unit) for number in (0.0, 1.0))
                except UnitError as error:
                    problem += str(error) if si_unit == si_units[0] else ""
                    continue
                if si_unit == _RATE:
                    problem += _NOT_INTEGRATED
                    break
                total = total + sign * (zero + (one - zero) * self.table.columns[name])
                chosen = si_unit
                problem = ""
                break
            wrong += [DataError(f"{where}{problem}")] if problem else []
        wrong.raise_all()
        return total, chosen


def check_recorded(values: Floats, where: str) -> None:
    """Raise DataError for a column without any number; ``where`` is its name in the message."""
    if not np.isfinite(values).any():
        raise DataError(f"{where} contains no numbers")


def find_columns(curve: str, mapped: object, tables: Sequence[MotionTable], optional: bool) -> CurveColumns | None:
    """Return the columns of a curve from the one table that has all of them; None for an optional curve without any."""
    unsigned = unsigned_names(mapped)
    # One table must have all terms: files need not share a clock to the sample.
    holders = [table for table in tables if unsigned and table.columns.keys() >= set(unsigned)]
    if len(holders) > 1:
        files = " and ".join(table.file for table in holders)
        raise DataError(f"{curve}: {files} both have the column {unsigned[0]!r}")
    if holders:
        signs = [-1.0 if name.startswith("-") else 1.0 for name in column_names(mapped)]
        return CurveColumns(f"{curve}.unit", holders[0], tuple(zip(signs, unsigned, strict=True)))
    if not (optional and not any(name in table.columns for name in unsigned for table in tables)):
        refuse_missing({curve: unsigned}, tables)
    return None


def refuse_missing(names: Mapping[str, Sequence[str]], tables: Sequence[MotionTable]) -> NoReturn:
    """Raise DataError for missing columns of curves; ``names`` are the unsigned columns of each curve.

    The message has the nearest name for each missing column, and the columns and remarks of the files, shortened. A
    column name that a file has more than once is another fault.
    """
    known = [name for table in tables for name in table.columns]
    reasons = []
    files = ", ".join(table.file for table in tables)
    for curve, wanted in names.items():
        missing = next((name for name in wanted if name not in known), wanted[0])
        twins = [name for name in known if re.fullmatch(re.escape(marker_of(missing)) + r"#\d+(\.[xyz])?", name)]
        if twins:
            either = " or ".join(repr(marker_of(name)) for name in twins if name[-2:] not in COORDINATES[1:])
            raise DataError(
                f"{curve}: {files} has several different columns {marker_of(missing)!r}; choose {either} in a gait "
                f"map ({setting_text('columns')})"
            )
        reason = f"there is no column {missing!r}{nearest_name(missing, known)}"
        reasons.append(f"{curve}: {'no file has all columns of this curve' if missing in known else reason}")
    # A marker counts once, not by its coordinates.
    markers = list(dict.fromkeys(one_line(marker_of(name)) for name in known))
    first_names = ", ".join(markers[:_MOST_NAMES]) + (", ..." if len(markers) > _MOST_NAMES else "")
    texts = [first_names, *(one_line(remark) for table in tables for remark in table.remarks)]
    listed = "; ".join(shorten(text, _LONGEST_TEXT, placeholder=" ...") for text in texts)
    message = f"{'; '.join(reasons)} ({files}: {listed}); a gait map ({setting_text('columns')}) names other columns"
    raise DataError(message)


def knee_signals(
    mapped: KneeMap | None, tables: Sequence[MotionTable], stature: float | None, is_default: bool
) -> dict[str, Signal]:
    """Return ``knee_forward`` and ``knee_up``, each a position [m] or an acceleration [m/s^2].

    With a thigh, they are the position of the knee, computed in the sagittal plane from the hip position in the columns
    of the map and the lean of the thigh. Raises DataError if a column, unit or length is missing or inconsistent.
    """
    if mapped is None or (is_default and mapped.thigh and mapped.thigh_length is None and stature is None):
        return {}
    if mapped.thigh and mapped.thigh_length is None and stature is None:
        raise DataError("knee.thigh needs knee.thigh_length, or the stature")
    found = find_columns("knee", mapped, tables, is_default)
    if found is None:
        return {}
    ends = len(mapped.forward), len(mapped.forward) + len(mapped.up)
    forward, unit = replace(found, terms=found.terms[: ends[0]]).in_unit(mapped.unit, ("m/s^2", "m"))
    up, other = replace(found, terms=found.terms[slice(*ends)]).in_unit(mapped.unit, ("m/s^2", "m"))
    if mapped.thigh is not None:
        if "m/s^2" in (unit, other):
            raise DataError(f"{found.table.file}: knee.thigh needs hip positions in m, not accelerations in m/s^2")
        leaning = replace(found, terms=found.terms[ends[1] :], unit_key="knee.thigh_unit")
        lean, _ = leaning.in_unit(mapped.thigh_unit, ("rad",))
        for values, terms in ((forward, mapped.forward), (up, mapped.up)):
            if np.ptp(values) == 0.0:
                raise DataError(f"{found.table.file}: the hip does not move ({', '.join(terms)} is constant)")
        height = float(np.mean(up[np.isfinite(up)]))
        if -height > _HIP_HEIGHT:
            raise DataError(
                f"{found.table.file}: the hip is {height:.2f} m high ({', '.join(mapped.up)}): the sign of knee.up is "
                "reversed"
            )
        # The file has the hip: the knee follows by the lean of the thigh.
        forward, up = knee_position(forward, up, lean, _thigh_length(mapped, stature))
    file = found.table.file
    time = found.table.time
    columns = tuple(dict.fromkeys(name for _, name in found.terms))
    return {
        "knee_forward": Signal(file, time, forward, unit == "m", columns),
        "knee_up": Signal(file, time, up, other == "m", columns),
    }


def knee_remarks(mapped: KneeMap | None, walk: Mapping[str, Signal], stature: float | None) -> list[str]:
    """Return remarks on the source of the knee's acceleration, or the reason for its absence; ``stature`` in [m].

    Raises DataError for an implausible length of the thigh.
    """
    if mapped is None or "knee_forward" not in walk:
        lacks_length = mapped is not None and mapped.thigh is not None
        why = f"the thigh length is unknown without {setting_text('stature')}" if lacks_length else "it has no columns"
        return [f"no acceleration of the knee: {why}"]
    remarks = []
    if mapped.thigh is not None and mapped.thigh_length is None:
        remarks.append(
            f"thigh length is {_thigh_length(mapped, stature):.3f} m, {THIGH_FRACTION:g} of the stature (Winter 2009)"
        )
    if walk["knee_forward"].is_position:
        remarks.append(
            f"acceleration of the knee from a Fourier series of its position, {HARMONICS['knee_forward']} harmonics"
        )
    return remarks


def knee_position(hip_forward: Floats, hip_up: Floats, lean: Floats, thigh_length: float) -> tuple[Floats, Floats]:
    """Return the knee position, forward and up [m]; ``lean`` of the thigh [rad], positive with the knee in front."""
    return hip_forward + thigh_length * np.sin(lean), hip_up - thigh_length * np.cos(lean)


def _thigh_length(mapped: KneeMap, stature: float | None) -> float:
    if mapped.thigh_length is None:
        return THIGH_FRACTION * (stature or 0.0)
    where = f"knee.thigh_length = {mapped.thigh_length!r}"
    low, high = _LENGTHS
    with refused_as(DataError, where, UnitError):
        length = parse_quantity(mapped.thigh_length, "m")
    if not low <= length <= high:
        raise DataError(f"{where}: must be from {low:g} to {high:g} m")
    return length
