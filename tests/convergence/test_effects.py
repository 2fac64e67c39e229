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
WARM = tuple(
    f"effects.coil_heating.{path}" for path in ("steady_rise=80 K", "time_constant=0.2 s", "pull_in_share=0.6")
)
SLOW = ("valve.opening_delay=8 ms", "valve.closing_delay=5 ms")
ICE = ("effects.ice.blockage_per_gas=3e4 1/kg", "effects.ice.melting_time=30 ms")
OPENING = ("effects.leak_opening.pressure=150 kPa_d",)
PLAY = ("effects.spool_play.width=0.2",)
LINE = ("effects.line_resistance.area=8 mm^2",)
REAL = ("effects.second_virial.share=1",)
LAMINAR = ("actuator.leak.area=0.1 mm^2", "effects.laminar_leak.coefficient=1e-15 kg/(s Pa^2)", *FREE)
STEP, PAIR, SPOOL = "step-response", "torque-task-solenoid", "torque-task-proportional"
CASES = (
    *((STEP, SEALS), (STEP, STRIBECK), (PAIR, (*SEALS, *STRIBECK, *FREE))),
    *((PAIR, (*SLOW, *WARM, *own)) for own in (("run.duration=1 s",), ("motion.kind=free", "run.duration=0.4 s"))),
    *((STEP, ICE), (STEP, (*ICE, "effects.silencer.sonic_conductance=1e-8 m^3/(s Pa)"))),
    *((PAIR, (*ICE, "motion.kind=free", "run.duration=0.5 s")), (STEP, (*ICE, *THERMAL, "run.duration=0.3 s"))),
    *((STEP, OPENING), (STEP, (*OPENING, *THERMAL, "run.duration=0.3 s")), (PAIR, (*OPENING, *FREE))),
    *((SPOOL, PLAY), (SPOOL, (*PLAY, *FREE)), (SPOOL, (*PLAY, *OPENING, "effects.ice.blockage_per_gas=3e3 1/kg"))),
    *((STEP, (*LINE, "run.duration=0.5 s")), (PAIR, (*LINE, *FREE))),
    (STEP, (*LINE, "effects.silencer.sonic_conductance=2e-8 m^3/(s Pa)", *THERMAL, "run.duration=0.3 s")),
    *((STEP, REAL), (PAIR, (*REAL, *FREE)), (SPOOL, (*REAL, *LINE, *PLAY, "run.duration=0.3 s"))),
    *((STEP, LAMINAR), (PAIR, LAMINAR)),
)


@pytest.mark.parametrize(("name", "texts"), CASES)
def test_effects_in_the_lanes_are_those_of_the_reference_solver(name: str, texts: tuple[str, ...]) -> None:
    agreement = compare_with_reference(plan_run(load_scenario(name, texts)))
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3


def test_every_effect_is_among_the_cases_but_those_of_stops_loads_and_sensors_which_have_tests_of_their_own() -> None:
    told = " ".join(text for _, texts in CASES for text in texts)
    assert [name for name in EFFECTS if f"effects.{name}." not in told] == ["restitution", "joint_load", "bandwidth"]


COILS = (*SLOW, WARM[1], "run.duration=0.6 s")


@pytest.mark.parametrize(
    ("name", "texts", "path", "values", "metrics"),
    [
        (PAIR, COILS, "effects.coil_heating.steady_rise=K", (0.0, 40.0, 100.0), ("gas_vented",)),
        (SPOOL, FREE[1:], "effects.spool_play.width=", (0.0, 0.1, 0.2), ("rms_error", "gas_vented")),
        (
            STEP,
            FREE[1:],
            "effects.second_virial.share=",
            (0.0, 0.5, 1.0),
            ("gas_vented", "gas_supplied", "gas_imbalance"),
        ),
    ],
)
def test_a_column_of_an_effect_has_the_numbers_of_the_single_runs_and_changes_them(
    name: str, texts: tuple[str, ...], path: str, values: tuple[float, ...], metrics: tuple[str, ...]
) -> None:
    path, _, unit = path.partition("=")
    found = run_ensemble(load_scenario(name, texts), {path: np.array(values)}, metrics).metrics
    for place, value in enumerate(values):
        alone = simulate(load_scenario(name, (*texts, f"{path}={value} {unit}".strip()))).metrics
        for metric in metrics:
            exact = metric.startswith("gas_")
            assert found[metric][place] == (
                alone[metric].value if exact else pytest.approx(alone[metric].value, rel=1e-12)
            )
    assert len(set(found[metrics[0]].tolist())) == len(values)
    assert np.abs(found.get("gas_imbalance", 0.0)).max() < 1e-15
