"""A walk as a functional mock-up unit: parameters and metrics; tests/doors compares its bits."""

import importlib

import pytest

from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.walking import load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk
from scripts.instances import Instance

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
SECONDS = 6.0
NAME = "proportional"


@pytest.fixture(scope="module", params=[2, 3])
def loop(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> str:
    """The closed loop, of both versions of FMI."""
    ((name, content),) = functional_unit(closed_loop(load_walk(NAME)), request.param, ["linux64"]).items()
    file = tmp_path_factory.mktemp("loop") / name
    file.write_bytes(content)
    return str(file)


@pytest.fixture(scope="module")
def walked() -> WalkResult:
    """The walk by Python."""
    return walk(NAME, minutes=SECONDS / 60.0)


def test_wearer_controller_and_sensors_are_parameters_and_metrics_can_be_read(loop: str, walked: WalkResult) -> None:
    assert importlib.import_module("fmpy.validation").validate_fmu(loop) == []
    found = {item.name: item for item in fmpy.read_model_description(loop).modelVariables}
    changes = {name: found[name].variability for name in ("wearer.foot_mass", "wearer.residual_share", "run.duration")}
    assert changes == {"wearer.foot_mass": "fixed", "wearer.residual_share": "tunable", "run.duration": "fixed"}
    assert {"controller.peak_torque", "sensors.force_bandwidth", "valve.area"} <= set(found)
    instance = Instance(loop, {"run.duration": SECONDS})
    instance.go_to(SECONDS)
    read = {
        name: instance.get(f"metrics.{name}")
        for name in ("gas", "positive_push_off_work", "net_push_off_work", "strides")
    }
    assert read == pytest.approx({name: walked.metrics[name].value for name in read}, rel=1e-12)
    instance.close()


def test_a_parameter_that_is_tuned_acts_and_one_that_would_change_the_steps_is_refused(
    loop: str, capfd: pytest.CaptureFixture[str]
) -> None:
    plain, tuned = Instance(loop), Instance(loop)
    for instance in (plain, tuned):
        instance.go_to(2.0)
    tuned.set("controller.peak_torque", 3.0)
    for instance in (plain, tuned):
        instance.go_to(4.0)
    assert tuned.get("net_push_off_work") < plain.get("net_push_off_work")
    tuned.set("valve.area", 200.0e-6)
    with pytest.raises(Exception, match="DoStep"):
        tuned.go_to(4.1)
    assert "other steps of the engine" in capfd.readouterr().out
    plain.close()
