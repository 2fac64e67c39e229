"""Link between plant and controller: packets, their detection in received bytes, and ports.

The page ``docs/wire-protocol.md`` describes the protocol as a table. All received data is checked here: a packet is
either completely valid, or counted and discarded. A port is a UDP socket or a serial device, opened from a text such as
``udp:127.0.0.1:5000``.
"""

import contextlib
import math
import os
import select
import socket
import struct
import time
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol, final

from ppafo.arguments.door import argument_text
from ppafo.errors import ScenarioError
from ppafo.wording import one_line, reason

try:
    from termios import error as TerminalError  # noqa: N812 - an exception, by a name in lower case
except ImportError:  # a system without terminals
    TerminalError = OSError  # type: ignore[misc, assignment]

RATE = 1000
"""Default sample rate [Hz]."""
LOWEST_RATE, HIGHEST_RATE = 50, 2000
MARK = b"\xa5\x5a"
VERSION = 1
SAMPLE, ANSWER = 1, 2
"""Kinds of packet."""
BEGIN, VENTED, OVER, COMPUTED = 1, 2, 4, 8
"""Flags of a sample."""
UNSOUND = 1
"""Flag of an answer that requests permanent venting of both chambers."""
FULL_COMMAND = 1_000_000
"""Counts of the full command 1."""
MICROSECONDS = 1_000_000
WRAP = 2**32
"""Value at which a counter or time stamp wraps around to 0."""

_HEADER = struct.Struct("<2sBBBBHII")
_WORD = struct.Struct("<i")
_MASK = struct.Struct("<I")
_CHECKSUM = 4
_SHORTEST = _HEADER.size + _WORD.size + _CHECKSUM
_LARGEST_COUNT = 2**31 - 1


CHANNELS = {
    "reference": 1.0e-6,
    "angle": 1.0e-6,
    "pressure_1": 1.0,
    "pressure_2": 1.0,
    "torque": 1.0e-6,
    "command": 1.0e-6,
    "supply_pressure": 1.0,
    "dorsiflexion_pressure": 1.0,
    "pressure_difference": 1.0,
    "external_torque": 1.0e-6,
    "angular_velocity": 1.0e-6,
    "upstream_pressure": 1.0,
    "downstream_pressure": 1.0,
    "mass_flow": 1.0e-9,
    "direction": 1.0,
    "repetition": 1.0,
}
"""SI value of one count of each channel, in the order of the mask bits."""
_NAMES = tuple(CHANNELS)
LONGEST = _SHORTEST + _WORD.size * len(CHANNELS)
"""Length [bytes] of the longest packet."""


class WireSample(NamedTuple):
    """Sample of a plant or a bench: flags, run, sequence number, time stamp [us], counts by channel."""

    flags: int
    run: int
    sequence: int
    time: int
    counts: Mapping[str, int]


class Answer(NamedTuple):
    """Answer of a controller: flags, run and sequence of the sample, controller time stamp [us], command in counts."""

    flags: int
    run: int
    sequence: int
    time: int
    command: int


Packet = WireSample | Answer


def count_of(name: str, value: float) -> int:
    """Return a value in SI units as rounded counts of a channel, clipped to the largest count."""
    counts = value / CHANNELS[name]
    return int(max(-_LARGEST_COUNT, min(_LARGEST_COUNT, math.floor(counts + 0.5))))


def value_of(name: str, counts: int) -> float:
    """Return the SI value of counts of a channel, as the float nearest to the decimal fraction."""
    return counts / counts_per_unit(name)


def counts_per_unit(name: str) -> int:
    """Counts of a channel per SI unit; dividing by this integer rounds once, multiplying by the scale twice."""
    return round(1.0 / CHANNELS[name])


def sample_bytes(sample: WireSample) -> bytes:
    """Return the packet of a sample for the controller."""
    # In order of bits, whatever the order of the mapping: the receiver has only the mask.
    mask = sum(1 << _NAMES.index(name) for name in sample.counts)
    values = [sample.counts[name] for name in _NAMES if name in sample.counts]
    return _packet(SAMPLE, sample[:4], _MASK.pack(mask) + struct.pack(f"<{len(values)}i", *values))


def answer_bytes(answer: Answer) -> bytes:
    """Return the packet of a controller's answer."""
    return _packet(ANSWER, answer[:4], _WORD.pack(answer.command))


def _packet(kind: int, head: tuple[int, int, int, int], payload: bytes) -> bytes:
    flags, run, sequence, time = head
    length = _HEADER.size + len(payload) + _CHECKSUM
    # 16 bits of checksum would pass a garbled packet in two hours at 1 kHz with 1 % garbled, 32 one in fourteen years.
    body = _HEADER.pack(MARK, VERSION, kind, length, flags, run, sequence, time) + payload
    return body + zlib.crc32(body).to_bytes(_CHECKSUM, "little")


