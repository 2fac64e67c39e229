"""Actuators in parameter sets: kinds, what does not fit together, and the file of one that was measured."""

import math
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from ppafo.engine.rows import leaves
from ppafo.errors import ParameterError, PpafoError
from ppafo.model.actuators.table import bases_at, level_of
from ppafo.parameters.actuator_table import (
    MeasuredVolumes,
    read_actuator_table,
    read_measured_volumes,
    table_of,
    within_resolution,
)
from ppafo.parameters.loading import load_device, load_parameter_set, parameter_set_toml, parse_parameter_set
from ppafo.simulation.ensemble.planning import check_columns, screen_columns
from ppafo.simulation.loading import load_scenario

EXAMPLE = Path(__file__).parents[2] / "actuators"
HEADER = "angle [deg],pressure [kPa_g],volume_1 [mL]"
GOOD = ["20,0,100", "20,50,130", "60,0,120", "60,50,160", "100,0,150", "100,50,200"]

GOOD_TO_110 = ("20,0,100", "20,66,130", "110,0,150", "110,66,200")
SHRINKING = ("20,0,1000", "20,500,1100", "110,0,500", "110,500,1600")
"""Chamber 1 shrinks with the angle at low pressure, and grows at a high one."""


def measured(folder: Path, *lines: str) -> Path:
    """A file of a measured actuator."""
    path = folder / "mine.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_set_without_a_kind_has_a_vane_and_one_that_names_it_is_the_same() -> None:
    text = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    named = text.replace("[actuator.torque_constant]", '[actuator]\nkind = "vane"\n\n[actuator.torque_constant]', 1)
    assert parse_parameter_set(named.encode(), "a.toml") == parse_parameter_set(text.encode(), "a.toml")
    assert load_device("ppafo2011").actuator.kind == "vane"


def test_the_torque_constant_of_another_kind_is_its_mean_growth() -> None:
    actuator = load_device("cylinder-lever").actuator
    stroke = 2.0 * 0.025 * np.sin(np.radians(55.0))
    area = 0.25 * np.pi * 0.0257**2
    assert actuator.torque_constant == actuator.displacement_per_radian
    assert actuator.torque_constant == pytest.approx(area * stroke / np.radians(110.0), rel=0.01)


def test_a_measured_set_is_written_with_its_file(tmp_path: Path) -> None:
    text = parameter_set_toml(load_parameter_set(EXAMPLE / "measured-bladder.toml"))
    (tmp_path / "measured-bladder.csv").write_bytes((EXAMPLE / "measured-bladder.csv").read_bytes())
    (tmp_path / "again.toml").write_text(text, encoding="utf-8")
    assert load_device(tmp_path / "again.toml") == load_device(EXAMPLE / "measured-bladder.toml")


