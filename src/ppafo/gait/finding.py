"""Report of a gait: numbers, curves, and for an imported gait the strides and remarks of the import.

The figure shows the curves over the stride in the units of the field, with deviation band, events and single strides.
"""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.documents.json_text import fields_of
from ppafo.gait.document import gait_toml
from ppafo.gait.gait import CURVES, Gait, clinical_angle, plain_unit
from ppafo.gait.recorded.importing import PHASES, ImportedGait
from ppafo.report.finding import Finding, Section, columns_of, facts
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, GREY, ORANGE, font_size
from ppafo.units.shown import quantity_of_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STRIDE_KEYS = ("start", "toe_off", "end", "stance_share")

_NOISE = 1e-9
"""Deviation or misfit [SI] below which it counts as rounding error."""
_CAPTION = "The curves over the stride: mean, standard deviation between strides as a band, toe-off dashed."
_HEAD = ("curve", "lowest", "highest", "unit", "between strides", "series error (RMS)")
_STANCE = "#dddddd"


@dataclass(frozen=True, slots=True)
class GaitFound:
    """Gait of a report, with the result of the import if the gait was imported."""

    gait: Gait
    imported: ImportedGait | None = None

    def json_document(self) -> dict[str, Any]:
        """Return numbers, curves and, after an import, strides as plain data in SI units."""
        gait = self.gait
        imported = self.imported
        document: dict[str, Any] = {
            **fields_of(gait, *(item.name for item in fields(Gait) if item.name not in CURVES)),
            "phases": PHASES.tolist(),
            "curves": {
                name: {
                    "unit": CURVES[name],
                    "harmonics": curve.harmonics,
                    "deviation": curve.deviation,
                    "series": curve.values_at(PHASES).tolist(),
                }
                for name, curve in gait.curves.items()
            },
        }
        if imported is not None:
            document["imported"] = {
                "files": list(imported.files),
                "events": imported.events,
                **{
                    name: [{key: getattr(stride, key) for key in _STRIDE_KEYS} for stride in strides]
                    for name, strides in (("strides", imported.strides), ("left_out", imported.left_out))
                },
                "remarks": list(imported.remarks),
                "curves": {
                    name: {
                        "strides": len(curve.strides),
                        "mean": curve.mean.tolist(),
                        "deviation": curve.deviation.tolist(),
                        "fit_root_mean_square": curve.fitted[1].root_mean_square,
                        "fit_largest": curve.fitted[1].largest,
                    }
                    for name, curve in imported.curves.items()
                },
            }
        return document


def gait_finding(gait: Gait, imported: ImportedGait | None = None) -> Finding[GaitFound]:
    """Return the report of a gait as printed by ``ppafo gait``; the gait file is one of its files."""
    speed = f", {gait.walking_speed:.3g} m/s" if gait.walking_speed is not None else ""
    stance = f"{100.0 * gait.stance_share:.1f} %{_plus_minus(100.0 * gait.stance_share_deviation)}"
    return Finding(
        name="gait",
        kicker="Gait",
        title=gait.title or gait.name,
        said=(f"{gait.name}: {gait.title} ({gait.origin})",),
        parts=(
            Section(
                columns=facts(
                    (
                        ("source", gait.source),
                        ("body mass", f"{gait.body_mass:.4g} kg"),
                        ("stature", "not known" if gait.stature is None else f"{gait.stature:.4g} m"),
                        ("speed", speed.removeprefix(", ") or "not known"),
                        ("stride time", f"{gait.stride_time:.4g} s{_plus_minus(gait.stride_time_deviation)}"),
                        ("stance", stance),
                        ("strides", str(gait.strides or "not known")),
                    )
                )
            ),
            Section("Curves", columns_of(_HEAD, (_row(gait, name, imported) for name in gait.curves))),
            Section(remarks=[f"remark: {text}" for text in imported.remarks] if imported else ()),
            Section(
                "Stride",
                panels=lambda: [_panel(gait, name, imported, number == 0) for number, name in enumerate(gait.curves)],
                name="gait",
                caption=_CAPTION,
                size=(5.4, 1.6),
                title=f"{gait.name}: {gait.body_mass:.4g} kg{speed}, stride {gait.stride_time:.3g} s",
                is_detail=True,
            ),
        ),
        found=GaitFound(gait, imported),
        kind="synthetic" if gait.origin == "synthetic" else "measured",
        files={f"{gait.name}.toml": lambda: gait_toml(gait).encode()},
    )


