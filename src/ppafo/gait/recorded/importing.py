"""Recorded files in, a gait out: tables, map, filter, strides, checks, mean curves and their series."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.fourier import HARMONICS, FitError, fit_curve
from ppafo.gait.gait import REQUIRED, Curve, Gait, Origin
from ppafo.gait.plausible.angles import standing_tilt, zero_remarks
from ppafo.gait.plausible.checked import MeanStride
from ppafo.gait.plausible.loads import force_remarks
from ppafo.gait.plausible.stride import check_plausible
from ppafo.gait.recorded.columns import LOADS
from ppafo.gait.recorded.drop_outs import check_constant
from ppafo.gait.recorded.events import Stride
from ppafo.gait.recorded.footfalls import (
    LEAST_STRIDES,
    SHANK,
    Footfalls,
    find_footfalls,
    strides_of_curve,
    usable_strides,
)
from ppafo.gait.recorded.knee import check_way, knee_remarks
from ppafo.gait.recorded.mapping import GaitMap
from ppafo.gait.recorded.noise import check_scatter, scatter_remarks
from ppafo.gait.recorded.settings import ImportSettings, check_settings
from ppafo.gait.recorded.signal import Signal, low_pass
from ppafo.gait.recorded.source import Source, read_source
from ppafo.gait.recorded.strides import CurveStatistics, mean_curve, strides_within, without_outliers
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats

LARGEST_STRIDE_CHANGE = 0.25
"""Fraction of the median stride time; a stride that differs by more has a missed event, or is not steady walking."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedGait:
    """The gait, its strides, the curves of each stride by name, errors of the series, and remarks.

    ``events`` says where the strides come from: ``vertical_force``, ``shank_angle`` or ``events of the file``.
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
    """Return the mean stride in recorded files (.mot, .sto, .csv, .c3d, .trc) of one walk of one person on one clock.

    Strides come from the vertical force where there is one, else from events of the file or from the shank. DataError
    names what is wrong with file, column and row, and what to do. What was mended is among the remarks.
    """
    check_settings(settings)
    source = read_source(files, settings)
    signs_from, settings = source.signs_from, source.settings
    footfalls = find_footfalls(source.walk, source.tables, settings.side, signs_from, settings.least_strides)
    walk, events, found = footfalls.walk, footfalls.events, footfalls.strides
    strides, left_out = without_outliers(usable_strides(walk, found), LARGEST_STRIDE_CHANGE)
    least = settings.least_strides or (1 if footfalls.is_one_cycle or footfalls.is_overground else LEAST_STRIDES)
    _check_enough(strides, found, {name: walk[name] for name in (*REQUIRED, events) if name in walk}, least)
    covered = {name: strides_of_curve(footfalls, name, signal, strides) for name, signal in walk.items()}
    unmeasured = [name for name in LOADS if name in walk and not covered[name] and strides_within(walk[name], strides)]
    walk = {name: signal for name, signal in walk.items() if name not in unmeasured}
    check_constant(walk, source.tables, strides, covered, left_out)
    smooth = walk if settings.low_pass is None else {n: low_pass(s, settings.low_pass) for n, s in walk.items()}
    curves = {name: mean_curve(name, signal, strides, covered[name]) for name, signal in smooth.items()}
    remarks = [*source.remarks, *footfalls.remarks, *(_NOT_MEASURED.format(name) for name in unmeasured)]
    return _finish(source, replace(footfalls, walk=walk), curves, (strides, left_out), remarks)


_NOT_MEASURED = "{} is left out: in no whole stride was it measured throughout the stance"


def _finish(
    source: Source,
    footfalls: Footfalls,
    curves: Mapping[str, CurveStatistics],
    strides: tuple[list[Stride], list[Stride]],
    remarks: Sequence[str],
) -> ImportedGait:
    """Return the gait of mean curves that legs can have; ``strides`` are those taken and those left out."""
    (taken, left_out), walk, settings, signs_from = strides, footfalls.walk, source.settings, source.signs_from
    share, time = _mean([item.stance_share for item in taken]), _mean([item.time for item in taken])
    means = {name: item.mean for name, item in curves.items()}
    fitted = {name: fit_curve(item.mean, HARMONICS[name], item.spread) for name, item in curves.items()}
    errors = {name: error for name, (_, error) in fitted.items()}
    check_scatter(curves, errors, walk)
    check_plausible(MeanStride({name: signal.file for name, signal in walk.items()}, means, share, time, signs_from))
    check_way(walk, signs_from)
    gait = _gait(settings, source.tables, taken, {name: curve for name, (curve, _) in fitted.items()}, footfalls.events)
    said = [*remarks, *_remarks(curves, taken, left_out, footfalls.events)]
    said += knee_remarks(source.columns.knee, walk, settings.stature)
    said += [*_zero_remarks(source.columns, means), *scatter_remarks(curves, errors)]
    names = tuple(table.file for table in source.tables)
    return ImportedGait(
        gait, tuple(taken), tuple(left_out), curves, errors, footfalls.events, names, tuple(dict.fromkeys(said))
    )


def _zero_remarks(columns: GaitMap, means: Mapping[str, Floats]) -> list[str]:
    """Return what there is to say of the ankle's zero, with the reading that would be neutral."""
    tilt = standing_tilt(means["shank_angle"], means["ankle_angle"])
    sign, taken_off = columns.ankle_angle.sign_and_neutral()
    neutral = float(np.degrees(taken_off)) + sign * tilt
    return zero_remarks(tilt, f"--ankle-neutral '{neutral:.1f} deg', or ankle_angle.neutral in a gait map, corrects it")


def _check_enough(strides: list[Stride], found: list[Stride], walk: Mapping[str, Signal], least: int) -> None:
    if len(strides) >= least:
        return
    spans = ", ".join(f"{name} {item.time[0]:.4g} to {item.time[-1]:.4g} s" for name, item in walk.items())
    count = f"{len(strides)} whole stride{'' if len(strides) == 1 else 's'}"
    where = list(walk)[-1]
    events = (
        f"{len(found)} in the events" if found else f"no heel strikes were found in {where}: is it the right column?"
    )
    raise DataError(
        f"{walk['shank_angle'].file}: has {count} within angles and events ({events}; {spans}), {least} are needed; "
        "give a longer recording, or accept fewer with --minimum-strides"
    )


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
        body_mass=settings.body_mass or 0.0,
        stature=settings.stature,
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
        knee_forward=curves.get("knee_forward"),
        knee_up=curves.get("knee_up"),
    )


def _remarks(
    curves: Mapping[str, CurveStatistics],
    strides: Sequence[Stride],
    left_out: Sequence[Stride],
    events: str,
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
    if "vertical_force" in curves:
        return remarks + force_remarks(curves["vertical_force"].mean)
    less = ": heel strikes and toe-offs come from the shank and are less exact" if events == SHANK else ""
    return [*remarks, f"no vertical force{less}"]