@pytest.mark.parametrize("angles", [2, 3, 4, 7, 12])
def test_a_curve_is_a_cubic_where_the_volume_is_one(angles: int) -> None:
    degree = min(3, angles - 1)
    places = np.linspace(0.3, 1.9, angles)
    polynomial = np.polynomial.Polynomial([2e-4, 1e-4, 3e-5, 2e-5][: degree + 1])
    volumes = MeasuredVolumes(places, np.zeros(1), polynomial(places)[:, None], None)
    table = table_of(volumes, "a.csv")
    for angle in np.linspace(0.3, 1.9, 31):
        level = level_of(table.chamber_1.lowest, bases_at(table, angle))
        assert level.volume == pytest.approx(polynomial(angle), rel=1e-10)
        assert level.slope == pytest.approx(polynomial.deriv()(angle), rel=1e-8)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ((), "is empty"),
        ((HEADER,), "no rows of numbers"),
        (("angel [deg],pressure [kPa_g],volume_1 [mL]", "1,2,3"), "unknown column 'angel', did you mean 'angle'?"),
        (("angle [deg],pressure [kPa_g]", "1,2"), "column 'volume_1' is missing"),
        (("angle [deg]", "1"), "columns 'pressure' and 'volume_1' are missing"),
        (("angle,pressure [kPa_g],volume_1 [mL]", "1,2,3"), "column 'angle' has no unit"),
        (
            ("angle [deg],pressure [kPa],volume_1 [mL]", "1,2,3"),
            "column 'pressure' must be in a gauge unit such as kPa_g",
        ),
        (("angle [deg],angle [deg],volume_1 [mL]", "1,2,3"), "the column 'angle' occurs twice"),
        ((HEADER, "1,2"), "line 2: has 2 values, the header has 3"),
        ((HEADER, "1,2,nan"), "line 2: volume_1 = 'nan' is not a finite number"),
        ((HEADER, *GOOD, "100,90,1e9"), "line 8: volume_1 = 1e+09 mL exceeds"),
        ((HEADER, *GOOD[:-1]), "there is no line for 100 deg and 50 kPa_g"),
        ((HEADER, *GOOD, GOOD[0]), "has more than one line for 20 deg and 0 kPa_g"),
        (
            (HEADER, *(line.replace(",0,", ",10,") for line in GOOD)),
            "has no volumes of the vented actuator; add lines at 0 kPa_g",
        ),
        ((HEADER.replace(",", ";"), *GOOD), "columns must be separated by commas"),
        ((HEADER, *GOOD[:2]), "has one angle only"),
        ((HEADER, *(line.replace(",50,", ",-150,") for line in GOOD)), "pressure = -150 kPa_g is below a perfect vac"),
        (
            (HEADER, *GOOD[:-1], "100,50,140"),
            "volume_1 decreases with pressure at 100 deg and 50 kPa_g, by 10 mL; allowed is the last digit, 1 mL",
        ),
        ((HEADER, "20,0,-5", *GOOD[1:]), "is negative"),
        ((HEADER, *GOOD[:3], "60,50,220", *GOOD[4:]), "must grow with the angle at the highest pressure"),
        ((HEADER, "20,0,1", "21,0,9", "22,0,9.1", "60,0,9.2"), "the interpolated volume_1 is negative near"),
        ((HEADER, *(f"{angle},0,{100 + angle}" for angle in range(20, 34))), "at most 12 are allowed"),
        ((HEADER, "20,0,100", "20.0001,0,101", "60,0,120"), "almost equal"),
    ],
)
def test_a_file_that_is_wrong_is_refused_in_one_line(tmp_path: Path, lines: tuple[str, ...], said: str) -> None:
    path = measured(tmp_path, *lines)
    with pytest.raises(ParameterError) as caught:
        read_actuator_table(path)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


ROUNDED = (
    *("20,0,2.7", "20,55,3.8", "20,110,3.8", "34,0,3.5", "34,55,5.0", "34,110,5.0"),
    *("47,0,4.4", "47,55,6.2", "47,110,6.2", "61,0,5.2", "61,55,7.3", "61,110,7.4"),
    *("75,0,6.0", "75,55,8.4", "75,110,8.5"),
)


def test_a_table_is_fitted_within_its_last_digit_and_no_further(tmp_path: Path) -> None:
    measurements = read_measured_volumes(measured(tmp_path, HEADER, *ROUNDED))
    shares = (measurements.angles - measurements.angles[0]) / np.ptp(measurements.angles)
    fitted = within_resolution(measurements.volume_1, shares, measurements.pressures, measurements.resolution_1)
    assert measurements.resolution_1 == pytest.approx(0.1e-6)
    assert 0.0 < fitted.move <= 0.05e-6
    assert np.max(np.abs(fitted.volume - measurements.volume_1)) == pytest.approx(fitted.move)
    assert read_actuator_table(measured(tmp_path, HEADER, *ROUNDED)).last_angle == pytest.approx(math.radians(75.0))
    exact = [f"{line}01" for line in ROUNDED]
    with pytest.raises(ParameterError, match="decreases with pressure near"):
        read_actuator_table(measured(tmp_path, HEADER, *exact))
    unmoved = within_resolution(measurements.volume_1, shares, measurements.pressures, 0.0)
    assert (unmoved.move, unmoved.torque_error) == (0.0, 0.0)
    assert unmoved.volume is measurements.volume_1


