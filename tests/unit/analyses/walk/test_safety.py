"""What the result of a walk says of help and pressures that are out of the ordinary."""

import ast
from dataclasses import replace

import numpy as np
import pytest

from ppafo.analyses.walk.answer import safety_remarks
from ppafo.constants import PASCALS_PER_PSI
from ppafo.signals import Channel
from ppafo.walking import compare_walks, load_walk, walk
from ppafo.walking.result import limited_request
from ppafo.wording import read_by


def test_a_peak_torque_above_the_limit_of_the_controller_is_said_in_the_first_lines() -> None:
    """50 psi on the 14.5 cm^3 of the vane are 5 N m, and 100 psi 10 N m."""
    peak, supplied = "controller.peak_torque=9 N m", "supply.pressure=100 psi_g"
    worn = walk(load_walk("proportional", [peak, supplied]), minutes=0.1)
    cut = "controller.peak_torque = 9 N m: the request is limited by controller.largest_torque = 5 N m; not tried: "
    (said,) = [line for line in str(worn).partition("\n\n")[0].splitlines() if line.startswith(cut)]
    mended = ast.literal_eval(said.removeprefix(f"{cut}overrides="))
    assert limited_request(load_walk("proportional", [peak, supplied, *mended])) == ""
    with read_by("command line"):
        assert limited_request(worn.scenario) == f"{cut}--set 'controller.largest_torque=9 N m'"
    law = ["device.valve=proportional", "controller.kind=event_proportional", "controller.vent_time=0.15 s"]
    said = limited_request(load_walk("off", [*law, peak]))
    given = "the actuator gives at most 5 N m at this supply pressure"
    assert said.endswith(f"largest_torque = 5 N m; {given}")
    assert limited_request(load_walk("proportional", [peak])).endswith(f"largest_torque = 5 N m; {given}")
    # Beyond reach a limit below reach may be increased to the reach.
    beyond = ["controller.peak_torque=20 N m", supplied]
    assert limited_request(load_walk("proportional", beyond)).endswith("['controller.largest_torque=10 N m']")


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
