"""Where packets come and go: a UDP socket or a serial device, opened from a text such as ``udp:127.0.0.1:5000``."""

import contextlib
import select
import socket
import time
from typing import Any, Protocol, final

from ppafo.errors import ScenarioError, one_line, reason
from ppafo.exports.hil.packets import Reader

FORMS = "udp:HOST:PORT or serial:DEVICE"
DEFAULT_BAUD = 921_600
BITS_OF_A_BYTE = 10
"""On a serial line: a start bit, eight bits, a stop bit."""
_LARGEST = 4096
_HIGHEST_PORT = 65_535
_AT_ONCE = 64
"""Packets of strangers that are looked at in one call: a flood of them must not hold the plant."""
_WRITE_TIMEOUT = 2.0e-4
"""Seconds that a serial line has to take a packet; with 0, pyserial tries for ever where nobody reads."""


class Port(Protocol):
    """Something that takes and gives bytes; what breaks under way is kept in ``failure``, and then nothing comes."""

    @property
    def is_stream(self) -> bool:
        """True where bytes follow each other, false where they come packet by packet."""

    @property
    def failure(self) -> str:
        """What went wrong under way, empty while all is well."""

    @property
    def strangers(self) -> int:
        """Packets of somebody else, which were dropped."""

    def send(self, data: bytes) -> None:
        """Send a packet, or drop it where that would take time."""

    def receive(self, timeout: float) -> bytes:
        """What came first within a time [s]; nothing where nothing came."""

    def close(self) -> None:
        """Give the port back."""


@final
class UdpPort:
    """A UDP socket that talks to one other: the one that it was given, or the first that sends it a good packet."""

    is_stream = False

    def __init__(self, own: socket.socket, other: Any) -> None:
        self.failure = ""
        self.strangers = 0
        self._socket = own
        self._other = other
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        """Send a packet to the other side, once it is known."""
        if self._other is None:
            return
        # A full buffer or an answer that nobody listens is a lost packet, which is what UDP may do.
        with contextlib.suppress(OSError):
            self._socket.sendto(data, self._other)

    def receive(self, timeout: float) -> bytes:
        """The first packet of the other side within a time [s]."""
        until = time.perf_counter() + timeout
        for _ in range(_AT_ONCE):
            ready, _, _ = select.select([self._socket], [], [], max(0.0, until - time.perf_counter()))
            if not ready:
                break
            try:
                data, sender = self._socket.recvfrom(_LARGEST)
            except OSError:
                continue
            if self._other is None:
                if not Reader(is_stream=False).take(data):
                    return data  # counted as refused; its sender is not accepted as the peer
                self._other = sender
            if sender[:2] == self._other[:2]:
                return data
            self.strangers += 1
        return b""

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()


@final
class SerialPort:
    """A serial device through pyserial."""

    is_stream = True
    strangers = 0

    def __init__(self, device: Any) -> None:
        self.failure = ""
        self._device = device

    def send(self, data: bytes) -> None:
        """Send a packet; it is lost where the line takes no more."""
        if not self.failure:
            self._try(lambda: self._device.write(data))

    def receive(self, timeout: float) -> bytes:
        """What came in, once there is anything, within a time [s]."""
        if self.failure:
            time.sleep(timeout)
            return b""
        return bytes(self._try(lambda: self._read(timeout)) or b"")

    def _read(self, timeout: float) -> bytes:
        self._device.timeout = timeout
        waiting = self._device.in_waiting
        data: bytes = self._device.read(max(1, min(_LARGEST, waiting)))
        return data

    def _try(self, action: Any) -> Any:
        import serial

        try:
            return action()
        except serial.SerialTimeoutException:
            return None
        except (OSError, TypeError) as error:  # pyserial on a device that is gone: SerialException is an OSError
            self.failure = f"the serial port broke: {one_line(error)}"
            return None

    def close(self) -> None:
        """Give the device back."""
        with contextlib.suppress(OSError):
            self._device.close()


def open_port(text: str, baud: int = DEFAULT_BAUD, listens: bool = False) -> Port:
    """Open a port of a text; one that ``listens`` waits at a UDP address for whoever first sends a good packet there.

    ScenarioError, in one line, for a text that is none, and for a port that is not there.
    """
    kind, _, place = text.partition(":")
    if kind == "udp":
        return _open_udp(text, place, listens)
    if kind == "serial" and place:
        return _open_serial(text, place, baud)
    raise ScenarioError(f"--port {one_line(text)}: must be {FORMS}")


def _open_udp(text: str, place: str, listens: bool) -> UdpPort:
    host, _, number = place.rpartition(":")
    if not host or not number.isascii() or not number.isdigit() or not 0 < int(number) <= _HIGHEST_PORT:
        raise ScenarioError(f"--port {one_line(text)}: must be udp:HOST:PORT with a port from 1 to {_HIGHEST_PORT}")
    own = None
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(number), type=socket.SOCK_DGRAM)
        family, kind, protocol, _, address = found[0]
        own = socket.socket(family, kind, protocol)
        if listens:
            own.bind(address)
        return UdpPort(own, None if listens else address)
    except (OSError, UnicodeError) as error:
        if own is not None:
            own.close()
        raise ScenarioError(f"--port {one_line(text)}: cannot be used: {reason(error)}") from error


def _open_serial(text: str, place: str, baud: int) -> SerialPort:
    try:
        import serial
    except ImportError as error:
        raise ScenarioError(f"--port {text}: a serial port needs pyserial: pip install 'ppafo[hil]'") from error
    try:
        device = serial.Serial(place, baud, timeout=0.0, write_timeout=_WRITE_TIMEOUT, exclusive=True)
        device.reset_input_buffer()
    except (OSError, ValueError) as error:
        raise ScenarioError(f"--port {one_line(text)}: cannot be opened: {one_line(error)}") from error
    return SerialPort(device)
