"""A unit is compared with Python before it is written."""

import pytest

from ppafo.errors import ProgramError
from ppafo.exports.c_library.files import expected_csv
from ppafo.exports.fmu import unit
from ppafo.exports.fmu.interface import closed_loop, plant_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.simulation.loading import load_scenario

pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
SHORT = ("run.duration=0.3 s", "reference.ramp_time=0.1 s")


@pytest.mark.long
@pytest.mark.parametrize(("interface", "fmi"), [(closed_loop, 2), (closed_loop, 3), (plant_alone, 2), (plant_alone, 3)])
def test_a_unit_with_other_numbers_than_python_is_not_written(
    interface: type, fmi: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = load_scenario("torque-task-slow-valve", SHORT)
    assert functional_unit(interface(scenario), fmi, ["linux64"])

    def of_another_device(run: object, *names: object) -> bytes:
        text = expected_csv(run, *names).decode()  # type: ignore[arg-type]
        head, *rows = text.splitlines()
        last = rows[-1].split(",")
        last[head.split(",").index("pressure_1")] = "7.0"
        return "\n".join([head, *rows[:-1], ",".join(last)]).encode()

    monkeypatch.setattr(unit, "expected_csv", of_another_device)
    with pytest.raises(
        ProgramError, match=r"at 0\.\d+ s: pressure_1 is \d+\.\d+, Python has 7\.0; no file was written"
    ):
        functional_unit(interface(scenario), fmi, ["linux64"])
