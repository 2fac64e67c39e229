"""Fits the gait that comes with the package to the table of mean curves and prints its file.

    python scripts/fit_built_in_gait.py FOLDER > src/ppafo/gait/normative/falisse2019-subject1.toml

FOLDER holds falisse2019_derived, with falisse2019_s1_1p33_stride.csv and falisse2019_s1_trials.csv, and
falisse2019_subject1, with IK_average_walking_FGC.mat: the mean stride of Falisse et al. (2019) as they publish it, from
which the way of the knee comes. The data are not part of the package; the coefficients are. Errors of the fit go to
standard error.
"""

import csv
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from ppafo.gait.document import gait_toml
from ppafo.gait.gait import HARMONICS, KNEE, FitError, Gait, GaitCurve, fit_curve
from ppafo.gait.recorded.signal import knee_position

DIGITS = 5
BODY_MASS = 62.0
COLUMNS = {
    "shank_angle": ("phi_deg", 1.0, 0.0),
    "ankle_angle": ("ankle_deg", -1.0, 90.0),
    "ankle_moment": ("ankle_moment_Nm_kg", 1.0, 0.0),
    "vertical_force": ("vGRF_BW", 1.0, 0.0),
}
"""Column of each curve, sign and zero: the table counts dorsiflexion above 0 from neutral."""
ANGLES = ("shank_angle", "ankle_angle")
THIGH_LENGTH = 0.3969
"""Hip to knee [m] in the authors' scaled model of the subject: github.com/antoinefalisse/3dpredictsim (MIT licence),
ExternalFunctions/PredSim.cpp, knee_r at (-0.0045, -0.3969, 0) in femur_r."""
SOURCE = (
    "Falisse et al. 2019, J R Soc Interface 16:20190402, doi:10.1098/rsif.2019.0402; "
    "github.com/antoinefalisse/3dpredictsim (MIT licence), subject 1: means of 11 overground strides"
)
NOTES = (
    "One healthy adult at self-selected speed. Curves filtered by the authors; the force does not vanish entirely in "
    "swing. Its mean over the stride is {force:.3f} body weights, as in the authors' table; half of a symmetric walk "
    "is 0.5, so that the force is {short:.0f} % short of {mass:g} kg. Fitted by scripts/fit_built_in_gait.py to 101 "
    "samples of the mean stride. Root mean square and largest error of the fit: {errors}. Accelerations of the knee: "
    "second derivatives of series through its way in the plane, from pelvis_tx, pelvis_ty, pelvis_tilt and "
    "hip_flexion_r of the authors' mean stride (IK_average_walking_FGC, of the same phases) with a thigh of 0.3969 m "
    "(their scaled model, ExternalFunctions/PredSim.cpp); the errors are of that way. How much strides differ in them "
    "is not known."
)


def table(path: Path) -> dict[str, np.ndarray]:
    """Return the columns of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def round_curve(curve: GaitCurve) -> GaitCurve:
    """Return the curve with as many digits as the fit deserves; what it still does not carry is left out."""
    cosines, sines = (tuple(round(value, DIGITS) for value in values) for values in (curve.cosines, curve.sines))
    return GaitCurve(round(curve.mean, DIGITS), cosines, sines, round(curve.deviation, DIGITS))


def knee_way(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the way of the knee over one stride, forward and up [m], without the mean speed of the walk."""
    (content,) = (value for name, value in loadmat(path, squeeze_me=True).items() if not name.startswith("__"))
    labels, rows = content["colheaders"].item(), content["data"].item()
    columns = {str(label): rows[:, number] for number, label in enumerate(labels)}
    lean = np.radians(columns["pelvis_tilt"] + columns["hip_flexion_r"])
    ways = knee_position(columns["pelvis_tx"], columns["pelvis_ty"], lean, THIGH_LENGTH)
    phase = np.linspace(0.0, 1.0, lean.size)
    forward, up = (way - (way[-1] - way[0]) * phase for way in ways)
    return forward, up


def fit_knee(path: Path, stride_time: float) -> dict[str, tuple[GaitCurve, FitError]]:
    """Return both accelerations of the knee by name, and what the series leave of its way [m]."""
    found = {}
    for name, way in zip(KNEE, knee_way(path), strict=True):
        curve, error = fit_curve(way, HARMONICS[name])
        found[name] = round_curve(curve.derivative(stride_time).derivative(stride_time)), error
    return found


def fit_stride(stride: Mapping[str, np.ndarray]) -> dict[str, tuple[GaitCurve, FitError]]:
    """Return curve and error of the fit by name, in the units of the table and the signs of the package."""
    found = {}
    for name, (column, sign, zero) in COLUMNS.items():
        deviation = float(np.sqrt(np.mean(stride[f"{column}_sd"] ** 2)))
        curve, error = fit_curve(zero + sign * stride[column], HARMONICS[name], deviation)
        found[name] = round_curve(curve), error
    return found


def in_si(name: str, curve: GaitCurve) -> GaitCurve:
    """Return the curve with angles in radians."""
    factor = np.pi / 180.0 if name in ANGLES else 1.0
    cosines, sines = (tuple(float(factor * value) for value in values) for values in (curve.cosines, curve.sines))
    return GaitCurve(float(factor * curve.mean), cosines, sines, float(factor * curve.deviation))


def built_in_gait(folder: Path) -> Gait:
    """Return the gait fitted to the tables in a folder."""
    derived = folder / "falisse2019_derived"
    trials = table(derived / "falisse2019_s1_trials.csv")
    stride_time = round(float(trials["stride_time_s_est"].mean()), 4)
    found = fit_stride(table(derived / "falisse2019_s1_1p33_stride.csv"))
    found |= fit_knee(folder / "falisse2019_subject1" / "IK_average_walking_FGC.mat", stride_time)
    force = found["vertical_force"][0].mean
    units = {name: " deg" if name in ANGLES else " m" if name in KNEE else "" for name in found}
    errors = "; ".join(
        f"{name} {error.root_mean_square:.2g} and {error.largest:.2g}{units[name]}"
        for name, (_, error) in found.items()
    )
    curves = {name: in_si(name, curve) for name, (curve, _) in found.items()}
    return Gait(
        name="falisse2019-subject1",
        title="Healthy adult, 62 kg, overground at 1.33 m/s",
        origin="measured",
        source=SOURCE,
        notes=NOTES.format(errors=errors, force=force, short=200.0 * (0.5 - force), mass=BODY_MASS),
        body_mass=BODY_MASS,
        walking_speed=round(float(trials["speed_m_s_est"].mean()), 2),
        stride_time=stride_time,
        stride_time_deviation=round(float(trials["stride_time_s_est"].std(ddof=1)), 4),
        stance_share=round(float(trials["stance_pct"].mean()) / 100.0, 4),
        stance_share_deviation=round(float(trials["stance_pct"].std(ddof=1)) / 100.0, 4),
        strides=len(trials["trial"]),
        shank_angle=curves["shank_angle"],
        ankle_angle=curves["ankle_angle"],
        ankle_moment=curves["ankle_moment"],
        vertical_force=curves["vertical_force"],
        knee_forward=curves["knee_forward"],
        knee_up=curves["knee_up"],
    )


def main() -> None:
    """Print the gait file."""
    folder = Path(sys.argv[1])
    gait = built_in_gait(folder)
    sys.stdout.write(gait_toml(gait))
    sys.stderr.write(gait.notes + "\n")


if __name__ == "__main__":
    main()
