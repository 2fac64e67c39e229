"""How the walking controllers were tuned: what a walk costs, and that many candidates walk as each would alone."""

import numpy as np
import pytest

from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import ScenarioError
from ppafo.studies.league import walking_tuning
from ppafo.studies.league.walking_tuning import FAILED, SEARCHED, Judged, defaults, judged, tune, tuning_walks
from ppafo.walking import walk

KIND = "event_proportional"


def of(**changed: float) -> Judged:
    """One walk that costs nothing but what is given."""
    given = {"error": 0.0, "gas": 0.0, "push_off_work": 0.0, "toe_height": 0.02, "slap_rate": 0.0, "toe_landing": 0.0}
    return Judged(**{name: np.array([value]) for name, value in (given | changed).items()}, is_good=np.array([True]))


def test_the_price_adds_error_gas_low_toes_slap_and_toe_landings_and_values_work() -> None:
    assert of().price[0] == 0.0
    assert of(error=0.3).price[0] == pytest.approx(0.3)
    assert of(gas=1.0e-3).price[0] == pytest.approx(1.0)
    assert of(toe_height=-0.005).price[0] == pytest.approx(1.0)
    assert of(slap_rate=-10.0).price[0] == pytest.approx(0.5)
    assert of(toe_landing=0.5).price[0] == pytest.approx(1.0)
    assert of(push_off_work=2.0).price[0] == pytest.approx(-0.6)


def test_what_is_searched_are_settings_within_their_limits_and_the_defaults_lie_there() -> None:
    for name, ranges in SEARCHED.items():
        quantities = {item.name: item for item in WALKING_CONTROLLERS[name].quantities}
        for setting, (low, high) in ranges.items():
            quantity = quantities[setting]
            assert quantity.minimum <= low < high <= quantity.maximum
            assert low <= defaults(name)[setting] <= high, (name, setting)


def test_candidates_walk_as_each_alone_and_as_a_walk_of_the_command_line() -> None:
    configuration = tuning_walks(KIND)[0]
    gains = np.array([0.5, defaults(KIND)["torque_gain"], 3.0])
    many = judged(configuration, defaults(KIND) | {"torque_gain": gains}, 3)
    alone = judged(configuration, defaults(KIND), 1)
    assert np.ptp(many.error) > 0.1
    for name in ("error", "gas", "toe_height", "slap_rate"):
        # The engine gives the same bits; the means over the samples add up in another order.
        assert getattr(many, name)[1] == pytest.approx(getattr(alone, name)[0], rel=1e-12)
    metrics = walk(configuration, walking_tuning.SECONDS / 60.0).metrics
    assert alone.error[0] == pytest.approx(metrics["push_off_error"].value, rel=0.05)
    assert alone.gas[0] == pytest.approx(metrics["gas"].value, rel=0.1)
    assert alone.toe_height[0] > 0.0


def test_a_walk_that_ends_in_the_safe_state_has_failed() -> None:
    settings = defaults(KIND) | {"largest_force": np.array([3.0e3, 100.0])}
    price = judged(tuning_walks(KIND)[0], settings, 2).price
    assert price[0] < 10.0
    assert price[1] == FAILED


def test_a_controller_without_anything_to_search_is_named() -> None:
    with pytest.raises(ScenarioError, match="nothing to tune for 'event_pit', did you mean 'event_pid'"):
        tune("event_pit")
