"""Recorded files in, a gait out: tables, map, filter, strides, checks, mean curves and their series."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ppafo.documents.models import NAME
from ppafo.errors import DataError
from ppafo.gait.fourier import HARMONICS, FitError, fit_curve
from ppafo.gait.gait import REQUIRED, Curve, Gait, Origin
from ppafo.gait.recorded.checks import Checked, check_force_scale, check_plausible
from ppafo.gait.recorded.events import Stride, strides_from_force, strides_from_shank
from ppafo.gait.recorded.mapping import CONVENTIONS, GaitMap, Side
from ppafo.gait.recorded.signal import Signal, low_passed
from ppafo.gait.recorded.strides import CurveStatistics, covered, statistics, without_outliers
from ppafo.gait.recorded.table import CSV, MotionTable, read_table
from ppafo.gait.recorded.walk import recorded_walk

LARGEST_STRIDE_CHANGE = 0.25
"""Share of the median stride time; a stride that differs by more has a missed event in it, or is no steady walking."""

_UNLOADED_FORCE = 0.02
_NAME = "imported-gait"


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What the files do not say: body mass [kg], side, speed [m/s], map, low pass [Hz], least number of strides."""

    body_mass: float
    side: Side = "right"
    columns: GaitMap | None = None
    walking_speed: float | None = None
    low_pass: float | None = None
    least_strides: int = 2
    name: str = _NAME
    title: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedGait:
    """The gait, the strides behind it, the curves of each stride by name, errors of the series, and remarks.

    ``events`` says where the strides come from: ``vertical_force`` or ``shank_angle``.
    """

    gait: Gait
    strides: tuple[Stride, ...]
    left_out: tuple[Stride, ...]
    curves: Mapping[str, CurveStatistics]
    fit_errors: Mapping[str, FitError]
    events: str
    files: tuple[str, ...]
    remarks: tuple[str, ...] = field(default=())


def import_gait(files: Sequence[str | Path], settings: ImportSettings) -> ImportedGait:
    """Return the mean stride in recorded files (.mot, .sto, .csv, .c3d) of one walk of one person on one clock.

    Strides come from the vertical force where there is one, else from the shank. DataError names what is wrong with
    file, column and row, and what to do.
    """
    _check_settings(settings)
    tables = [read_table(path) for path in files]
    if not tables:
        raise DataError("no file was given; a gait needs at least the angles of shank and ankle")
    walk = _walk(tables, settings)
    events = "vertical_force" if "vertical_force" in walk else "shank_angle"
    found = _strides(walk, events)
    smooth = walk if settings.low_pass is None else {n: low_passed(s, settings.low_pass) for n, s in walk.items()}
    usable = [item for item in found if all(covered(walk[name], [item]) for name in REQUIRED)]
    strides, left_out = without_outliers(usable, LARGEST_STRIDE_CHANGE)
    _check_enough(strides, found, walk, settings.least_strides)
    curves = {name: _curve(name, signal, strides) for name, signal in smooth.items()}
    share, time = _mean([item.stance_share for item in strides]), _mean([item.time for item in strides])
    means = {name: item.mean for name, item in curves.items()}
    check_plausible(Checked({name: signal.file for name, signal in walk.items()}, means, share, time))
    fitted = {name: fit_curve(item.mean, HARMONICS[name], item.spread) for name, item in curves.items()}
    gait = _gait(settings, tables, strides, {name: curve for name, (curve, _) in fitted.items()}, events)
    errors = {name: error for name, (_, error) in fitted.items()}
    remarks = tuple(_remarks(curves, strides, left_out, walk))
    names = tuple(str(path) for path in files)
    return ImportedGait(gait, tuple(strides), tuple(left_out), curves, errors, events, names, remarks)


def _check_settings(settings: ImportSettings) -> None:
    if not 1.0 <= settings.body_mass <= 500.0:
        raise DataError(f"a body mass of {settings.body_mass:g} kg is not plausible; give it in kg, such as '62 kg'")
    if settings.walking_speed is not None and not 0.05 <= settings.walking_speed <= 4.0:
        raise DataError(f"a walking speed of {settings.walking_speed:g} m/s is not plausible; walking is 0.05 to 4 m/s")
    if settings.low_pass is not None and not (math.isfinite(settings.low_pass) and settings.low_pass >= 1.0):
        raise DataError(f"a low pass at {settings.low_pass:g} Hz takes the walking away; 6 Hz is usual")
    if re.fullmatch(NAME, settings.name) is None:
        raise DataError(f"name {settings.name!r} must consist of small letters, digits, '-' and '_'")
    if settings.least_strides < 1:
        raise DataError(f"the least number of strides is 1, not {settings.least_strides}")


