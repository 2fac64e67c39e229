"""Units of the loads in C3D files: Plug-in Gait divides by body mass, and the header often does not say so."""

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.table import MotionTable

_FACTORS = {
    "moment": {"N m/kg": 1.0, "N mm/kg": 1.0e-3, "N m": None, "N mm": None},
    "force": {"N/kg": 1.0, "N": None, "": 9.8, "percent": 0.098},
}
"""What makes N m/kg or N/kg of a number in the unit; None where the body mass does."""

_PLAUSIBLE = {"moment": (0.35, 2.6), "force": (5.5, 20.0)}
"""Peaks of walking in N m/kg and N/kg, narrow enough for no two units to fit up to a body mass of 130 kg."""


def load_unit(table: MotionTable, name: str, kind: str, body_mass: float) -> tuple[str, list[str]]:
    """Return the unit of a column of ``kind`` "moment" or "force", and a remark where it is not what the file states.

    The stated unit is taken where the numbers can be walking in it, else the only one in which they can.
    """
    values = np.abs(table.columns[name][np.isfinite(table.columns[name])])
    stated = table.units.get(name, "")
    peak = float(np.percentile(values, 99.5)) if values.size else 0.0
    fitting = [unit for unit in _FACTORS[kind] if _fits(peak, unit, kind, body_mass)]
    if stated in fitting or (not fitting and stated in _FACTORS[kind]):
        return stated, []
    if len(fitting) != 1:
        known = ", ".join(repr(unit) for unit in _FACTORS[kind])
        raise DataError(
            f"{table.file}: column {name!r} reaches {peak:.4g} and its unit, {stated or 'not stated'!r}, does not fit "
            f"a {kind} of walking; give it in a gait map: {known}"
        )
    was = f"the file states {stated!r}" if stated in _FACTORS[kind] else "the file does not state it"
    return fitting[0], [f"column '{name}' was read in {fitting[0] or 'body weights'} by its size: {was}"]


def _fits(peak: float, unit: str, kind: str, body_mass: float) -> bool:
    factor = _FACTORS[kind][unit]
    if factor is None:
        factor = (1.0e-3 if unit == "N mm" else 1.0) / body_mass
    low, high = _PLAUSIBLE[kind]
    return low <= factor * peak <= high
