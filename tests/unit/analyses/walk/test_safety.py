"""What the result of a walk says of help and pressures that are out of the ordinary."""

from dataclasses import replace

import numpy as np
import pytest

from ppafo.analyses.walk.answer import safety_remarks
from ppafo.constants import PASCALS_PER_PSI
from ppafo.signals import Channel
from ppafo.walking import compare_walks, load_walk, walk


def test_a_peak_torque_above_the_limit_of_the_controller_is_said() -> None:
    peak = "controller.peak_torque=9 N m"
    (said,) = safety_remarks(walk(load_walk("proportional", [peak]), minutes=0.1))
    assert said.startswith(
        "controller.peak_torque = 9 N m: the request is limited by controller.largest_torque = 5 N m"
    )
    assert safety_remarks(walk(load_walk("proportional", [peak, "controller.largest_torque=9 N m"]), minutes=0.1)) == []
    law = ["device.valve=proportional", "controller.kind=event_proportional", "controller.vent_time=0.15 s"]
    (said,) = safety_remarks(walk(load_walk("off", [*law, peak]), minutes=0.1))
    assert said.endswith("largest_torque = 5 N m; the actuator cannot give more at this supply pressure")


@pytest.mark.long
def test_a_pressure_far_above_the_supply_is_said_with_its_chamber() -> None:
    """Of a healthy wearer none is; gauge pressure counts from the atmosphere of the device."""
    overrides = ["supply.atmospheric_pressure=80 kPa_a", "supply.dorsiflexion_pressure=30 psi_g"]
    worn = compare_walks(load_walk("proportional", overrides=overrides), minutes=0.1).with_device
    assert safety_remarks(worn) == []
    pressed = Channel(np.full(worn.recording.time.size, 80.0e3 + 100.0 * PASCALS_PER_PSI), "Pa")
    channels = {**worn.recording.channels, "pressure_2": pressed}
    (said,) = safety_remarks(replace(worn, recording=replace(worn.recording, channels=channels)))
    assert said.startswith("the pressure in chamber 2 reaches 100 psi_g, at a supply pressure of 30 psi_g: ")
