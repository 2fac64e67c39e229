"""What ``ppafo gait`` prints and leaves in its folder: the gait file, gait.json, and the figure."""

from typing import Any

import numpy as np

from ppafo.documents.json_text import json_text
from ppafo.gait.gait import CURVES, Gait, plain_unit
from ppafo.gait.recorded.events import Stride
from ppafo.gait.recorded.importing import ImportedGait
from ppafo.gait.recorded.strides import phases
from ppafo.gait.writing import gait_toml
from ppafo.reporting.gait_figure import gait_figure
from ppafo.reporting.style import rendered

JSON, FIGURE, FORMATS = "gait.json", "gait", ("png", "svg")
_NOISE = 1e-9
_DEGREES = float(np.degrees(1.0))


def file_names(name: str) -> list[str]:
    """Return the names of all files of a gait."""
    return [f"{name}.toml", JSON, *(f"{FIGURE}.{file_format}" for file_format in FORMATS)]


def gait_files(gait: Gait, imported: ImportedGait | None = None) -> dict[str, bytes]:
    """Return the files by name."""
    figures = rendered(gait_figure(gait, imported), FORMATS)
    return {
        f"{gait.name}.toml": gait_toml(gait).encode(),
        JSON: f"{json_text(gait_document(gait, imported))}\n".encode(),
        **{f"{FIGURE}.{file_format}": content for file_format, content in figures.items()},
    }


def gait_document(gait: Gait, imported: ImportedGait | None = None) -> dict[str, Any]:
    """Return the gait as data that JSON can hold, in SI units: its numbers, and its curves at every percent."""
    document: dict[str, Any] = {
        "name": gait.name,
        "title": gait.title,
        "origin": gait.origin,
        "source": gait.source,
        "notes": gait.notes,
        "body_mass": gait.body_mass,
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
                "series": curve.sampled(phases()).tolist(),
            }
            for name, curve in gait.curves.items()
        },
    }
    return document if imported is None else document | {"imported": _imported(imported)}


def _imported(imported: ImportedGait) -> dict[str, Any]:
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


def gait_table(gait: Gait, imported: ImportedGait | None = None) -> list[str]:
    """Return the lines that the command prints."""
    speed = "not known" if gait.walking_speed is None else f"{gait.walking_speed:.3g} m/s"
    time = f"{gait.stride_time:.4g} s{_plus_minus(gait.stride_time_deviation)}"
    share = f"{100.0 * gait.stance_share:.1f} %{_plus_minus(100.0 * gait.stance_share_deviation)}"
    lines = [
        f"{gait.name}: {gait.title} ({gait.origin})",
        f"  source        {gait.source}",
        f"  body mass     {gait.body_mass:.4g} kg",
        f"  speed         {speed}",
        f"  stride time   {time}",
        f"  stance        {share}",
        f"  strides       {gait.strides or 'not known'}",
    ]
    lines += [_line(gait, name, imported) for name in gait.curves]
    return lines if imported is None else [*lines, *(f"  remark: {remark}" for remark in imported.remarks)]


def _plus_minus(deviation: float) -> str:
    return f" +- {deviation:.2g}" if deviation > _NOISE else ""


def _line(gait: Gait, name: str, imported: ImportedGait | None) -> str:
    factor, unit = (_DEGREES, "deg") if CURVES[name] == "rad" else (1.0, plain_unit(CURVES[name]))
    curve = gait.curves[name]
    values = factor * curve.sampled(phases())
    text = f"  {name:<18}  from {values.min():7.3g} to {values.max():7.3g} {unit}".rstrip()
    text += f", between strides {factor * curve.deviation:.2g}" if curve.deviation else ", between strides not known"
    left = 0.0 if imported is None else imported.fit_errors[name].root_mean_square
    return f"{text}, series within {factor * left:.2g} RMS" if left > _NOISE else text
