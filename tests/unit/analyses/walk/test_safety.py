"""What the result says where a neuromuscular gait model gets less help: flag, strides with help, picture."""

from dataclasses import replace

import numpy as np
import pytest

from ppafo.analyses.walk.safety import safety_remarks
from ppafo.constants import PASCALS_PER_PSI
from ppafo.control.walking.fault_flags import FAULT_FLAGS, NOT_FLAT
from ppafo.model.helping import LIFTS
from ppafo.signals import Channel
from ppafo.walking import compare_walks, load_walk, walk
from ppafo.walking.events import SafetyEvent
from ppafo.wearer.answer import reacting_finding


def test_a_peak_torque_above_the_limit_of_the_controller_is_said() -> None:
    peak = "controller.peak_torque=9 N m"
    (said,) = safety_remarks(walk(load_walk("proportional", [peak]), minutes=0.1))
    assert said.startswith(
        "controller.peak_torque = 9 N m: no more than controller.largest_torque = 5 N m is requested"
    )
    assert safety_remarks(walk(load_walk("proportional", [peak, "controller.largest_torque=9 N m"]), minutes=0.1)) == []


@pytest.mark.long
def test_the_answer_of_a_wearer_who_reacts_says_and_shows_where_help_was_less() -> None:
    compared = compare_walks(load_walk("reacting"), minutes=0.1)
    assert "The walk over time" not in {section.heading for section in reacting_finding(compared).parts}
    flag = FAULT_FLAGS[NOT_FLAT]
    event = SafetyEvent(2.0, LIFTS, flag, {"heel_force": 6e-33, "toe_force": 319.4})
    worn = compared.with_device
    helped = np.arange(worn.helped.size) < 1
    answer = reacting_finding(replace(compared, with_device=replace(worn, events=(event,), helped=helped)))
    assert "The walk over time" in {section.heading for section in answer.parts}
    first, second = answer.parts[0].remarks[-2:]
    assert first.startswith("lift-only (no push-off) from 2.00 s: ")
    assert first.endswith("; heel 0 N, toe 319 N")
    assert second == f"help in 1 of {helped.size} strides: fewer than half"
    ends = {name for name, *_ in answer.parts[0].rows}
    assert "Strides with help, of gas and push-off" in ends
    (written,) = answer.to_dict()["events"]
    assert (written["time"], written["fault_flag"]) == (2.0, flag.name)


@pytest.mark.long
def test_a_pressure_far_above_the_supply_is_said_with_its_chamber() -> None:
    """Of a healthy wearer none is; gauge pressure counts from the atmosphere of the device."""
    overrides = ["supply.atmospheric_pressure=80 kPa_a", "supply.dorsiflexion_pressure=30 psi_g"]
    worn = compare_walks(load_walk("reacting", overrides=overrides), minutes=0.1).with_device
    assert safety_remarks(worn) == []
    pressed = Channel(np.full(worn.recording.time.size, 80.0e3 + 100.0 * PASCALS_PER_PSI), "Pa")
    channels = {**worn.recording.channels, "pressure_2": pressed}
    (said,) = safety_remarks(replace(worn, recording=replace(worn.recording, channels=channels)))
    assert said.startswith("the pressure in chamber 2 reaches 100 psi_g, and its supply is set to 30 psi_g: ")
