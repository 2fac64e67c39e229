"""A gait as an answer: its numbers, its curves, and for an imported one what was made of the recording.

The figure has the curves over the stride, in the units of the field, with band, events and single strides.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.gait.document import gait_toml
from ppafo.gait.gait import CURVES, Gait, clinical_angle, plain_unit
from ppafo.gait.recorded.footfalls import Stride
from ppafo.gait.recorded.importing import ImportedGait, phases
from ppafo.report import Answer, Column, Figure, Section, Table
from ppafo.report.display_units import display_unit, display_value, display_values, quantity_of_unit
from ppafo.report.style import BLACK, BLUE, GREY, ORANGE, Margins, figure_of_panels, house_style, mark_kind
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

_PLAIN = (
    "name",
    "title",
    "origin",
    "source",
    "notes",
    "body_mass",
    "stature",
    "walking_speed",
    "recorded_speed",
    "stride_time",
    "stride_time_deviation",
    "stance_share",
    "stance_share_deviation",
    "strides",
)
"""Fields of a gait that are plain data as they stand."""

_NOISE = 1e-9
_CAPTION = "The curves over the stride: mean, standard deviation between strides as a band, toe-off dashed."


def gait_answer(gait: Gait, imported: ImportedGait | None = None) -> Answer:
    """Return what ``ppafo gait`` says of a gait; the gait file is among its files."""
    head = ("curve", "lowest", "highest", "unit", "between strides", "series error (RMS)")
    rows = tuple(_row(gait, name, imported) for name in gait.curves)
    return Answer(
        name="gait",
        kicker="Gait",
        title=gait.title or gait.name,
        lead=(f"{gait.name}: {gait.title} ({gait.origin})",),
        sections=(
            Section(table=Table((), _facts(gait))),
            Section("Curves", table=Table(tuple(map(Column, head)), rows)),
            Section(remarks=tuple(f"remark: {text}" for text in imported.remarks) if imported else ()),
            Section("Stride", figure=Figure("gait", _CAPTION, lambda: gait_figure(gait, imported)), is_detail=True),
        ),
        data=_data(gait, imported),
        kind=gait.origin,
        files={f"{gait.name}.toml": lambda: gait_toml(gait).encode()},
    )


def _facts(gait: Gait) -> tuple[tuple[str, str], ...]:
    speed = "not known" if gait.walking_speed is None else f"{gait.walking_speed:.3g} m/s"
    stance = f"{100.0 * gait.stance_share:.1f} %{_plus_minus(100.0 * gait.stance_share_deviation)}"
    return (
        ("source", gait.source),
        ("body mass", f"{gait.body_mass:.4g} kg"),
        ("stature", "not known" if gait.stature is None else f"{gait.stature:.4g} m"),
        ("speed", speed),
        ("stride time", f"{gait.stride_time:.4g} s{_plus_minus(gait.stride_time_deviation)}"),
        ("stance", stance),
        ("strides", str(gait.strides or "not known")),
    )


def _plus_minus(deviation: float) -> str:
    return f" +- {deviation:.2g}" if deviation > _NOISE else ""


def _row(gait: Gait, name: str, imported: ImportedGait | None) -> tuple[str | None, ...]:
    quantity = quantity_of_unit(CURVES[name])
    curve = gait.curves[name]
    is_ankle = name == "ankle_angle"
    series = curve.values_at(phases())
    values = display_values(clinical_angle(series) if is_ankle else series, quantity)
    left = 0.0 if imported is None else display_value(imported.fit_errors[name].root_mean_square, quantity)
    return (
        f"{name} (0 neutral, dorsiflexion positive)" if is_ankle else name,
        f"{values.min():.3g}",
        f"{values.max():.3g}",
        display_unit(quantity) or plain_unit(CURVES[name]),
        f"{display_value(curve.deviation, quantity):.2g}" if curve.deviation else None,
        f"{left:.2g}" if left > _NOISE else None,
    )


def _data(gait: Gait, imported: ImportedGait | None) -> dict[str, Any]:
    document: dict[str, Any] = {
        **{name: getattr(gait, name) for name in _PLAIN},
        "phases": phases().tolist(),
        "curves": {
            name: {
                "unit": CURVES[name],
                "harmonics": curve.harmonics,
                "deviation": curve.deviation,
                "series": curve.values_at(phases()).tolist(),
            }
            for name, curve in gait.curves.items()
        },
    }
    if imported is None:
        return document
    return document | {
        "imported": {
            "files": list(imported.files),
            "events": imported.events,
            "strides": [_stride(item) for item in imported.strides],
            "left_out": [_stride(item) for item in imported.left_out],
            "remarks": list(imported.remarks),
            "curves": {
                name: {
                    "strides": len(item.strides),
                    "mean": item.mean.tolist(),
                    "deviation": item.deviation.tolist(),
                    "fit_root_mean_square": imported.fit_errors[name].root_mean_square,
                    "fit_largest": imported.fit_errors[name].largest,
                }
                for name, item in imported.curves.items()
            },
        }
    }


def _stride(stride: Stride) -> dict[str, float]:
    return {"start": stride.start, "toe_off": stride.toe_off, "end": stride.end, "stance_share": stride.stance_share}


_WIDTH, _PANEL = 7.2, 1.45
_MARGINS = Margins(left=0.82, right=0.25, top=0.72, bottom=0.52, row_gap=0.42, label=0.58)
_STANCE = "#f1f1f1"


@dataclass(frozen=True, slots=True)
class _CurvePanel:
    """Title, what one SI unit is in that of the title, and where the level line lies."""

    title: str
    factor: float
    level: float


_DEGREES = float(np.degrees(1.0))
_PANELS: dict[str, _CurvePanel] = {
    "shank_angle": _CurvePanel("Shank angle (deg, above 0: ankle in front of the knee)", _DEGREES, 0.0),
    "ankle_angle": _CurvePanel("Ankle angle (deg, 0 neutral, dorsiflexion positive)", _DEGREES, 0.0),
    "ankle_moment": _CurvePanel("Ankle moment (N m/kg, above 0: plantarflexion)", 1.0, 0.0),
    "vertical_force": _CurvePanel("Vertical ground reaction (body weights)", 1.0, 0.0),
    "centre_of_pressure": _CurvePanel("Centre of pressure (cm in front of the ankle)", 100.0, 0.0),
    "knee_forward": _CurvePanel("Acceleration of the knee forward (m/s$^2$)", 1.0, 0.0),
    "knee_up": _CurvePanel("Acceleration of the knee upwards (m/s$^2$, without gravity)", 1.0, 0.0),
}


def gait_figure(gait: Gait, imported: ImportedGait | None = None) -> "Drawing":
    """Return the curves of a gait over the stride; with the strides behind it where it was just imported."""
    names = list(gait.curves)
    height = len(names) * _PANEL + (len(names) - 1) * _MARGINS.row_gap + _MARGINS.top + _MARGINS.bottom
    with house_style():
        figure, grid = figure_of_panels((_WIDTH, height), _MARGINS, len(names))
        for name, (axes,) in zip(names, grid, strict=True):
            _draw(axes, gait, name, imported)
        bottom = grid[-1][0]
        bottom.set_xlabel("Stride (%)")
        bottom.set_xlim(0.0, 100.0)
        _name_events(grid[0][0], gait)
        inch = 1.0 / height
        speed = f", {gait.walking_speed:.3g} m/s" if gait.walking_speed is not None else ""
        headline = f"{gait.name}: {gait.body_mass:.4g} kg{speed}, stride {gait.stride_time:.3g} s"
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 * inch, headline, ha="left", va="top", fontweight="bold")
        figure.legend(
            *grid[0][0].get_legend_handles_labels(),
            loc="upper left",
            bbox_to_anchor=(0.09 / _WIDTH, 1.0 - 0.28 / height),
            ncols=3,
            borderaxespad=0.0,
            handlelength=1.6,
        )
        mark_kind(figure, gait.origin)
        return figure


def _draw(axes: "Axes", gait: Gait, name: str, imported: ImportedGait | None) -> None:
    shown, curve, percent = _PANELS[name], gait.curves[name], 100.0 * phases()
    axes.axvspan(0.0, 100.0 * gait.stance_share, color=_STANCE, zorder=0, linewidth=0.0)
    axes.axhline(shown.level, color=GREY, linewidth=0.8)
    axes.axvline(100.0 * gait.stance_share, color=ORANGE, linewidth=1.0)
    series = _shown_values(name, curve.values_at(phases()))
    if imported is None:
        mean, band = series, np.full(series.size, shown.factor * curve.deviation)
        label = "standard deviation, mean over the stride"
    else:
        found = imported.curves[name]
        mean, band = _shown_values(name, found.mean), shown.factor * found.deviation
        label = "standard deviation"
        axes.plot(percent, _shown_values(name, found.curves).T, color=GREY, linewidth=0.6, alpha=0.5)
    axes.fill_between(percent, mean - band, mean + band, color=BLUE, alpha=0.2, linewidth=0.0, label=label)
    axes.plot(percent, mean, color=BLUE, label="mean of the strides" if imported is not None else "series")
    if imported is not None:
        axes.plot(percent, series, color=BLACK, linewidth=1.0, linestyle=(0, (4, 2)), label="series")
    axes.set_title(shown.title)


def _shown_values(name: str, values: Floats) -> Floats:
    """Return values of a curve in the unit and the sign of its panel."""
    return _PANELS[name].factor * (clinical_angle(values) if name == "ankle_angle" else values)


def _name_events(axes: "Axes", gait: Gait) -> None:
    """Write where the shank's curve is not: low at heel strike, high at toe-off."""
    for at, height, text in ((0.0, 0.05, "heel strike"), (100.0 * gait.stance_share, 0.85, "toe-off")):
        place, offset = ("data", "axes fraction"), "offset points"
        axes.annotate(text, (at, height), xycoords=place, xytext=(3, 0), textcoords=offset, color=GREY, fontsize=8.5)
