"""The walking controller on whole numbers: its numbers, what the converter shows, and the float form beside it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.control.fixed.walking_law import (
    HALVES,
    LONGEST,
    SETTINGS,
    TOP,
    gait_converter,
    next_phase,
    next_stride,
    next_switch,
    part_of,
    read_gait,
)
from ppafo.control.fixed.walking_law import PhaseNumbers as Numbers
from ppafo.control.fixed.walking_law import SwitchCounts as Switch
from ppafo.control.fixed.walking_numbers import EVENT_ON_OFF
from ppafo.control.walking import observer, phases, signs
from ppafo.control.walking.event_on_off import EVENT_ON_OFF as FLOAT_KIND
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.exports.firmware.walking import DrawnGait, Gas, Manner, nominal_device
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.walking.loading import load_walk

PERIOD = 1.0e-3
WALK = load_walk("solenoid")
SET = {item.name: float(WALK.control.settings[item.name]) for item in FLOAT_KIND.quantities}
GIVEN = {item.name: float(item.default or 0.0) for item in SETTINGS}
# Both ends of this range of pressures are no readings with floats either.
CONVERTER = gait_converter(*(GIVEN | {"converter_range": 2.2e6}).values())
NUMBERS = EVENT_ON_OFF.prepare(SET, PERIOD, CONVERTER)
RULES = Numbers(
    load=1200, unload=1050, debounce=10, first_stride=2200, stride_weight=9830, push_off_start=6554
)  # 60 N, 30 N, 10 ms, 1.1 s, 0.3 and 0.4 at 1 kHz


def gas() -> Gas:
    return Gas(nominal_device(WALK), PERIOD)


def own_names(row: type) -> list[str]:
    return [path.rpartition(".")[2] for path in leaf_paths(row, "")]


def test_every_number_is_declared_in_the_order_of_its_rows() -> None:
    paths = [path.replace(".", "_") for path in leaf_paths(EVENT_ON_OFF.kind.parameters, "")]
    names = [item.name for item in EVENT_ON_OFF.kind.quantities]
    assert len(set(names)) == len(paths)
    assert all(path.endswith(f"_{name}") for path, name in zip(paths, names, strict=True))
    assert len(leaf_paths(EVENT_ON_OFF.numbers, "")) == len(NUMBERS)
    assert [item.name for item in EVENT_ON_OFF.number_quantities] == list(NUMBERS)
    assert set(own_names(type(EVENT_ON_OFF.begins))) == set(EVENT_ON_OFF.state_ranges)


def test_what_defaults_come_to_is_whole_and_within_what_is_declared() -> None:
    for item in EVENT_ON_OFF.number_quantities:
        assert NUMBERS[item.name] % 1.0 == 0.0
        assert item.minimum <= NUMBERS[item.name] <= item.maximum


def test_times_that_must_be_passed_and_times_that_must_be_reached_keep_their_sample() -> None:
    settings = SET | {"vent_time": 0.2504, "debounce": 0.0101, "nominal_switching_interval": 0.0501}
    found = EVENT_ON_OFF.prepare(settings, PERIOD, CONVERTER)
    assert (NUMBERS["vent"], NUMBERS["debounce"], NUMBERS["interval"], NUMBERS["alarm"]) == (250.0, 10.0, 50.0, 5.0)
    assert (found["vent"], found["debounce"], found["interval"]) == (250.0, 11.0, 51.0)


def test_readings_are_counts_of_fourteen_bits_and_stay_in_their_range() -> None:
    seen = read_gait(CONVERTER, GaitMeasurement(1.401, 0.0, 1.0e9, 0.0, -1.0e4, 1601.0))
    assert seen == (0, 512 << 4, 512 << 4, 0, 1023 << 4)
    fine = gait_converter(14.0, 2.2e6, -200.0, 3.4e3, 2.8)
    assert max(read_gait(fine, GaitMeasurement(9.9, 1.0e9, 1.0e9, 0.0, 1.0e9, 1.0e9))) == TOP


@given(st.integers(0, HALVES), st.floats(0.0, 1.999))
def test_a_fraction_of_the_stride_is_the_exact_one_rounded_down(stride: int, fraction: float) -> None:
    share = int(fraction * 2.0**14 + 0.5)
    # So a whole number of samples passes it exactly where it passes the whole one.
    assert part_of(stride, share) == stride * share >> 15


@given(st.integers(600, 4000), st.integers(0, LONGEST))
def test_the_moving_average_is_that_of_floats_to_a_third_of_a_sample(known: int, since: int) -> None:
    usual = 0.25 * known < since < known
    exact = 0.5 * known + 0.3 * (since - 0.5 * known) if usual else 0.5 * known
    near = abs(since - 0.25 * known) <= 1.0 or abs(since - known) <= 1.0
    assert near or abs(0.5 * next_stride(RULES, known, since) - exact) <= 0.3


@given(st.integers(0, 3), st.booleans(), st.booleans(), st.booleans())
def test_the_phases_follow_each_other_as_in_floats(phase: int, heel: bool, toe: bool, late: bool) -> None:
    before = phases.START._replace(phase=float(phase), stride_time=1.0)
    rules = phases.PhaseRules(60.0, 30.0, 0.01, 1.1, 0.3, 0.4)
    wanted = phases.next_phase(rules, before, float(heel), float(toe), 0.5 if late else 0.1)
    assert next_phase(phase, int(heel), int(toe), late) == wanted


def test_a_change_of_load_counts_when_it_has_lasted() -> None:
    switch, seen = Switch(0, 0), []
    for force in (1201,) * 9 + (1100,) * 2 + (1201,) * 10 + (1049,) * 10:
        switch = next_switch(RULES, switch, force)
        seen.append(switch.loaded)
    # Between both thresholds nothing is indicated but what was: what had begun ends there.
    assert seen == [0] * 20 + [1] * 10 + [0]


class Both:
    """The float form and the integer form on the same measurements."""

    def __init__(self) -> None:
        values = [SET[item.name] for item in FLOAT_KIND.quantities]
        self.floats, self.float_state = rebuilt(FLOAT_KIND.parameters, values), FLOAT_KIND.initial
        own = [*CONVERTER, *NUMBERS.values()]
        self.fixed, self.fixed_state = rebuilt(EVENT_ON_OFF.kind.parameters, own), EVENT_ON_OFF.kind.initial

    def update(self, seen: GaitMeasurement) -> tuple[float, float]:
        wanted, self.float_state = FLOAT_KIND.update(self.floats, self.float_state, 0.0, seen, PERIOD)
        found, self.fixed_state = EVENT_ON_OFF.kind.update(self.fixed, self.fixed_state, 0.0, seen, PERIOD)
        return wanted, found


def steps(readings: tuple[int, ...]) -> GaitMeasurement:
    """What the middle of each count stands for."""
    heel, toe, angle, pressure_1, pressure_2 = (float(value >> 4) for value in readings)
    return GaitMeasurement(
        angle=angle * CONVERTER.angle_step,
        pressure_1=pressure_1 * CONVERTER.pressure_step,
        pressure_2=pressure_2 * CONVERTER.pressure_step,
        torque=0.0,
        heel_force=CONVERTER.force_zero + heel * CONVERTER.force_step,
        toe_force=CONVERTER.force_zero + toe * CONVERTER.force_step,
    )


@pytest.mark.parametrize(("turned", "lifts"), [(0.0, False), (0.04, False), (0.06, True)])
def test_who_sits_with_a_foot_that_was_flat_above_the_angle_of_lifting_is_not_lifted(
    turned: float, lifts: bool
) -> None:
    both, commands = Both(), set()
    # 109 deg, as of somebody who sits with the knee stretched: a foot in the air is lifted from 104 deg on.
    for force, angle in (*((200.0, 1.9),) * 400, *((0.0, 1.9),) * 50, *((0.0, 1.9 + turned),) * 8):
        room = 1.013e5
        wanted, found = both.update(GaitMeasurement(angle, room, room, 0.0, force, force))
        assert wanted == found
        commands.add(found)
    assert (-1.0 in commands) is lifts
    assert both.fixed_state.safety.level == both.float_state.safety.level == 0.0


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_floats_and_whole_numbers_help_pause_and_stop_alike_on_drawn_gaits(seed: int) -> None:
    drawn, command, both = DrawnGait(CONVERTER, gas(), seed), 0, Both()
    levels, other_commands, other_signs, samples, differed = set(), 0, 0, 15_000, 0
    for _ in range(samples):
        readings, begins = drawn.next(command)
        both = Both() if begins else both
        wanted, found = both.update(steps(readings))
        command = 0 if found > VENTS_ABOVE else int(found)
        levels.add(both.fixed_state.safety.level)
        other_commands += wanted != found
        wanted_safety, found_safety = both.float_state.safety, both.fixed_state.safety
        differs = (wanted_safety.level, wanted_safety.finding.sign) != (found_safety.level, found_safety.finding.sign)
        # Floats add up times, and so pass a limit a sample earlier or later; a residual that grows slowly, some more.
        differed = differed + 1 if differs else 0
        assert differed <= 20
        other_signs += differs
    assert {0.0, 3.0} <= levels
    assert other_commands < 0.0005 * samples
    assert other_signs < 0.001 * samples


@pytest.mark.parametrize(
    ("odd", "sensor", "fault", "wanted"),
    [
        ("turns down", 0, "none", {signs.LATE_FORCES}),
        ("", 3, "half", {observer.LEAK}),
        ("", 4, "half", {observer.SUPPLY_LOW}),
        ("", 0, "frozen", {signs.STILL_HEEL, signs.FROZEN_HEEL}),
        ("", 1, "frozen", {signs.STILL_TOE, signs.FROZEN_TOE}),
        ("", 2, "frozen", {signs.STILL_ANGLE, signs.FROZEN_ANGLE}),
    ],
)
def test_a_fault_is_found_by_the_same_signs_within_two_samples(
    odd: str, sensor: int, fault: str, wanted: set[float]
) -> None:
    drawn, command, both = DrawnGait(CONVERTER, gas(), 1), 0, Both()
    manner = Manner(stride=800, spread=0.0, odd_share=1.0, odd=odd, sensor=sensor, fault=fault, begins=1700, value=0)
    drawn.begin(manner, 3000)
    floats: dict[float, int] = {}
    whole: dict[float, int] = {}
    for place in range(3000):
        _, found = both.update(steps(drawn.next(command)[0]))
        command = 0 if found > VENTS_ABOVE else int(found)
        floats.setdefault(both.float_state.safety.finding.sign, place)
        whole.setdefault(both.fixed_state.safety.finding.sign, place)
    assert set(floats) == set(whole) == {signs.NO_SIGN, *wanted}
    assert all(abs(floats[sign] - whole[sign]) <= 2 for sign in wanted)
