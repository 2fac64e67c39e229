"""Time of a plant on a link: real time, or simulated time in lock step with the answers."""

import time
from collections.abc import Callable
from typing import final

from ppafo.exports.hil.ports import Port

_MOST_PACKETS = 64
"""Maximum number of packets processed without checking the clock, so that a flood of packets cannot block the plant."""

TakeBytes = Callable[[bytes], bool]
"""Function that processes received bytes and returns True if the awaited packet has arrived."""


def listen_for(seconds: float, clock: Callable[[], float], port: Port, take: TakeBytes) -> None:
    """Pass received data to ``take`` for some seconds of a clock, or until ``take`` returns True.

    Data received while the computer was suspended past the end is passed too.
    """
    end = clock() + seconds
    while (remaining := end - clock()) > 0.0:
        data = port.receive(remaining)
        if data and take(data):
            return
    _drain(port, take)


def _drain(port: Port, take: TakeBytes) -> None:
    """Pass data already received to ``take``, up to a limited number of packets."""
    for _ in range(_MOST_PACKETS):
        data = port.receive(0.0)
        if not data:
            return
        take(data)


@final
class RealTime:
    """Real time; plant time is paused while the computer is suspended for more than a period.

    ``clock`` returns the time [s].
    """

    is_real = True

    def __init__(self, period: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self.pauses: list[float] = []
        self.clock = clock
        self._period = period
        self._start = clock()

    def begin(self) -> None:
        """Set the time to zero now."""
        self._start = self.clock()

    def now(self) -> float:
        """Time [s] since the start, without pauses."""
        return self.clock() - self._start

    def delay(self, due: float) -> float:
        """Return the delay [s] with respect to a due time [s]; a delay above one period pauses the time."""
        delay = max(0.0, self.now() - due)
        # Less than a period late is jitter, which the next sample makes up; more would be made up by a burst of
        # samples.
        if delay > self._period:
            self.pauses.append(delay)
            self._start += delay
        return delay

    def listen(self, until: float, port: Port, take: TakeBytes) -> None:
        """Pass received data to ``take`` until the time ``until`` [s], or until ``take`` returns True."""
        listen_for(until - self.now(), self.clock, port, take)

    def rest(self, until: float, port: Port, take: TakeBytes) -> None:
        """Pass received data to ``take`` until the time ``until`` [s]."""
        while (remaining := until - self.now()) > 0.0:
            data = port.receive(remaining)
            if data:
                take(data)


@final
class LockStep:
    """Simulated time that waits for each answer, at most for ``patience`` [s] of a clock."""

    is_real = False

    def __init__(self, patience: float = 1.0, clock: Callable[[], float] = time.perf_counter) -> None:
        self.pauses: list[float] = []
        self.clock = clock
        self._patience = patience
        self._now = 0.0

    def begin(self) -> None:
        """Set the time to zero."""
        self._now = 0.0

    def now(self) -> float:
        """Time [s] of the current sample."""
        return self._now

    def delay(self, due: float) -> float:
        """Advance to a due time [s]; the delay is always 0."""
        self._now = due
        return 0.0

    def listen(self, until: float, port: Port, take: TakeBytes) -> None:
        """Pass received data to ``take`` until it returns True, at most for ``patience`` [s]."""
        del until
        listen_for(self._patience, self.clock, port, take)

    def rest(self, until: float, port: Port, take: TakeBytes) -> None:
        """Pass data already received to ``take``."""
        del until
        _drain(port, take)


LoopPacing = RealTime | LockStep
"""Time stepping of the plant: real time or lock step; ``is_real`` if times are meaningful."""
