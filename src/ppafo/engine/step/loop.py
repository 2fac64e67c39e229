"""Time-stepping loop for many independent runs at once."""

from collections.abc import Iterator
from typing import Any, Protocol

from ppafo.engine.program import Program
from ppafo.engine.step import meters, phases, sample
from ppafo.engine.step.lane import MAXIMUM_PARTS, SAME_MOMENT, Lane, Now


class Lanes(Protocol):
    """Runs of a block, with the arrays of records and of delayed values."""

    records: Any
    signal_history: Any
    command_history: Any
    trace: Any

    def __iter__(self) -> Iterator[Lane]:
        """Iterate over the runs."""

    def record(self, index: int) -> None:
        """Store the state of all runs as a recorded sample."""

    def set_aside(self) -> None:
        """Save the data of waiting runs: their state, and the values passed from the previous step."""

    def put_back(self) -> None:
        """Restore the saved data of runs whose step was already complete."""

    def traces(self, index: int, trace_every: int) -> bool:
        """Return whether a sample is traced."""

    def slot(self, index: int, trace_every: int) -> int:
        """Return the index of a sample in the trace, a ring buffer of the last samples."""


def advance(
    parts: Program,
    lanes: Lanes,
    first_step: int,
    step_count: int,
    steps_in_all: int,
    steps_per_sample: int,
    interval: float,
    last_record: int,
    next_record: int,
    trace_every: int,
    signal_delay: int,
    command_delay: int,
) -> None:
    """Advance all runs of a block by some steps, including the samples that are due."""
    if parts.hands_chambers_on:
        for lane in lanes:
            phases.hold_chambers(parts, lane)
    if parts.leg is not None:
        for lane in lanes:
            parts.leg.carry(parts, lane)
    # Samples without room in the record are not kept where neither meters nor traces read them.
    last = last_record if parts.takes_samples else lanes.records.shape[0] - 1
    due = next_record * interval
    beyond = first_step + step_count
    # The sample at the end of the run is a step that is not done.
    for step in range(first_step, beyond + 1 if beyond == steps_in_all else beyond):
        now = Now(
            step=step,
            sample=step // steps_per_sample,
            goal=1.0,
            early_command=(step - command_delay - 1) % lanes.command_history.shape[0] if parts.late_commands else 0,
            late_command=(step - command_delay) % lanes.command_history.shape[0] if parts.late_commands else 0,
            late_signal=(step - signal_delay) % lanes.signal_history.shape[1] if parts.late_signals else 0,
            next_signal=(step + 1) % lanes.signal_history.shape[1] if parts.late_signals else 0,
        )
        if step < beyond:
            begin_step(parts, lanes, now, steps_per_sample)
        reached = 0.0
        while reached < 1.0:
            if next_record <= last and due <= step + reached + SAME_MOMENT:
                take_sample(parts, lanes, step + reached, next_record, interval, last_record, trace_every)
                next_record += 1
                due = next_record * interval
            if step == beyond:
                break
            if parts.samples_inside:
                is_inside = next_record <= last and due < step + (1.0 - SAME_MOMENT)
                now = now._replace(goal=due - step if is_inside else 1.0)
            if parts.is_parted:
                do_parts(parts, lanes, now)
            else:
                do_step(parts, lanes, now)
            reached = now.goal


def begin_step(parts: Program, lanes: Lanes, now: Now, steps_per_sample: int) -> None:
    """Read sensors and compute commands if a controller sample is due, and store delayed values."""
    if parts.late_signals and now.step == 0:
        for slot in range(lanes.signal_history.shape[1]):
            for lane in lanes:
                sample.fill_signals(parts, lane, slot)
    if parts.controller is not None and now.step % steps_per_sample == 0:
        for lane in lanes:
            sample.control(parts, lane, now)
    if parts.late_commands:
        slot = now.step % lanes.command_history.shape[0]
        for lane in lanes:
            sample.remember_command(parts, lane, slot)
    if parts.is_parted:
        for lane in lanes:
            phases.begin_step(parts, lane)


