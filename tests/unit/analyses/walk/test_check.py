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