def sample_length(channels: int) -> int:
    """Return the length [bytes] of a sample packet with a number of channels."""
    return _SHORTEST + _WORD.size * channels


REFUSALS = ("stray bytes", "version", "kind", "length", "checksum", "content")
"""Causes of discarded bytes: outside any packet, or a packet with a fault in the named part."""


@final
class Reader:
    """Parser of packets in received bytes; ``refused`` counts discarded data by ``REFUSALS``.

    A stream may split packets between calls; datagrams are complete.
    """

    def __init__(self, is_stream: bool) -> None:
        self.is_stream = is_stream
        self.refused: Counter[str] = Counter()
        self._waiting = b""

    def take(self, data: bytes) -> list[Packet]:
        """Return the valid packets in new data, combined with an earlier incomplete packet."""
        if not self.is_stream:
            return self._datagram(data)
        packets: list[Packet] = []
        waiting = self._waiting + data
        while True:
            at = waiting.find(MARK)
            if at < 0:
                # The last byte may be the first half of a mark that is still to come.
                at = len(waiting) - (1 if waiting.endswith(MARK[:1]) else 0)
                self._drop("stray bytes", at)
                break
            self._drop("stray bytes", at)
            waiting, at = waiting[at:], 0
            # The head is checked before all bytes are there: a wrong length would wait for bytes that never come.
            why = _wrong_head(waiting)
            if why is None and (len(waiting) < _HEADER.size or len(waiting) < waiting[4]):
                break
            packet = _read(waiting[: waiting[4]]) if why is None else why
            if isinstance(packet, str):
                self._drop(packet)
                # Only the mark is dropped: a good packet may begin inside what looked like another one.
                waiting = waiting[len(MARK) :]
            else:
                packets.append(packet)
                waiting = waiting[waiting[4] :]
        self._waiting = waiting[at:]
        return packets

    def _datagram(self, data: bytes) -> list[Packet]:
        if not data.startswith(MARK):
            self._drop("stray bytes", len(data))
            return []
        why = _wrong_head(data)
        if why is None and (len(data) < _HEADER.size or len(data) != data[4]):
            why = "length"
        packet = _read(data) if why is None else why
        if isinstance(packet, str):
            self._drop(packet)
            return []
        return [packet]

    def _drop(self, why: str, count: int = 1) -> None:
        if count:
            self.refused[why] += count


def _wrong_head(data: bytes) -> str | None:
    """Return the fault in the bytes after a mark, as far as received; None if there is none."""
    if len(data) > 2 and data[2] != VERSION:
        return "version"
    if len(data) > 3 and data[3] not in (SAMPLE, ANSWER):
        return "kind"
    if len(data) > 4:
        longest = _SHORTEST if data[3] == ANSWER else LONGEST
        if not _SHORTEST <= data[4] <= longest or (data[4] - _SHORTEST) % _WORD.size:
            return "length"
    return None


def _read(data: bytes) -> Packet | str:
    """Return the packet of bytes of complete length, or the name of its fault."""
    if zlib.crc32(data[:-_CHECKSUM]) != int.from_bytes(data[-_CHECKSUM:], "little"):
        return "checksum"
    _, _, kind, _, flags, run, sequence, time = _HEADER.unpack_from(data)
    if kind == ANSWER:
        (command,) = _WORD.unpack_from(data, _HEADER.size)
        is_good = -FULL_COMMAND <= command <= FULL_COMMAND
        answer = Answer(flags=flags, run=run, sequence=sequence, time=time, command=command)
        return answer if is_good else "content"
    (mask,) = _MASK.unpack_from(data, _HEADER.size)
    names = [name for number, name in enumerate(_NAMES) if mask >> number & 1]
    # Bits of channels that this version does not know, or a length that is not theirs.
    if mask >> len(CHANNELS) or len(data) != sample_length(len(names)):
        return "content"
    # Little-endian and signed, as the protocol says, whatever this computer is.
    values = struct.unpack_from(f"<{len(names)}i", data, _HEADER.size + _MASK.size)
    counts = dict(zip(names, values, strict=True))
    return WireSample(flags=flags, run=run, sequence=sequence, time=time, counts=counts)


def described_refusals(refused: Mapping[str, int], others: Iterable[tuple[str, int]] = ()) -> str:
    """Discarded bytes and messages by cause, as text; ``nothing`` if there were none."""
    counted = [*((why, refused.get(why, 0)) for why in REFUSALS), *others]
    return ", ".join(f"{count} {why}" for why, count in counted if count) or "nothing"


