"""Packets between plant and controller, and their detection in received bytes.

The page ``docs/wire-protocol.md`` describes the protocol as a table. All received data is checked here: a packet is
either completely valid, or counted and discarded.
"""

import math
import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import NamedTuple, final

RATE = 1000
"""Default sample rate [Hz]."""
LOWEST_RATE, HIGHEST_RATE = 50, 2000
MARK = b"\xa5\x5a"
VERSION = 1
SAMPLE, ANSWER = 1, 2
"""Packet types."""
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
"""Mark, version, kind, length, flags, run, sequence number and time stamp."""
_VERSION_AT, _KIND_AT, _LENGTH_AT = 2, 3, 4
"""Positions of version, kind and length in a packet."""
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
    return packet_bytes(SAMPLE, sample[:4], _MASK.pack(mask) + struct.pack(f"<{len(values)}i", *values))


def packet_bytes(kind: int, head: tuple[int, int, int, int], payload: bytes) -> bytes:
    """Return a packet; ``head`` has the first four numbers of a sample or an answer."""
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
            return self._packets_of_datagram(data)
        packets: list[Packet] = []
        waiting = self._waiting + data
        while True:
            start = waiting.find(MARK)
            if start < 0:
                # The last byte may be the first half of a mark that is still to come.
                start = len(waiting) - (1 if waiting.endswith(MARK[:1]) else 0)
            self._refuse("stray bytes", start)
            waiting = waiting[start:]
            # The head is checked before all bytes are there: a wrong length would wait for bytes that never come.
            fault = _fault_of_head(waiting)
            if fault is None and (len(waiting) < _HEADER.size or len(waiting) < waiting[_LENGTH_AT]):
                self._waiting = waiting
                return packets
            packet = _parsed(waiting[: waiting[_LENGTH_AT]]) if fault is None else fault
            if isinstance(packet, str):
                self._refuse(packet)
                # Only the mark is dropped: a good packet may begin inside what looked like another one.
                waiting = waiting[len(MARK) :]
            else:
                packets.append(packet)
                waiting = waiting[waiting[_LENGTH_AT] :]

    def _packets_of_datagram(self, data: bytes) -> list[Packet]:
        if not data.startswith(MARK):
            self._refuse("stray bytes", len(data))
            return []
        fault = _fault_of_head(data)
        if fault is None and (len(data) < _HEADER.size or len(data) != data[_LENGTH_AT]):
            fault = "length"
        packet = _parsed(data) if fault is None else fault
        if isinstance(packet, str):
            self._refuse(packet)
            return []
        return [packet]

    def _refuse(self, cause: str, count: int = 1) -> None:
        # A cause that never occurred is no key of the counter.
        if count:
            self.refused[cause] += count


def _fault_of_head(data: bytes) -> str | None:
    """Return the fault in the bytes after a mark, as far as received; None if there is none."""
    if len(data) > _VERSION_AT and data[_VERSION_AT] != VERSION:
        return "version"
    if len(data) > _KIND_AT and data[_KIND_AT] not in (SAMPLE, ANSWER):
        return "kind"
    if len(data) > _LENGTH_AT:
        length = data[_LENGTH_AT]
        longest = _SHORTEST if data[_KIND_AT] == ANSWER else LONGEST
        if not _SHORTEST <= length <= longest or (length - _SHORTEST) % _WORD.size:
            return "length"
    return None


def _parsed(data: bytes) -> Packet | str:
    """Return the packet of bytes of complete length, or the name of its fault."""
    if zlib.crc32(data[:-_CHECKSUM]) != int.from_bytes(data[-_CHECKSUM:], "little"):
        return "checksum"
    _, _, kind, _, flags, run, sequence, time = _HEADER.unpack_from(data)
    if kind == ANSWER:
        (command,) = _WORD.unpack_from(data, _HEADER.size)
        is_in_range = -FULL_COMMAND <= command <= FULL_COMMAND
        answer = Answer(flags=flags, run=run, sequence=sequence, time=time, command=command)
        return answer if is_in_range else "content"
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
    counts = [*((cause, refused.get(cause, 0)) for cause in REFUSALS), *others]
    return ", ".join(f"{count} {cause}" for cause, count in counts if count) or "nothing"
