"""What an event of a walk says in a line."""

import numpy as np

from ppafo.control.walking.fault_flags import FAULT_FLAGS
from ppafo.model.helping import PAUSED
from ppafo.walking.loading import load_walk
from ppafo.walking.safety_events import FINDING_ROW, SAFE_ROW, VENTINGS_ROW, safety_events


def test_readings_of_pressure_count_from_the_atmosphere_of_the_device() -> None:
    configuration = load_walk("solenoid", ["supply.atmospheric_pressure=83 kPa_a"])
    number, flag = next((number, flag) for number, flag in FAULT_FLAGS.items() if "pressure_1" in flag.readings)
    event = np.array([0.0, 1.0])
    readings = {f"{FINDING_ROW}.{name}": event * (83e3 + 50.0 * 6894.757293168361) for name in flag.readings}
    record = {SAFE_ROW: event * PAUSED, VENTINGS_ROW: event, f"{FINDING_ROW}.fault_flag": event * number, **readings}
    (found,) = safety_events(configuration, np.array([0.0, 0.1]), record)
    assert "pressure 1 50 psi_g, pressure 2 50 psi_g" in found.message
