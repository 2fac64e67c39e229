"""Drawn wearers and devices: what is drawn reaches the engine, and nothing else does."""

import numpy as np
import pytest

from ppafo.engine.lanes import Floats
from ppafo.studies.league.draws import UNCERTAINTIES
from ppafo.studies.league.walking import draws, walking_task
from ppafo.studies.league.walking.draws import CHANGED, drawn_measures, drawn_plants
from ppafo.studies.league.walking.measures import MEASURES
from ppafo.studies.league.walking.nominal import walked_measures
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import plan_of

TASK = walking_task(minutes=0.1)
WALKED = TASK.configuration("event_proportional", "proportional")


def test_the_uncertainties_change_what_is_written_into_the_engine_and_nothing_else() -> None:
    run = plan_walk(plan_of(WALKED, TASK.seconds))
    count = len(UNCERTAINTIES)
    plants = drawn_plants(WALKED, run, np.ones((count, count)) + 0.1 * np.eye(count))
    changed = {name for plant in plants for name in plant._fields if getattr(plant, name) != getattr(run.plant, name)}
    assert changed == set(CHANGED)


def test_the_first_draw_with_the_tasks_own_device_is_the_walk_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_changed(count: int) -> Floats:
        return np.ones((count, len(UNCERTAINTIES)))

    monkeypatch.setattr(draws, "drawn_factors", none_changed)
    first, second = drawn_measures(TASK, WALKED, 2).drawn
    assert first is not None
    assert second is not None
    own = walked_measures(TASK, WALKED)
    assert first == pytest.approx(own, rel=1e-9, abs=1e-12)
    assert second["torque_error"] != pytest.approx(own["torque_error"], rel=1e-6)


def test_draws_are_the_same_in_groups_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    together = drawn_measures(TASK, WALKED, 3)
    monkeypatch.setattr(draws, "NUMBERS_AT_ONCE", 1.0)
    assert drawn_measures(TASK, WALKED, 3) == together
    assert set(together.drawn[0] or {}) == set(MEASURES)