BLADDERS = {
    "parabola": lambda share: 15.0 + 62.0 * share - 12.0 * share**2,
    "cosine": lambda share: 20.0 + 45.0 * (1.0 - np.cos(1.4 * share)),
    "exponential": lambda share: 15.0 + 12.0 * np.expm1(1.5 * share),
    "cubic": lambda share: 15.0 + 40.0 * share - 30.0 * share**2 + 35.0 * share**3,
}


def largest_errors(count: int, digit: float) -> tuple[float, float, float]:
    """Torque of four bladders from tables of ``count`` angles rounded to ``digit`` [mL], relative to the largest one.

    Root mean squares of the largest error at any angle, without and with moves, and of the error that is stated.
    """
    shares, fine, errors = np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, 201), []
    filled, pressures = 1.0 - 0.28 * np.exp(-np.linspace(0.0, 4.0, 5)), np.linspace(0.0, 160.0e3, 5)
    over_pressure = np.array([0.5, 1.0, 1.0, 1.0, 0.5])
    for volume in BLADDERS.values():
        rounded = 1e-6 * digit * np.round(np.outer(volume(shares), filled) / digit)
        fitted = within_resolution(rounded, shares, pressures, 1e-6 * digit)
        true = 1e-6 * np.gradient(volume(fine), fine, edge_order=2) * (filled @ over_pressure)
        torques = (CubicSpline(shares, table @ over_pressure)(fine, 1) for table in (rounded, fitted.volume))
        errors.append((*(np.abs(one - true).max() / np.abs(true).max() for one in torques), fitted.torque_error))
    return tuple(np.sqrt(np.mean(np.square(errors), axis=0)).tolist())  # type: ignore[return-value]


def test_more_rows_of_a_rounded_table_make_its_torque_no_worse() -> None:
    as_they_are, moved, stated = zip(*(largest_errors(count, 1.0) for count in (6, 8, 10, 12)), strict=True)
    assert max(as_they_are) > 0.1
    assert max(moved) < 0.05
    assert moved[-1] < 0.4 * as_they_are[-1]
    assert all(error < 2.0 * own for error, own in zip(moved, stated, strict=True))


def test_volumes_whose_digits_are_not_felt_stay_as_they_are() -> None:
    as_they_are, moved, _ = largest_errors(12, 0.01)
    assert moved == as_they_are


@pytest.mark.parametrize(("decimals", "times", "step"), [(".1f", 1.0, 0.1), (".3f", 1.0, 0.1), (".0f", 50.0, 5.0)])
def test_the_step_of_a_table_is_that_of_its_numbers_and_not_of_its_zeros(
    tmp_path: Path, decimals: str, times: float, step: float
) -> None:
    lines = [line.rpartition(",") for line in ROUNDED]
    written = [f"{before},{times * float(volume):{decimals}}" for before, _, volume in lines]
    assert read_measured_volumes(measured(tmp_path, HEADER, *written)).resolution_1 == pytest.approx(step * 1e-6)
    few = measured(tmp_path, HEADER, *GOOD)
    assert read_measured_volumes(few).resolution_1 == pytest.approx(1e-6), "six numbers may be multiples by chance"


