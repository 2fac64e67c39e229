"""Import of a gait from recorded files: selection of strides, checks, mean curves and their Fourier series."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.gait.agreement import check_side, delay_remarks, size_remarks
from ppafo.gait.document import load_gait
from ppafo.gait.gait import HARMONICS, REQUIRED, FitError, Gait, Origin, fit_curve
from ppafo.gait.mean_stride import MeanStride
from ppafo.gait.plausible import check_force_scale, check_plausible, force_remarks, moment_remarks
from ppafo.gait.plausible_angles import sign_remarks, standing_tilt, zero_remarks
from ppafo.gait.plausible_knee import turning_remarks
from ppafo.gait.recorded.columns import LOADS
from ppafo.gait.recorded.contacts import contacts_of
from ppafo.gait.recorded.curves import CurveStatistics, check_scatter, over_strides, scatter_remarks, statistics
from ppafo.gait.recorded.footfalls import (
    FORCE,
    LEAST_STRIDES,
    SHANK,
    Footfalls,
    Stride,
    find_footfalls,
    heel_strikes,
    lost_in,
    strides_of_curve,
    strides_within,
    usable_strides,
)
from ppafo.gait.recorded.knee import check_direction, knee_remarks
from ppafo.gait.recorded.mapping import ImportSettings, check_settings, setting_text
from ppafo.gait.recorded.signal import Signal, low_pass
from ppafo.gait.recorded.source import GaitSource, of_largest_one, read_source
from ppafo.gait.recorded.strides import StrideSelection, of_usual_time, without_drop_outs, without_odd_shapes
from ppafo.gait.recorded.table import LONGEST_FILLED
from ppafo.wording import count_of


@dataclass(frozen=True, slots=True, eq=False)
class ImportedGait:
    """Imported gait with the strides, curves and fit errors behind it.

    ``strides`` are the strides used and ``left_out`` the strides rejected. ``curves`` holds the single strides by curve
    name, ``fit_errors`` the errors of the Fourier series. ``events`` is the source of the strides: ``vertical_force``,
    ``shank_angle`` or ``events of the file``. ``files`` are the names of the files, ``remarks`` the sentences for the
    user.
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
    """Return the mean stride of one walk of one person, from recorded files that share a clock.

    The files may be of any format of ``source.FORMS``: .mot, .sto, .csv, .txt, .tsv, .emt, .c3d, .trc, .mat.

    Strides come from the vertical force if available, otherwise from events of the file or from the shank. Raises a
    DataError that lists all problems with file, column, row and remedy: after a problem with one curve, the other
    curves are still checked. Repaired values are listed in the remarks.
    """
    wrong: list[PpafoError] = []
    with noted_in(wrong):
        check_settings(settings)
    source = read_source(files, settings, wrong)
    settings = source.settings
    walk, footfalls = dict(source.walk), None
    if FORCE in walk:
        try:
            check_force_scale(walk[FORCE].file, walk[FORCE].values, source.signs_from)
        except DataError as error:
            wrong.append(error)
            # Scaled to 1, so that its events are still found.
            walk[FORCE] = of_largest_one(walk[FORCE], is_upwards=True)
    with noted_in(wrong):
        footfalls = find_footfalls(walk, source.tables, settings.side, settings.least_strides)
    if footfalls is None:
        raise_noted(wrong)
    walk = dict(footfalls.walk)
    least = settings.least_strides or (1 if footfalls.is_one_cycle or footfalls.is_overground else LEAST_STRIDES)
    strides = of_usual_time(usable_strides(walk, footfalls.strides), least)
    counts = [(stride, max(lost_in(walk[name], stride) for name in REQUIRED)) for stride in footfalls.strides]
    lost = [(stride, f"markers or angles lost in {count_of(count, 'frame')}") for stride, count in counts if count]
    strides = replace(strides, left_out=(*strides.left_out, *lost))
    sources = {name: walk[name] for name in (*REQUIRED, footfalls.events) if name in walk}
    with noted_in(wrong):
        _check_enough(strides, footfalls.strides, sources)
    if not strides.taken:
        raise_noted(wrong)
    covered = {name: strides_of_curve(footfalls, name, signal, strides.taken) for name, signal in walk.items()}
    # A load that no plate measured for a whole stance would otherwise look like one whose file is too short.
    unmeasured = [
        name for name in LOADS if name in walk and not covered[name] and strides_within(walk[name], strides.taken)
    ]
    walk = {name: signal for name, signal in walk.items() if name not in unmeasured}
    strides = without_drop_outs(walk, source.tables, covered, strides, wrong)
    # Footfalls come from the unfiltered force, whose edges a low pass would move.
    smooth = walk
    if settings.low_pass is not None:
        smooth = {name: low_pass(signal, settings.low_pass) for name, signal in walk.items()}
    curves = {
        name: statistics(name, signal, [stride for stride in covered[name] if stride in strides.taken])
        for name, signal in smooth.items()
    }
    strides = without_odd_shapes(curves, strides)
    curves = _over_taken_strides(curves, walk, strides, wrong)
    missing = [f"{name} is left out: not measured throughout the stance of any stride" for name in unmeasured]
    remarks = [*source.remarks, *footfalls.remarks, *missing]
    if any(name not in curves for name in REQUIRED):
        raise_noted(wrong)
    walk = {name: signal for name, signal in walk.items() if name in curves}
    return _finish(source, replace(footfalls, walk=walk), curves, strides, remarks, wrong)


