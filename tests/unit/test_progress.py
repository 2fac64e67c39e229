"""The progress line: share, rate, time left, failures, and how often it is said."""

import io

from ppafo.progress import Progress, ProgressLine


def test_the_line_has_share_rate_time_left_and_failures() -> None:
    line = Progress(total=1_000_000, done=300_000, earlier=100_000, failed=12, elapsed=8.0).line()
    assert line == "300,000 of 1,000,000 runs (30 %), 25,000 runs/s, 28 s left, 12 failed"


class Terminal(io.StringIO):
    """A stream that somebody watches."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_one_line_that_is_written_over() -> None:
    stream = Terminal()
    line = ProgressLine(stream)
    for done in (1, 2, 3):
        line(Progress("", done, 3, 0, 0, 1.0))
    line.close()
    line.close()
    assert stream.getvalue().count("\r") == 3
    assert stream.getvalue().count("\n") == 1


def test_a_file_gets_a_line_now_and_then_and_the_last_one() -> None:
    stream, now = io.StringIO(), [0.0]
    line = ProgressLine(stream, lambda: now[0])
    for done in range(1, 31):
        now[0] += 1.0
        line(Progress("", done, 30, 0, 0, now[0]))
    line.close()
    said = stream.getvalue().splitlines()
    assert [text.split(" of ")[0] for text in said] == [f"ppafo: {done}" for done in (1, 6, 11, 16, 21, 26, 30)]