def test_columns_and_lines_may_stand_in_any_order(tmp_path: Path) -> None:
    rows = [
        (angle, pressure, 100 + angle + pressure, 300 - angle + pressure) for angle in (20, 60) for pressure in (0, 9)
    ]
    one = read_actuator_table(measured(tmp_path, f"{HEADER},volume_2 [mL]", *(",".join(map(str, row)) for row in rows)))
    header = "volume_2 [L],volume_1 [mL],pressure [bar_g],angle [deg]"
    lines = [f"{second / 1000},{first},{pressure / 100},{angle}" for angle, pressure, first, second in rows[::-1]]
    other = read_actuator_table(measured(tmp_path, header, "# upside down", *lines))
    assert leaves(other) == pytest.approx(leaves(one))
    bases = bases_at(one, np.radians(60.0))
    assert level_of(one.chamber_1.lowest, bases).volume == pytest.approx(160e-6)
    assert level_of(one.chamber_2.lowest, bases).volume == pytest.approx(240e-6)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            ("20,0,100", "20,60,130", "110,0,150", "110,60,200"),
            "covers pressures up to 161.3 kPa_a, but the supply has 166.8",
        ),
        (
            ("20,0,1000", "20,500,1100", "110,0,500", "110,500,1600"),
            "chamber 1 must grow with the angle, but changes by",
        ),
    ],
)
def test_a_table_must_hold_at_supply_pressure(tmp_path: Path, lines: tuple[str, ...], said: str) -> None:
    measured(tmp_path, HEADER, *lines).rename(tmp_path / "measured-bladder.csv")
    (tmp_path / "set.toml").write_bytes((EXAMPLE / "measured-bladder.toml").read_bytes())
    with pytest.raises(ParameterError, match=said):
        load_device(tmp_path / "set.toml")


@pytest.mark.parametrize(
    ("lines", "pressures", "said"),
    [
        (
            GOOD_TO_110,
            (60.0, 900.0),
            "actuator: the volume table covers pressures up to 66 kPa_g, but the supply has 900",
        ),
        (SHRINKING, (490.0, 65.0), "chamber 1 must grow with the angle, but changes by -"),
    ],
)
def test_a_run_of_a_study_that_the_table_does_not_hold_for_is_refused_as_alone(
    tmp_path: Path, lines: tuple[str, ...], pressures: tuple[float, float], said: str
) -> None:
    measured(tmp_path, HEADER, *lines).rename(tmp_path / "measured-bladder.csv")
    for name in ("measured-bladder.toml", "step-response-measured-bladder.toml"):
        (tmp_path / name).write_bytes((EXAMPLE / name).read_bytes())
    file = tmp_path / "step-response-measured-bladder.toml"
    good, bad = (f"supply.pressure={pressure} kPa_g" for pressure in pressures)
    with pytest.raises(PpafoError) as alone:
        load_scenario(file, [bad])
    columns = {"supply.pressure": 101325.0 + 1e3 * np.array(pressures)}
    screen = screen_columns(check_columns(load_scenario(file, [good]), columns))
    assert (screen.members.tolist(), list(screen.reasons)) == ([0], [1])
    assert said in screen.reasons[1]
    assert str(alone.value).endswith(screen.reasons[1])


def test_stops_beyond_what_was_measured_are_refused(tmp_path: Path) -> None:
    measured(tmp_path, HEADER, *GOOD).rename(tmp_path / "measured-bladder.csv")
    (tmp_path / "set.toml").write_bytes((EXAMPLE / "measured-bladder.toml").read_bytes())
    with pytest.raises(ParameterError, match="volume table covers 20 to 100 deg, but the stops are at 20 to 110 deg"):
        load_device(tmp_path / "set.toml")


@pytest.mark.parametrize(
    ("name", "override", "said"),
    [
        ("cylinder-lever", "actuator.lever_offset=60 deg", "the angle between lever and base is 80 to 190 deg"),
        ("cylinder-lever", "actuator.rod_diameter=30 mm", "rod_diameter must be below bore"),
        ("cylinder-lever", "actuator.torque_constant=1e-5 m^3", "has no value 'actuator.torque_constant'"),
    ],
)
def test_numbers_that_do_not_fit_together_are_refused(name: str, override: str, said: str) -> None:
    with pytest.raises(PpafoError) as caught:
        load_device(name, overrides=[override])
    assert said in str(caught.value)


def test_a_run_of_an_ensemble_whose_lever_comes_to_its_dead_centre_is_refused_and_the_others_go_on() -> None:
    base = load_scenario(EXAMPLE / "torque-task-cylinder.toml")
    offsets = np.radians([15.0, 60.0, 20.0])
    screen = screen_columns(check_columns(base, {"actuator.lever_offset": offsets}))
    assert screen.members.tolist() == [0, 2]
    assert "actuator: the angle between lever and base is 80 to 190 deg" in screen.reasons[1]
