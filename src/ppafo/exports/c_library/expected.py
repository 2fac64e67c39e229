"""Results of Python for comparison in ``make check`` of an exported library: ``expected.csv``."""

import math
from collections.abc import Iterable

from ppafo.running import simulate
from ppafo.simulation.scenario import Scenario

MOST_ROWS = 1000
"""Maximum number of samples in the table; of a longer run every second, third, ... sample and the last."""


def expected_csv(scenario: Scenario, channels: Iterable[str], metrics: Iterable[str] = ()) -> bytes:
    """Return samples of a run as CSV in SI units with 17 digits, then its metrics as ``# name = value``.

    Channels and metrics missing in the recording are left out, as are all metrics of a failed run.
    """
    result = simulate(scenario)
    recording = result.recording
    names = [name for name in channels if name in recording.names]
    columns = [recording.time, *(recording[name] for name in names)]
    last = len(recording) - 1
    samples = [*range(0, last, math.ceil(last / MOST_ROWS) or 1), last]
    rows = (",".join(f"{column[sample]:.17g}" for column in columns) for sample in samples)
    values = (f"# {name} = {result.metrics[name].value:.17g}" for name in metrics if name in result.metrics)
    return "\n".join([",".join(["time", *names]), *rows, *values, ""]).encode()