FORMS = "udp:HOST:PORT or serial:DEVICE"
DEFAULT_BAUD = 921_600
BITS_OF_A_BYTE = 10
"""Bits per byte on a serial line: start bit, eight data bits, stop bit."""
_LARGEST_RECEIVED = 4096
_HIGHEST_PORT = 65_535
_STRANGERS_AT_ONCE = 64
"""Maximum number of packets from other senders processed in one call, so that a flood cannot block the plant."""
_WRITE_TIMEOUT = 2.0e-4
"""Write timeout [s] of a serial line; with 0, pyserial would retry forever if nobody reads."""


class Port(Protocol):
    """Link for sending and receiving bytes; after a fault, stored in ``failure``, nothing is received."""

    is_stream: bool
    """True for a byte stream, False for separate datagrams."""
    failure: str
    """Fault during the run; empty without one."""
    strangers: int
    """Number of discarded packets from other senders."""

    def send(self, data: bytes) -> None:
        """Send a packet without blocking, or drop it."""

    def receive(self, timeout: float) -> bytes:
        """Return bytes received within a time [s]; empty on a timeout."""

    def close(self) -> None:
        """Release the port."""


@final
class _UdpPort:
    """UDP socket with a single peer: the given one, or the first sender of a valid packet."""

    is_stream = False

    def __init__(self, own: socket.socket, other: Any) -> None:
        self.failure = ""
        self.strangers = 0
        self._socket = own
        self._other = other
        # The plant's time must not stop in a full buffer.
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        """Send a packet to the peer, if known."""
        if self._other is None:
            return
        # A full buffer or an answer that nobody listens is a lost packet, which is what UDP may do.
        with contextlib.suppress(OSError):
            self._socket.sendto(data, self._other)

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
            if self._other is None:
                if not Reader(is_stream=False).take(data):
                    return data  # counted as refused; its sender is not accepted as the peer
                self._other = sender
            if sender[:2] == self._other[:2]:
                return data
            self.strangers += 1
        return b""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


@final
class _SerialPort:
    """Serial port, by pyserial."""

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
            yield
        except serial.SerialTimeoutException:
            pass
        except (OSError, TypeError) as error:  # pyserial on a device that is gone: SerialException is an OSError
            self.failure = f"the serial port broke: {one_line(error)}"

    def close(self) -> None:
        """Close the device."""
        with contextlib.suppress(OSError):
            self._device.close()


def open_port(text: str, baud: int = DEFAULT_BAUD, listens: bool = False) -> Port:
    """Open a port from a text; with ``listens``, a UDP port waits for the first sender of a valid packet.

    Raises ScenarioError for an invalid text, and for a port that cannot be opened.
    """
    kind, _, address = text.partition(":")
    if kind == "udp":
        return _open_udp(text, address, listens)
    if kind == "serial" and address:
        try:
            import serial
        except ImportError as error:
            raise ScenarioError(
                f"{argument_text('port')} {text}: a serial port needs pyserial: pip install 'ppafo[hil]'"
            ) from error
        try:
            device = serial.Serial(address, baud, timeout=0.0, write_timeout=_WRITE_TIMEOUT, exclusive=True)
            device.reset_input_buffer()
        except (OSError, ValueError, OverflowError, TerminalError) as error:
            # pyserial writes the number and the words of the system twice, and names an ioctl that no user knows.
            number = error.errno if isinstance(error, OSError) else None
            why = one_line(error) if number is None else reason(OSError(number, os.strerror(number)))
            if address and Path(address).exists() and not _is_terminal(address):
                why = "not a serial port"
            raise ScenarioError(f"{argument_text('port')} {one_line(text)}: cannot be opened: {why}") from error
        return _SerialPort(device)
    raise ScenarioError(f"{argument_text('port')} {one_line(text)}: must be {FORMS}")


def _is_terminal(address: str) -> bool:
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


def _open_udp(text: str, place: str, listens: bool) -> _UdpPort:
    host, _, number = place.rpartition(":")
    if not host or not number.isascii() or not number.isdigit() or not 0 < int(number) <= _HIGHEST_PORT:
        raise ScenarioError(
            f"{argument_text('port')} {one_line(text)}: must be udp:HOST:PORT with a port from 1 to {_HIGHEST_PORT}"
        )
    own = None
    try:
        addresses = socket.getaddrinfo(host.strip("[]"), int(number), type=socket.SOCK_DGRAM)
        family, kind, protocol, _, address = addresses[0]
        own = socket.socket(family, kind, protocol)
        if listens:
            own.bind(address)
        return _UdpPort(own, None if listens else address)
    except (OSError, UnicodeError) as error:
        if own is not None:
            own.close()
        raise ScenarioError(f"{argument_text('port')} {one_line(text)}: cannot be used: {reason(error)}") from error
