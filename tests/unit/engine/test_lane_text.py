"""The text of a lane loop: how many lanes a block has, and what a rare phase costs where no lane needs it."""

import ast
import re
from dataclasses import replace
from typing import Any

import pytest

from ppafo.engine.generator import StepText
from ppafo.engine.lane_rows import FIRST_CACHE, LANES, VECTOR, lanes_of
from ppafo.engine.loop_rows import RowsOfLanes, RowsOfRun
from ppafo.engine.loop_text import LoopText, _unparsed
from ppafo.engine.program import Program
from ppafo.engine.reduction import Definition
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step import meters, phases, sample
from ppafo.engine.step.lane import Lane
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import with_duration
from ppafo.walking.planning import plan_walk
from tests.composed_programs import lane_source


def test_blocks_are_as_large_as_the_first_cache_allows_and_never_less_than_a_vector() -> None:
    task = plan_run(load_scenario("torque-task-solenoid")).program
    walk = plan_walk(with_duration(load_walk("solenoid"), 6.0)).program
    assert (lanes_of(task), lanes_of(walk)) == (LANES, 2 * VECTOR)
    rows = RowsOfLanes(StepText(walk, SourceCollector(""))).aside
    assert 8 * 2 * VECTOR * rows <= FIRST_CACHE < 8 * 4 * VECTOR * rows


def test_a_phase_loads_the_groups_that_it_asks_for_and_stores_what_it_changes() -> None:
    text = lane_source(plan_run(load_scenario("torque-task-proportional")).program)
    first = text[text.index("def advance") :]
    held = first[first.index("for lane in range(width):\n        plant") :].split("for step in")[0]
    assert "engine_step_phases_hold_chambers(plant, state)" in held
    assert "timing" not in held
    # Of the result of a run a step changes one number.
    finished = first[first.index("after_finish = ") :]
    assert len(re.findall(r"= after_finish\.result\.", finished)) == 1


def passed_over(parts: Program, lanes: Any) -> None:
    """A loop with a phase that few lanes need."""
    if any(lane.slid.departs > 0.0 for lane in lanes):
        for lane in lanes:
            phases.begin_step(parts, lane)


def test_a_rare_phase_is_passed_over_where_no_lane_needs_it() -> None:
    step = StepText(plan_run(load_scenario("step-response")).program, SourceCollector(""))
    rows = RowsOfLanes(step)
    asked, (row_of_before,) = rows.step_at["slid.departs"], [rows.step_at["before"]]
    text = "\n".join(_unparsed(LoopText({rows: step}, passed_over).lines()))
    assert isinstance(Lane(), Lane)
    for needed, left in (([0.0, 0.0], [2.0, 2.0]), ([0.0, 1.0], [0.0, 0.0])):
        cells = {(asked, lane): value for lane, value in enumerate(needed)}
        cells |= {(row_of_before, lane): 2.0 for lane in range(2)}
        scope: dict[str, Any] = {"x": cells, "width": 2}
        exec("\n".join([step.collector.text(), text]), scope)
        assert [cells[row_of_before, lane] for lane in range(2)] == left


def remembered(parts: Program, lanes: Any) -> None:
    """A loop whose only phase sets one number of a history, and nothing else."""
    for lane in lanes:
        sample.remember_command(parts, lane, 1)


def test_a_phase_with_a_single_result_stores_it_in_its_history_for_one_run_as_for_many() -> None:
    program = plan_run(load_scenario("torque-task-slow-valve")).program
    for rows_of in (RowsOfLanes, lambda step: RowsOfRun(step, "outputs")):
        step = StepText(program, SourceCollector(""))
        text = "\n".join(_unparsed(LoopText({rows_of(step): step}, remembered).lines()))
        assert re.search(r"^ *command_history\[1, (lane|0)\] = new_command$", text, re.MULTILINE), text


def shown(parts: Program, lanes: Any) -> None:
    """A loop that shows one sample."""
    for lane in lanes:
        meters.store_trace(parts, lane, 0.0, 0, 1.0, 0)


@pytest.mark.parametrize("channels", [("torque",), ("torque", "angle")])
def test_a_single_run_shows_its_sample_with_one_channel_as_with_several(channels: tuple[str, ...]) -> None:
    step = StepText(replace(plan_run(load_scenario("step-response")).program, traced=channels), SourceCollector(""))
    text = "\n".join(_unparsed(LoopText({RowsOfRun(step, "outputs"): step}, shown).lines()))
    assert "samples.before = samples.last" in text
    (values,) = re.findall(r"samples\.last = outputs\(0\.0, ([\w., ]+)\)", text)
    assert len(values.split(", ")) == len(channels)


@pytest.mark.parametrize(
    "text", ["[part + x for x in 'ab']", "{part + x for x in 'ab'}", "{part + x: 1 for x in 'ab'}"]
)
def test_a_comprehension_of_any_form_sees_the_names_that_are_known(text: str) -> None:
    (function,) = ast.parse(f"def found(parts): return {text}").body
    assert isinstance(function, ast.FunctionDef)
    (line,) = function.body
    assert isinstance(line, ast.Return)
    assert line.value is not None
    definition = Definition(function)
    assert definition.read_in(line.value) == {"part"}
    assert set(definition.value(line.value, {}, {"part": "heel"})) == {"heela", "heelb"}
