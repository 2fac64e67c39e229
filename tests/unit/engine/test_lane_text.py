"""The text of a lane loop says no more than what is needed."""

from ppafo.engine.components import RarePhase
from ppafo.engine.lane_rows import FIRST_CACHE, LANES, VECTOR, LaneRows, lanes_of, over_lanes
from ppafo.engine.source_text import SourceCollector
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import with_duration
from ppafo.walking.planning import plan_walk


def test_loads_that_nothing_asks_for_are_left_out_and_what_others_need_stays() -> None:
    lines = [
        "plant = Plant(x[1, lane], Box(x[2, lane]))",
        "state = State(x[3, lane])",
        "walk = Walk(x[4, lane])",
        "empty = ()",
        "part = wrap(state)",
        "length = 2.0 * state.angle",
        "x[5, lane] = plant.mass",
    ]
    assert over_lanes(lines) == [
        "for lane in range(width):",
        "    plant = Plant(x[1, lane], Box(x[2, lane]))",
        "    state = State(x[3, lane])",
        "    length = 2.0 * state.angle",
        "    x[5, lane] = plant.mass",
    ]


def test_load_that_is_made_anew_from_itself_stays() -> None:
    lines = ["state = State(x[1, lane])", "state = moved(state)", "x[1, lane] = state.angle"]
    assert over_lanes(lines)[1:] == [f"    {line}" for line in lines]


def test_line_that_gathers_over_the_lanes_for_what_follows_the_loop_stays() -> None:
    lines = ["reference = Profile(x[1, lane])", "earliest = min(earliest, x[2, lane])"]
    assert over_lanes(lines) == ["for lane in range(width):", "    earliest = min(earliest, x[2, lane])"]


def test_blocks_are_as_large_as_the_first_cache_allows_and_never_less_than_a_vector() -> None:
    task = plan_run(load_scenario("torque-task-solenoid")).program
    walk = plan_walk(with_duration(load_walk("solenoid"), 6.0)).program
    assert (lanes_of(task), lanes_of(walk)) == (LANES, VECTOR)
    rows = LaneRows(walk, SourceCollector("")).aside
    assert 8 * VECTOR * rows <= FIRST_CACHE < 8 * 2 * VECTOR * rows


def test_a_rare_phase_is_passed_over_where_no_lane_needs_it() -> None:
    rows = LaneRows(plan_run(load_scenario("step-response")).program, SourceCollector(""))
    text = "\n".join(rows.over_phases([], [["x[1, lane] = 1.0"], RarePhase(["x[2, lane] = 3.0"], "x[0, lane]")]))
    for needed, left in (([0.0, 0.0], [2.0, 2.0]), ([0.0, 1.0], [3.0, 3.0])):
        cells = {(row, lane): value for lane, first in enumerate(needed) for row, value in enumerate((first, 0.0, 2.0))}
        exec(text, {"x": cells, "width": 2})
        assert [cells[2, lane] for lane in range(2)] == left
        assert [cells[1, lane] for lane in range(2)] == [1.0, 1.0]
