"""The text of a lane loop says no more than what is needed."""

from ppafo.engine.lane_rows import over_lanes


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
