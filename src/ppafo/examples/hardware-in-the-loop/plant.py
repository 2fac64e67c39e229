"""Hardware in the loop: the simulated device in real time behind a UDP socket, and your board as its controller.

    python plant.py     in one terminal, and in another, until your board takes its place:
    python board.py

The board calls by an empty datagram. Then the plant sends it every sample of the controller in 52 bytes, little-endian:

    uint32   number of the sample, from 0
    float64  time [s], reference [N m], angle [rad], absolute pressures of chambers 1 and 2 [Pa], torque [N m]

and the board answers in 12: the number of the sample (uint32) and the command, -1 to 1 (float64). A command that comes
before the next sample is due acts from its own sample on, as in a simulation; without one the last command stays. After
20 ms without an answer the run ends. With --lock-step the plant waits for each answer, at most a second, so that every
run has the bits of ``ppafo.simulate`` with the same controller. An empty datagram is the end.

On a serial line, ``read(ANSWER.size)`` and ``write`` of pyserial take the place of ``recvfrom`` and ``sendto``.
"""

import argparse
import math
import socket
import struct
import time

import ppafo

SAMPLE = struct.Struct("<I6d")
ANSWER = struct.Struct("<Id")
LONGEST_SILENCE, LONGEST_WAIT = 0.02, 1.0  # s


def answer_to(number: int, line: socket.socket, until: float) -> float | None:
    """Return the command that answers a sample, or None if it has not come by a time [s]; other answers are dropped."""
    while (left := until - time.perf_counter()) > 0.0:
        line.settimeout(left)
        try:
            answer, _ = line.recvfrom(64)
        except TimeoutError:
            break
        if len(answer) == ANSWER.size:
            answered, command = ANSWER.unpack(answer)
            if answered == number and math.isfinite(command):
                return max(-1.0, min(1.0, command))
    return None


def exchange(run: ppafo.SteppedRun, line: socket.socket, lock_step: bool) -> tuple[int, int]:
    """Run the plant under the commands of the board; return the number of samples, and of those without an answer."""
    _, board = line.recvfrom(64)
    due = time.perf_counter()
    command = 0.0
    number = 0
    missed = 0
    last = 0
    patience = 1 if lock_step else max(1, round(LONGEST_SILENCE / run.period))
    while not run.is_over and number - last < patience:
        line.sendto(SAMPLE.pack(number, run.time, run.reference, *run.measurement[:4]), board)
        # Where this computer was held up, time stands still rather than leave the board less than half a period.
        due = max(due + run.period, time.perf_counter() + 0.5 * run.period)
        answer = answer_to(number, line, time.perf_counter() + LONGEST_WAIT if lock_step else due)
        number += 1
        if answer is None:
            missed += 1
        else:
            command = answer
            last = number
        if not lock_step:
            time.sleep(max(0.0, due - time.perf_counter()))
        run.step(command)
    line.sendto(b"", board)
    return number, missed


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("scenario", nargs="?", default="torque-task-proportional")
    parser.add_argument("--host", default="127.0.0.1", help="address of this computer; 0.0.0.0 for a board elsewhere")
    parser.add_argument("--port", type=int, default=5000)
    parser.add_argument("--lock-step", action="store_true")
    given = parser.parse_args()
    run = ppafo.start(given.scenario)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind((given.host, given.port))
        samples, missed = exchange(run, line, given.lock_step)
    run.result().save("out/hil")
    print(f"{samples} samples, {missed} without an answer in time; written: out/hil")
    if not run.is_over:
        raise SystemExit(f"the board was silent from t = {run.time:.3f} s on")