def _walk(tables: Sequence[MotionTable], settings: ImportSettings) -> dict[str, Signal]:
    """Return the signals, through the user's map or the convention of the files."""
    if settings.columns is not None:
        return recorded_walk(tables, settings.columns, settings.body_mass, is_default=False)
    forms = sorted({table.form for table in tables})
    if len(forms) > 1:
        raise DataError(
            f"the files are of different forms ({', '.join(forms)}); name the columns of all of them in a gait map"
        )
    if forms[0] == CSV and settings.side != "right":
        raise DataError("a CSV file without a gait map has the columns of one foot; --side left has no meaning there")
    columns = CONVENTIONS[forms[0]](settings.side)
    return recorded_walk(tables, columns, settings.body_mass, is_default=True)


def _strides(walk: Mapping[str, Signal], events: str) -> list[Stride]:
    if events != "vertical_force":
        return strides_from_shank(walk[events])
    check_force_scale(walk[events].file, walk[events].values)
    return strides_from_force(walk[events])


def _check_enough(strides: list[Stride], found: list[Stride], walk: Mapping[str, Signal], least: int) -> None:
    if len(strides) >= least:
        return
    spans = ", ".join(f"{name} {item.time[0]:.4g} to {item.time[-1]:.4g} s" for name, item in walk.items())
    count = f"{len(strides)} whole stride{'' if len(strides) == 1 else 's'}"
    events = f"{len(found)} in the events" if found else "no heel strikes were found"
    raise DataError(
        f"{walk['shank_angle'].file}: has {count} within angles and events ({events}; {spans}), {least} are needed; "
        "give a longer recording, or ask for fewer with --least-strides"
    )


def _curve(name: str, signal: Signal, strides: Sequence[Stride]) -> CurveStatistics:
    """Return the curves of the strides that a signal covers; at least one has to be."""
    inside = covered(signal, strides)
    if not inside:
        raise DataError(
            f"{signal.file}: {name} goes from {signal.time[0]:.4g} to {signal.time[-1]:.4g} s and covers no whole "
            f"stride ({strides[0].start:.4g} to {strides[0].end:.4g} s is the first); give a longer file, or "
            "leave it out"
        )
    result = statistics(signal, inside)
    return _bridged(result) if name == "centre_of_pressure" else result


def _bridged(result: CurveStatistics) -> CurveStatistics:
    """Return a centre of pressure with a straight line over swing, where it has no meaning."""
    phases = np.linspace(0.0, 1.0, result.mean.size)
    share = _mean([item.stance_share for item in result.strides])
    inside = (phases > _UNLOADED_FORCE) & (phases < share - _UNLOADED_FORCE)
    at, first = phases[inside], float(result.mean[inside][0])
    mean = np.interp(phases, [*at, 1.0 + at[0]], [*result.mean[inside], first], period=None)
    deviation = np.where(inside, result.deviation, 0.0)
    return CurveStatistics(result.curves, mean, deviation, result.strides)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


def _spread(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


def _gait(
    settings: ImportSettings,
    tables: Sequence[MotionTable],
    strides: Sequence[Stride],
    curves: Mapping[str, Curve],
    events: str,
) -> Gait:
    origin: Origin = "measured" if all(table.kind == "measured" for table in tables) else "synthetic"
    names = ", ".join(Path(table.file).name for table in tables)
    return Gait(
        name=settings.name,
        title=settings.title or f"Mean of {len(strides)} strides, {settings.side} foot",
        origin=origin,
        source=f"imported from {names}, {settings.side} foot; strides from the {events.replace('_', ' ')}",
        body_mass=settings.body_mass,
        walking_speed=settings.walking_speed,
        stride_time=_mean([item.time for item in strides]),
        stance_share=_mean([item.stance_share for item in strides]),
        stride_time_deviation=_spread([item.time for item in strides]),
        stance_share_deviation=_spread([item.stance_share for item in strides]),
        strides=len(strides),
        shank_angle=curves["shank_angle"],
        ankle_angle=curves["ankle_angle"],
        ankle_moment=curves.get("ankle_moment"),
        vertical_force=curves.get("vertical_force"),
        centre_of_pressure=curves.get("centre_of_pressure"),
    )


def _remarks(
    curves: Mapping[str, CurveStatistics],
    strides: Sequence[Stride],
    left_out: Sequence[Stride],
    walk: Mapping[str, Signal],
) -> list[str]:
    remarks = [
        f"stride from {item.start:.4g} to {item.end:.4g} s left out: {item.time:.3g} s long, the others are about "
        f"{_mean([stride.time for stride in strides]):.3g} s"
        for item in left_out
    ]
    remarks += [
        f"{name} covers {len(item.strides)} of {len(strides)} strides"
        for name, item in curves.items()
        if len(item.strides) < len(strides)
    ]
    if "vertical_force" not in walk:
        remarks.append("no vertical force: heel strikes and toe-offs come from the shank and are less exact")
    return remarks
