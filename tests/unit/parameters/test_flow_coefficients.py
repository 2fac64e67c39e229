"""Cv, Kv and nominal flow of data sheets in C and b, against numbers that makers print."""

import ast

import pytest

from ppafo.errors import ParameterError
from ppafo.parameters.flow_coefficients import conductance_of, conductance_of_nominal_flow, nominal_flow_of_cv
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.overrides import apply_overrides

LITRE_PER_SECOND_BAR = 1e-8


def test_a_cv_of_1_passes_984_litres_a_minute_of_nominal_flow() -> None:
    # "qn = 984 Cv" stands in catalogues of several makers.
    assert nominal_flow_of_cv(1.0) == pytest.approx(984.0, rel=1e-3)


def test_nominal_flow_is_what_iso_6358_passes_from_7_to_6_bar() -> None:
    # By hand: 7 sqrt(1 - ((6/7 - 0.3)/0.7)^2) = 4.238.
    assert conductance_of_nominal_flow(60 * 4.238) == pytest.approx(LITRE_PER_SECOND_BAR, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "text", "litres_per_second_bar"),
    [
        ("cv", "1", 3.87),
        ("kv", "1", 4.48),
        ("kv", "1 m^3/h", 4.48),
        ("kv", "16.667 L/min", 4.48),
        ("qn", "254 L/min", 1.0),
        ("qn", "254 Nl/min", 1.0),
        ("qn", "254", 1.0),
    ],
)
def test_c_of_what_a_data_sheet_states(name: str, text: str, litres_per_second_bar: float) -> None:
    assert conductance_of(name, text) == pytest.approx(litres_per_second_bar * LITRE_PER_SECOND_BAR, rel=2e-3)


@pytest.mark.parametrize("text", ["-1", "0", "3 mm^2", "large", "1 kg"])
def test_what_is_no_flow_coefficient_is_not_converted(text: str) -> None:
    assert conductance_of("cv", text) is None


@pytest.mark.parametrize(
    "given", ["valve.cv=0.05", "valve.kv=0.05 m^3/h", "valve.qn=50 L/min", "valve.Kvs=0.045", "valve.C=12 L/(min bar)"]
)
def test_the_answer_to_a_flow_coefficient_is_taken(given: str) -> None:
    before = load_parameter_set("ppafo2011")
    with pytest.raises(ParameterError, match=r"which is 'valve\.sonic_conductance'") as caught:
        apply_overrides(before, [given])
    answers = ast.literal_eval(str(caught.value).partition("overrides=")[2])
    after = apply_overrides(before, answers)
    assert after.numbers["valves.proportional.critical_ratio"].value == 0.3
    assert 0.15 < after.numbers["valves.proportional.sonic_conductance"].value < 0.25


@pytest.mark.parametrize("given", ["valve.orifice=2 mm", "valve.diameter=0.0787402 in", "valve.bore=3.1416 mm^2"])
def test_the_answer_to_an_orifice_is_an_area(given: str) -> None:
    before = load_parameter_set("ppafo2011")
    with pytest.raises(ParameterError, match=r"which is 'valve\.area', pi/4 of the diameter squared") as caught:
        apply_overrides(before, [given])
    [answer] = ast.literal_eval(str(caught.value).partition("overrides=")[2])
    assert answer == "valve.area=3.142 mm^2"
    assert apply_overrides(before, [answer]).numbers["valves.proportional.area"].value == 3.142
