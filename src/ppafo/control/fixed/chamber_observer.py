"""The observer of the chambers on whole numbers: ``control.walking.observer`` as a small processor computes it.

All of it fits 16 bits. A pressure is in counts of 14 bits, as the converter shows it; a volume in 1/2^13 of a largest
one; a content p V in counts at that volume, and the flow of a sample in 1/16 of it, whose rest is carried on. An
opening is in 1/2^14, a delay of a coil in 1/64 of a sample. A quotient takes as many shifts and subtractions as a
product takes shifts and additions, so that no table is needed: a flow follows its curve along four straight lines.

The supply is taken to be constant: the lines behind regulators are in the form for floats alone.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ppafo.control.fixed.whole_numbers import LARGEST_FRACTION, fraction_of, nearest_fraction_of
from ppafo.control.walking import observer
from ppafo.model.declaration import Quantity

NO_CAUSE: int = int(observer.NO_CAUSE)
SUPPLY_HIGH: int = int(observer.SUPPLY_HIGH)
SUPPLY_LOW: int = int(observer.SUPPLY_LOW)
SUPPLY_LOST: int = int(observer.SUPPLY_LOST)
VALVE_OPEN: int = int(observer.VALVE_OPEN)
VALVE_SHUT: int = int(observer.VALVE_SHUT)
LEAK: int = int(observer.LEAK)

BITS = 14
FULL: int = 2**BITS
"""An opening of 1."""
HALF_WAY: int = FULL // 2
"""A spool that is fully open, in 1/2^13."""
TOP: int = FULL - 1
"""Largest pressure and largest content."""
LARGEST_VOLUME: int = FULL // 2 - 1
FLOW_BITS = 4
FLOW_PARTS: int = 2**FLOW_BITS
"""Of a count in the content that flows in a sample."""
MOST_FLOW: int = FULL // 2 - FLOW_PARTS
"""Largest flow through one opening [1/16 content]: with two of them and what is carried it fits 16 bits."""
MOST_ADDED: int = FULL // 4 - 1
"""More than all that can be added in a sample: the mask changes nothing, and is how the proof knows it."""
SAMPLE_PARTS = 64
"""Of a sample in a delay."""
OPENED: int = FULL // SAMPLE_PARTS
LONGEST: int = TOP
"""Samples at which counting ends."""
FIRST_WIDTH, SECOND_WIDTH, THIRD_WIDTH, TAIL_WIDTH = 2, 4, 8, 16
"""The line of a flow is so many times shorter than 1, and as steep at most."""
FIRST_MASK: int = FULL // FIRST_WIDTH - 1
SECOND_MASK: int = FULL // SECOND_WIDTH - 1
THIRD_MASK: int = FULL // THIRD_WIDTH - 1
TAIL_MASK: int = FULL // TAIL_WIDTH - 1
ROOMY = 1.25
"""Largest volume over that of a chamber at its stop."""
NEARLY_FULL: int = int(observer.NEARLY_FULL * 2**15)


class PieceNumbers(NamedTuple):
    """A line from a ratio of pressures [1/2^14] on: share of a choked flow [1/2^14] there, slope over the steepest."""

    begins: int
    share: int
    slope: int


class FlowNumbers(NamedTuple):
    """Choked flow of a sample over the pressure before the valve [1/2^15]; the share of it along four lines."""

    conductance: int
    first: PieceNumbers
    second: PieceNumbers
    third: PieceNumbers
    tail: PieceNumbers


class ChamberNumbers(NamedTuple):
    """Supply [counts], dead volume [1/2^13]; what offset [content] and pressure [1/2^15] explain in a mean volume."""

    supply: int
    dead_volume: int
    offset: int
    tolerance: int


class CoilNumbers(NamedTuple):
    """Delays of opening and closing [1/64 of a sample], shortest time between two switchings [samples]."""

    opening: int
    closing: int
    interval: int


class ObserverNumbers(NamedTuple):
    """The nominal device on whole numbers, and how contents follow what is measured.

    ``growth`` is volume over angle [1/2^15]; stops in counts; ``pair`` and ``relieving`` 0 or 1; ``follows`` is the
    part of the way that a spool goes in a sample, ``forgets`` the flow that a residual makes, ``keeps`` what is left of
    the gas that has passed, ``lags`` of an expected pressure [1/2^15]; ``joining`` and ``alarm`` in samples.
    """

    flow: FlowNumbers
    plantar: ChamberNumbers
    dorsal: ChamberNumbers
    room: int
    relieving: int
    growth: int
    lower_stop: int
    upper_stop: int
    pair: int
    coil: CoilNumbers
    follows: int
    joining: int
    lags: int
    forgets: int
    keeps: int
    alarm: int
    half_offset: int


class CoilCounts(NamedTuple):
    """Where the flow is (0 or 1) and where it goes, since when [samples], in what time it is there [1/64 sample]."""

    position: int
    target: int
    since: int
    waits: int


class ChamberCounts(NamedTuple):
    """Content, the flow that it is still to take, pressure that it gives and pressure expected of the sensor.

    ``passed`` is the gas that has passed lately [1/2 content], ``contrary`` for how many samples there is an alarm,
    ``shown`` the content of the last reading, and ``least`` the lowest since the chamber was connected otherwise.
    """

    content: int
    carried: int
    pressure: int
    expected: int
    passed: int
    contrary: int
    shown: int
    least: int
    volume: int


class ObserverCounts(NamedTuple):
    """Both chambers and their coils, the opening of a spool, for how many samples the chambers are joined yet."""

    plantar: ChamberCounts
    dorsal: ChamberCounts
    coil_1: CoilCounts
    coil_2: CoilCounts
    spool: int
    joined: int


def quotient(low: int, high: int) -> int:
    """``low`` / ``high`` in 1/2^14, rounded down, for 0 <= low <= high < 2^14; less than 1."""
    left = low
    found = 0
    for _ in range(BITS):
        left = left + left
        found = found + found
        if left >= high:
            left = left - high
            found = found + 1
        # What is left is below ``high``: the mask changes nothing, and is how the proof of the widths knows it.
        left = left & TOP
    return found


def content_of(pressure: int, volume: int) -> int:
    """The content of a pressure, or difference of pressures, [counts] in a volume."""
    return nearest_fraction_of(pressure, volume * 4)


def pressure_of(content: int, volume: int) -> int:
    """The pressure [counts] of a content in a volume, ``TOP`` where it is larger."""
    whole = volume * 2
    return TOP if content >= whole else quotient(content, whole)


def flow_share(flow: FlowNumbers, ratio: int) -> int:
    """Flow over choked flow [1/2^14] at a ratio of pressures [1/2^14]."""
    if ratio < flow.first.begins:
        return flow.first.share
    piece = flow.first
    further = (ratio - piece.begins & FIRST_MASK) * FIRST_WIDTH
    if ratio >= flow.tail.begins:
        piece = flow.tail
        further = (ratio - piece.begins & TAIL_MASK) * TAIL_WIDTH
    elif ratio >= flow.third.begins:
        piece = flow.third
        further = (ratio - piece.begins & THIRD_MASK) * THIRD_WIDTH
    elif ratio >= flow.second.begins:
        piece = flow.second
        further = (ratio - piece.begins & SECOND_MASK) * SECOND_WIDTH
    share = piece.share - fraction_of(further, piece.slope)
    return max(share, 0)


def shared(flow: int, share: int) -> int:
    """A part [1/2^14] of a flow."""
    return flow if share == FULL else nearest_fraction_of(flow, (share & TOP) * 2)


def flow_into(flow: FlowNumbers, pressure: int, node: int, takes_back: int) -> int:
    """What enters a chamber from a node [counts] in a sample through the open valve [1/16 content]; below 0 leaves."""
    upstream = max(pressure, node)
    choked = nearest_fraction_of(upstream, flow.conductance)
    share = flow_share(flow, quotient(min(pressure, node), upstream))
    found = shared(min(MOST_FLOW, choked), share)
    return found if node >= pressure else (-found if takes_back == 1 else 0)


def next_coil(numbers: CoilNumbers, coil: CoilCounts, wanted: int) -> tuple[int, CoilCounts]:
    """Mean position of a coil [1/2^14] in a sample in which it was ordered to be at ``wanted``, and the coil after."""
    accepts = wanted != coil.target and coil.since >= numbers.interval
    target = wanted if accepts else coil.target
    waits = (numbers.opening if wanted == 1 else numbers.closing) if accepts else coil.waits
    before = min(waits, SAMPLE_PARTS)
    before_open = before if coil.position == 1 else 0
    after_open = SAMPLE_PARTS - before if target == 1 else 0
    after = CoilCounts(
        position=target if waits <= SAMPLE_PARTS else coil.position,
        target=target,
        since=1 if accepts else min(coil.since + 1, LONGEST),
        waits=max(waits - SAMPLE_PARTS, 0),
    )
    return min(before_open + after_open, SAMPLE_PARTS) * OPENED, after


def passed_chamber(
    numbers: ObserverNumbers, own: ChamberNumbers, chamber: ChamberCounts, source: int, vent: int, turns: bool
) -> ChamberCounts:
    """A chamber after a sample in which it was open to its supply and to the atmosphere [1/2^14]; ``turns`` anew."""
    pressure = chamber.pressure
    entered = chamber.carried
    if source > 0:
        entered = entered + shared(flow_into(numbers.flow, pressure, own.supply, numbers.relieving), source)
    if vent > 0:
        entered = entered + shared(flow_into(numbers.flow, pressure, numbers.room, 1), vent)
    # In one sample no flow leads beyond the pressures between which it runs.
    high = max(pressure, own.supply if source > 0 else numbers.room)
    low = min(pressure, numbers.room if vent > 0 else own.supply)
    end = content_of(high if entered > 0 else low, chamber.volume)
    moved = chamber.content + (entered >> FLOW_BITS)
    fuller = max(chamber.content, min(moved, end))
    emptier = min(chamber.content, max(moved, end))
    content = fuller if entered > 0 else emptier
    passed = nearest_fraction_of(chamber.passed, numbers.keeps)
    added = max(content - chamber.content, chamber.content - content) & MOST_ADDED
    passed = passed + added + added
    return ChamberCounts(
        content=content,
        carried=entered & FLOW_PARTS - 1,
        pressure=pressure,
        expected=chamber.expected,
        passed=min(TOP, passed),
        contrary=chamber.contrary,
        shown=chamber.shown,
        least=chamber.shown if turns else min(chamber.least, chamber.shown),
        volume=chamber.volume,
    )


def met_chamber(
    numbers: ObserverNumbers, own: ChamberNumbers, chamber: ChamberCounts, volume: int, measured: int, blind: bool
) -> ChamberCounts:
    """A chamber after a reading [counts] in its volume; a ``blind`` observer takes the content from it."""
    shown = content_of(measured, volume)
    if blind:
        return ChamberCounts(
            content=shown,
            carried=0,
            pressure=measured,
            expected=measured,
            passed=0,
            contrary=0,
            shown=shown,
            least=shown,
            volume=volume,
        )
    held = pressure_of(chamber.content, volume)
    expected, content = held, chamber.content
    if numbers.lags > 0:
        expected = held + nearest_fraction_of(chamber.expected - held, numbers.lags)
        expected = max(0, min(TOP, expected))
        content = content_of(expected, volume)
    residual = shown - content
    allowed = (chamber.passed >> 3) + (chamber.passed >> 4) + own.offset + fraction_of(measured, own.tolerance)
    return ChamberCounts(
        content=chamber.content,
        carried=chamber.carried + nearest_fraction_of(residual, numbers.forgets),
        pressure=held,
        expected=expected,
        passed=chamber.passed,
        contrary=min(chamber.contrary + 1, LONGEST) if max(residual, -residual) > allowed else 0,
        shown=shown,
        least=chamber.least,
        volume=volume,
    )


def volume_of(numbers: ObserverNumbers, own: ChamberNumbers, turned: int) -> int:
    """Volume of a chamber whose ankle has turned by so many counts from the stop where it is smallest."""
    grown = fraction_of(max(min(turned, TOP), 0), numbers.growth)
    return min(own.dead_volume + grown, LARGEST_VOLUME)


def next_observer(
    numbers: ObserverNumbers, state: ObserverCounts, side: int, angle: int, pressure_1: int, pressure_2: int
) -> ObserverCounts:
    """Both chambers after a sample that the command (1, -1, 0 to vent) has lasted, and the readings after it."""
    begins = state.plantar.volume == 0
    on_1, coil_1 = next_coil(numbers.coil, state.coil_1, 1 if side > 0 else 0)
    on_2, coil_2 = next_coil(numbers.coil, state.coil_2, 1 if side < 0 else 0)
    wanted = HALF_WAY if side > 0 else (-HALF_WAY if side < 0 else 0)
    way = (wanted >> 1) - (state.spool >> 1)
    spool = state.spool + 2 * nearest_fraction_of(way, numbers.follows)
    spool = wanted if numbers.follows == 0 else max(-HALF_WAY, min(HALF_WAY, spool))
    is_pair = numbers.pair == 1
    towards_1, towards_2 = max(spool, 0) * 2, max(-spool, 0) * 2
    source_1, source_2 = on_1 if is_pair else towards_1, on_2 if is_pair else towards_2
    vent_1 = FULL - on_1 if is_pair else (FULL if side == 0 else towards_2)
    vent_2 = FULL - on_2 if is_pair else (FULL if side == 0 else towards_1)
    was_1, was_2 = is_fed(numbers, state.coil_1, state.spool), is_fed(numbers, state.coil_2, -state.spool)
    joined = numbers.joining if coil_1.position == 1 else max(state.joined - 1, 0)
    blind = begins or (joined > 0 and coil_1.position == 0)
    passed_1 = passed_chamber(numbers, numbers.plantar, state.plantar, source_1, vent_1, (source_1 > vent_1) != was_1)
    passed_2 = passed_chamber(numbers, numbers.dorsal, state.dorsal, source_2, vent_2, (source_2 > vent_2) != was_2)
    volume_1 = volume_of(numbers, numbers.plantar, angle - numbers.lower_stop)
    volume_2 = volume_of(numbers, numbers.dorsal, numbers.upper_stop - angle)
    return ObserverCounts(
        plantar=met_chamber(numbers, numbers.plantar, passed_1, volume_1, pressure_1, blind),
        dorsal=met_chamber(numbers, numbers.dorsal, passed_2, volume_2, pressure_2, blind),
        coil_1=coil_1,
        coil_2=coil_2,
        spool=spool,
        joined=joined,
    )


def is_fed(numbers: ObserverNumbers, coil: CoilCounts, spool: int) -> bool:
    """True where a valve is believed to feed its chamber; ``spool`` is above 0 towards it."""
    return coil.position == 1 if numbers.pair == 1 else spool > 0


def is_vented(numbers: ObserverNumbers, coil: CoilCounts, spool: int, side: int) -> bool:
    """True where a valve is believed to vent its chamber; ``spool`` is above 0 towards it."""
    return coil.position == 0 if numbers.pair == 1 else (side == 0 or spool < 0)


def cause_of(
    numbers: ObserverNumbers, own: ChamberNumbers, chamber: ChamberCounts, measured: int, fed: bool, vented: bool
) -> int:
    """The sign of a chamber with a reading [counts], fed or vented; ``NO_CAUSE`` where there is none."""
    if chamber.contrary < numbers.alarm:
        return NO_CAUSE
    gains = measured > chamber.expected
    if fed:
        some = measured - numbers.room > (chamber.expected - numbers.room) >> 2
        return SUPPLY_HIGH if gains else (SUPPLY_LOW if some else SUPPLY_LOST)
    if not gains:
        return LEAK
    if not vented:
        return VALVE_OPEN
    into_vent = (
        measured > fraction_of(own.supply, NEARLY_FULL)
        or content_of(measured - numbers.half_offset, chamber.volume) > chamber.least
    )
    return VALVE_OPEN if into_vent else VALVE_SHUT


def found_cause(numbers: ObserverNumbers, state: ObserverCounts, side: int, pressure_1: int, pressure_2: int) -> int:
    """The sign of a sample with two pressures [counts], whose command before was ``side``; 0 where there is none."""
    fed_1, fed_2 = is_fed(numbers, state.coil_1, state.spool), is_fed(numbers, state.coil_2, -state.spool)
    vented_1 = is_vented(numbers, state.coil_1, state.spool, side)
    vented_2 = is_vented(numbers, state.coil_2, -state.spool, side)
    first = cause_of(numbers, numbers.plantar, state.plantar, pressure_1, fed_1, vented_1)
    return first if first > NO_CAUSE else cause_of(numbers, numbers.dorsal, state.dorsal, pressure_2, fed_2, vented_2)


def _number(name: str, summary: str, highest: int = LARGEST_FRACTION, lowest: int = 0) -> Quantity:
    return Quantity(name, "", summary, None, float(lowest), float(highest))


def _of_piece(name: str, words: str, width: int) -> tuple[Quantity, ...]:
    return (
        _number(f"{name}_begins", f"ratio of pressures from which {words} line of a flow is taken, in 1/2^14", TOP),
        _number(f"{name}_share", "share of a choked flow there, in 1/2^14", FULL),
        _number(f"{name}_slope", f"how fast it falls with the ratio, in 1/2^15 of {width}"),
    )


def _of_chamber(name: str, words: str) -> tuple[Quantity, ...]:
    return (
        _number(f"{name}_supply", f"pressure to {words}, in counts", TOP, 1),
        _number(f"{name}_dead_volume", "its dead volume, in 1/2^13 of the largest one", LARGEST_VOLUME, 1),
        _number(f"{name}_offset", "content that an offset of its sensor explains, in counts", TOP // 4),
        _number(f"{name}_tolerance", "and what its pressure explains, in 1/2^15 of it"),
    )


OF_OBSERVER = (
    _number("conductance", "choked flow of a sample over the pressure before the valve, in 1/2^19", lowest=1),
    *_of_piece("first", "the first", FIRST_WIDTH),
    *_of_piece("second", "the second", SECOND_WIDTH),
    *_of_piece("third", "the third", THIRD_WIDTH),
    *_of_piece("tail", "the last", TAIL_WIDTH),
    *_of_chamber("plantar", "chamber 1"),
    *_of_chamber("dorsal", "chamber 2"),
    _number("room", "pressure of the atmosphere, in counts", TOP, 1),
    _number("relieving", "1 where the supplies take gas back", 1),
    _number("growth", "volume over angle, in 1/2^15"),
    _number("lower_stop", "lower stop of the ankle, in counts", TOP, -TOP),
    _number("upper_stop", "upper stop, in counts", 2 * TOP, -TOP),
    _number("pair", "1 for a pair of on/off valves, 0 for a spool with a dump valve", 1),
    _number("opening", "delay of a coil that opens, in 1/64 of a sample"),
    _number("closing", "and of one that closes"),
    _number("interval", "shortest time between two switchings of a coil, in samples", LONGEST),
    _number("follows", "part of the way that a spool goes in a sample, in 1/2^15; 0 for all of it"),
    _number("joining", "samples in which the chambers are joined after chamber 1 was fed", LONGEST),
    _number("lags", "what is left of an expected pressure a sample later, in 1/2^15"),
    _number("forgets", "flow that a residual makes in a sample, in 1/2^15"),
    _number("keeps", "what is left of the gas that has passed a sample later, in 1/2^15"),
    _number("alarm", "samples after which a residual counts", LONGEST),
    _number("half_offset", "half of the offset of a pressure, in counts", TOP),
)
"""Every number of ``ObserverNumbers``, in order."""

_NO_GAS = ChamberCounts(content=0, carried=0, pressure=0, expected=0, passed=0, contrary=0, shown=0, least=0, volume=0)
_AT_REST = CoilCounts(position=0, target=0, since=LONGEST, waits=0)
OBSERVER_START = ObserverCounts(plantar=_NO_GAS, dorsal=_NO_GAS, coil_1=_AT_REST, coil_2=_AT_REST, spool=0, joined=0)
"""Nothing seen yet, and all vents."""

_CONTENT, _PRESSURE = (0, TOP), (0, TOP)
OBSERVER_RANGES = {
    "content": _CONTENT,
    "pressure": _PRESSURE,
    "expected": _PRESSURE,
    "carried": (-FULL, FULL + FLOW_PARTS),
    "passed": (0, TOP),
    "contrary": (0, LONGEST),
    "shown": _CONTENT,
    "least": _CONTENT,
    "volume": (0, LARGEST_VOLUME),
    "position": (0, 1),
    "target": (0, 1),
    "since": (0, LONGEST),
    "waits": (0, LARGEST_FRACTION),
    "spool": (-HALF_WAY, HALF_WAY),
    "joined": (0, LONGEST),
}
"""Lowest and highest of every number of ``ObserverCounts``, by its own name."""

_KNOTS = (0.0, 0.42, 0.7)
"""Where the first three lines of a flow begin: parts of the way from the critical pressure ratio to 1."""


def observer_numbers(
    settings: Mapping[str, float], period: float, angle_count: float, pressure_count: float
) -> dict[str, float]:
    """Whole numbers by name, not yet limited, for ``nominal_`` settings, a period [s] and counts [rad], [Pa]."""
    own = {name.removeprefix("nominal_"): value for name, value in settings.items() if name.startswith("nominal_")}
    turns = own["angle_max"] - own["angle_min"]
    largest = ROOMY * (max(own["dead_volume_1"], own["dead_volume_2"]) + own["volume_per_angle"] * turns)
    largest = largest if largest > 0.0 else 1.0
    found: dict[str, float] = {
        "conductance": observer.WARM * period * own["flow"] / largest * FLOW_PARTS * 2**15,
        "room": own["atmospheric_pressure"] / pressure_count,
        "relieving": own["relieving"],
        "growth": own["volume_per_angle"] * angle_count / largest * LARGEST_VOLUME * 2**15,
        "lower_stop": own["angle_min"] / angle_count,
        "upper_stop": own["angle_max"] / angle_count,
        "pair": own["pair"],
        "opening": own["opening_delay"] / period * SAMPLE_PARTS,
        "closing": own["closing_delay"] / period * SAMPLE_PARTS,
        "follows": period / (period + own["lag"]) * 2**15 if own["lag"] > 0.0 else 0.0,
        "joining": own["joining_time"] / period,
        "lags": own["sensor_lag"] / (period + own["sensor_lag"]) * 2**15,
        "forgets": min(FLOW_PARTS * period / observer.FORGETS * 2**15, LARGEST_FRACTION),
        "keeps": max(1.0 - period / observer.FORGETS, 0.0) * 2**15,
        "half_offset": 0.5 * observer.OFFSET / pressure_count,
    }
    for number, name, supply in ((1, "plantar", "supply_pressure"), (2, "dorsal", "dorsiflexion_pressure")):
        mean = (own[f"dead_volume_{number}"] + 0.5 * own["volume_per_angle"] * turns) / largest
        found |= {
            f"{name}_supply": own[supply] / pressure_count,
            f"{name}_dead_volume": own[f"dead_volume_{number}"] / largest * LARGEST_VOLUME,
            f"{name}_offset": mean * observer.OFFSET / pressure_count,
            f"{name}_tolerance": mean * observer.OF_PRESSURE * 2**15,
        }
    rounded = {name: math.floor(value + 0.5) for name, value in found.items()}
    # Times that must be passed, or reached: a whole number of samples is not one more because of its last bit.
    rounded["interval"] = math.ceil(own["switching_interval"] / period - observer.SAME / period)
    rounded["alarm"] = math.ceil(max(observer.ALARM_TIME / period, observer.ALARM_SAMPLES) - observer.SAME / period)
    return {name: float(value) for name, value in (rounded | _lines(own["critical_ratio"])).items()}


def _lines(critical: float) -> dict[str, int]:
    """The curve of ``observer.flow_share`` along four lines: three chords, and the line that it ends with."""
    last = (observer.LINEAR_RATIO - critical) / (1.0 - critical)
    places = [min(knot, last) for knot in _KNOTS] + [last]
    ratios = [critical + place * (1.0 - critical) for place in places] + [1.0]
    shares = [math.sqrt(1.0 - place * place) for place in places] + [0.0]
    found: dict[str, int] = {}
    widths = {"first": FIRST_WIDTH, "second": SECOND_WIDTH, "third": THIRD_WIDTH, "tail": TAIL_WIDTH}
    for (name, width), first, share, end, low in zip(
        widths.items(), ratios, shares, ratios[1:], shares[1:], strict=False
    ):
        slope = (share - low) / (end - first) if end > first else 0.0
        # A slope that is rounded up ends at 0 before the ratio does.
        found[f"{name}_begins"] = math.floor(first * FULL + 0.5)
        found[f"{name}_share"] = math.floor(share * FULL)
        found[f"{name}_slope"] = math.ceil(slope / width * 2**15)
    return found
