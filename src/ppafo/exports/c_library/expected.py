"""Numbers of Python that an exported library is compared with when its ``make check`` runs: ``expected.csv``."""

import math
from collections.abc import Iterable

from ppafo.running import simulate
from ppafo.simulation.scenario import Scenario

MOST_ROWS = 1000
"""Samples of a run in the table at most: of a longer one, every second, third, ... and the last."""


def expected_csv(scenario: Scenario, channels: Iterable[str], metrics: Iterable[str] = ()) -> bytes:
    """Return samples of a run as CSV in SI units with 17 digits, then its metrics as ``# name = value``.

    The channels and metrics that a recording has not are left out, as are metrics of a run that failed.
    """
    result = simulate(scenario)
    recording = result.recording
    names = [name for name in channels if name in recording.names]
    columns = [recording.time, *(recording[name] for name in names)]
    last = len(recording) - 1
    chosen = [*range(0, last, math.ceil(last / MOST_ROWS) or 1), last]
    rows = (",".join(f"{column[row]:.17g}" for column in columns) for row in chosen)
    found = [name for name in metrics if name in result.metrics]
    said = (f"# {name} = {result.metrics[name].value:.17g}" for name in found)
    return "\n".join([",".join(["time", *names]), *rows, *said, ""]).encode()
