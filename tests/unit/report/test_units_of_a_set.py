"""What is said and drawn is in the units in which the author of a parameter set wrote it."""

import re
from importlib import resources
from pathlib import Path

import pytest

import ppafo
from ppafo.parameters.parameter_set import written_units
from ppafo.simulation.gains import gains_of, remark_on_following_gains
from ppafo.studies.loading import load_study
from ppafo.studies.varying import varied_path
from ppafo.units.shown import shown_in, shown_text
from ppafo.walking import load_walk

PSI = 6894.757293168361
TASK, SHORT = "torque-task-proportional", "run.duration=0.4 s"
BAR = {"Pa_a": "bar_g", "Pa_d": "bar_d", "N m": "N cm", "rad": "deg", "rad/s": "deg/s"}


@pytest.fixture
def in_bar(tmp_path: Path) -> str:
    """The paper's set as somebody would write it who has bar gauges and a small torque sensor."""
    text = resources.files("ppafo.parameters.sets").joinpath("ppafo2011.toml").read_text(encoding="utf-8")

    def number(factor: float, unit: str) -> object:
        return lambda found: f'value = {float(found[1]) * factor:.12g}\nunit = "{unit}"'

    text = re.sub(r'value = ([\d.]+)\nunit = "psi_g"', number(PSI / 1e5, "barg"), text)  # type: ignore[call-overload]
    text = re.sub(r'value = ([\d.]+)\nunit = "N m"', number(100.0, "N cm"), text)  # type: ignore[call-overload]
    # A citation of the paper has to have the paper's numbers.
    text = re.sub(r'key = ".*"\n|parent = ".*"\n', "", text)
    file = tmp_path / "bar.toml"
    file.write_text(text.replace('"ppafo2011"', '"bar"', 1), encoding="utf-8")
    return str(file)


def test_the_units_of_a_set_are_those_in_which_it_is_written(in_bar: str) -> None:
    assert ppafo.load_parameter_set(in_bar).shown.items() >= BAR.items()
    paper = ppafo.load_parameter_set("ppafo2011").shown
    assert (paper["Pa_a"], paper["N m"], paper["rad"]) == ("psi_g", "N m", "deg")
    assert written_units({}) == {}


def test_the_unit_in_which_a_number_is_given_goes_before_that_of_the_set(in_bar: str) -> None:
    changed = ppafo.load_device(in_bar, overrides=["supply.pressure=70 psi_g"])
    assert (changed.shown["Pa_a"], changed.shown["Pa_d"], changed.shown["N m"]) == ("psi_g", "psi_d", "N cm")
    # Who gives a number in SI says nothing of how he reads one.
    assert ppafo.load_device(in_bar, overrides={"supply.pressure": 4.0e5}).shown["Pa_a"] == "bar_g"
    text = str(ppafo.simulate(TASK, overrides=[SHORT, "supply.pressure=3 bar_g"]))
    assert re.search(r"largest_pressure +[\d.]+ bar_g", text)
    assert "psi" not in text


