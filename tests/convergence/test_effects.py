"""Effects of every kind: the lanes agree with the reference solver, and a column of one is its single runs."""

import numpy as np
import pytest

from ppafo.model.catalog import EFFECTS
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.simulate import simulate
from tests.reference.reference_solver import compare_with_reference

THERMAL = (
    *("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"),
    "gas_model.wall_area_per_volume=100 1/m",
)
FREE = ("motion.kind=free", "run.duration=0.3 s")
SEALS = tuple(
    f"effects.seal_friction.{text}_per_pressure={2 - n}e-6 N m/Pa" for n, text in enumerate(("static", "dynamic"))
)
STRIBECK = ("effects.stribeck.velocity=2 rad/s",)
LINE = ("effects.line_resistance.area=8 mm^2",)
LAMINAR = ("actuator.leak.area=0.1 mm^2", "effects.laminar_leak.coefficient=1e-15 kg/(s Pa^2)", *FREE)
TABLE = tuple(
    f"effects.opening.{name}_{number:02}={value}"
    for number, node in enumerate(((0.05, 0.0), (0.3, 0.1), (0.5, 0.1), (0.8, 0.9)), 1)
    for name, value in zip(("command", "opening"), node, strict=True)
)
STEP = "step-response"
PAIR = "torque-task-solenoid"
SPOOL = "torque-task-proportional"
CASES = (
    *((STEP, SEALS), (STEP, STRIBECK), (PAIR, (*SEALS, *STRIBECK, *FREE))),
    *((STEP, (*LINE, "run.duration=0.5 s")), (PAIR, (*LINE, *FREE))),
    (STEP, (*LINE, *THERMAL, "run.duration=0.3 s")),
    (SPOOL, (*LINE, "run.duration=0.3 s")),
    *((STEP, LAMINAR), (PAIR, LAMINAR)),
    (SPOOL, (*TABLE, "run.duration=0.3 s")),
    ("torque-task-slow-valve", (*TABLE, "run.duration=0.3 s")),
)


@pytest.mark.parametrize(("name", "texts"), CASES)
def test_effects_in_the_lanes_are_those_of_the_reference_solver(name: str, texts: tuple[str, ...]) -> None:
    agreement = compare_with_reference(plan_run(load_scenario(name, texts)))
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3


def test_every_effect_is_among_the_cases_but_those_of_stops_loads_and_sensors_which_have_tests_of_their_own() -> None:
    told = " ".join(text for _, texts in CASES for text in texts)
    assert [name for name in EFFECTS if f"effects.{name}." not in told] == ["restitution", "joint_load", "bandwidth"]


def test_a_column_of_an_effect_has_the_bits_of_the_single_runs_and_changes_them() -> None:
    path = LINE[0].partition("=")[0]
    values = (0.0, 5e-6, 1e-5)
    metrics = ("gas_vented", "gas_supplied")
    found = run_ensemble(load_scenario(STEP, FREE[1:]), {path: np.array(values)}, metrics).metrics
    for place, value in enumerate(values):
        alone = simulate(load_scenario(STEP, (*FREE[1:], f"{path}={value} m^2"))).metrics
        assert [found[metric][place] for metric in metrics] == [alone[metric].value for metric in metrics]
    assert len(set(found[metrics[0]].tolist())) == len(values)
