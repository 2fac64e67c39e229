"""Second line of a walk: whether the device helps, with numbers of both walks, the cause if not, and a remedy."""

import re

import pytest

import ppafo
from ppafo.analyses.walk.answer import benefit_sentence
from ppafo.walking.walk import compare_walks


def sentence(name: str, *overrides: str, minutes: float = 0.1) -> str:
    return benefit_sentence(compare_walks(ppafo.load_walk(name, overrides), minutes=minutes))


@pytest.mark.parametrize(
    ("name", "verdict", "cause"),
    [
        ("solenoid", "the device helps in push-off but not in swing, ", "the ankle is not lifted enough"),
        ("off", "the device does not help, ", "its controller is off"),
    ],
)
def test_the_remedy_of_a_walk_that_does_not_lift_the_toes_lifts_them(name: str, verdict: str, cause: str) -> None:
    said = sentence(name, minutes=0.4)
    assert said.startswith(verdict)
    assert f"; {cause}: for example with `" in said
    remedy = tuple(text.replace(" = ", "=", 1) for text in re.findall("`(.*?)`", said))
    again = sentence(name, *remedy, minutes=0.4)
    assert again.startswith("the device helps, against the same walk without it")
    gain = r"toes (\S+) mm over the ground and (\S+) J, simulated in another walk of 0.4 min"
    ((toes, work),) = re.findall(gain, said)
    assert f"toes {toes} mm over the ground" in again
    assert f": {work} J of net work" in again


@pytest.mark.parametrize(
    ("overrides", "asked", "setting"),
    [
        (("controller.hold_stiffness=0 N m/rad",), r"1\.\d+", r"hold_stiffness = [\d.]+ N m/rad"),
        (("controller.largest_torque=1.5 N m",), r"1\.5", r"largest_torque = 5 N m"),
    ],
)
def test_toes_that_drag_below_the_reach_of_the_actuator_are_mended_at_the_controller(
    overrides: tuple[str, ...], asked: str, setting: str
) -> None:
    said = sentence("proportional", *overrides)
    cause = f"the controller requests {asked} N m at the lowest toes, where the actuator gives 5 N m"
    assert re.search(rf"{cause}: for example with `controller\.{setting}`, toes", said), said
