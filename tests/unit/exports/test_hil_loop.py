"""The plant at the wire in virtual time: what answers do, and what everything does that is no answer."""

import math
import random
from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError
from ppafo.exports.hil.loop import BROKEN, NOT_SOUND, SILENT, STOPPED, Bench, LogRow
from ppafo.exports.hil.pacing import LockStep, RealTime
from ppafo.exports.hil.plant import CompiledPlant, check_baud, plant_of
from ppafo.exports.hil.result import HardwareRun, longest_silence
from ppafo.exports.hil.run import run_plant
from ppafo.exports.hil.wire import OVER, VENTED, Answer, WireSample
from ppafo.loading import load_scenario
from ppafo.model.sensors import Measurement
from ppafo.model.valves.kind import VENT
from ppafo.parameters.device import Device
from ppafo.running import simulate
from ppafo.simulation.simulate import result_of
from tests.virtual_wire import (
    Fault,
    ProportionalLaw,
    ProportionalPartner,
    VirtualWire,
    answer_bytes,
    faults,
    undisturbed,
    with_sequence,
)

PERIOD = 1.0e-3
RUN = 4660
TASK = "torque-task-proportional"
SHORT = ("run.duration=0.2 s",)
AT_REST = ("initial.pressure_1=20 psi_g", "initial.pressure_2=20 psi_g")


@cache
def plant(*overrides: str, name: str = TASK) -> CompiledPlant:
    return plant_of(load_scenario(name, overrides or SHORT))


def run_on(wire: VirtualWire, made: CompiledPlant | None = None, **further: object) -> HardwareRun:
    pace = partial(RealTime, clock=wire.clock)
    return run_plant(made or plant(), wire, pace, run=RUN, **further)  # type: ignore[arg-type]


def rows_of(found: HardwareRun) -> tuple[LogRow, ...]:
    return found.traffic.rows


def replayed_is_same(found: HardwareRun) -> bool:
    """True where the log's commands, given to the lanes step by step, lead to the bits of the recording."""
    run = found.plant.run
    per_sample = run.steps_per_sample
    commands = np.repeat([row.command for row in rows_of(found)], per_sample)[: run.step_count]
    missing = run.step_count - len(commands)
    # Past the end of a stopped run the last command goes on; what comes of it is cut.
    outcome = replay(batch_of(run), StepInputs(np.append(commands, np.full(missing, commands[-1])), {}))
    again, first = result_of(found.plant.scenario, run, outcome).recording, found.result.recording
    count = len(first)
    return all(np.array_equal(again[name][:count], first[name]) for name in first.names)


@pytest.mark.parametrize("name", [TASK, "torque-task-slow-valve", "torque-task-solenoid"])
def test_a_controller_that_answers_in_time_decides_as_in_a_simulation(name: str) -> None:
    wire = VirtualWire(ProportionalPartner().answers)
    scenario = load_scenario(name, (*SHORT, "controller.rate=1 kHz"))
    found = run_on(wire, plant_of(scenario))
    wanted = simulate(scenario.controlled_by(ProportionalLaw())).recording
    assert found.is_good
    assert len(found.delays) - len(found.response_times) == 0
    assert found.delays == pytest.approx([0.0] * 200, abs=1e-12)
    assert found.response_times[1:] == pytest.approx([3.0e-4] * 199, abs=1e-12)
    for channel in wanted.names:
        assert np.array_equal(found.result.recording[channel], wanted[channel]), channel
    assert replayed_is_same(found)


def test_what_the_controller_is_shown_is_what_the_sensors_show() -> None:
    partner = ProportionalPartner()
    flawed = ("sensors.pressure_noise=300 Pa_d", "sensors.pressure_resolution=100 Pa_d", "sensors.delay=3 ms")
    made = plant(*SHORT, *flawed)
    found = run_on(VirtualWire(partner.answers), made)
    shown = np.array([sample.counts["pressure_1"] for sample in partner.seen[:200]])
    true = found.result.recording["pressure_1"][:200]
    assert set(shown % 100) == {0}
    away = shown[3:] - true[:-3]
    assert 200.0 < away.std() < 400.0
    assert abs(away.mean()) < 100.0
    assert [sample.sequence for sample in partner.seen[:200]] == list(range(200))
    assert [sample.time for sample in partner.seen[:200]] == [1000 * number for number in range(200)]


