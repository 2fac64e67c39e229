"""How the gains of the league were found: what candidates cost, and that many are run as each would be alone."""

import numpy as np
import pytest

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import ScenarioError
from ppafo.questions.tune.problem import Effort
from ppafo.walking import walk
from scripts import league_gains as gains

KIND = "event_proportional"


def of(**changed: float) -> gains.WalkJudgement:
    """One walk that costs nothing but what is given."""
    given = {"error": 0.0, "gas": 0.0, "push_off_work": 0.0, "toe_height": 0.02, "slap_rate": 0.0, "toe_landing": 0.0}
    values = {name: np.array([value]) for name, value in (given | changed).items()}
    return gains.WalkJudgement(**values, is_good=np.array([True]))


def price(kind: str, **changed: float) -> float:
    """The price of the defaults of a controller with other values of what is searched."""
    values = {name: gains.defaults(kind)[name] for name in gains.SEARCHED[kind]} | changed
    return float(gains.prices(kind, {name: np.array([value]) for name, value in values.items()})[0])


def test_the_price_adds_error_gas_low_toes_slap_and_toe_landings_and_values_work() -> None:
    assert of().price[0] == 0.0
    assert of(error=0.3).price[0] == pytest.approx(0.3)
    assert of(gas=1.0e-3).price[0] == pytest.approx(1.0)
    assert of(toe_height=-0.005).price[0] == pytest.approx(1.0)
    assert of(slap_rate=-10.0).price[0] == pytest.approx(0.5)
    assert of(toe_landing=0.5).price[0] == pytest.approx(1.0)
    assert of(push_off_work=2.0).price[0] == pytest.approx(-0.6)


def test_what_is_searched_are_settings_within_their_limits_and_the_defaults_of_walking_lie_there() -> None:
    for name, ranges in gains.SEARCHED.items():
        quantities = {item.name: item for item in (dict(CONTROLLERS) | dict(WALKING_CONTROLLERS))[name].quantities}
        for setting, (low, high) in ranges.items():
            quantity = quantities[setting]
            assert quantity.minimum <= low < high <= quantity.maximum
            if name in WALKING_CONTROLLERS:
                assert low <= gains.defaults(name)[setting] <= high, (name, setting)


def test_candidates_walk_as_each_alone_and_as_a_walk_of_the_command_line() -> None:
    configuration = gains.walks_to_judge(KIND)[0]
    torque_gains = np.array([0.5, gains.defaults(KIND)["torque_gain"], 3.0])
    many = gains.judge_walks(configuration, gains.defaults(KIND) | {"torque_gain": torque_gains}, 3)
    alone = gains.judge_walks(configuration, gains.defaults(KIND), 1)
    assert np.ptp(many.error) > 0.1
    for name in ("error", "gas", "toe_height", "slap_rate"):
        # The engine gives the same bits; the means over the samples add up in another order.
        assert getattr(many, name)[1] == pytest.approx(getattr(alone, name)[0], rel=1e-12)
    metrics = walk(configuration, gains.SECONDS / 60.0).metrics
    assert alone.error[0] == pytest.approx(metrics["push_off_error"].value, rel=0.05)
    assert alone.gas[0] == pytest.approx(metrics["gas"].value, rel=0.1)
    assert alone.toe_height[0] > 0.0


def test_a_walk_whose_controller_stops_has_failed() -> None:
    settings = gains.defaults(KIND) | {"largest_force": np.array([3.0e3, 100.0])}
    found = gains.judge_walks(gains.walks_to_judge(KIND)[0], settings, 2).price
    assert found[0] < 10.0
    assert found[1] == gains.FAILED


def test_the_shipped_gains_are_cheaper_than_gains_beside_them() -> None:
    for kind in ("sliding_mode", "feedback_linearisation"):
        defaults, name = gains.defaults(kind), next(iter(gains.SEARCHED[kind]))
        shipped = price(kind)
        assert shipped < price(kind, **{name: 5.0 * defaults[name]})
        assert shipped < price(kind, **{name: 0.1 * defaults[name]})


def test_every_device_of_the_torque_task_has_noise_of_its_own() -> None:
    seeds = [task.sensors.seed for task in gains.tasks_to_judge()[1:]]
    assert len(set(seeds)) == len(seeds) == gains.DEVICES


def test_a_search_never_ends_worse_than_the_defaults_and_refuses_the_unknown() -> None:
    found, cost = gains.find("sliding_mode", Effort(starts=1, generations=1, candidates_per_gain=4, seed=1))
    assert cost <= price("sliding_mode") * (1.0 + 1e-9)
    assert cost < price("sliding_mode", reaching_command=0.0)
    assert price("sliding_mode", **found) == pytest.approx(cost, rel=1e-9)
    with pytest.raises(ScenarioError, match="nothing to search for 'slidingmode', did you mean 'sliding_mode'"):
        gains.find("slidingmode")
