"""Conversion of Cv, Kv, nominal flow and orifice from data sheets to C and b of ISO 6358, or to an area.

Nominal flow ``qn`` goes from p1 = 7 bar to p2 = 6 bar, absolute, in litres at ANR. By ISO 6358 it is ``C p1 s`` with
``s = sqrt(1 - ((p2/p1 - b)/(1 - b))^2)``, 254.3 L/min per L/(s bar) at b = 0.3. A valve of Cv = 1 passes 984 L/min at
these pressures, by ``q = 22.48 Cv sqrt((p1 - p2) p2/(G T))`` of ANSI/(NFPA) T3.21.3 [ft^3/min, psi absolute, degrees
Rankine, G = 1 for air] at 20 degC. Hence C = 3.87 L/(s bar) per Cv; a Kv is 1.156 Cv.

The conversion for liquids, 17.0 mm^2 of orifice per Cv, does not hold for gas: choked flow would be 13 % too small.
"""

import contextlib
import math

from ppafo.errors import UnitError
from ppafo.units import parse_quantity, split_number, to_si
from ppafo.units.spelling import flow_of, is_volume_flow

USUAL_CRITICAL_RATIO = 0.3
"""Usual critical pressure ratio b of spool valves [-], for data sheets without b."""

CV_PER_KV = 1.156
"""Ratio of Cv to Kv: US gal/min at 1 psi per m^3/h at 1 bar, both of water (IEC 60534-1)."""

_BEFORE, _BEHIND = 7.0, 6.0
"""Upstream and downstream pressures of nominal flow [bar absolute]."""
_NFPA, _PSI_PER_BAR, _RANKINE, _LITRES_PER_CUBIC_FOOT = 22.48, 14.5038, 527.67, 28.3168
_LITRE_PER_SECOND_BAR = 1.0e-8


def conductance_of_nominal_flow(flow: float) -> float:
    """Sonic conductance C [m^3/(s Pa)] of a valve with a nominal flow [L/min at ANR] from 7 to 6 bar absolute."""
    share = math.sqrt(1.0 - ((_BEHIND / _BEFORE - USUAL_CRITICAL_RATIO) / (1.0 - USUAL_CRITICAL_RATIO)) ** 2)
    return flow / 60.0 / (_BEFORE * share) * _LITRE_PER_SECOND_BAR


def nominal_flow_of_cv(cv: float) -> float:
    """Nominal flow [L/min] of air from 7 to 6 bar absolute through a valve with a Cv [US gal/min, psi]."""
    drop, behind = (_BEFORE - _BEHIND) * _PSI_PER_BAR, _BEHIND * _PSI_PER_BAR
    return _NFPA * cv * math.sqrt(drop * behind / _RANKINE) * _LITRES_PER_CUBIC_FOOT


def area_of(text: str) -> float | None:
    """Parse the diameter of an orifice, ``2 mm``, or its area into the area [m^2]; None for an invalid text."""
    with contextlib.suppress(UnitError):
        return 0.25 * math.pi * parse_quantity(text, "m") ** 2
    with contextlib.suppress(UnitError):
        return parse_quantity(text, "m^2")
    return None


def conductance_of(name: str, text: str) -> float | None:
    """Parse ``cv``, ``kv``, ``qn`` or ``c`` text, ``0.05 m^3/h``, into C [m^3/(s Pa)]; None for an invalid text."""
    try:
        if name == "c":
            return parse_quantity(text, "m^3/(s Pa)")
        value, unit = split_number(text)
        is_flow = bool(unit) and is_volume_flow(unit)
        # Normal litres are taken as those of the nominal flow.
        litres = to_si(value, flow_of(unit).unit, "m^3/s") * 6.0e4 if is_flow else value
    except UnitError:
        return None
    if value <= 0.0 or (unit and not is_flow):
        return None
    if name == "qn":
        return conductance_of_nominal_flow(litres)
    # Kv is in m^3/h unless it says L/min; Cv has no unit that anybody writes.
    cv = CV_PER_KV * (litres * 0.06 if is_flow else value) if name == "kv" else value
    return conductance_of_nominal_flow(nominal_flow_of_cv(cv))