@pytest.mark.parametrize("name", [TASK, "torque-task-solenoid"])
def test_a_controller_that_falls_silent_for_20_ms_is_vented(name: str) -> None:
    partner = ProportionalPartner(silent_from=60)
    found = run_on(VirtualWire(partner.answers), plant("run.duration=1 s", *AT_REST, name=name))
    commands = [row.command for row in rows_of(found)]
    assert commands[59:79] == [partner.commands[59] / 1e6] * 20
    assert commands[79:] == [VENT] * (1000 - 79)
    assert found.traffic.vent_reason == SILENT
    assert found.traffic.vented_at == pytest.approx(0.079)
    assert not found.is_good
    assert longest_silence(rows_of(found)) == 1000 - 60
    atmosphere = found.plant.scenario.device.supply.atmospheric_pressure
    before = found.result.recording.between(0.0, 0.078)
    for chamber in ("pressure_1", "pressure_2"):
        assert found.result.recording[chamber][-1] == pytest.approx(atmosphere, rel=0.02)
    assert max(before["pressure_1"].max(), before["pressure_2"].max()) > 1.5 * atmosphere
    told = [sample for sample in partner.seen if sample.flags & VENTED]
    assert [sample.sequence for sample in told[:2]] == [80, 81]
    assert replayed_is_same(found)


def test_nineteen_missed_samples_vent_nothing_and_twenty_do() -> None:
    for missing, vents in ((19, False), (20, True)):
        partner = ProportionalPartner()
        lost = range(50, 50 + missing)
        wire = VirtualWire(lambda data, lost=lost, partner=partner: without(partner, data, lost))
        assert bool(run_on(wire).traffic.vent_reason) == vents


def without(partner: ProportionalPartner, data: bytes, lost: range) -> list[bytes]:
    answers = partner.answers(data)
    return [] if partner.seen[-1].sequence in lost else answers


def test_one_answer_again_and_again_does_not_keep_the_plant_from_venting() -> None:
    partner = ProportionalPartner()
    kept: list[bytes] = []

    def stuck(data: bytes) -> list[bytes]:
        kept.extend(partner.answers(data))
        return kept[:10][-1:]

    found = run_on(VirtualWire(stuck))
    assert found.traffic.vent_reason == SILENT
    assert found.traffic.vented_at == pytest.approx(0.029)
    assert found.traffic.ignored["repeated or out of order"] >= 190 - 10


def test_answers_that_are_always_30_ms_old_vent() -> None:
    found = run_on(VirtualWire(ProportionalPartner().answers, latency=0.030), patience=0.2)
    assert found.traffic.vent_reason == SILENT
    assert found.traffic.ignored["too late"] == 20


def test_a_controller_that_is_not_sound_is_vented_at_once_and_for_good() -> None:
    found = run_on(VirtualWire(ProportionalPartner(unsound_from=40).answers))
    assert found.traffic.vent_reason == NOT_SOUND
    assert [row.command == VENT for row in rows_of(found)] == [number >= 40 for number in range(200)]


@pytest.mark.parametrize(
    ("run", "shift", "why"),
    [
        (RUN + 1, 0, "of another run"),
        (RUN, 1, "with a sequence number not yet sent"),
        (RUN, -1, "repeated or out of order"),
    ],
)
def test_an_answer_to_something_else_does_nothing_but_be_counted(run: int, shift: int, why: str) -> None:
    partner = ProportionalPartner()

    def also(data: bytes) -> list[bytes]:
        answers = partner.answers(data)
        wrong = Answer(1, RUN, partner.seen[-1].sequence, 0, 1_000_000)  # it would open the valve, and vent
        return [with_sequence(answer_bytes(wrong), run, partner.seen[-1].sequence + shift), *answers] if answers else []

    wire = VirtualWire(also)
    calm = run_on(VirtualWire(ProportionalPartner().answers))
    found = run_on(wire)
    assert [row.command for row in rows_of(found)] == [row.command for row in rows_of(calm)]
    assert found.traffic.ignored[why] >= 198
    assert found.is_good


SHARES = st.sampled_from([0.0, 0.02, 0.2, 0.6, 1.0])


