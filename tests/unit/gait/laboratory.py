"""A walk of the built-in gait as laboratories record it: markers and loads of both feet, on few plates."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.gait import load_gait
from ppafo.signals.recording import Floats

GAIT = load_gait()
STRIDE, MASS, SPEED, THIGH = GAIT.stride_time, GAIT.body_mass, 1.33, 0.4
UNLOADED = 0.025
"""Body weights that the built-in gait has in the swing, and a plate has not."""

DELAY = {"right": 0.0, "left": 0.5 * STRIDE}


def curve(name: str, time: Floats, side: str = "right") -> Floats:
    """A curve of a foot at times [s]; the right heel strikes at 0."""
    return GAIT.curve(name).values_at((time - DELAY[side]) / STRIDE)


def force(time: Floats, side: str = "right", strides: Iterable[int] | None = None, away: float = 0.0) -> Floats:
    """Vertical force [N], only in some strides where these are given; ``away`` is what stands off the plate."""
    newton = MASS * STANDARD_GRAVITY * np.maximum(curve("vertical_force", time, side) - UNLOADED, 0.0)
    if strides is None:
        return newton
    return np.where(on_plate(time, side, strides), newton, away)


def on_plate(time: Floats, side: str, strides: Iterable[int]) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Whether a foot is in one of these strides."""
    return np.isin(np.floor((time - DELAY[side]) / STRIDE), list(strides))


def knee(time: Floats, side: str = "right") -> tuple[Floats, Floats]:
    """Where the knee is, forward and up [m]."""
    moved = []
    for name in ("knee_forward", "knee_up"):
        series, order = GAIT.curve(name), 1.0 + np.arange(GAIT.curve(name).harmonics)
        phase = 2.0 * np.pi * np.outer((time - DELAY[side]) / STRIDE, order)
        terms = np.cos(phase) * np.array(series.cosines) + np.sin(phase) * np.array(series.sines)
        moved.append(-terms @ (STRIDE / (2.0 * np.pi * order)) ** 2)
    return SPEED * time + moved[0], 0.5 + moved[1]


def markers(time: Floats, side: str = "right", forward: int = 0, sign: float = 1.0, up: int = 2) -> dict[str, Floats]:
    """Markers of a leg [mm], (3, frames), by the names of Plug-in Gait."""
    shank = curve("shank_angle", time, side)
    pitch = shank - curve("ankle_angle", time, side) + 0.5 * np.pi
    ahead, above = knee(time, side)
    ankle = ahead + 0.4 * np.sin(shank), above - 0.4 * np.cos(shank)
    ways = {
        "KNE": (ahead, above),
        "ANK": ankle,
        "HEE": (ankle[0] - 0.05 * np.cos(pitch), ankle[1] - 0.06 - 0.05 * np.sin(pitch)),
        "TOE": (ankle[0] + 0.15 * np.cos(pitch), ankle[1] - 0.06 + 0.15 * np.sin(pitch)),
    }
    found = {}
    for name, (x, z) in ways.items():
        point = np.full((3, time.size), 100.0)
        point[forward], point[up] = sign * 1000.0 * x, 1000.0 * z
        found[f"{side[0].upper()}{name}"] = point
    return found


def opensim(path: Path, time: Floats, columns: Mapping[str, Floats], head: str = "", width: int | None = None) -> Path:
    """Write a table as OpenSim does."""
    rows = ["\t".join(f"{cell:.10f}" for cell in row) for row in np.column_stack([time, *columns.values()])]
    counts = [f"nRows={len(rows)}", f"nColumns={width or 1 + len(columns)}"]
    path.write_text("\n".join([path.stem, *counts, head, "endheader", "\t".join(["time", *columns]), *rows]) + "\n")
    return path


def angles(time: Floats, side: str = "right", scale: float = 180.0 / np.pi) -> dict[str, Floats]:
    """Coordinates of inverse kinematics, in degrees unless scaled otherwise."""
    foot, bent = side[0], np.radians(-20.0 + 15.0 * np.sin(time))
    return {
        "pelvis_tilt": scale * np.full(time.size, 0.07),
        f"hip_flexion_{foot}": scale * (curve("shank_angle", time, side) - bent - 0.07),
        f"knee_angle_{foot}": scale * bent,
        f"ankle_angle_{foot}": scale * (0.5 * np.pi - curve("ankle_angle", time, side)),
    }


def trc(path: Path, time: Floats, points: Mapping[str, Floats], unit: str = "mm") -> Path:
    """Write markers as .trc; what is NaN leaves its cell empty."""
    names = list(points)
    keys = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        keys,
        f"100\t100\t{time.size}\t{len(names)}\t{unit}\t100\t1\t{time.size}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{number}" for number in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    table = np.concatenate([points[name] for name in names]).T
    rows = [
        "\t".join([str(frame), f"{time[frame - 1]:.4f}", *("" if np.isnan(x) else f"{x:.4f}" for x in row)])
        for frame, row in enumerate(table, 1)
    ]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path
