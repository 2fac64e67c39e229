"""A synthetic walk of the built-in gait as files: CSV, OpenSim tables, C3D."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from ppafo.gait import Gait, load_gait, walk_recording
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

STRIDES = 6


@pytest.fixture(scope="session")
def normative() -> Gait:
    """The gait that comes with the package."""
    return load_gait()


@pytest.fixture(scope="session")
def knee_way(normative: Gait) -> Callable[[Floats], tuple[Floats, Floats]]:
    """Where the knee is at times [s], forward and up [m]: what the accelerations integrate to, at 1.33 m/s."""

    def way(name: str, time: Floats) -> Floats:
        curve, order = normative.curve(name), 1.0 + np.arange(normative.curve(name).harmonics)
        phase = 2.0 * np.pi * np.outer(time / normative.stride_time, order)
        terms = np.cos(phase) * np.array(curve.cosines) + np.sin(phase) * np.array(curve.sines)
        return np.asarray(-terms @ (normative.stride_time / (2.0 * np.pi * order)) ** 2)

    return lambda time: (1.33 * time + way("knee_forward", time), 0.5 + way("knee_up", time))


@pytest.fixture(scope="session")
def walk(normative: Gait) -> Recording:
    """Six equal strides of it."""
    return walk_recording(normative, STRIDES)


@pytest.fixture
def csv_of(walk: Recording, tmp_path: Path) -> Callable[..., Path]:
    """Writes the walk as CSV with a header and columns of one's own: (header, values) pairs, time first by itself."""

    def written(columns: Mapping[str, Floats], time: Floats | None = None) -> Path:
        path = tmp_path / "walk.csv"
        seconds = walk.time if time is None else time
        table = np.column_stack([seconds, *columns.values()])
        rows = [",".join(map(repr, row)) for row in table.tolist()]
        path.write_text("\n".join([",".join(["time [s]", *columns]), *rows]) + "\n")
        return path

    return written


@pytest.fixture
def columns(walk: Recording) -> dict[str, Floats]:
    """The columns of the walk with the headers of the package."""
    return {f"{name} [{walk.unit(name)}]": np.array(walk[name]) for name in walk.names}


THIGH_LENGTH = 0.4


@pytest.fixture
def opensim_files(
    walk: Recording, normative: Gait, knee_way: Callable[[Floats], tuple[Floats, Floats]], tmp_path: Path
) -> dict[str, Path]:
    """Angles, moments and forces of the walk as OpenSim writes them: one foot, degrees, N m, N; thigh of 0.4 m."""
    shank, ankle = np.degrees(walk["shank_angle"]), np.degrees(walk["ankle_angle"])
    knee = -20.0 + 15.0 * np.sin(walk.time)
    mass = normative.body_mass
    angles = {"pelvis_tilt": np.full(shank.size, 4.0), "hip_flexion_r": shank - knee - 4.0, "knee_angle_r": knee}
    angles["ankle_angle_r"] = 90.0 - ankle
    forward, up = knee_way(walk.time)
    lean = np.radians(shank - knee)
    angles["pelvis_tx"] = forward - THIGH_LENGTH * np.sin(lean)
    angles["pelvis_ty"] = up + THIGH_LENGTH * np.cos(lean)
    return {
        "ik": _opensim(tmp_path / "walk_ik.mot", walk.time, angles, "Angles are in degrees."),
        "id": _opensim(tmp_path / "walk_id.sto", walk.time, {"ankle_angle_r_moment": -mass * walk["ankle_moment"]}),
        "grf": _opensim(
            tmp_path / "walk_grf.mot", walk.time, {"ground_force_vy": 9.80665 * mass * walk["vertical_force"]}
        ),
    }


def _opensim(path: Path, time: Floats, columns: Mapping[str, Floats], sentence: str = "") -> Path:
    head = ["Table", f"nRows={time.size}", f"nColumns={1 + len(columns)}", sentence, "endheader"]
    rows = ["\t".join(f"{cell:.10f}" for cell in row) for row in np.column_stack([time, *columns.values()])]
    path.write_text("\n".join([*head, "\t".join(["time", *columns]), *rows]) + "\n")
    return path
