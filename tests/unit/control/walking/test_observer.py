"""The observer of the chambers: what it expects of a sound device, and which cause it names."""

import math

import pytest

from ppafo.control.walking import fault_flags, observer
from ppafo.control.walking.nominal_device import NominalDevice, volumes
from ppafo.model.regulator import SupplyLines
from ppafo.model.valves.kind import VENT
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import walk

PERIOD = 1.0e-3
ROOM, SUPPLY = 101325.0, 446062.864658
NO_LINES = SupplyLines(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
PAIR = NominalDevice(
    nominal_flow=2.25e-4,
    nominal_critical_ratio=0.5457,
    nominal_supply_pressure=SUPPLY,
    nominal_dorsiflexion_pressure=SUPPLY,
    nominal_atmospheric_pressure=ROOM,
    nominal_relieving=0.0,
    nominal_displacement_per_radian=51.0e-6,
    nominal_dead_volume_1=2.0e-6,
    nominal_dead_volume_2=2.0e-6,
    nominal_angle_min=math.radians(20.0),
    nominal_angle_max=math.radians(130.0),
    nominal_pair=1.0,
    nominal_opening_delay=0.0,
    nominal_closing_delay=0.0,
    nominal_switching_interval=0.0,
    nominal_delay=0.0,
    nominal_lag=0.0,
    nominal_dead_band=0.0,
    nominal_joining_time=0.0,
    nominal_sensor_lag=0.0,
    nominal_lines=NO_LINES,
)
SPOOL = PAIR._replace(nominal_pair=0.0)
STANDS, FLEXES = math.radians(90.0), math.radians(75.0)


def test_every_number_of_the_nominal_device_is_that_of_the_device_unless_given() -> None:
    settings = load_walk("solenoid").controller.settings
    assert settings["nominal_supply_pressure"] == load_walk("solenoid").device.supply.pressure
    assert (settings["nominal_pair"], settings["nominal_switching_interval"]) == (1.0, 0.05)
    assert settings["nominal_flow"] == pytest.approx(2.256e-4, rel=1.0e-3)
    changed = load_walk("proportional", ["valve.area=20 mm^2", "valve.delay=5 ms", "supply.pressure=60 psi_g"])
    assert changed.controller.nominal_supply_pressure == changed.device.supply.pressure
    assert (changed.controller.nominal_delay, changed.controller.nominal_lag) == (0.005, 0.0)
    given = load_walk("solenoid", ["supply.pressure=60 psi_g", "controller.nominal_supply_pressure=50 psi_g"])
    assert given.controller.nominal_supply_pressure == pytest.approx(SUPPLY)


def test_a_valve_that_is_not_known_leaves_the_observer_off() -> None:
    off = PAIR._replace(nominal_flow=0.0)
    state = observer.next_observer(off, observer.START, STANDS, ROOM, ROOM, STANDS, 4.0e5, 4.0e5, PERIOD)
    assert state == observer.START
    assert observer.found_cause(off, state, STANDS, 4.0e5, 4.0e5, PERIOD) == fault_flags.NOT_RAISED


def found(nominal: NominalDevice, real: NominalDevice, commands: list[float], shown: float | None = None) -> float:
    """The first flag while a real device follows commands at a still angle; chamber 2 may show one pressure [Pa]."""
    volume_1, volume_2 = volumes(real, STANDS)
    content_1, content_2 = ROOM * volume_1, ROOM * volume_2
    state, cause = observer.START, fault_flags.NOT_RAISED
    last = (ROOM, ROOM)
    for command in commands:
        now = (content_1 / volume_1, shown or content_2 / volume_2)
        state = observer.next_observer(nominal, state, STANDS, *last, STANDS, *now, PERIOD)
        cause = min(cause, observer.found_cause(nominal, state, STANDS, *now, PERIOD))
        state, last = state._replace(command=command), now
        to_1 = SUPPLY if command == 1.0 else ROOM
        to_2 = real.nominal_dorsiflexion_pressure if command == -1.0 else ROOM
        if nominal.nominal_pair or command in (1.0, -1.0, VENT):
            content_1 += PERIOD * observer.flow_into(real, content_1 / volume_1, to_1, 1.0)
            content_2 += PERIOD * observer.flow_into(real, content_2 / volume_2, to_2, 1.0)
    return cause


FILLS = [VENT] * 20 + [-1.0] * 300 + [VENT] * 400


@pytest.mark.parametrize("nominal", [PAIR, SPOOL])
def test_a_device_that_is_a_little_different_gives_no_sign(nominal: NominalDevice) -> None:
    for flow in (0.85, 1.0, 1.15):
        for supply in (0.95, 1.0, 1.05):
            real = nominal._replace(
                nominal_flow=flow * 1.1 * nominal.nominal_flow, nominal_dorsiflexion_pressure=supply * SUPPLY
            )
            assert found(nominal, real, FILLS) == fault_flags.NOT_RAISED


@pytest.mark.parametrize("nominal", [PAIR, SPOOL])
@pytest.mark.parametrize("dead", [0.5, 2.0])
def test_a_dead_volume_of_half_or_twice_what_is_believed_gives_no_sign(nominal: NominalDevice, dead: float) -> None:
    # The vane of the paper: its dead volumes are most of its chambers.
    mostly_dead = nominal._replace(
        nominal_displacement_per_radian=14.51e-6, nominal_dead_volume_1=36.0e-6, nominal_dead_volume_2=36.0e-6
    )
    real = mostly_dead._replace(nominal_dead_volume_1=dead * 36.0e-6, nominal_dead_volume_2=dead * 36.0e-6)
    assert found(mostly_dead, real, FILLS) == fault_flags.NOT_RAISED
    assert found(real, mostly_dead, FILLS) == fault_flags.NOT_RAISED


@pytest.mark.parametrize("nominal", [PAIR, SPOOL])
def test_a_supply_a_third_too_high_is_found_once_the_chamber_is_full(nominal: NominalDevice) -> None:
    high = nominal._replace(nominal_dorsiflexion_pressure=4.0 / 3.0 * SUPPLY)
    assert found(nominal, high, [VENT] * 20 + [-1.0] * 2000) == fault_flags.SUPPLY_HIGH


@pytest.mark.parametrize("nominal", [PAIR, SPOOL])
@pytest.mark.parametrize(
    ("pressure", "flag"),
    [(1.9 * SUPPLY, fault_flags.SUPPLY_HIGH), (0.45 * SUPPLY, fault_flags.SUPPLY_LOW), (ROOM, fault_flags.SUPPLY_LOST)],
)
def test_a_supply_that_is_not_as_it_should_be_is_named(nominal: NominalDevice, pressure: float, flag: float) -> None:
    assert found(nominal, nominal._replace(nominal_dorsiflexion_pressure=pressure), FILLS) == flag


def test_gas_that_comes_or_stays_where_the_valve_vents_is_named() -> None:
    assert found(PAIR, PAIR, FILLS, 4.3e5) == fault_flags.VALVE_OPEN
    closes = PAIR._replace(nominal_flow=1.0e-9)
    half = [-1.0] * 60 + [VENT] * 200
    volume = volumes(PAIR, STANDS)[1]
    state, content, cause = observer.START, ROOM * volume, fault_flags.NOT_RAISED
    for command in half:
        now = (ROOM, content / volume)
        state = observer.next_observer(PAIR, state, STANDS, *now, STANDS, *now, PERIOD)
        cause = min(cause, observer.found_cause(PAIR, state, STANDS, *now, PERIOD))
        state = state._replace(command=command)
        real = PAIR if command == -1.0 else closes
        content += PERIOD * observer.flow_into(real, content / volume, SUPPLY if command == -1.0 else ROOM, 1.0)
    assert cause == fault_flags.VALVE_SHUT


def test_a_closed_chamber_that_loses_gas_leaks() -> None:
    volume = volumes(SPOOL, STANDS)[1]
    state, content, cause = observer.START, ROOM * volume, fault_flags.NOT_RAISED
    for command in [-1.0] * 300 + [0.0] * 200:
        now = (ROOM, content / volume)
        state = observer.next_observer(SPOOL, state, STANDS, *now, STANDS, *now, PERIOD)
        cause = min(cause, observer.found_cause(SPOOL, state, STANDS, *now, PERIOD))
        state = state._replace(command=command)
        leak = 0.4 if command == 0.0 else 1.0
        content += leak * PERIOD * observer.flow_into(SPOOL, content / volume, SUPPLY if command else ROOM, 1.0)
    assert cause == fault_flags.LEAK


def test_no_movement_of_the_ankle_changes_a_content() -> None:
    state = observer.START._replace(command=0.0)
    for angle in (STANDS, FLEXES, math.radians(129.0), STANDS):
        volume_1, volume_2 = volumes(SPOOL, angle)
        first, second = ROOM * volumes(SPOOL, STANDS)[0], 3.0 * ROOM * volumes(SPOOL, STANDS)[1]
        now = (first / volume_1, second / volume_2)
        state = observer.next_observer(SPOOL, state, angle, *now, angle, *now, PERIOD)
        assert state.chamber_2.content == pytest.approx(second)
        assert state.chamber_2.contrary == 0.0


FOUR_STAIRS = """schema_version = 1
name = "four-stairs"

[[segment]]
kind = "walk"
strides = 4

[[segment]]
kind = "stairs"
strides = 4
"""


@pytest.mark.parametrize("name", ["solenoid", "proportional"])
def test_who_climbs_stairs_at_the_speed_of_the_gait_is_not_stopped(name: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    file = tmp_path / "four-stairs.toml"
    file.write_text(FOUR_STAIRS)
    climbed = walk(load_walk(name, task_sequence=file))
    assert climbed.status.is_completed
    assert climbed.events == (), [event.message for event in climbed.events]


def test_a_supply_that_is_higher_than_the_controller_believes_stops_within_two_strides() -> None:
    given = ["supply.pressure=120 psi_g", "controller.nominal_supply_pressure=50 psi_g"]
    scenario = load_walk("solenoid", [*given, "controller.nominal_dorsiflexion_pressure=50 psi_g"])
    found = walk(scenario, minutes=0.1)
    (event,) = found.events
    assert event.fault_flag is not None
    assert event.fault_flag.name == "supply_high"
    assert event.time < 2.0 * walk_of(scenario).gait.stride_time


def test_a_line_without_a_volume_or_a_droop_is_not_predicted_and_no_state_is_lost() -> None:
    whole = {"droop": 1.0, "largest_flow": 1.0e3, "volume": 1.0e-6}
    for missing in ("volume_2", "droop_1", "droop_2"):
        given = {f"{name}_{line}": value for name, value in whole.items() for line in (1, 2)}
        nominal = PAIR._replace(nominal_lines=SupplyLines(**{**given, missing: 0.0}, relieving=0.4))
        state = observer.next_observer(nominal, observer.START, STANDS, ROOM, ROOM, STANDS, ROOM, ROOM, PERIOD)
        assert (state.lines.mass_1, state.lines.mass_2) == (0.0, 0.0)
        assert observer.supplied(nominal, state.lines) == (SUPPLY, nominal.nominal_dorsiflexion_pressure)
