"""A gait as an answer: its numbers, its curves, and for an imported one what was made of the recording."""

from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_unit, display_value, display_values, quantity_of_unit
from ppafo.gait.figure import gait_figure
from ppafo.gait.gait import CURVES, Gait, clinical_angle, plain_unit
from ppafo.gait.recorded.events import Stride
from ppafo.gait.recorded.importing import ImportedGait
from ppafo.gait.recorded.strides import phases
from ppafo.gait.writing import gait_toml

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
        "name": gait.name,
        "title": gait.title,
        "origin": gait.origin,
        "source": gait.source,
        "notes": gait.notes,
        "body_mass": gait.body_mass,
        "stature": gait.stature,
        "walking_speed": gait.walking_speed,
        "recorded_speed": gait.recorded_speed,
        "stride_time": gait.stride_time,
        "stride_time_deviation": gait.stride_time_deviation,
        "stance_share": gait.stance_share,
        "stance_share_deviation": gait.stance_share_deviation,
        "strides": gait.strides,
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
    return document if imported is None else document | {"imported": _import_data(imported)}


def _import_data(imported: ImportedGait) -> dict[str, Any]:
    return {
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


def _stride(stride: Stride) -> dict[str, float]:
    return {"start": stride.start, "toe_off": stride.toe_off, "end": stride.end, "stance_share": stride.stance_share}