def _plus_minus(deviation: float) -> str:
    return f" +- {deviation:.2g}" if deviation > _NOISE else ""


def _row(gait: Gait, name: str, imported: ImportedGait | None) -> tuple[str | None, ...]:
    kind = Kind(unit=plain_unit(CURVES[name]), quantity=quantity_of_unit(CURVES[name]))
    curve = gait.curves[name]
    is_ankle = name == "ankle_angle"
    series = curve.values_at(PHASES)
    values = kind.values(clinical_angle(series) if is_ankle else series)
    left = 0.0 if imported is None else kind.shown(imported.curves[name].fitted[1].root_mean_square)
    return (
        f"{name} (0 neutral, dorsiflexion positive)" if is_ankle else name,
        f"{values.min():.3g}",
        f"{values.max():.3g}",
        kind.shown_unit,
        f"{kind.shown(curve.deviation):.2g}" if curve.deviation else None,
        f"{left:.2g}" if left > _NOISE else None,
    )


_STRIDE = Kind("Stride", "%")
_PANELS: dict[str, Kind] = {
    "shank_angle": Kind("Shank angle (above 0: ankle in front of the knee)", "rad", "angle"),
    "ankle_angle": Kind("Ankle angle (0 neutral, dorsiflexion positive)", "rad", "angle"),
    "ankle_moment": Kind("Ankle moment (above 0: plantarflexion)", "N m/kg"),
    "vertical_force": Kind("Vertical ground reaction (body weights)"),
    "centre_of_pressure": Kind("Centre of pressure in front of the ankle", "m", "body length"),
    "knee_forward": Kind("Acceleration of the knee forward", "m/s^2", "acceleration"),
    "knee_up": Kind("Acceleration of the knee upwards (without gravity)", "m/s^2", "acceleration"),
}


def _panel(gait: Gait, name: str, imported: ImportedGait | None, is_first: bool) -> Panel:
    """Return the panel of one curve over the stride, with the single strides in the background after an import."""
    sign = clinical_angle if name == "ankle_angle" else np.asarray
    curve = gait.curves[name]
    percent = 100.0 * PHASES
    toe_off = 100.0 * gait.stance_share
    series = sign(curve.values_at(PHASES))
    marks = [
        Mark("span", (0.0, toe_off), colour=_STANCE, style={"alpha": 0.5}),
        Mark("level", (), 0.0, colour=GREY, style={"linewidth": 0.8}),
        Mark("at", toe_off, colour=ORANGE, style={"linewidth": 1.0}),
    ]
    if imported is None:
        mean = series
        band = np.full(series.size, curve.deviation)
        label = "standard deviation, mean over the stride"
    else:
        found = imported.curves[name]
        mean = sign(found.mean)
        band = found.deviation
        label = "standard deviation"
        marks.append(Mark("line", percent, sign(found.curves).T, colour=GREY, style={"linewidth": 0.6, "alpha": 0.5}))
    named = "series" if imported is None else "mean of the strides"
    marks += [
        Mark("band", percent, (mean - band, mean + band), label=label, style={"alpha": 0.2}),
        Mark("line", percent, mean, label=named),
    ]
    if imported is not None:
        dashed = {"linewidth": 1.0, "linestyle": (0, (4, 2))}
        marks.append(Mark("line", percent, series, label="series", colour=BLACK, style=dashed))

    def name_events(axes: "Axes") -> None:
        """Label heel strike and toe-off at heights that the curve of the shank leaves free."""
        axes.set_xlim(0.0, 100.0)
        for at, height, text in ((0.0, 0.05, "heel strike"), (toe_off, 0.85, "toe-off")) if is_first else ():
            place = ("data", "axes fraction")
            offset = "offset points"
            axes.annotate(
                text,
                (at, height),
                xycoords=place,
                xytext=(3, 0),
                textcoords=offset,
                color=GREY,
                fontsize=font_size(8.5),
            )

    legend = "above" if is_first else ""
    return Panel(_STRIDE, _PANELS[name], marks, legend=legend, then=name_events, shares_x=True)
