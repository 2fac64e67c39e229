"""Functions that prepare a run of a library, as Python runs them."""

from types import SimpleNamespace

import numpy as np
import pytest

from ppafo.engine.groups import Role, filled
from ppafo.engine.run import batch_of
from ppafo.errors import ProgramError
from ppafo.exports import c_library
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.preparation import VANE_PREPARATION, start
from ppafo.exports.c_library.prepared import Preparation, PreparedLane
from ppafo.loading import load_scenario

WARM = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("torque-task-proportional", ()),
        ("torque-task-solenoid", (*WARM, "supply_line.plantarflexion.droop=3e6 Pa s/kg")),
        ("torque-task-solenoid", ("effects.coil_heating.steady_rise=10 K", "sensors.delay=5 ms")),
        ("cylinder-servo", ()),
        ("swing-foot", ()),
    ],
)
def test_a_library_prepares_a_run_with_the_numbers_that_python_plans(name: str, overrides: tuple[str, ...]) -> None:
    scenario = load_scenario(name, overrides)
    library = library_of(scenario)
    program = library.program.program
    settings = SimpleNamespace(**{setting.name: setting.value for setting in library.settings})
    lane = PreparedLane()
    *preparing, counted = VANE_PREPARATION
    for function in preparing:
        function(Preparation(scenario, program), lane, settings)

    planned = batch_of(scenario.motion.motion_kind.plan(scenario)[0])
    for role, rows, numbers in (
        (Role.PARAMETER, planned.program.parameter_rows(), planned.parameters),
        (Role.STATE, planned.program.state_rows(), planned.states),
    ):
        own = {group: getattr(lane, group) for group in rows if hasattr(lane, group)}
        np.testing.assert_array_equal(filled(rows, own, 1, role), numbers)
    assert counted(Preparation(scenario, program), lane, settings)[1] == planned.clock.step_count


def test_a_number_that_no_function_prepares_is_named_with_its_group(monkeypatch: pytest.MonkeyPatch) -> None:
    unstarted = tuple(function for function in VANE_PREPARATION if function is not start)
    monkeypatch.setattr(c_library, "VANE_PREPARATION", unstarted)
    said = r"preparation\.py:\d+: no preparation function sets 'result' \(LaneResult\) of the program"
    with pytest.raises(ProgramError, match=said):
        library_files(library_of(load_scenario("torque-task-proportional")))
