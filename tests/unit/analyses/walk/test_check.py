"""A walk whose torque loop oscillates fails a check, and is said without one."""

from ppafo.analyses.walk.question import walk_with_and_without

TURNS = ("controller.torque_gain=5 1/(N m)", "valve.delay=8 ms")


def test_a_walk_whose_torque_loop_oscillates_fails_a_check_only() -> None:
    plain, judged, sound = (
        walk_with_and_without("proportional", minutes=0.1, overrides=given, check=check)
        for given, check in ((TURNS, False), (TURNS, True), ((), True))
    )
    assert "the torque loop oscillates" in str(plain)
    assert plain.passed
    assert not judged.passed
    assert sound.passed


def test_a_walk_that_its_bottle_ends_has_not_passed_and_says_so_first() -> None:
    ended = walk_with_and_without(
        "solenoid-regulators", minutes=0.3, overrides=("bottle.fill=0.04",), bottle="paper-co2-9oz"
    )
    status = ended.found["status"]
    assert not ended.passed
    assert status["kind"] == "ended early"
    assert ended.said[0].startswith("solenoid-regulators: ended early, ")
    assert ended.said[1] == f"solenoid-regulators: {status['message']}"
    assert ended.said[1].startswith(f"solenoid-regulators: ended after {status['time']:.6g} of 18 s: the bottle is ")
    assert ended.said[2].startswith("until then the device helps")
