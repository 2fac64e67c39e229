"""Laws on a valve that opens beyond a dead band: every law of the catalogues that asks for openings knows it."""

import pytest

import ppafo
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers.switching import CONSTANT, ON_OFF
from ppafo.control.torque_loop import dead_zone_opening
from ppafo.control.walking.catalog import walking_controllers
from ppafo.walking.loading import load_walk

OUTSIDE = ("hysteresis",)
"""Laws of the tests' own plugins."""
WHOLE = {CONSTANT.name, ON_OFF.name, "on_off_fixed_point", "event_on_off", "off"}
"""Laws whose command is what is given, or full opening: there is nothing to be made up for."""
TASK = "torque-task-slow-valve"


def test_every_law_that_asks_for_openings_follows_the_dead_band_of_its_valve() -> None:
    kinds = {**CONTROLLERS, **walking_controllers()}
    laws = {name: kind for name, kind in kinds.items() if name not in {*WHOLE, *OUTSIDE}}
    assert len(laws) > 12
    for name, kind in laws.items():
        follows = {quantity.name: quantity.follows for quantity in kind.quantities}
        # The opening of a law with a dead zone is a number that has the band in it.
        assert follows.get("dead_band") == "dead_band" or follows.get("opening") == dead_zone_opening, name


@pytest.mark.parametrize("kind", ["pid", "sliding_mode", "pid_fixed_point"])
def test_a_dead_band_that_a_law_believes_in_costs_it_nothing(kind: str) -> None:
    changes = [f"controller.kind={kind}", "run.duration=1.2 s", "reference.ramp_time=0.5 s", "run.step=1 ms"]
    errors = [
        ppafo.simulate(TASK, [*changes, f"valve.dead_band={band}"]).metrics["rms_error"].value for band in (0.0, 0.3)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["event_proportional", "event_pid", "event_sliding_mode"])
def test_laws_that_walk_open_the_valve_beyond_its_dead_band(kind: str) -> None:
    walk = ppafo.walk(load_walk("proportional", [f"controller.kind={kind}", "valve.dead_band=0.3"]), minutes=0.1)
    assert walk.scenario.controller.settings["dead_band"] == 0.3
    plain = ppafo.walk(load_walk("proportional", [f"controller.kind={kind}"]), minutes=0.1)
    errors = [run.metrics["torque_error"].value for run in (walk, plain)]
    assert errors[0] == pytest.approx(errors[1], rel=0.05)
