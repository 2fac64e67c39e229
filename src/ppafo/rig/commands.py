"""The controller of a run on the rig: what it decides sample by sample, and its commands on the way to the valve."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.engine.continuous_time import SAME_TIME
from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.model.effects.spool_play import spool_position
from ppafo.model.sensors import Measurement


class CommandUnderWay(NamedTuple):
    """A command [-] and the time [s] at which the valve gets it."""

    arrival: float
    command: float


class Commands:
    """The commands of one run: ``decided`` [-] by the controller, and ``at_valve`` [-], behind play and dead time.

    ``period`` and ``delay`` [s] are the time between two decisions and the dead time before the valve, ``hysteresis``
    [-] is the play of its spool. SimulationError for a controller in Python, which the rig cannot ask.
    """

    def __init__(self, run: Run, period: float, delay: float, hysteresis: float) -> None:
        if run.program.controller is None:
            raise SimulationError("the simulated test bench runs controllers of the catalogue only")
        self._controller: ControllerKind = run.program.controller
        self._run, self._period, self._delay, self._hysteresis = run, period, delay, hysteresis
        self._controller_state = self._controller.initial
        self._spool = 0.0
        self._under_way: list[CommandUnderWay] = []
        self.decided = 0.0
        self.at_valve = 0.0

    def decide(self, sample: int, time: float, measurement: Measurement) -> None:
        """Let the controller see a measurement at a time [s], and send its command on its way."""
        run = self._run
        reference = run.program.reference.value(run.reference, sample * self._period)[0]
        # A constant command is decided once for the whole run; the law still has the period of its file.
        self.decided, self._controller_state = self._controller.update(
            run.controller, self._controller_state, reference, measurement, run.period
        )
        self._spool = spool_position(self._spool, self.decided, self._hysteresis)
        self._under_way.append(CommandUnderWay(time + self._delay, self._spool))

    def arrive(self, time: float) -> None:
        """Hand over to the valve what has arrived by a time [s]."""
        while self._under_way and self._under_way[0].arrival <= time + SAME_TIME:
            self.at_valve = self._under_way.pop(0).command

    def next_arrival(self, end: float) -> float:
        """Return the time [s] at which the next command arrives, ``end`` [s] where none does before."""
        return min(end, self._under_way[0].arrival) if self._under_way else end
