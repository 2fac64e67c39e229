"""Metrics of a recording, given as an object, a file or a result folder."""

from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import checked
from ppafo.metrics import Metric
from ppafo.metrics import evaluate as of_recording
from ppafo.signals import Recording
from ppafo.storage.reading import ColumnsLike, read_recording

if TYPE_CHECKING:
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset


@checked
def evaluate(
    recording: "Recording | DataFrame | Dataset | str | Path", *, columns: ColumnsLike | None = None
) -> dict[str, Metric]:
    """Compute every metric [SI] that the channels of a recording allow, by name; none for a single sample.

    Arguments:
        recording: a Recording, or a file, a result folder, a pandas DataFrame or an xarray Dataset with one
        columns: a column map of a file with other columns, or the name of one

    Returns:
        the metrics by name, each with value, unit and meaning

    Raises:
        DataError: a recording that cannot be used

    >>> import ppafo
    >>> recording = ppafo.simulate("torque-task-proportional").recording
    >>> print(f"{ppafo.evaluate(recording)['peak_torque'].value:.3f} N m")
    5.000 N m
    """
    return of_recording(recording if isinstance(recording, Recording) else read_recording(recording, columns=columns))
