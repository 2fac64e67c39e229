"""How much strides scatter, and how far their series is off, relative to the range of the curve."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.fourier import FitError
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.strides import CurveStatistics

REMARKED_SPREAD, REFUSED_SPREAD = 0.1, 0.25
"""Standard deviation between strides, fractions of the range of the mean curve; steady walks have 0.004 to 0.06."""

REMARKED_MISFIT, REFUSED_MISFIT = 0.03, 0.1
"""What the series leaves, root mean square, fractions of the same range; true curves have below 0.01."""

_REMEDY = "smooth the recording (--low-pass '6 Hz'), or give better or more strides"


@dataclass(frozen=True, slots=True)
class _Scatter:
    """Spread and misfit of one curve as fractions of its range."""

    name: str
    spread: float
    misfit: float


def check_scatter(
    curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError], walk: Mapping[str, Signal]
) -> None:
    """Raise DataError for curves that scatter by a quarter of their range, or that no series comes near."""
    for item in _scatters(curves, errors):
        if item.spread > REFUSED_SPREAD or item.misfit > REFUSED_MISFIT:
            raise DataError(
                f"{walk[item.name].file}: {_statement(item)}; at most {100.0 * REFUSED_SPREAD:.0f} % and "
                f"{100.0 * REFUSED_MISFIT:.0f} % are accepted; {_REMEDY}"
            )


def scatter_remarks(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> list[str]:
    """Return a line on each curve that scatters more than a steady walk does."""
    return [
        f"{_statement(item)}: that is noise, or the walk is not steady; {_REMEDY}"
        for item in _scatters(curves, errors)
        if item.spread > REMARKED_SPREAD or item.misfit > REMARKED_MISFIT
    ]


def _statement(item: _Scatter) -> str:
    return (
        f"{item.name} differs between strides by {100.0 * item.spread:.0f} % of its range and its series misses "
        f"{100.0 * item.misfit:.1f} % (standard deviation, root mean square)"
    )


def _scatters(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> Iterator[_Scatter]:
    for name, item in curves.items():
        moved = float(np.ptp(item.mean))
        if moved > 0.0:
            yield _Scatter(name, item.spread / moved, errors[name].root_mean_square / moved)
