"""The bytes of the protocol: those of the page, those of zlib, and whatever anybody may send."""

import re
import struct
import zlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.exports.hil.wire import (
    ANSWER,
    CHANNELS,
    FULL_COMMAND,
    LONGEST,
    SAMPLE,
    Answer,
    Packet,
    Reader,
    WireSample,
    count_of,
    sample_bytes,
    value_of,
)
from ppafo.signals import CHANNELS as KNOWN
from tests.virtual_wire import answer_bytes

PAGE = (Path(__file__).parents[3] / "docs" / "wire-protocol.md").read_text(encoding="utf-8")
WORDS = st.integers(0, 2**32 - 1)
HALVES = st.integers(0, 2**16 - 1)
FLAGS = st.integers(0, 255)
COUNTS = st.integers(-(2**31), 2**31 - 1)
NAMES = list(CHANNELS)
SAMPLES = st.builds(WireSample, FLAGS, HALVES, WORDS, WORDS, st.dictionaries(st.sampled_from(NAMES), COUNTS))
ANSWERS = st.builds(Answer, FLAGS, HALVES, WORDS, WORDS, st.integers(-FULL_COMMAND, FULL_COMMAND))
PACKETS = st.one_of(SAMPLES, ANSWERS)
SHOWN = WireSample(
    0, 0x1234, 250, 250_000, dict(zip(NAMES[:5], (1_500_000, 1_308_997, 150_000, 101_325, 9), strict=True))
)


def bytes_of(packet: Packet) -> bytes:
    return sample_bytes(packet) if isinstance(packet, WireSample) else answer_bytes(packet)


def rows_of_page(pattern: str) -> list[tuple[str, ...]]:
    return re.findall(pattern, PAGE, re.MULTILINE)


def test_the_hex_of_the_page_is_the_sample_and_the_answer_it_speaks_of() -> None:
    found = [bytes.fromhex(line) for line in re.findall(r"^    (A5 5A [0-9A-F ]+)$", PAGE, re.MULTILINE)]
    sample, answer = (Reader(is_stream=False).take(data)[0] for data in found)
    assert isinstance(sample, WireSample)
    assert sample.sequence == 250
    assert sample.run == 4660
    values = {name: value_of(name, count) for name, count in sample.counts.items()}
    assert values["reference"] == 1.5
    assert values["angle"] == pytest.approx(1.30899694, abs=1e-6)
    assert (values["pressure_1"], values["pressure_2"]) == (150_000.0, 101_325.0)
    assert answer == Answer(0, sample.run, sample.sequence, 17_000_123, 250_000)


def test_the_tables_of_the_page_are_those_of_the_code() -> None:
    units = {
        "1 µN m": 1e-6,
        "1 µrad": 1e-6,
        "1 Pa": 1.0,
        "1/1,000,000": 1e-6,
        "1 µrad/s": 1e-6,
        "1 µg/s": 1e-9,
        "1": 1.0,
    }
    cells = rows_of_page(r"(\d+) \| `(\w+)`(?:, absolute)? \| ([^|]+?) \|")
    assert {int(bit): (name, units[unit]) for bit, name, unit in cells} == dict(enumerate(CHANNELS.items()))
    assert CHANNELS.keys() <= KNOWN.keys()


def test_a_packet_is_laid_out_as_struct_and_zlib_say() -> None:
    data = sample_bytes(SHOWN)
    body = struct.pack("<2sBBBBHIII5i", b"\xa5\x5a", 1, SAMPLE, 44, 0, 0x1234, 250, 250_000, 31, *SHOWN.counts.values())
    assert data == body + struct.pack("<I", zlib.crc32(body))
    answer = answer_bytes(Answer(1, 7, 9, 11, -5))
    body = struct.pack("<2sBBBBHIIi", b"\xa5\x5a", 1, ANSWER, 24, 1, 7, 9, 11, -5)
    assert answer == body + struct.pack("<I", zlib.crc32(body))


@given(PACKETS, st.booleans())
def test_a_packet_comes_back_as_it_was(packet: Packet, is_stream: bool) -> None:
    data = bytes_of(packet)
    reader = Reader(is_stream)
    assert reader.take(data) == [packet]
    assert not reader.refused
    assert len(data) <= LONGEST


