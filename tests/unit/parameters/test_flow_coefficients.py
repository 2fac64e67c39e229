"""Cv, Kv, nominal flow and diameter of data sheets: the number of a set that is meant, and its factor."""

import math

import pytest

from ppafo.errors import ParameterError
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.overrides import apply_overrides

# By hand: from 7 to 6 bar absolute an orifice of b = 0.3 passes 7 sqrt(1 - ((6/7 - 0.3)/0.7)^2) L/s for each L/(s bar).
QN = 60.0 * 7.0 * math.sqrt(1.0 - ((6.0 / 7.0 - 0.3) / 0.7) ** 2)
# By ANSI/(NFPA) T3.21.3, in cubic feet, psi and degrees Rankine; "qn = 984 Cv" stands in catalogues of several makers.
CV = 22.48 * math.sqrt(14.5038 * 6.0 * 14.5038 / 527.67) * 28.3168


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("valve.cv=0.05", f"'valve.sonic_conductance', {CV / QN:.2f} L/(s bar) for each Cv"),
        ("valve.Kvs=0.045", f"'valve.sonic_conductance', {1.156 * CV / QN:.2f}"),
        ("valve.qn=50 L/min", f"'valve.sonic_conductance', qn/{QN:.0f} L/(s bar)"),
        ("valve.bore=3 mm", "'valve.area', pi/4 of the diameter squared"),
    ],
)
def test_a_number_of_a_data_sheet_is_answered_by_that_of_a_set(given: str, said: str) -> None:
    with pytest.raises(ParameterError) as caught:
        apply_overrides(load_parameter_set("ppafo2011"), [given])
    assert f"which is {said}" in str(caught.value)