@pytest.mark.thorough
@settings(max_examples=8)
@given(st.builds(faults, SHARES, SHARES, SHARES, SHARES), st.integers(0, 2**32), st.booleans())
def test_no_disturbance_of_the_wire_crashes_or_holds_pressure(fault: Fault, seed: int, is_stream: bool) -> None:
    partner = ProportionalPartner()

    def after_the_start(draw: random.Random, arrival: float, data: bytes) -> list[tuple[float, bytes]]:
        return (fault if partner.seen[-1].sequence > 0 else undisturbed)(draw, arrival, data)

    made = plant("run.duration=0.12 s", *AT_REST)
    found = run_on(VirtualWire(partner.answers, fault=after_the_start, seed=seed, is_stream=is_stream), made)
    rows = rows_of(found)
    assert len(rows) == 120
    sent = {number: command / 1e6 for number, command in partner.commands.items()}
    for number, row in enumerate(rows):
        if row.is_vented:
            assert all(later.command == VENT for later in rows[number:])
            break
        # What acts is a command that was given less than 20 ms ago, and no older one than before.
        assert row.command in {sent[old] for old in range(max(0, number - 19), number + 1) if old in sent}
        if row.response_time is not None:
            assert row.command == sent[number]
    assert found.traffic.vent_reason in ("", SILENT)
    assert replayed_is_same(found)


def test_a_run_that_is_stopped_vents_and_its_log_is_whole() -> None:
    partner = ProportionalPartner()
    wire = VirtualWire(partner.answers)
    made = plant("run.duration=2 s", *AT_REST)
    found = run_on(wire, made, is_stopped=lambda: len(partner.seen) > 150)
    rows = rows_of(found)
    assert found.traffic.is_stopped
    assert found.traffic.vent_reason == STOPPED
    assert [row.sequence for row in rows] == list(range(len(rows)))
    vented = [row for row in rows if row.is_vented]
    assert len(vented) == 500
    assert all(row.delay is None and row.command == VENT for row in vented)
    assert found.result.recording.time[-1] == pytest.approx(rows[-1].due)
    assert found.result.recording["pressure_1"][-1] < found.result.recording["pressure_1"].max()
    assert [bool(sample.flags & OVER) for sample in partner.seen[-6:]] == [True] * 6
    assert replayed_is_same(found)
    assert len(found.delays) == len(rows) - 500


def test_a_computer_that_sleeps_makes_time_stand_still_and_blames_nobody() -> None:
    wire = VirtualWire(ProportionalPartner().answers)
    wire.sleeps = {80: 0.050}
    found = run_on(wire)
    assert found.is_good
    assert len(found.traffic.pauses) == 1
    assert found.traffic.pauses[0] == pytest.approx(0.049)
    assert max(found.delays) == pytest.approx(0.049)
    calm = run_on(VirtualWire(ProportionalPartner().answers))
    assert [row.command for row in rows_of(found)] == [row.command for row in rows_of(calm)]


def test_the_controller_is_called_until_it_answers_and_begins_anew_each_time() -> None:
    partner = ProportionalPartner()
    wire = VirtualWire(lambda data: partner.answers(data) if len(wire.sent) > 20 else [])
    found = run_on(wire)
    assert found.is_good
    assert partner.begun == 1
    assert len({data for data in wire.sent[:21]}) == 1


def test_where_nobody_answers_one_line_says_what_came_in() -> None:
    wire = VirtualWire(lambda _: [b"hello"])
    with pytest.raises(ScenarioError, match=r"^no controller answered within 0.05 s; received: \d+ stray bytes$"):
        run_on(wire, patience=0.05)


def test_an_interrupt_before_anybody_answers_is_an_interrupt() -> None:
    with pytest.raises(KeyboardInterrupt, match="no file was written"):
        run_on(VirtualWire(lambda _: []), is_stopped=lambda: True)


def test_in_lock_step_an_answer_may_take_any_time_below_the_patience() -> None:
    wire = VirtualWire(ProportionalPartner().answers, latency=0.5)
    found = run_plant(plant(), wire, lambda _: LockStep(clock=wire.clock), run=RUN)
    calm = run_on(VirtualWire(ProportionalPartner().answers))
    assert found.is_good
    assert [row.command for row in rows_of(found)] == [row.command for row in rows_of(calm)]
    assert not found.traffic.is_real_time
    assert "link.png" not in found.files()


def test_in_lock_step_nobody_is_waited_for_once_the_plant_is_vented() -> None:
    wire = VirtualWire(ProportionalPartner(silent_from=60).answers)
    start = wire.time
    found = run_plant(plant(), wire, lambda _: LockStep(clock=wire.clock), run=RUN)
    assert found.traffic.vent_reason == SILENT
    assert len(rows_of(found)) == 200
    assert wire.time - start == pytest.approx(20.0, abs=1.0)  # a second for each sample up to there


def test_in_lock_step_a_vented_controller_that_answers_is_listened_to() -> None:
    wire = VirtualWire(ProportionalPartner(unsound_from=40).answers)
    found = run_plant(plant(), wire, lambda _: LockStep(clock=wire.clock), run=RUN)
    assert found.traffic.vent_reason == NOT_SOUND
    assert rows_of(found)[40].response_time is not None