def _over_taken_strides(
    curves: Mapping[str, CurveStatistics], walk: Mapping[str, Signal], strides: StrideSelection, wrong: list[PpafoError]
) -> dict[str, CurveStatistics]:
    """Return the curves over the selected strides only; a curve that covers none of them is reported and left out."""
    remaining = {}
    for name, curve in curves.items():
        is_taken = [stride in strides.taken for stride in curve.strides]
        if not any(is_taken):
            signal = walk[name]
            wrong.append(
                DataError(
                    f"{signal.file}: {name}, {signal.time[0]:.4g} to {signal.time[-1]:.4g} s, covers no whole stride "
                    f"(first stride: {strides.taken[0].start:.4g} to {strides.taken[0].end:.4g} s); give a longer "
                    "file, or omit the file"
                )
            )
            continue
        taken = [stride for stride in curve.strides if stride in strides.taken]
        remaining[name] = curve if all(is_taken) else over_strides(name, curve.curves[is_taken], taken)
    return remaining


def _finish(
    source: GaitSource,
    footfalls: Footfalls,
    curves: Mapping[str, CurveStatistics],
    strides: StrideSelection,
    remarks: Sequence[str],
    wrong: list[PpafoError],
) -> ImportedGait:
    """Return the import result of the mean curves; raises DataError, with all problems, if a curve is implausible."""
    taken, walk, settings, signs_from = strides.taken, footfalls.walk, source.settings, source.signs_from
    shares, times = ([getattr(each, name) for each in taken] for name in ("stance_share", "time"))
    means = {name: curve.mean for name, curve in curves.items()}
    fitted = {name: fit_curve(curve.mean, HARMONICS[name], curve.spread) for name, curve in curves.items()}
    errors = {name: error for name, (_, error) in fitted.items()}
    files = {name: signal.file for name, signal in walk.items()}
    # Both coordinates of the knee may be from one marker, whose unit is one.
    knee, is_one_marker = source.columns.knee, False
    if knee is not None and knee.thigh is None and len(knee.forward) == len(knee.up) == 1:
        forward, up = (terms[0].removeprefix("-").rpartition(".")[0] for terms in (knee.forward, knee.up))
        is_one_marker = forward == up != ""
    mean_stride = MeanStride(files, means, float(np.mean(shares)), float(np.mean(times)), signs_from, is_one_marker)
    with noted_in(wrong):
        check_scatter(curves, errors, walk)
    with noted_in(wrong):
        # The ankle of the other foot looks like a wrong zero to what follows.
        check_side(mean_stride, load_gait())
        check_plausible(mean_stride)
    with noted_in(wrong):
        check_direction(walk, signs_from)
    raise_noted(wrong)
    # A file states that it was made by a model, never that it was measured.
    origin: Origin = "imported" if all(table.kind == "measured" for table in source.tables) else "synthetic"
    series: dict[str, Any] = {name: curve for name, (curve, _) in fitted.items()}
    joined = ", ".join(Path(table.file).name for table in source.tables)
    gait = Gait(
        name=settings.name,
        title=settings.title or f"Mean of {len(taken)} strides, {settings.side} foot",
        origin=origin,
        source=f"imported from {joined}, {settings.side} foot; strides from the {footfalls.events.replace('_', ' ')}",
        body_mass=settings.body_mass or 0.0,
        stature=settings.stature,
        walking_speed=settings.walking_speed,
        stride_time=mean_stride.stride_time,
        stance_share=mean_stride.stance_share,
        stride_time_deviation=float(np.std(times, ddof=1)) if len(taken) > 1 else 0.0,
        stance_share_deviation=float(np.std(shares, ddof=1)) if len(taken) > 1 else 0.0,
        strides=len(taken),
        **series,
    )
    all_remarks = [*remarks, *_remarks(curves, strides, footfalls.events)]
    all_remarks += knee_remarks(knee, walk, settings.stature) + sign_remarks(means["shank_angle"], means["ankle_angle"])
    all_remarks += moment_remarks(means["ankle_moment"]) if "ankle_moment" in means else []
    all_remarks += turning_remarks(mean_stride) + delay_remarks(mean_stride) + size_remarks(mean_stride)
    all_remarks += _sampling_remarks(walk, taken)
    tilt = standing_tilt(means["shank_angle"], means["ankle_angle"])
    sign, taken_off = source.columns.ankle_angle.sign_and_neutral()
    # The reading of the file that would be neutral.
    neutral = float(np.degrees(taken_off)) + sign * tilt
    given = setting_text("ankle_neutral", math.radians(neutral), f"{neutral:.1f} deg")
    all_remarks += zero_remarks(tilt, f"give {given}") + scatter_remarks(curves, errors)
    left_out, names = (stride for stride, _ in strides.left_out), (table.file for table in source.tables)
    unique = tuple(dict.fromkeys(all_remarks))
    return ImportedGait(gait, taken, tuple(left_out), curves, errors, footfalls.events, tuple(names), unique)


