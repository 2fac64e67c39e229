"""Drawn wearers and devices: what is drawn reaches the engine, and nothing else does."""

import numpy as np
import pytest

from ppafo.engine.lanes import Floats
from ppafo.questions.league.standing import UNCERTAINTIES
from ppafo.questions.league.walking import measures
from ppafo.questions.league.walking.measures import CHANGED, MEASURES, draw_measures, draw_plants, walk_measures
from ppafo.questions.league.walking.task import walking_task
from ppafo.walking.motion import with_duration
from ppafo.walking.planning import plan_walk

TASK = walking_task(minutes=0.1)
WALKED = TASK.configuration("event_proportional", "proportional")


def test_the_uncertainties_change_what_is_written_into_the_engine_and_nothing_else() -> None:
    run = plan_walk(with_duration(WALKED, TASK.seconds))
    count = len(UNCERTAINTIES)
    plants = draw_plants(WALKED, run, np.ones((count, count)) + 0.1 * np.eye(count))
    changed = {name for plant in plants for name in plant._fields if getattr(plant, name) != getattr(run.plant, name)}
    assert changed == set(CHANGED)


def test_the_first_draw_with_the_tasks_own_device_is_the_walk_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_changed(count: int, _seed: int) -> Floats:
        return np.ones((count, len(UNCERTAINTIES)))

    monkeypatch.setattr(measures, "draw_factors", none_changed)
    first, second = draw_measures(TASK, WALKED, 2).drawn
    assert first is not None
    assert second is not None
    own = walk_measures(TASK, WALKED)
    assert first == pytest.approx(own, rel=1e-9, abs=1e-12)
    assert second["torque_error"] != pytest.approx(own["torque_error"], rel=1e-6)


def test_draws_are_the_same_in_groups_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    together = draw_measures(TASK, WALKED, 3)
    monkeypatch.setattr(measures, "NUMBERS_AT_ONCE", 1.0)
    assert draw_measures(TASK, WALKED, 3) == together
    assert set(together.drawn[0] or {}) == set(MEASURES)


def test_every_draw_has_noise_of_its_own_whatever_the_seed_of_the_walk() -> None:
    noisy = ["sensors.pressure_noise=5 kPa_d"]
    drawn = []
    for seed in (1, 2):
        task = walking_task(overrides=[*noisy, f"sensors.seed={seed}"], minutes=0.1)
        drawn.append(draw_measures(task, task.configuration("event_proportional", "proportional"), 3))
    assert drawn[0] == drawn[1], "the seed of the walk does not decide"
    assert drawn[0].renoised[0] != drawn[0].drawn[0]
