"""Recorded files in, a gait out: tables, map, filter, strides, checks, mean curves and their series."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.fourier import HARMONICS, FitError, fit_curve
from ppafo.gait.gait import REQUIRED, Curve, Gait, Origin
from ppafo.gait.plausible.checked import MeanStride, SignSource
from ppafo.gait.plausible.loads import check_force_scale, force_remarks
from ppafo.gait.plausible.stride import check_plausible
from ppafo.gait.recorded.drop_outs import check_constant
from ppafo.gait.recorded.events import Stride, strides_from_force, strides_from_shank
from ppafo.gait.recorded.knee import check_way, knee_remarks
from ppafo.gait.recorded.mapping import CONVENTIONS, GaitMap, Side
from ppafo.gait.recorded.noise import check_scatter, scatter_remarks
from ppafo.gait.recorded.settings import ImportSettings, check_settings
from ppafo.gait.recorded.signal import Signal, low_pass
from ppafo.gait.recorded.strides import CurveStatistics, mean_curve, strides_within, without_outliers
from ppafo.gait.recorded.table import CSV, MotionTable, read_table
from ppafo.gait.recorded.walk import Person, walk_signals

LARGEST_STRIDE_CHANGE = 0.25
"""Fraction of the median stride time; a stride that differs by more has a missed event, or is not steady walking."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedGait:
    """The gait, its strides, the curves of each stride by name, errors of the series, and remarks.

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
    check_settings(settings)
    signs_from: SignSource = "columns" if settings.columns is None else "map"
    tables = [read_table(path) for path in files]
    if not tables:
        raise DataError("no file was given; a gait needs at least the angles of shank and ankle")
    columns = settings.columns or _convention(tables, settings.side)
    person = Person(settings.body_mass, settings.stature)
    walk = walk_signals(tables, columns, person, is_default=settings.columns is None)
    events = "vertical_force" if "vertical_force" in walk else "shank_angle"
    found = _strides(walk, events, signs_from)
    smooth = walk if settings.low_pass is None else {n: low_pass(s, settings.low_pass) for n, s in walk.items()}
    usable = [item for item in found if all(strides_within(walk[name], [item]) for name in REQUIRED)]
    strides, left_out = without_outliers(usable, LARGEST_STRIDE_CHANGE)
    _check_enough(strides, found, {name: walk[name] for name in (*REQUIRED, events)}, settings.least_strides)
    check_constant(walk, tables, strides, left_out)
    curves = {name: mean_curve(name, signal, strides) for name, signal in smooth.items()}
    fraction, time = _mean([item.stance_share for item in strides]), _mean([item.time for item in strides])
    means = {name: item.mean for name, item in curves.items()}
    fitted = {name: fit_curve(item.mean, HARMONICS[name], item.spread) for name, item in curves.items()}
    errors = {name: error for name, (_, error) in fitted.items()}
    check_scatter(curves, errors, walk)
    check_plausible(MeanStride({name: signal.file for name, signal in walk.items()}, means, fraction, time, signs_from))
    check_way(walk, signs_from)
    gait = _gait(settings, tables, strides, {name: curve for name, (curve, _) in fitted.items()}, events)
    remarks = (*_remarks(curves, strides, left_out), *knee_remarks(columns.knee, walk, settings.stature))
    remarks += tuple(scatter_remarks(curves, errors))
    names = tuple(str(path) for path in files)
    return ImportedGait(gait, tuple(strides), tuple(left_out), curves, errors, events, names, remarks)


def _convention(tables: Sequence[MotionTable], side: Side) -> GaitMap:
    """Return the convention of the package for the files."""
    forms = sorted({table.form for table in tables})
    if len(forms) > 1:
        raise DataError(
            f"the files have different formats ({', '.join(forms)}); name the columns of all of them in a gait map"
        )
    if forms[0] == CSV and side != "right":
        raise DataError("a CSV file without a gait map has the columns of one foot; --side left has no meaning there")
    return CONVENTIONS[forms[0]](side)


def _strides(walk: Mapping[str, Signal], events: str, signs_from: SignSource) -> list[Stride]:
    if events != "vertical_force":
        return strides_from_shank(walk[events])
    check_force_scale(walk[events].file, walk[events].values, signs_from)
    return strides_from_force(walk[events])


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
        knee_forward=curves.get("knee_forward"),
        knee_up=curves.get("knee_up"),
    )


def _remarks(
    curves: Mapping[str, CurveStatistics],
    strides: Sequence[Stride],
    left_out: Sequence[Stride],
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
    if "vertical_force" not in curves:
        return [*remarks, "no vertical force: heel strikes and toe-offs come from the shank and are less exact"]
    return remarks + force_remarks(curves["vertical_force"].mean)