def _check_enough(strides: StrideSelection, usable: list[Stride], walk: Mapping[str, Signal]) -> None:
    """Raise DataError for too few strides; ``usable`` are all strides found in the events."""
    taken, least = len(strides.taken), strides.least
    if taken >= least:
        return
    spans = ", ".join(f"{name} {signal.time[0]:.4g} to {signal.time[-1]:.4g} s" for name, signal in walk.items())
    count = count_of(taken, "whole stride")
    where = FORCE if FORCE in walk else SHANK
    events = f"{count_of(len(usable), 'stride')} in the events"
    if not usable:
        strikes = heel_strikes(where, walk)
        if strikes:
            events = f"{where} has one heel strike only, at {strikes[0]:.3g} s; a stride needs two"
        elif where == FORCE and any(off is not None for _, off in contacts_of(walk[FORCE])):
            events = (
                f"no heel strike in {where}: the foot is on the ground at the start, and a heel strike follows a swing"
            )
        else:
            events = f"no heel strikes were found in {where}: check its column"
    fewer = f", or accept fewer with {setting_text('least_strides')}" if taken else ""
    # From the last sample before the longest gap to the first one after it.
    longest = max(
        0.0 if signal.lost is None else float(np.max(np.diff(signal.time[~signal.lost]))) for signal in walk.values()
    )
    if longest > 0.0:
        # Rounded up, so that the value in the remedy fills the gap.
        needed = math.ceil(100.0 * longest - 1e-6) / 100.0
        filled = f"fill the gaps ({setting_text('longest_gap', needed, f'{needed:g} s')})"
        remedy = filled if needed <= LONGEST_FILLED else f"the longest gap of {longest:.3g} s cannot be filled"
        raise DataError(
            f"{walk['shank_angle'].file}: has {count} without missing samples, but at least {least} are needed; "
            f"{remedy}{(', give' if fewer else ', or give')} a longer recording{fewer}"
        )
    raise DataError(
        f"{walk['shank_angle'].file}: has {count} covered by both angles and events ({events}; {spans}), but at least "
        f"{least} are needed; give a longer recording{fewer}"
    )


_COARSE_RATE = 50.0
"""Sampling rate [Hz] below which the error of an event exceeds a hundredth of a stride."""
_NOISY_FORCE = 0.02
"""Standard deviation of the force in swing [body weights] for a remark; events are at 0.05 and 0.03."""
_WITHIN_SWING = 0.1
"""Fraction of the swing at both ends in which the foot may still touch the plate."""


def _sampling_remarks(walk: Mapping[str, Signal], strides: Sequence[Stride]) -> list[str]:
    """Return remarks on curves with few samples, and on noise of the force while the foot is in the air."""
    rates: dict[int, list[str]] = {}
    for name, signal in walk.items():
        if signal.rate < _COARSE_RATE:
            rates.setdefault(round(signal.rate), []).append(name)
    remarks = [
        f"{', '.join(names)}: sampled at {rate} Hz; heel strikes and toe-offs are accurate to about "
        f"{500.0 / rate:.0f} ms"
        for rate, names in rates.items()
    ]
    force = walk.get("vertical_force")
    if force is None:
        return remarks
    spans = [(stride.toe_off, stride.end, _WITHIN_SWING * (stride.end - stride.toe_off)) for stride in strides]
    # Only the middle of the swing: at its ends the foot may still be on the plate.
    swings = [force.values[(force.time > off + slack) & (force.time < end - slack)] for off, end, slack in spans]
    scatter = max((float(np.std(values)) for values in swings if values.size > 1), default=0.0)
    if scatter > _NOISY_FORCE:
        remarks.append(
            f"vertical_force has noise of {scatter:.2g} body weights in swing, close to the thresholds of heel strike "
            "and toe-off, 0.05 and 0.03; filter the force in the file for reliable events"
        )
    return remarks


def _remarks(curves: Mapping[str, CurveStatistics], strides: StrideSelection, events: str) -> list[str]:
    """Return remarks on strides left out or not covered, and on the vertical force or its absence."""
    remarks = [
        f"stride from {stride.start:.4g} to {stride.end:.4g} s left out: {why}" for stride, why in strides.left_out
    ]
    remarks += [
        f"{name} covers {len(curve.strides)} of {len(strides.taken)} strides"
        for name, curve in curves.items()
        if len(curve.strides) < len(strides.taken)
    ]
    if "vertical_force" in curves:
        return remarks + force_remarks(curves["vertical_force"].mean)
    less = ": heel strikes and toe-offs are from shank_angle and less exact" if events == SHANK else ""
    return [
        *remarks,
        f"no vertical force{less}; name its column in a gait map ({setting_text('columns')}) if there is one",
    ]
