"""Kinds of other packages: found by entry point or by module and object, refused in one line."""

import logging
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import ppafo
from ppafo import plugins
from ppafo.cli.main import main
from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.profiles import SINE
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.trials import check_kind
from ppafo.errors import ScenarioError
from ppafo.loading import with_overrides
from ppafo.metrics import METRICS
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.simulation.profiles import profile_bounds

LAW = """
from dataclasses import replace
from ppafo.control.catalog import CONTROLLERS
KIND = replace(CONTROLLERS[{name!r}], name={call!r}, summary="Of another package.")
"""
Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Installs a package with one module and entry points; forgotten at the end of the test."""
    known = [(kinds, set(kinds)) for kinds in (CONTROLLERS, PROFILES, METRICS, WALKING_CONTROLLERS)]
    modules = set(sys.modules)

    def installed(package: str, text: str, **groups: str) -> None:
        (tmp_path / f"{package}.py").write_text(text)
        about = tmp_path / f"{package}-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        lines = "".join(f"[ppafo.{group}]\n{name} = {package}:KIND\n" for group, name in groups.items())
        (about / "entry_points.txt").write_text(lines)
        monkeypatch.syspath_prepend(tmp_path)

    yield installed
    for kinds, names in known:
        for name in set(kinds) - names:
            del kinds[name]
    for name in set(sys.modules) - modules:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def test_a_law_of_another_package_is_found_by_its_name_and_only_then(install: Install) -> None:
    install("other_laws", LAW.format(name="on_off", call="mine"), controllers="mine")
    load_scenario("torque-task-proportional")
    assert "other_laws" not in sys.modules
    assert load_scenario("torque-task-proportional", ["controller.kind=mine"]).controller.kind == "mine"
    assert "other_laws" in sys.modules
    assert CONTROLLERS["mine"].summary == "Of another package."


def test_a_broken_package_is_one_line_and_stops_no_other(install: Install, caplog: pytest.LogCaptureFixture) -> None:
    install("broken_laws", "import nowhere_to_be_found\n", controllers="broken")
    install("angry_laws", "raise SystemExit('no\\nno')\n", controllers="angry")
    install("other_laws", LAW.format(name="on_off", call="mine"), controllers="mine")
    with caplog.at_level(logging.WARNING):
        problems = CONTROLLERS.load_all()
    assert problems == (
        "controller 'angry' of package 'angry_laws' cannot be loaded: SystemExit: no no",
        "controller 'broken' of package 'broken_laws' cannot be loaded: ModuleNotFoundError: No module named "
        "'nowhere_to_be_found'",
    )
    assert len(caplog.records) == len(problems)
    assert "mine" in CONTROLLERS
    document = dict(load_scenario("torque-task-proportional").origin.content)
    document["controller"] = {"kind": "broken"}
    with pytest.raises(ScenarioError, match="controller 'broken' of package 'broken_laws' cannot be loaded"):
        scenario_from_dict(document)


def test_a_name_of_one_of_our_own_is_refused_by_name(install: Install) -> None:
    ours = CONTROLLERS["pid"]
    install("clashing_laws", LAW.format(name="on_off", call="pid"), controllers="pid")
    (problem,) = CONTROLLERS.load_all()
    assert problem == (
        "controller 'pid' of package 'clashing_laws': ppafo already has a kind with this name; rename the kind in its "
        "package"
    )
    assert CONTROLLERS["pid"] is ours


@pytest.mark.usefixtures("install")
def test_a_law_of_the_working_folder_is_named_and_no_file_alone_runs_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "beside.py").write_text(LAW.format(name="on_off", call="anything"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plugins, "_named", {})
    path = list(sys.path)
    scenario = ppafo.load_scenario("torque-task-proportional", ["controller.kind=beside:KIND"], plugins=["beside"])
    assert scenario.controller.kind == "beside:KIND"
    assert sys.path == path
    with pytest.raises(ScenarioError, match="is not loaded, because a file alone must not run code"):
        load_scenario("torque-task-proportional", ["controller.kind=json.tool:main"])


def test_another_law_forgets_a_number_of_the_same_name_in_another_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    pid, task, chosen = CONTROLLERS["pid"], "torque-task-proportional", "controller.kind=other"
    gains = [
        replace(each, unit="1/s", default=2.0, follows=()) if each.name == "integral_gain" else each
        for each in pid.quantities
    ]
    monkeypatch.setitem(CONTROLLERS, "other", replace(pid, name="other", quantities=tuple(gains)))
    later = with_overrides(load_scenario(task, ["controller.integral_gain=0.3 1/(N m s)"]), [chosen])
    for scenario in (load_scenario(task, [chosen]), later):
        assert (scenario.controller.settings["integral_gain"], scenario.controller.settings["proportional_gain"]) == (
            2.0,
            0.095,
        )


def test_metrics_are_found_too(install: Install) -> None:
    metric = "from dataclasses import replace\nfrom ppafo.metrics import METRICS\n"
    install("other_metrics", metric + 'KIND = replace(METRICS["rms_error"], name="mine")\n', metrics="mine")
    assert "mine" in METRICS


STUDY = Path(ppafo.__file__).parent / "studies" / "library" / "pressure-and-area.toml"
PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "extend.md").read_text(encoding="utf-8")
OWN_LAW = next(block for block in PAGE.split("```python\n") if "ControllerKind(" in block).partition("```")[0]
MISTAKES = {
    "one_value": ("return command, HysteresisState(command)", "return command", ":22: update: cannot unpack"),
    "other_value": ("return command, ", "return 50.0, ", r":22: update: update\(.*must return a command from -1 to 1"),
    "no_unit": ('Number("N m"', 'Number("Nm/foo"', r":10: HysteresisParameters: 'foo' is not a known unit"),
    "out_of_range": ("0.2, 0.0, 100.0", "200.0, 0.0, 100.0", ":10: HysteresisParameters: band: .*must rise"),
    "divides_by_zero": ("    error = ", "    error = 1.0 / 0.0 * ", ":22: update: float division by zero"),
    "no_function": ("update=update", "update=print", ":10: HysteresisParameters: update = .*must be a plain function"),
    "fails_later": ("HysteresisState(0.0)", "{}", r":\d+: controller 'fails_later:KIND': update\(.*TypeError"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_in_a_law_is_one_line_with_its_file(
    name: str, install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    right, wrong, said = MISTAKES[name]
    assert right in OWN_LAW
    # A law without defaults is not tried when it is loaded.
    text = OWN_LAW.replace(right, wrong).replace("0.2, 0.0", "None, 0.0" if name == "fails_later" else "0.2, 0.0")
    (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    texts = [f"controller.kind={name}:KIND", "controller.band=0.2 N m", "run.duration=10 ms"]
    sets = [word for text in texts for word in ("--set", text)]
    assert main(["simulate", "torque-task-proportional", *sets, "--plugin", str(tmp_path / f"{name}.py")]) == 2
    assert f"{name}.py:" in capsys.readouterr().err.splitlines()[-1]
    with pytest.raises(ppafo.PpafoError, match=rf"{name}\.py{said}"):
        ppafo.simulate("torque-task-proportional", texts, plugins=[tmp_path / f"{name}.py"])


SWAPPED = """
from dataclasses import replace
from ppafo.control.profiles import SINE

