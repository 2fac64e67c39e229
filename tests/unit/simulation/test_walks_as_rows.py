"""A row of columns of a walk has the bits of the single walk: 11 walks by 12 rows."""

from typing import Any

import numpy as np
import pytest

from ppafo.engine.run import batch_of
from ppafo.loading import reloaded
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.walking import load_walk

ROWS = 12
THERMAL = ("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)")
WALKS: dict[str, tuple[str, tuple[str, ...]]] = {
    "solenoid": ("solenoid", ()),
    "off": ("off", ()),
    "proportional": ("proportional", ()),
    "lines": ("proportional-regulators", ()),
    "lines, slow": ("solenoid-regulators", ("controller.rate=500 Hz",)),
    "slow sensors": ("proportional", ("sensors.pressure_bandwidth=40 Hz",)),
    "thermal": ("proportional", (*THERMAL, "gas_model.wall_area_per_volume=100 1/m", "sensors.force_noise=2 N")),
}
VARIED: dict[str, tuple[float, float, str]] = {
    "supply.pressure": (0.95, 1.15, "Pa_a"),
    "supply.dorsiflexion_pressure": (0.7, 0.9, "Pa_a"),
    "supply.atmospheric_pressure": (0.9, 1.02, "Pa_a"),
    "valve.delay": (0.5, 1.5, "s"),
    "wearer.body_mass": (0.8, 1.3, "kg"),
    "wearer.shank_length": (0.9, 1.1, "m"),
    "wearer.heel_lever": (0.6, 1.4, "m"),
    "wearer.ankle_stiffness": (0.5, 2.0, "N m/rad"),
    "controller.push_off_start": (0.9, 1.05, ""),
    "controller.period": (0.6, 1.4, "s"),
    "sensors.pressure_bandwidth": (0.5, 2.0, "Hz"),
    "sensors.force_bandwidth": (0.5, 2.0, "Hz"),
    "run.duration": (0.95, 1.5, "s"),
    "run.step": (0.5, 1.5, "s"),
    "gas_model.heat_transfer_coefficient": (0.5, 2.0, "W/(m^2 K)"),
    "supply_line.plantarflexion.volume": (0.5, 2.0, "m^3"),
}


def columns_of(scenario: Scenario, seed: int) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Columns of five numbers that a walk has, drawn about what it has, and their units."""
    from ppafo.simulation.numbers import declared_numbers, number_at

    known, draw = declared_numbers(scenario), np.random.default_rng(seed)
    clock = {"run.duration": scenario.run.duration, "run.step": 1.0e-3, "controller.period": scenario.controller.period}
    usual = {path: clock[path] if path in clock else number_at(scenario, path) for path in VARIED if path in known}
    paths = [path for path in VARIED if usual.get(path, 0.0) > 0.0]
    chosen = sorted(draw.choice(len(paths), 5, replace=False).tolist())
    found = {path: usual[path] * draw.uniform(*VARIED[path][:2], ROWS) for path in (paths[place] for place in chosen)}
    return found, {path: VARIED[path][2] for path in found}


@pytest.mark.parametrize("name", WALKS)
def test_a_row_of_columns_has_the_bits_of_the_single_walk(name: str) -> None:
    file, words = WALKS[name]
    base = load_walk(file, [*words, "run.duration=6 s"])
    columns, units = columns_of(base, len(name))
    plan = plan_ensemble(check_columns(base, columns))
    rows: dict[int, Any] = dict(plan.reasons)
    for members, batch in plan.batches:
        for place, row in enumerate(members.tolist()):
            clock = batch.clock
            rows[row] = (batch.program, clock, batch.parameters[:, place], batch.states[:, place])
    assert len(plan.reasons) < ROWS / 2, plan.reasons
    for row in range(ROWS):
        if row in plan.reasons:
            continue
        single = reloaded(base, [f"{path}={float(values[row])!r} {units[path]}" for path, values in columns.items()])
        alone = batch_of(plan_run(single))
        program, clock, parameters, states = rows[row]
        assert (program, clock) == (alone.program, alone.clock), row
        np.testing.assert_array_equal(parameters, alone.parameters[:, 0], err_msg=str(row))
        np.testing.assert_array_equal(states, alone.states[:, 0], err_msg=str(row))


def test_a_walk_that_contradicts_itself_is_refused_and_the_others_go_on() -> None:
    base = load_walk("solenoid", ["run.duration=6 s"])
    found = run_ensemble(base, {"controller.load_threshold": np.array([60.0, 25.0])}, ["strides"])
    assert found.status.tolist() == [0, 2]
    assert "must be below controller.load_threshold = 25 N" in found.reasons[1]
