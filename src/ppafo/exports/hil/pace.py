"""How the plant's time goes on: as it goes by, or in lock step with the answers; and what keeps a run undisturbed."""

import gc
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, final

from ppafo.exports.hil.ports import Port

_AT_ONCE = 64
"""Packets that are taken without a look at the clock: whoever sends without end must not hold the plant."""
Take = Callable[[bytes], bool]
"""Takes what came in, and says whether what is waited for is there."""


class Pace(Protocol):
    """How the plant's time goes on."""

    stood_still: list[float]

    @property
    def is_real(self) -> bool:
        """True where times mean something."""

    def begin(self) -> None:
        """Let time begin."""

    def now(self) -> float:
        """Time [s] since the beginning."""

    def late(self, due: float) -> float:
        """By how much a time [s] that was listened for has been missed [s]."""

    def call(self, seconds: float, port: Port, take: Take) -> None:
        """Hand over what comes in for some seconds, or until what is waited for is there."""

    def listen(self, until: float, port: Port, take: Take) -> None:
        """Hand over what comes in until a time [s], or until what is waited for is there."""

    def rest(self, until: float, port: Port, take: Take) -> None:
        """Hand over what comes in until a time [s]."""


def _listen(seconds: float, clock: Callable[[], float], port: Port, take: Take) -> None:
    """Hand over what comes in for some seconds of a clock, or until ``take`` has what it waits for.

    What has come in while the computer slept through the end is handed over too.
    """
    end = clock() + seconds
    while (left := end - clock()) > 0.0:
        data = port.receive(left)
        if data and take(data):
            return
    _drain(port, take)


def _drain(port: Port, take: Take) -> None:
    """Hand over what has come in, or as much as a plant can wait for."""
    for _ in range(_AT_ONCE):
        data = port.receive(0.0)
        if not data:
            return
        take(data)


@final
class RealTime:
    """Time as it goes by. Where the computer sleeps through a whole period, the plant's time stands still for so long.

    ``clock`` tells seconds.
    """

    is_real = True

    def __init__(self, period: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self.stood_still: list[float] = []
        self._period = period
        self._clock = clock
        self._start = clock()

    def begin(self) -> None:
        """Let time begin now."""
        self._start = self._clock()

    def now(self) -> float:
        """Time [s] since the beginning, less that in which it stood still."""
        return self._clock() - self._start

    def late(self, due: float) -> float:
        """By how much a time [s] that was listened for has been missed [s]."""
        missed = max(0.0, self.now() - due)
        if missed > self._period:
            self.stood_still.append(missed)
            self._start += missed
        return missed

    def call(self, seconds: float, port: Port, take: Take) -> None:
        """Hand over what comes in for some seconds, or until what is waited for is there."""
        _listen(seconds, self._clock, port, take)

    def listen(self, until: float, port: Port, take: Take) -> None:
        """Hand over what comes in until a time [s], or until what is waited for is there."""
        _listen(until - self.now(), self._clock, port, take)

    def rest(self, until: float, port: Port, take: Take) -> None:
        """Hand over what comes in until a time [s]."""
        while (left := until - self.now()) > 0.0:
            data = port.receive(left)
            if data:
                take(data)


@final
class LockStep:
    """Time that stands still until the answer is there, or ``patience`` [s] of a clock have gone by."""

    is_real = False

    def __init__(self, patience: float = 1.0, clock: Callable[[], float] = time.perf_counter) -> None:
        self.stood_still: list[float] = []
        self._patience = patience
        self._clock = clock
        self._now = 0.0

    def begin(self) -> None:
        """Let time begin."""
        self._now = 0.0

    def now(self) -> float:
        """Time [s] of the present sample."""
        return self._now

    def late(self, due: float) -> float:
        """Go on to a time [s]; none is ever missed."""
        self._now = due
        return 0.0

    def call(self, seconds: float, port: Port, take: Take) -> None:
        """Hand over what comes in for some seconds, or until what is waited for is there."""
        _listen(seconds, self._clock, port, take)

    def listen(self, until: float, port: Port, take: Take) -> None:
        """Hand over what comes in until what is waited for is there."""
        del until
        _listen(self._patience, self._clock, port, take)

    def rest(self, until: float, port: Port, take: Take) -> None:
        """Hand over what has come in."""
        del until
        _drain(port, take)


@contextmanager
def stop_by_interrupt() -> Iterator[Callable[[], bool]]:
    """Let Ctrl-C ask for an end in place of interrupting whatever is being done; a second one interrupts as ever."""
    asked = threading.Event()

    def ask(_signal: int, _frame: object) -> None:
        if asked.is_set():
            raise KeyboardInterrupt
        asked.set()

    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    before = signal.signal(signal.SIGINT, ask)
    try:
        yield asked.is_set
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def without_collections() -> Iterator[None]:
    """Keep Python from looking for garbage, which takes milliseconds."""
    was_on = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
