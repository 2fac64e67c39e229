"""The command that times effects has all of the package."""

from benchmarks.effects import ON
from ppafo.model.catalog import EFFECTS
from ppafo.parameters.effects import effects_of
from ppafo.simulation.loading import load_scenario


def test_every_effect_of_the_package_is_timed() -> None:
    timed = set()
    for text in ON:
        scenario = load_scenario("step-response", [text])
        timed |= set(effects_of(scenario.device, {"sensors": scenario.sensors}))
    assert timed == set(EFFECTS.values())
