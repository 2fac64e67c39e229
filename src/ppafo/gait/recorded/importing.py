"""Import of a gait from recorded files: strides, mean curves, checks, and the Fourier series of a gait."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.gait.document import load_gait
from ppafo.gait.gait import HARMONICS, REQUIRED, FitError, Gait, GaitCurve, Origin, fit_curve
from ppafo.gait.plausible import (
    MeanStride,
    check_plausible,
    check_side,
    force_remarks,
    moment_remarks,
    sign_remarks,
    zero_remarks,
)
from ppafo.gait.recorded.footfalls import (
    FORCE,
    SHANK,
    Footfalls,
    Stride,
    find_footfalls,
    strides_of_curve,
    strides_within,
)
from ppafo.gait.recorded.mapping import ImportSettings, check_settings
from ppafo.gait.recorded.signal import LOADS, Signal, check_direction, knee_remarks, low_pass
from ppafo.gait.recorded.source import GaitSource, read_source
from ppafo.gait.recorded.strides import (
    CurveStatistics,
    StrideSelection,
    check_enough,
    check_scatter,
    over_strides,
    scatter_remarks,
    select_strides,
    statistics,
    without_drop_outs,
    without_odd_shapes,
)


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
    try:
        footfalls = find_footfalls(source.walk, source.tables, settings.side, settings.least_strides)
    except PpafoError as error:
        raise_noted([*wrong, error])
    curves, strides, unmeasured = _curves_over_strides(source, footfalls, wrong)
    # Both coordinates of the knee may be from one marker, whose scale is one.
    knee, is_one_marker = source.columns.knee, False
    if knee is not None and knee.thigh is None and len(knee.forward) == len(knee.up) == 1:
        forward, up = (terms[0].removeprefix("-").rpartition(".")[0] for terms in (knee.forward, knee.up))
        is_one_marker = forward == up != ""
    mean_stride = MeanStride(
        file={name: source.walk[name].file for name in curves},
        curves={name: curve.mean for name, curve in curves.items()},
        stance_share=float(np.mean([stride.stance_share for stride in strides.taken])),
        stride_time=float(np.mean([stride.time for stride in strides.taken])),
        is_knee_one_marker=is_one_marker,
    )
    fitted = {name: fit_curve(curve.mean, HARMONICS[name], curve.spread) for name, curve in curves.items()}
    errors = {name: error for name, (_, error) in fitted.items()}
    walk = {name: footfalls.walk[name] for name in curves}
    with noted_in(wrong):
        check_scatter(curves, errors, walk)
    with noted_in(wrong):
        # The ankle of the other foot looks like a wrong zero to the checks of the curves.
        check_side(mean_stride, load_gait())
        check_plausible(mean_stride)
    with noted_in(wrong):
        check_direction(walk)
    raise_noted(wrong)
    further = _remarks(source, footfalls.events, walk, curves, errors, strides)
    return ImportedGait(
        gait=_gait(
            source, footfalls.events, {name: curve for name, (curve, _) in fitted.items()}, mean_stride, strides
        ),
        strides=strides.taken,
        left_out=tuple(stride for stride, _ in strides.left_out),
        curves=curves,
        fit_errors=errors,
        events=footfalls.events,
        files=tuple(table.file for table in source.tables),
        remarks=tuple(dict.fromkeys([*source.remarks, *footfalls.remarks, *unmeasured, *further])),
    )


def _curves_over_strides(
    source: GaitSource, footfalls: Footfalls, wrong: list[PpafoError]
) -> tuple[dict[str, CurveStatistics], StrideSelection, list[str]]:
    """Return the curves over the selected strides, the selection, and a remark on each load without a measured stance.

    Problems are added to ``wrong``. Raises DataError, with all of them, without strides or without an angle.
    """
    cut_off, recorded = source.settings.low_pass, footfalls.walk
    usable = select_strides(footfalls, source.settings.least_strides)
    with noted_in(wrong):
        check_enough(usable, footfalls)
    if not usable.taken:
        raise_noted(wrong)
    covered = {name: strides_of_curve(footfalls, name, signal, usable.taken) for name, signal in recorded.items()}
    # A load that no plate measured for a whole stance would otherwise be refused as one whose file is too short.
    uncovered = [name for name in LOADS if name in recorded and not covered[name]]
    unmeasured = [name for name in uncovered if strides_within(recorded[name], usable.taken)]
    walk = {name: signal for name, signal in recorded.items() if name not in unmeasured}
    moving = without_drop_outs(walk, source.tables, covered, usable, wrong)
    # Footfalls come from the unfiltered force, whose edges a low pass would move.
    smooth = walk if cut_off is None else {name: low_pass(signal, cut_off) for name, signal in walk.items()}
    curves = {
        name: statistics(name, signal, [stride for stride in covered[name] if stride in moving.taken])
        for name, signal in smooth.items()
    }
    strides = without_odd_shapes(curves, moving)
    remaining = {}
    for name, curve in curves.items():
        is_taken = [stride in strides.taken for stride in curve.strides]
        taken = [stride for stride in curve.strides if stride in strides.taken]
        if taken:
            remaining[name] = curve if all(is_taken) else over_strides(name, curve.curves[is_taken], taken)
            continue
        file, time = walk[name].file, walk[name].time
        wrong.append(
            DataError(
                f"{file}: {name}, {time[0]:.4g} to {time[-1]:.4g} s, covers no whole stride (first stride: "
                f"{strides.taken[0].start:.4g} to {strides.taken[0].end:.4g} s)"
            )
        )
    if any(name not in remaining for name in REQUIRED):
        raise_noted(wrong)
    remarks = [f"{name} is left out: not measured throughout the stance of any stride" for name in unmeasured]
    return remaining, strides, remarks


def _remarks(
    source: GaitSource,
    events: str,
    walk: Mapping[str, Signal],
    curves: Mapping[str, CurveStatistics],
    errors: Mapping[str, FitError],
    strides: StrideSelection,
) -> list[str]:
    """Return the remarks on strides, signs and sizes of the curves, zero of the ankle, and scatter."""
    means, count = {name: curve.mean for name, curve in curves.items()}, len(strides.taken)
    less = ": heel strikes and toe-offs are from shank_angle and less exact" if events == SHANK else ""
    foot = source.columns.ankle_angle
    zero = f"ankle angle from the markers {foot.heel} and {foot.toe}; zero from the flat foot"
    return [
        *(f"stride from {each.start:.4g} to {each.end:.4g} s left out: {why}" for each, why in strides.left_out),
        *(f"{name} covers {own} of {count} strides" for name in curves if (own := len(curves[name].strides)) < count),
        *(force_remarks(means[FORCE]) if FORCE in means else [f"no vertical force{less}"]),
        *knee_remarks(source.columns.knee, walk, source.settings.stature),
        *sign_remarks(means["shank_angle"], means["ankle_angle"]),
        *(moment_remarks(means["ankle_moment"]) if "ankle_moment" in means else []),
        *([zero] if foot.terms is None else []),
        *zero_remarks(means["shank_angle"], means["ankle_angle"]),
        *scatter_remarks(curves, errors),
    ]


def _gait(
    source: GaitSource,
    events: str,
    series: Mapping[str, GaitCurve],
    mean_stride: MeanStride,
    strides: StrideSelection,
) -> Gait:
    """Return the gait with the Fourier series by curve, and with means and deviations of the times of its strides."""
    settings, files = source.settings, ", ".join(Path(table.file).name for table in source.tables)
    # A file states that it was made by a model, never that it was measured.
    origin: Origin = "imported" if all(table.kind == "measured" for table in source.tables) else "synthetic"
    count, curves = len(strides.taken), dict[str, Any](series)
    times, shares = ([getattr(stride, name) for stride in strides.taken] for name in ("time", "stance_share"))
    # A table over percent does not state the number of its strides.
    is_mean_stride = any(table.is_mean_stride for table in source.tables)
    counted = f"Mean of {count} strides" if count > 1 else "One stride"
    return Gait(
        name=settings.name,
        title=settings.title or f"{'Mean stride' if is_mean_stride else counted}, {settings.side} foot",
        origin=origin,
        source=f"imported from {files}, {settings.side} foot; strides from the {events.replace('_', ' ')}",
        body_mass=settings.body_mass or 0.0,
        stature=settings.stature,
        walking_speed=settings.walking_speed,
        stride_time=mean_stride.stride_time,
        stance_share=mean_stride.stance_share,
        stride_time_deviation=float(np.std(times, ddof=1)) if count > 1 else 0.0,
        stance_share_deviation=float(np.std(shares, ddof=1)) if count > 1 else 0.0,
        strides=count,
        **curves,
    )
