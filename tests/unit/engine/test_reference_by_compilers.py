"""The reference solver has the same bits by every compiler."""

from collections.abc import Sequence

import numpy as np
import pytest

pytest.importorskip("sksundae")

from ppafo.engine.loading import BACKEND_VARIABLE
from ppafo.engine.run import Run
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from tests.compilers_here import compilers_here
from tests.reference.reference_solver import load_right_hand_side, solve_reference

POINTS = 2000
THERMAL = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
)
PROGRAMS = {"torque-task-solenoid": (), "step-response": (), "torque-task-moving-ankle": THERMAL}


def planned(name: str, settings: Sequence[str], duration: str = "20 ms") -> Run:
    return plan_run(load_scenario(name, [f"run.duration={duration}", *settings]))


@pytest.mark.parametrize("name", PROGRAMS)
def test_slopes_at_random_points_have_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    run, found = planned(name, PROGRAMS[name]), {}
    for compiler in compilers_here():
        monkeypatch.setenv(BACKEND_VARIABLE, compiler)
        y, slopes, fill = load_right_hand_side(run)
        draw, rows = np.random.default_rng(3), []
        for _ in range(POINTS):
            y[:] = draw.uniform(0.2, 1.0, y.size)
            y[1], y[2:4] = draw.uniform(-5.0, 5.0), run.initial.mass_1 * draw.uniform(0.3, 4.0, 2)
            fill(draw.uniform(), draw.uniform(-1.0, 1.0), float(draw.integers(-1, 2)))
            rows.append(slopes.tobytes())
        found[compiler] = rows
    assert len(set(found[compiler])) == POINTS
    assert all(rows == found[compiler] for rows in found.values())


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_solution_has_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    run, found = planned(name, PROGRAMS[name], "150 ms"), set()
    for compiler in compilers_here():
        monkeypatch.setenv(BACKEND_VARIABLE, compiler)
        result = solve_reference(run)
        found.add((result.states.tobytes(), result.commands.tobytes(), tuple(result.impacts), result.evaluations))
    assert len(found) == 1