class BreakingWire(VirtualWire):
    """A wire that is pulled out after some samples."""

    def send(self, data: bytes) -> None:
        super().send(data)
        if len(self.sent) == 61:
            self.failure = "the serial port failed: it is gone"
            self.under_way.clear()


def test_a_wire_that_is_pulled_out_vents_at_once_and_the_log_goes_on() -> None:
    found = run_on(BreakingWire(ProportionalPartner().answers), plant(*SHORT, *AT_REST))
    assert found.traffic.vent_reason == BROKEN
    assert found.traffic.vented_at == pytest.approx(0.060)
    assert len(rows_of(found)) == 200
    assert found.text().endswith("port       the serial port failed: it is gone")
    assert replayed_is_same(found)


class FloodedWire(VirtualWire):
    """A wire on which something sends without end once the run has begun; a packet takes a microsecond to read."""

    def receive(self, timeout: float) -> bytes:
        if len(self.sent) < 30:
            return super().receive(timeout)
        self.time += 1.0e-6
        return b"again and again"


def test_a_flood_does_not_hold_the_plant() -> None:
    found = run_on(FloodedWire(ProportionalPartner().answers), plant("run.duration=0.06 s", *AT_REST))
    assert len(rows_of(found)) == 60
    assert found.traffic.vent_reason == SILENT
    assert found.traffic.pauses == ()


class LeavingPlant:
    """A plant whose pressure is no number after some samples."""

    samples = 50

    def __init__(self) -> None:
        self.sample = 0
        self.reference = 1.0

    def measurement(self) -> Measurement:
        return Measurement(1.0, math.nan if self.sample >= 7 else 2.0e5, 1.0e5, 0.0)

    def advance(self, command: float) -> None:
        self.sample += 1


def test_a_plant_that_leaves_what_is_possible_ends_the_run() -> None:
    partner = ProportionalPartner()
    wire = VirtualWire(partner.answers)
    bench = Bench(LeavingPlant(), PERIOD, wire, RealTime(PERIOD, wire.clock), RUN)  # type: ignore[arg-type]
    found = bench.run(1.0, lambda: False)
    assert len(found.rows) == 7
    assert not found.is_stopped
    assert all(isinstance(sample, WireSample) and sample.counts["pressure_1"] == 200_000 for sample in partner.seen)
    assert partner.seen[-1].flags & OVER


def test_log_document_and_figure_say_what_happened() -> None:
    found = run_on(VirtualWire(ProportionalPartner(silent_from=100).answers), plant(*SHORT, *AT_REST))
    contents = found.files()
    assert set(contents) == {"log.csv", "link.json", "link.png", "link.svg", "until-vented.csv"}
    lines = contents["log.csv"].decode().splitlines()
    assert len(lines) == 201
    assert lines[101].split(",")[3] == ""
    assert lines[200].split(",")[-1] == "1"
    document = found.document()
    assert (document["samples"], document["answered"], document["missed"]) == (200, 100, 100)
    assert document["vented_at"] == pytest.approx(0.119)
    assert document["longest_silence"] == pytest.approx(0.1)
    assert "VENTED     at 0.119 s: no answer for 20 ms" in found.text()
    last = contents["until-vented.csv"].decode().splitlines()[-1]
    assert float(last.split(",")[0]) == pytest.approx(0.118)


def test_a_walk_is_refused_whose_controller_reads_forces_that_the_wire_does_not_carry() -> None:
    with pytest.raises(
        ScenarioError,
        match="'proportional' is a walk, but the hardware-in-the-loop link transmits no ground reaction forces",
    ):
        plant_of(load_scenario("proportional"))


@pytest.mark.parametrize("rate", [49, 2001])
def test_a_rate_out_of_range_is_refused(rate: int) -> None:
    with pytest.raises(ScenarioError, match=f"^rate {rate}: must be 50 to 2000"):
        plant_of(load_scenario(TASK), rate)


def test_a_line_that_is_too_slow_is_refused() -> None:
    check_baud(440_000, 1000)
    with pytest.raises(ScenarioError, match=r"^baud 115200: 1000 samples per second need 440000 baud; .* 261 or less$"):
        check_baud(115_200, 1000)


def test_twenty_milliseconds_are_four_samples_at_200_a_second() -> None:
    made = plant_of(load_scenario(TASK, SHORT), 200)
    found = run_on(VirtualWire(ProportionalPartner(silent_from=20).answers), made)
    assert found.traffic.vented_at == pytest.approx(0.115)
    assert isinstance(found.plant.scenario.device, Device)