def test_the_unit_of_a_controller_setting_or_a_sensor_is_of_that_number_alone(tmp_path: Path) -> None:
    # 0.5 deg is pi / 360 rad; the least noise that a person would set is in any unit.
    words = ["controller.tolerance=0.00872665 rad", "sensors.angle_noise=0.0001 rad", "sensors.pressure_noise=1 kPa_d"]
    scenario = ppafo.load_scenario("swing-foot-angle", words)
    assert (scenario.device.shown["rad"], scenario.device.shown["Pa_a"]) == ("deg", "psi_g")
    assert ppafo.load_scenario("swing-foot-angle", ["motion.angle=1.8 rad"]).device.shown["rad"] == "rad"
    assert (
        ppafo.load_scenario(
            "torque-task-proportional", ["controller.kind=on_off_dead_zone", "controller.dead_zone=30 N cm"]
        ).device.shown["N m"]
        == "N m"
    )
    assert load_walk("proportional", ["controller.peak_torque=900 N cm"]).device.shown["N m"] == "N cm"
    with shown_in(scenario.device.shown):
        given = gains_of(scenario)
        assert given is not None
        assert "tolerance 0.5 deg (given)" in given.sentence
    remark = remark_on_following_gains(ppafo.load_scenario("swing-foot-angle"), ["actuator.torque_constant"])
    assert "controller.tolerance=0.1375 deg'" in remark
    assert " rad'" not in remark
    file = tmp_path / "foot.toml"
    shipped = resources.files("ppafo.scenarios").joinpath("swing-foot-angle.toml").read_text(encoding="utf-8")
    file.write_text(shipped.replace('error_limit = "2 deg"', 'error_limit = "0.035 rad"'), encoding="utf-8")
    assert ppafo.load_scenario(file).device.shown["rad"] == "deg"
    wave = ["motion.kind=free", "reference.kind=sine", "reference.amplitude=20 deg", "run.duration=3 s"]
    ranged = {"vary": "controller.tolerance=0.005..0.02 rad", "such_that": "follows", "grid": 3, "overrides": wave}
    said = ppafo.find("swing-foot-angle", **ranged).said
    assert said[0].startswith("controller.tolerance = 0.005 rad is the lowest value")
    assert "largest error" in said[1]
    assert " deg allowed)" in said[1]
    varied = {"path": "controller.tolerance", "kind": "list", "values": ["0.005 rad", "0.01 rad"]}
    configurations = [{"name": "foot", "scenario": "swing-foot-angle"}]
    study = load_study({"schema_version": 1, "name": "foot", "configurations": configurations, "vary": [varied]})
    assert study.shown_for(study.configurations[0].scenario)["rad"] == "deg"


def test_find_answers_in_the_units_of_its_range_and_condition() -> None:
    found = ppafo.find(TASK, vary="reference.level=100..300 N cm", such_that="final_error <= 30 N cm", grid=3)
    assert re.search(r"final_error is [\d.]+ N cm there", found.said[0])
    assert "(N cm)" in found.plot().axes[0].get_ylabel()


@pytest.mark.parametrize(
    ("value", "si_unit", "text"),
    [
        (5.201e-4, "m^2", "520.1 mm^2"),
        (5.295e-6, "N/Pa", "0.5295 N/bar"),
        (3.929e-9, "m^3/(s Pa)", "0.3929 L/(s bar)"),
        (401325.0, "Pa_a", "3 bar_g"),
        (401325.0, "Pa", "3 bar_g"),
        (3.0e5, "Pa_d", "3 bar_d"),
        (0.05, "N m", "5 N cm"),
        (6.6378e-7, "Pa_d", "0 bar_d"),
        (2.665e-15, "N m", "0 N cm"),
        (186.0, "1/(N m)", "186 1/(N m)"),
        (0.5, "1", "0.5"),
    ],
)
def test_a_number_is_written_in_the_units_of_the_set_with_digits_that_people_read(
    value: float, si_unit: str, text: str
) -> None:
    with shown_in(BAR):
        assert shown_text(value, si_unit) == text


@pytest.mark.parametrize(("text", "shown"), [("1.451e-5 m^3", "14.51 cm^3"), ("14510 mm^3", "14510 mm^3")])
def test_a_unit_that_needs_a_power_of_ten_is_not_the_one_in_which_a_number_is_said(text: str, shown: str) -> None:
    assert varied_path("actuator.torque_constant", ppafo.load_scenario(TASK), [text]).quote(1.451e-5) == shown


