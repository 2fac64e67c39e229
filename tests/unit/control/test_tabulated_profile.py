"""The profile that follows a table: knots, repetition, and the same in the lanes as in Python."""

import numpy as np
import pytest

from ppafo.control.tabulated import KIND, KNOTS, NEVER, Tabulated, bounds, used_knots, value
from ppafo.engine.rows import rebuilt
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate

TIMES = (0.0, 0.15, 0.35, 0.5, 0.62, 0.7)
VALUES = (0.5, 0.6, 3.0, 6.0, -3.0, 0.0)
PERIOD = 1.1


def table(times: tuple[float, ...] = TIMES, values: tuple[float, ...] = VALUES, level: float = 0.0) -> Tabulated:
    settings = {item.name: item.default or 0.0 for item in KIND.quantities} | {"period": PERIOD, "level": level}
    settings |= {f"time_{number:02d}": time for number, time in enumerate(times, 1) if number > 1}
    settings |= {f"value_{number:02d}": value for number, value in enumerate(values, 1)}
    return rebuilt(Tabulated, settings.values())


def test_the_value_lies_on_straight_lines_between_the_knots_and_repeats() -> None:
    profile = table(level=2.0)
    times = np.linspace(0.0, 4.9 * PERIOD, 4321)
    expected = 2.0 + np.interp(np.mod(times, PERIOD), (*TIMES, PERIOD), (*VALUES, VALUES[0]))
    found = [value(profile, time)[0] for time in times.tolist()]
    assert np.max(np.abs(np.array(found) - expected)) < 1e-9


def test_the_rate_is_that_of_the_line_which_begins_at_a_knot() -> None:
    assert value(table(), 0.35)[1] == pytest.approx((6.0 - 3.0) / 0.15)
    assert value(table(), 1.0)[1] == pytest.approx(0.5 / 0.4)


def test_all_knots_may_be_used() -> None:
    times = tuple(PERIOD * knot / KNOTS for knot in range(KNOTS))
    values = tuple(float(knot % 7) for knot in range(KNOTS))
    profile = table(times, values)
    assert [value(profile, time)[0] for time in times] == pytest.approx(values)
    assert len(used_knots(profile)) == KNOTS


def test_knots_that_never_come_count_neither_in_the_value_nor_in_the_bounds() -> None:
    whole = table()
    assert whole.knots[18].time == NEVER
    knots = (*whole.knots[:18], whole.knots[18]._replace(value=99.0), *whole.knots[19:])
    profile = whole._replace(knots=knots)
    assert bounds(profile) == (-3.0, 6.0)
    assert max(value(profile, 0.01 * step)[0] for step in range(300)) <= 6.0


def test_the_lanes_follow_the_table_as_python_does() -> None:
    texts = [f"reference.time_{number:02d}={time} s" for number, time in enumerate(TIMES, 1) if number > 1]
    texts += [f"reference.value_{number:02d}={torque} N m" for number, torque in enumerate(VALUES, 1)]
    kind = ["reference.kind=tabulated", "reference.level=0 N m", f"reference.period={PERIOD} s", "run.duration=2.5 s"]
    scenario = load_scenario("torque-task-proportional", [*kind, *texts])
    pressure = np.array([scenario.device.supply.pressure])
    lanes = run_ensemble(scenario, {"supply.pressure": pressure}, ("rms_error", "peak_error"))
    alone = simulate(scenario)
    reference = alone.recording["reference"]
    expected = np.interp(np.mod(alone.recording.time, PERIOD), (*TIMES, PERIOD), (*VALUES, VALUES[0]))
    assert np.max(np.abs(reference - expected)) < 1e-9
    for name in ("rms_error", "peak_error"):
        assert lanes.metrics[name][0] == pytest.approx(alone.metrics[name].value, rel=1e-9)
