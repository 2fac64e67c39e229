"""The example controller in C of ``ppafo export controller`` in place of a board: built, run, and asked over UDP."""

import contextlib
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

from ppafo.exports.hil.wire import Answer, Reader, WireSample, sample_bytes
from ppafo.processor.link import example_controller
from ppafo.simulation.loading import load_scenario
from tests.virtual_wire import free_port

COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
WHOLE = ("controller.kind=pid_fixed_point", "sensors.pressure_resolution=1 Pa_d")
SENT = ("reference", "angle", "pressure_1", "pressure_2", "torque")


def built(folder: Path, name: str, *overrides: str) -> Path:
    for file, content in example_controller(load_scenario(name, (*WHOLE, *overrides))).items():
        (folder / file).write_bytes(content)
    subprocess.run(["make", "-C", str(folder), f"CC={COMPILER}"], check=True, capture_output=True)
    return folder / "controller"


@contextlib.contextmanager
def running(*words: str) -> Iterator["subprocess.Popen[str]"]:
    """A controller process that has said that it is ready."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


class Plug:
    """A plant's end of a wire to the example in C: a sample goes out, its answer comes back."""

    def __init__(self, own: socket.socket, port: int) -> None:
        self.own, self.port = own, port

    def send(self, data: bytes) -> None:
        self.own.sendto(data, ("127.0.0.1", self.port))

    def ask(
        self,
        sequence: int,
        flags: int = 0,
        run: int = 7,
        pressure: int | None = None,
        apart: int = 1000,
        stamp: int | None = None,
    ) -> Answer:
        """The answer to a sample of a plant whose samples are some time [us] apart, or which has a stamp of its own."""
        shown = 150_000 + 700 * sequence * sequence if pressure is None else pressure
        counts = dict(zip(SENT, (1_000_000, 0, shown, 150_000, 0), strict=True))
        self.send(sample_bytes(WireSample(flags, run, sequence, apart * sequence if stamp is None else stamp, counts)))
        (answer,) = Reader(is_stream=False).take(self.own.recv(256))
        assert isinstance(answer, Answer)
        assert (answer.run, answer.sequence) == (run, sequence)
        return answer


@contextlib.contextmanager
def plug(controller: Path, silence: str) -> Iterator[Plug]:
    port = free_port()
    with running(str(controller), "udp", str(port), silence), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.settimeout(30.0)
        yield Plug(own, port)
