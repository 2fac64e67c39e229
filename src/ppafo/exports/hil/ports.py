"""Ports of a link: UDP sockets and serial devices, opened from a text such as ``udp:127.0.0.1:5000``."""

import contextlib
import os
import select
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, final

from ppafo.errors import ScenarioError
from ppafo.exports.hil.wire import Reader
from ppafo.wording import argument_text, one_line, reason

try:
    from termios import error as TerminalError  # noqa: N812 - an exception, by a name in lower case
except ImportError:  # a system without terminals
    TerminalError = OSError  # type: ignore[misc, assignment]

_FORMS = "udp:HOST:PORT or serial:DEVICE"
DEFAULT_BAUD = 921_600
BITS_PER_BYTE = 10
"""Bits per byte on a serial line: start bit, eight data bits, stop bit."""
_LARGEST_RECEIVED = 4096
_HIGHEST_PORT = 65_535
_STRANGERS_AT_ONCE = 64
"""Maximum number of packets from other senders processed in one call, so that a flood cannot block the plant."""
_WRITE_TIMEOUT = 2.0e-4
"""Longest time [s] that a serial line may take to accept a packet; with 0, pyserial would try forever."""


@final
class _UdpPort:
    """UDP socket with a single peer: the given one, or the first sender of a valid packet."""

    is_stream = False

    def __init__(self, bound: socket.socket, peer: Any) -> None:
        self.failure = ""
        self.strangers = 0
        self._socket = bound
        self._peer = peer
        # The plant's time must not stop in a full buffer.
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        """Send a packet to the peer, if known."""
        if self._peer is None:
            return
        # A full buffer, or a peer that does not listen, loses the packet, as UDP allows.
        with contextlib.suppress(OSError):
            self._socket.sendto(data, self._peer)

    def receive(self, timeout: float) -> bytes:
        """Return the first packet of the peer within a time [s]; empty datagrams are skipped."""
        until = time.perf_counter() + timeout
        for _ in range(_STRANGERS_AT_ONCE):
            ready, _, _ = select.select([self._socket], [], [], max(0.0, until - time.perf_counter()))
            if not ready:
                break
            try:
                data, sender = self._socket.recvfrom(_LARGEST_RECEIVED)
            except OSError:
                continue
            if not data:  # to the caller that would be silence, with packets behind it still unread
                continue
            if self._peer is None:
                if not Reader(is_stream=False).take(data):
                    return data  # counted as refused; its sender is not accepted as the peer
                self._peer = sender
            if sender[:2] == self._peer[:2]:
                return data
            self.strangers += 1
        return b""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


@final
class _SerialPort:
    """Serial port opened with pyserial."""

    is_stream = True
    strangers = 0

    def __init__(self, device: Any) -> None:
        self.failure = ""
        self._device = device

    def send(self, data: bytes) -> None:
        """Send a packet; it is lost if the line does not accept it in time."""
        if not self.failure:
            with self._watched():
                self._device.write(data)

    def receive(self, timeout: float) -> bytes:
        """Return the bytes received, as soon as there are any, within a time [s]."""
        if self.failure:
            time.sleep(timeout)
            return b""
        with self._watched():
            self._device.timeout = timeout
            waiting = self._device.in_waiting
            return bytes(self._device.read(max(1, min(_LARGEST_RECEIVED, waiting))) or b"")
        return b""

    @contextlib.contextmanager
    def _watched(self) -> Iterator[None]:
        """Store a fault of the device, and ignore timeouts."""
        import serial

        try:
            with contextlib.suppress(serial.SerialTimeoutException):
                yield
        except (OSError, TypeError) as error:  # pyserial on a device that is gone: SerialException is an OSError
            self.failure = f"the serial port failed: {one_line(error)}"

    def close(self) -> None:
        """Close the device."""
        with contextlib.suppress(OSError):
            self._device.close()


Port = _UdpPort | _SerialPort
"""Link for sending and receiving bytes, as a stream (``is_stream``) or as separate datagrams.

``failure`` is the fault during the run, empty without one; after a fault nothing is received. ``strangers`` is the
number of discarded packets from other senders.
"""


def open_port(text: str, baud: int = DEFAULT_BAUD, listens: bool = False) -> Port:
    """Open a port from a text; with ``listens``, a UDP port waits for the first sender of a valid packet.

    Raises ScenarioError for an invalid text, and for a port that cannot be opened.
    """
    kind, _, address = text.partition(":")
    named = f"{argument_text('port')} {one_line(text)}"
    if kind == "udp":
        return _open_udp(named, address, listens)
    if kind == "serial" and address:
        return _open_serial(named, address, baud)
    raise ScenarioError(f"{named}: must be {_FORMS}")


def _open_udp(named: str, address: str, listens: bool) -> _UdpPort:
    """Open a UDP port at ``HOST:PORT``; ``named`` is the argument in messages."""
    host, _, number = address.rpartition(":")
    if not host or not number.isascii() or not number.isdigit() or not 0 < int(number) <= _HIGHEST_PORT:
        raise ScenarioError(f"{named}: must be udp:HOST:PORT with a port from 1 to {_HIGHEST_PORT}")
    bound = None
    try:
        addresses = socket.getaddrinfo(host.strip("[]"), int(number), type=socket.SOCK_DGRAM)
        family, kind, protocol, _, peer = addresses[0]
        bound = socket.socket(family, kind, protocol)
        if listens:
            bound.bind(peer)
        return _UdpPort(bound, None if listens else peer)
    except (OSError, UnicodeError) as error:
        if bound is not None:
            bound.close()
        raise ScenarioError(f"{named}: cannot be used: {reason(error)}") from error


def _open_serial(named: str, address: str, baud: int) -> _SerialPort:
    """Open a serial device; ``named`` is the argument in messages."""
    try:
        import serial
    except ImportError as error:
        raise ScenarioError(f"{named}: a serial port needs pyserial: pip install 'ppafo[hil]'") from error
    try:
        device = serial.Serial(address, baud, timeout=0.0, write_timeout=_WRITE_TIMEOUT, exclusive=True)
        device.reset_input_buffer()
    except (OSError, ValueError, OverflowError, TerminalError) as error:
        # pyserial writes the number and the words of the system twice, and names an ioctl that no user knows.
        number = error.errno if isinstance(error, OSError) else None
        cause = one_line(error) if number is None else reason(OSError(number, os.strerror(number)))
        if Path(address).exists() and not _may_be_terminal(address):
            cause = "not a serial port"
        raise ScenarioError(f"{named}: cannot be opened: {cause}") from error
    return _SerialPort(device)


def _may_be_terminal(address: str) -> bool:
    """Return True if a path is a serial port, or this user cannot determine it."""
    if os.name != "posix" or not os.access(address, os.R_OK | os.W_OK):
        return True
    if not Path(address).is_char_device():
        return False
    file = os.open(address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        return os.isatty(file)
    finally:
        os.close(file)
