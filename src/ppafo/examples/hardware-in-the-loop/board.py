"""A board in Python: proportional control of the torque, over the messages of plant.py."""

import socket
import struct
import sys

from ppafo.model.sensors import Measurement

SAMPLE = struct.Struct("<I6d")
ANSWER = struct.Struct("<Id")


class Proportional:
    """The controller, as ``Scenario.controlled_by`` takes it too."""

    def reset(self) -> None:
        pass

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        """Return the command for a reference [N m]; the gain is 0.3 1/(N m)."""
        return max(-1.0, min(1.0, 0.3 * (reference - measurement.torque)))


if __name__ == "__main__":
    plant = ("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 5000)
    law = Proportional()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("", 0))
        line.settimeout(0.1)
        while True:
            try:
                message = line.recv(64)
            except TimeoutError:
                line.sendto(b"", plant)  # not there yet
                continue
            if not message:
                break
            number, time, reference, *seen = SAMPLE.unpack(message)
            line.sendto(ANSWER.pack(number, law.update(time, reference, Measurement(*seen))), plant)