def test_every_table_of_an_analysis_is_in_the_units_of_the_set(in_bar: str, tmp_path: Path) -> None:
    changes = [f"device.set={in_bar}", SHORT]
    compared = ppafo.compare([TASK, "torque-task-solenoid"], overrides=changes)
    assert "RMS error (N cm)" in str(compared)
    found = ppafo.find(TASK, vary="supply.pressure=40..60 psi_g", such_that="peak_torque >= 1 N m", overrides=changes)
    assert re.search(r"supply.pressure = [\d.]+ psi_g is the lowest value.*: peak_torque is [\d.]+ N m", found.said[0])
    linear = str(ppafo.linearise(TASK, overrides=[*changes, "reference.level=300 N cm"]))
    assert re.search(r"supply_pressure +Pa +3.447\d* bar_g", linear)
    assert re.search(r"torque +N m +[\d.]+ N cm", linear)
    recorded = ppafo.simulate("step-response", overrides=[f"device.set={in_bar}"]).save(tmp_path / "bench")
    validated = ppafo.validate(in_bar, [recorded], motion="leg", overrides=["supply.pressure=3.8 bar_g"])
    for said in (str(compared), linear, str(validated)):
        assert "psi" not in said
    assert re.search(r"supply.pressure = [\d.]+ bar_g was used", str(validated))
    # Drawn later, out of the call, and from a file.
    axes = linear_axes(validated)
    assert any("(bar" in label for label in axes)


def linear_axes(finding: object) -> list[str]:
    """Return what the axes of a finding's first figure say."""
    figure = finding.plot()  # type: ignore[attr-defined]
    return [text for axes in figure.axes for text in (axes.get_ylabel(), axes.get_title(loc="left"))]


def test_gauge_pressures_count_from_the_atmosphere_of_the_set_in_every_answer(in_bar: str, tmp_path: Path) -> None:
    room = 0.7e5
    high = [f"device.set={in_bar}", "supply.atmospheric_pressure=0.7 bar_a", "supply.pressure=3.5 bar_g"]
    changes = [*high, SHORT]

    def gauge(pattern: str, text: str) -> float:
        said = re.search(pattern + r"(-?[\d.]+) bar_g", text)
        assert said is not None, text
        return float(said[1])

    result = ppafo.simulate(TASK, overrides=changes)
    largest = (result.metrics["largest_pressure"].value - room) / 1e5
    assert gauge("largest_pressure +", str(result)) == pytest.approx(largest, abs=2e-3)
    assert gauge("Largest pressure</td><td[^>]*>", result._repr_html_()) == pytest.approx(largest, abs=2e-3)
    drawn = next(axes for axes in result.plot().axes if axes.get_title(loc="left").startswith("Pressure"))
    assert max(max(line.get_ydata()) for line in drawn.lines) == pytest.approx(largest, abs=1e-6)
    found = ppafo.find(TASK, vary="supply.pressure=3..4 bar_g", such_that="peak_torque >= 1 N m", overrides=changes)
    assert found.found.value is not None
    assert gauge("supply.pressure = ", found.said[0]) == pytest.approx((found.found.value - room) / 1e5, abs=1e-4)
    assert 3.0 <= (found.found.value - room) / 1e5 <= 4.0
    linear = ppafo.linearise(TASK, overrides=[*changes, "reference.level=3 N m"])
    assert gauge(r"supply_pressure +Pa +", str(linear)) == pytest.approx(3.5, abs=1e-3)
    ppafo.sweep("torque-task-uncertainty", draws=4, out=tmp_path / "study", overrides=[*changes[:2], SHORT])
    assert ppafo.load_study_results(tmp_path / "study").units["gauge_zero"] == "70000.0 Pa_a"
    result.save(tmp_path / "run")
    stored = ppafo.read_result(tmp_path / "run").plot()
    kept = next(axes for axes in stored.axes if axes.get_title(loc="left").startswith("Pressure"))
    assert max(max(line.get_ydata()) for line in kept.lines) == pytest.approx(largest, abs=1e-6)
    too_high = ppafo.simulate(TASK, overrides=[*high, "reference.level=9 N m"]).tracking
    assert too_high is not None
    assert gauge("at 75 deg and ", too_high.sentence) == pytest.approx(3.5, abs=1e-3)