@given(st.lists(PACKETS, max_size=4), st.data())
def test_a_stream_may_be_cut_anywhere(packets: list[Packet], data: st.DataObject) -> None:
    whole = b"".join(map(bytes_of, packets))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=6)))
    reader = Reader(is_stream=True)
    parts = [whole[start:end] for start, end in zip([0, *cuts], [*cuts, len(whole)], strict=True)]
    assert [packet for part in parts for packet in reader.take(part)] == packets
    assert not reader.refused


@given(st.binary(max_size=300), PACKETS, st.binary(max_size=100))
def test_a_good_packet_is_found_between_bytes_of_anybody(before: bytes, packet: Packet, after: bytes) -> None:
    reader = Reader(is_stream=True)
    found = reader.take(before + bytes_of(packet) + after) + reader.take(bytes(LONGEST))
    # Only a head of a packet among the bytes before can keep one waiting, and it is given up when its bytes are there.
    assert packet in found
    assert len(reader._waiting) <= LONGEST


@given(PACKETS, st.integers(0, 10_000), st.integers(1, 255), st.booleans())
def test_a_garbled_byte_makes_a_packet_none(packet: Packet, place: int, change: int, is_stream: bool) -> None:
    data = bytearray(bytes_of(packet))
    data[place % len(data)] ^= change
    reader = Reader(is_stream)
    assert reader.take(bytes(data) + (bytes(LONGEST) if is_stream else b"")) == []
    assert sum(reader.refused.values()) > 0


@given(st.binary(max_size=200), st.booleans())
def test_bytes_of_anybody_crash_nothing(data: bytes, is_stream: bool) -> None:
    reader = Reader(is_stream)
    for packet in reader.take(data):
        assert bytes_of(packet) in data


@given(PACKETS, st.integers(0, 120))
def test_a_datagram_of_another_length_is_refused(packet: Packet, length: int) -> None:
    data = bytes_of(packet)
    other = (data + bytes(120))[:length]
    reader = Reader(is_stream=False)
    assert reader.take(other) == ([packet] if other == data else [])
    assert bool(reader.refused) == (other != data and length > 0)


def checked(body: bytes) -> bytes:
    return body + struct.pack("<I", zlib.crc32(body))


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (checked(struct.pack("<2sBBBBHIIi", b"\xa5\x5a", 2, ANSWER, 24, 0, 0, 0, 0, 0)), "version"),
        (checked(struct.pack("<2sBBBBHIIi", b"\xa5\x5a", 1, 3, 24, 0, 0, 0, 0, 0)), "kind"),
        (checked(struct.pack("<2sBBBBHIIii", b"\xa5\x5a", 1, ANSWER, 28, 0, 0, 0, 0, 0, 0)), "length"),
        (checked(struct.pack("<2sBBBBHIIi", b"\xa5\x5a", 1, ANSWER, 24, 0, 0, 0, 0, 1_000_001)), "content"),
        (checked(struct.pack("<2sBBBBHIII", b"\xa5\x5a", 1, SAMPLE, 24, 0, 0, 0, 0, 1 << 16)), "content"),
        (checked(struct.pack("<2sBBBBHIIIi", b"\xa5\x5a", 1, SAMPLE, 28, 0, 0, 0, 0, 3, 0)), "content"),
        (b"\xa5\x5b" + bytes(22), "stray bytes"),
        (answer_bytes(Answer(0, 0, 0, 0, 0))[:-1] + b"\0", "checksum"),
    ],
)
@pytest.mark.parametrize("is_stream", [False, True])
def test_what_is_wrong_is_counted_by_its_name(data: bytes, why: str, is_stream: bool) -> None:
    reader = Reader(is_stream)
    assert reader.take(data) == []
    assert reader.refused[why] > 0


@given(st.sampled_from(NAMES), COUNTS)
def test_a_count_has_a_value_and_that_value_the_count(name: str, count: int) -> None:
    assert count_of(name, value_of(name, max(count, 1 - 2**31))) == max(count, 1 - 2**31)


@pytest.mark.parametrize(("value", "count"), [(1e30, 2**31 - 1), (-1e30, 1 - 2**31), (0.49e-6, 0), (-0.51e-6, -1)])
def test_a_value_beyond_the_counts_stays_at_their_end(value: float, count: int) -> None:
    assert count_of("torque", value) == count
