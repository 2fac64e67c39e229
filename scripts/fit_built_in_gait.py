"""Fits the gait that comes with the package to the table of mean curves and prints its file.

    python scripts/fit_built_in_gait.py FOLDER > src/ppafo/gait/normative/falisse2019-subject1.toml

FOLDER holds falisse2019_s1_1p33_stride.csv and falisse2019_s1_trials.csv, derived from the files of Falisse et al.
(2019). The data are not part of the package; the coefficients are. Errors of the fit go to standard error.
"""

import csv
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ppafo.gait.document import gait_toml
from ppafo.gait.fourier import HARMONICS, FitError, fit_curve
from ppafo.gait.gait import Curve, Gait

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
SOURCE = (
    "Falisse et al. 2019, J R Soc Interface 16:20190402, doi:10.1098/rsif.2019.0402; "
    "github.com/antoinefalisse/3dpredictsim (MIT licence), subject 1: means of 11 overground strides"
)
NOTES = (
    "One healthy adult at self-selected speed. Curves filtered by the authors; the force does not vanish entirely in "
    "swing. Fitted by scripts/fit_built_in_gait.py to 101 samples of the mean stride. Root mean square and largest "
    "error of the fit: {errors}."
)


def table(path: Path) -> dict[str, np.ndarray]:
    """Return the columns of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def rounded(curve: Curve) -> Curve:
    """Return the curve with as many digits as the fit deserves; what it still does not carry is left out."""
    cosines, sines = (tuple(round(value, DIGITS) for value in values) for values in (curve.cosines, curve.sines))
    return Curve(round(curve.mean, DIGITS), cosines, sines, round(curve.deviation, DIGITS))


def fitted(stride: Mapping[str, np.ndarray]) -> dict[str, tuple[Curve, FitError]]:
    """Return curve and error of the fit by name, in the units of the table and the signs of the package."""
    found = {}
    for name, (column, sign, zero) in COLUMNS.items():
        deviation = float(np.sqrt(np.mean(stride[f"{column}_sd"] ** 2)))
        curve, error = fit_curve(zero + sign * stride[column], HARMONICS[name], deviation)
        found[name] = rounded(curve), error
    return found


def in_si(name: str, curve: Curve) -> Curve:
    """Return the curve with angles in radians."""
    factor = np.pi / 180.0 if name in ANGLES else 1.0
    cosines, sines = (tuple(float(factor * value) for value in values) for values in (curve.cosines, curve.sines))
    return Curve(float(factor * curve.mean), cosines, sines, float(factor * curve.deviation))


def built_in_gait(folder: Path) -> Gait:
    """Return the gait fitted to the tables in a folder."""
    found = fitted(table(folder / "falisse2019_s1_1p33_stride.csv"))
    trials = table(folder / "falisse2019_s1_trials.csv")
    units = {name: " deg" if name in ANGLES else "" for name in found}
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
        notes=NOTES.format(errors=errors),
        body_mass=BODY_MASS,
        walking_speed=round(float(trials["speed_m_s_est"].mean()), 2),
        stride_time=round(float(trials["stride_time_s_est"].mean()), 4),
        stride_time_deviation=round(float(trials["stride_time_s_est"].std(ddof=1)), 4),
        stance_share=round(float(trials["stance_pct"].mean()) / 100.0, 4),
        stance_share_deviation=round(float(trials["stance_pct"].std(ddof=1)) / 100.0, 4),
        strides=len(trials["trial"]),
        shank_angle=curves["shank_angle"],
        ankle_angle=curves["ankle_angle"],
        ankle_moment=curves["ankle_moment"],
        vertical_force=curves["vertical_force"],
    )


def main() -> None:
    """Print the gait file."""
    folder = Path(sys.argv[1])
    gait = built_in_gait(folder)
    sys.stdout.write(gait_toml(gait))
    sys.stderr.write(gait.notes + "\n")


if __name__ == "__main__":
    main()