def take_sample(
    parts: Program,
    lanes: Lanes,
    elapsed: float,
    index: int,
    interval: float,
    last_record: int,
    trace_every: int,
) -> None:
    """Record the sample ``elapsed`` steps after the start; without records, update meters and traces."""
    if not parts.takes_samples:
        lanes.record(index)
    if parts.follows_reference and index == 0:
        summarise_reference(parts, lanes, interval, last_record)
    if parts.meters:
        if index == 0:
            for lane in lanes:
                meters.start_meters(parts, lane, elapsed, index, interval)
        else:
            if parts.cuts_reference:
                for lane in lanes:
                    meters.update_course(parts, lane, elapsed, index, interval)
                # Few samples begin a part.
                if any(lane.course.is_new > 0.0 for lane in lanes):
                    for lane in lanes:
                        meters.end_parts(parts, lane)
            for lane in lanes:
                meters.update_meters(parts, lane, elapsed, index, interval)
    if parts.traced and lanes.traces(index, trace_every):
        # A name of its own: what is not used is dropped by its name, and the caller has another ``slot``.
        trace_slot = lanes.slot(index, trace_every)
        for lane in lanes:
            meters.store_trace(parts, lane, elapsed, index, interval, trace_slot)


def summarise_reference(parts: Program, lanes: Lanes, interval: float, last_record: int) -> None:
    """Evaluate the whole reference before the first sample: final value, largest value, and start of the final hold."""
    for lane in lanes:
        meters.begin_reference_summary(parts, lane, interval, last_record)
    # A monotone one is largest at one of its ends, and where its hold starts shows on the way. The sample is no
    # ``index``: this text is inserted into that of the caller, who needs his own ``index`` afterwards.
    if not parts.reference.is_monotone:
        for number in range(last_record):
            for lane in lanes:
                meters.update_largest_reference(parts, lane, interval, number)
        for number in range(last_record - 1, -1, -1):
            for lane in lanes:
                meters.search_final_hold(parts, lane, interval, number)
            # The search ends as soon as every lane has found its hold.
            if not any(lane.course.hold_start == 0.0 for lane in lanes):
                break


def do_parts(parts: Program, lanes: Lanes, now: Now) -> None:
    """Do a step in as many parts as needed.

    All runs of a block take as many parts as the run with the most parts.
    """
    for part in range(MAXIMUM_PARTS):
        for lane in lanes:
            phases.measure_part(parts, lane, now)
        # Never in the first part: a select for each row takes longer.
        if parts.parts_are_rare and part > 0:
            lanes.set_aside()
        do_step(parts, lanes, now)
        if parts.parts_are_rare and part > 0:
            lanes.put_back()
        if not any(lane.remaining > 0.0 for lane in lanes):
            break
    else:
        for lane in lanes:
            phases.give_up(parts, lane, now)


def do_step(parts: Program, lanes: Lanes, now: Now) -> None:
    """Do the phases of a step or part.

    Each phase is a short loop over all runs, so that the processor works on several runs at once. The processor looks
    some hundred instructions ahead, and a division or square root waits for the previous one of the same run.
    """
    if parts.leg is not None:
        lead_walk(parts, lanes, now)
    for lane in lanes:
        phases.open_valve(parts, lane, now)
    for lane in lanes:
        phases.begin_gas(parts, lane, now)
    for lane in lanes:
        phases.pass_gas(parts, lane, now)
    if parts.angle is None:
        for lane in lanes:
            phases.feed_gas(parts, lane)
    if parts.leg is not None:
        for lane in lanes:
            parts.leg.reach(parts, lane)
        # Most steps need this in no lane.
        if any(lane.ended.departs > 0.0 for lane in lanes):
            for lane in lanes:
                parts.leg.depart(parts, lane)
    elif parts.angle is None:
        for lane in lanes:
            phases.slide(parts, lane, now)
        if any(lane.slid.departs > 0.0 for lane in lanes):
            for lane in lanes:
                phases.depart(parts, lane)
    for lane in lanes:
        phases.finish(parts, lane, now)


def lead_walk(parts: Program, lanes: Lanes, now: Now) -> None:
    """Set the gait at the end of the step, and the predicted motion of the foot."""
    assert parts.leg is not None, "a leg walks"
    for lane in lanes:
        parts.leg.find_place(parts, lane, now)
    for lane in lanes:
        parts.leg.find_measured(parts, lane)
    for lane in lanes:
        parts.leg.find_gait(parts, lane)
    for lane in lanes:
        parts.leg.begin(parts, lane)