def bounds(parameters):
    lowest, highest = SINE.bounds(parameters)
    return {returned}

KIND = replace(SINE, name="wave", bounds=bounds)
"""


def test_bounds_of_another_package_are_in_order_and_let_no_profile_leave_the_stops(install: Install) -> None:
    install("other_waves", SWAPPED.format(returned="highest, lowest"), profiles="wave")
    wave = {"kind": "wave", "level": "1 N m", "amplitude": "2 N m", "frequency": "1 Hz"}
    document = dict(load_scenario("torque-task-moving-ankle").origin.content)
    with pytest.raises(ppafo.KindError, match="must return lowest and highest value, not 3 and -1"):
        profile_bounds(scenario_from_dict({**document, "reference": wave}).reference)
    turning = {**wave, "level": "1.5 rad", "amplitude": "1.5 rad"}
    with pytest.raises(ScenarioError, match=r"leaves the stops .* rad at 0\.\d+ s"):
        scenario_from_dict({**document, "motion": {"kind": "prescribed", "profile": turning}})


def test_a_metric_of_another_package_with_one_number_for_all_runs_is_refused(install: Install) -> None:
    text = """from dataclasses import replace
from ppafo.metrics import METRICS
KIND = replace(METRICS["rms_error"], name="mine", read=lambda readings: 1.0)
"""
    install("other_numbers", text, metrics="mine")
    document = tomllib.loads(STUDY.read_text(encoding="utf-8"))
    document["outputs"] = {"metrics": ["mine"]}
    with pytest.raises(ppafo.KindError, match=r"'mine': .* for each run, an array of shape"):
        ppafo.sweep(document, overrides=["run.duration=20 ms"])


def test_a_law_need_not_be_defined_at_every_number(install: Install) -> None:
    # Once of no use at 1, once at its default.
    for name, divisor in (("pole", "(reference - 1.0)"), ("unset", "parameters.band")):
        text = OWN_LAW.replace("    error = ", f"    error = 1.0 / {divisor} + ").replace("0.2, 0.0", "0.0, 0.0")
        install(f"law_{name}", text.replace("hysteresis", name), controllers=name)
        assert CONTROLLERS[name].name == name


def test_the_numbers_of_a_kind_have_the_order_of_its_fields() -> None:
    with pytest.raises(ppafo.KindError, match="its fields are in the order level, amplitude"):
        check_kind(replace(SINE, quantities=SINE.quantities[::-1]))


def test_a_command_that_no_valve_has_is_refused_at_its_time(install: Install) -> None:
    text = OWN_LAW.replace("return command, ", "return min(0.5 * abs(reference), 3.0), ")
    install("wild_law", text.replace("hysteresis", "wild"), controllers="wild")
    overrides = ["controller.kind=wild", "reference.level=8 N m", "run.duration=0.5 s"]
    result = ppafo.simulate("torque-task-proportional", overrides)
    with pytest.raises(ppafo.KindError, match=r"^controller 'wild': command .* at t = 0\.\d+ s: must be -1 to 1$"):
        result.recording  # noqa: B018 - it is made when it is asked for


def test_every_kind_of_the_package_passes_the_check_of_others() -> None:
    for catalogue in (CONTROLLERS, PROFILES, WALKING_CONTROLLERS, VALVES, ACTUATORS, EFFECTS, METRICS):
        catalogue.load_own()
        for kind in catalogue.loaded().values():
            check_kind(kind)
